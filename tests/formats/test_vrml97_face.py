"""Faces in VRML97 and BT: tables, feature points, FAPUs and scenes come back as they were."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faces import small_face, small_scene

from fat import AnimatableFace, FaceDefMesh, FaceDefTable, FaceDefTables, FaceDefTransform, TransformField
from fba import FaceScene, Fapu, FeaturePoint, FeaturePoints, Frame, PolyMesh, Role, Shape, standard_feature_points
from fba.errors import FaceDefTablesError, FbaError, LandmarkError
from fba.orientation import turn_scene
from formats import bt, read, write
from formats.vrml97 import VrmlDocument, parse, to_text
from formats.vrml97.tree import Numbers, Use, VrmlNode, definitions, walk
from samples import default_source

SUFFIXES = (".wrl", ".wrz", ".wrl.gz", ".bt", ".bt.gz")
FRAMES = (None, Frame(np.array([[0.0, -1, 0], [0, 0, 1], [-1, 0, 0]])), Frame(np.diag([-1.0, 1, 1]), True))


def read_face(path: Path) -> AnimatableFace:
    face = read(path)
    assert isinstance(face, AnimatableFace)
    return face


def assert_same_tables(found: FaceDefTables, wanted: FaceDefTables) -> None:
    assert [t.key for t in found] == [t.key for t in wanted]
    for a, b in zip(found, wanted, strict=True):
        assert a.high_level_select == b.high_level_select
        assert a.transforms == b.transforms
        assert [m.shape for m in a.meshes] == [m.shape for m in b.meshes]
        for m, n in zip(a.meshes, b.meshes, strict=True):
            assert np.array_equal(m.interval_borders, n.interval_borders)
            assert np.array_equal(m.coord_index, n.coord_index)
            assert np.array_equal(m.displacements, n.displacements)


def assert_same_mesh(found: PolyMesh, wanted: PolyMesh) -> None:
    for name in PolyMesh.__dataclass_fields__:
        a, b = getattr(found, name), getattr(wanted, name)
        assert (a is None) == (b is None), name
        assert a == b if name == "group_names" else a is None or np.array_equal(a, b), name


def assert_same_scene(found: FaceScene, wanted: FaceScene) -> None:
    assert np.array_equal(found.frame.axes, wanted.frame.axes)
    assert found.frame.reversed_winding == wanted.frame.reversed_winding
    assert (found.meters_per_unit, found.name) == (wanted.meters_per_unit, wanted.name)
    pairs = list(zip(found.walk(), wanted.walk(), strict=True))
    for (a, above), (b, below) in pairs:
        assert a.name == b.name
        assert [t.name for t in above] == [t.name for t in below]
        if isinstance(a, Shape):
            assert isinstance(b, Shape)
            assert (a.role, a.materials) == (b.role, b.materials)
            assert_same_mesh(a.mesh, b.mesh)
            assert (a.vertex_ids is None) == (b.vertex_ids is None)
        else:
            assert replace(a, children=()) == replace(b, children=())  # type: ignore[arg-type]


def assert_same_face(found: AnimatableFace, wanted: AnimatableFace) -> None:
    assert_same_tables(found.tables, wanted.tables)
    assert_same_scene(found.scene, wanted.scene)
    assert dict(found.feature_points) == dict(wanted.feature_points)
    assert found.fapu == wanted.fapu
    assert dict(found.notes) == dict(wanted.notes)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("frame", FRAMES)
def test_face_reads_back_identical(suffix: str, frame: Frame | None, tmp_path: Path) -> None:
    face = small_face(frame)
    write(face, tmp_path / f"a{suffix}")
    back = read_face(tmp_path / f"a{suffix}")
    assert_same_face(back, face)
    assert isinstance(back.scene.document, VrmlDocument)
    assert back.scene.document.findings == ()


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_same_face_same_bytes(suffix: str, tmp_path: Path) -> None:
    for name in ("a", "b"):
        write(small_face(), tmp_path / f"{name}{suffix}")
    write(read_face(tmp_path / f"a{suffix}"), tmp_path / f"c{suffix}")
    data = [(tmp_path / f"{name}{suffix}").read_bytes() for name in "abc"]
    assert data[0] == data[1] == data[2]


@pytest.mark.parametrize(("first", "second"), [(".wrl", ".bt"), (".bt", ".wrl")])
def test_a_face_moves_between_the_formats(first: str, second: str, tmp_path: Path) -> None:
    face = small_face(FRAMES[1])
    write(face, tmp_path / f"a{first}")
    write(read_face(tmp_path / f"a{first}"), tmp_path / f"b{second}")
    assert_same_face(read_face(tmp_path / f"b{second}"), face)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_scene_without_tables_reads_back(suffix: str, tmp_path: Path) -> None:
    scene = small_scene(FRAMES[1])
    write(scene, tmp_path / f"a{suffix}")
    back = read(tmp_path / f"a{suffix}")
    assert isinstance(back, FaceScene)
    assert_same_scene(back, scene)


def test_names_that_are_no_identifiers(tmp_path: Path) -> None:
    face = small_face()
    new = "skin of 9.3 (ö)"
    shape = replace(face.scene.shape("skin"), name=new)
    tables = FaceDefTables(
        tuple(
            replace(t, meshes=tuple(replace(m, shape=new) if m.shape == "skin" else m for m in t.meshes))
            for t in face.tables
        )
    )
    points = FeaturePoints(
        {i: replace(p, shape=new) if p.shape == "skin" else p for i, p in face.feature_points.items()}
    )
    face = replace(face, scene=face.scene.map_shapes({"skin": shape}), tables=tables, feature_points=points)
    for suffix in (".wrl", ".bt"):
        write(face, tmp_path / f"a{suffix}")
        assert_same_face(read_face(tmp_path / f"a{suffix}"), face)


def test_face_is_added_to_a_vrml_file_and_nothing_is_lost(tmp_path: Path) -> None:
    text = (
        "#VRML V2.0 utf8\nPROTO Odd [ field SFInt32 n 1 ] { Group { } }\nDEF skin Viewpoint { }\n"
        "DEF Body Transform { translation 1 0 0 children [ DEF Lamp PointLight { } Shape { geometry DEF G"
        " IndexedFaceSet { creaseAngle 1 coord Coordinate { point [ 0 0 0 1 0 0 0 1 0 ] } coordIndex [ 0 1 2 ] }"
        " } ] }\n"
        "Odd { n 2 } DEF T TimeSensor { } ROUTE T.time TO Lamp.x\n"
    )
    (tmp_path / "t.wrl").write_text(text)
    scene = read(tmp_path / "t.wrl")
    assert isinstance(scene, FaceScene)
    name = scene.shapes[0].name
    mesh = FaceDefMesh(name, np.array([0, 1080]), np.array([1]), np.ones((1, 1, 3), np.float32))
    turn = FaceDefTransform("Body", TransformField.ROTATION, (0.0, 1.0, 0.0, 1.0))
    tables = FaceDefTables((FaceDefTable(3, 1, (mesh,)), FaceDefTable(49, 1, (), (turn,))))
    points = FeaturePoints({"2.1": FeaturePoint(name, (1,), (1.0,))})
    face = AnimatableFace(scene, points, tables, Fapu(1, 2, 3, 4, 5))
    for suffix in (".wrl", ".bt"):
        write(face, tmp_path / f"out{suffix}")
        assert_same_face(read_face(tmp_path / f"out{suffix}"), face)
    out = parse((tmp_path / "out.wrl").read_text())
    start = len(out) - len(parse(text)) - 2
    kept = out[start:-2]
    defs = definitions(kept)
    assert defs[name].nodes("geometry") == definitions(parse(text))["Body"].nodes("children")[1].nodes("geometry")  # type: ignore[union-attr]
    without = [s for s in kept if not (isinstance(s, VrmlNode) and s.def_name == "Body")]
    assert without == [s for s in parse(text) if not (isinstance(s, VrmlNode) and s.def_name == "Body")]


def test_a_second_face_replaces_the_first(tmp_path: Path) -> None:
    write(small_face(), tmp_path / "a.wrl")
    face = read_face(tmp_path / "a.wrl")
    fewer = replace(face, tables=FaceDefTables(face.tables.tables[:1]))
    write(fewer, tmp_path / "b.wrl")
    tree = parse((tmp_path / "b.wrl").read_text())
    assert sum(isinstance(s, VrmlNode) and s.type == "Face" for s in tree) == 1
    assert len(read_face(tmp_path / "b.wrl").tables) == 1


def test_calibration_points_are_the_84_in_order() -> None:
    face = small_face()
    node = next(s for s in walk(parse(to_text(face))) if isinstance(s, VrmlNode) and s.type == "FDP")
    owner = node.nodes("featurePointsCoord")[0]
    assert isinstance(owner, VrmlNode)
    value = owner.get("point")
    assert isinstance(value, Numbers)
    rows = value.values.reshape(84, 3)
    positions = face.feature_points.positions(face.scene)
    for key, row in zip(standard_feature_points(), rows, strict=True):
        wanted = positions.get(key)
        assert np.array_equal(row, [3.4028235e38] * 3 if wanted is None else wanted)


def without_metadata(text: str) -> str:
    return re.sub(r"DEF fba_toolkit WorldInfo \{.*?\n ?\}\n", "", text, flags=re.DOTALL)


def test_file_without_our_notes_reads_as_a_standard_face(tmp_path: Path) -> None:
    face = small_face()
    positions = face.feature_points.positions(face.scene)
    path = tmp_path / "a.wrl"
    text = without_metadata(to_text(face))
    assert "fba_toolkit" not in text
    path.write_text(text)
    back = read_face(path)
    assert_same_tables(back.tables, face.tables)
    for key, position in back.feature_points.positions(back.scene).items():
        assert np.allclose(position, positions[key], atol=1e-12)
    assert back.feature_points["2.1"].shape == "skin"
    assert back.feature_points["7.1"].shape is None
    assert back.scene.shape("skin").role is Role.SKIN
    assert back.scene.shape("eye_left").role is Role.EYE_LEFT
    assert back.scene.shape("eye_right").role is Role.EYE_RIGHT
    assert "not measurable" in back.notes["fapu"]
    assert back.fapu.es0 == 1024


def test_fapus_are_measured_where_the_points_allow(tmp_path: Path) -> None:
    positions = {
        "3.1": (0.4, 0.5, 0.3), "3.3": (0.4, 0.3, 0.3), "3.2": (-0.4, 0.5, 0.3), "3.4": (-0.4, 0.3, 0.3),
        "3.5": (0.4, 0.4, 0.3), "3.6": (-0.4, 0.4, 0.3), "9.15": (0, -0.1, 0.4), "2.2": (0, -0.4, 0.4),
        "8.3": (0.25, -0.5, 0.3), "8.4": (-0.25, -0.5, 0.3),
    }  # fmt: skip
    points = FeaturePoints({i: FeaturePoint.free(np.array(p, dtype=float)) for i, p in positions.items()})
    path = tmp_path / "a.wrl"
    path.write_text(without_metadata(to_text(replace(small_face(), feature_points=points))))
    found = read_face(path).fapu
    expected = Fapu.from_feature_points({i: np.array(p, dtype=float) for i, p in positions.items()})
    assert np.allclose(
        [found.es0, found.ens0, found.mns0, found.mw0, found.irisd0],
        [expected.es0, expected.ens0, expected.mns0, expected.mw0, expected.irisd0],
    )


def test_notes_that_do_not_fit_are_said_and_ignored(tmp_path: Path) -> None:
    text = to_text(small_face())
    path = tmp_path / "a.wrl"
    path.write_text(text.replace("0.3333333333333333", "5.5").replace('\\"role\\":\\"skin\\"', '\\"role\\":\\"nose\\"'))
    back = read_face(path)
    document = back.scene.document
    assert isinstance(document, VrmlDocument)
    assert {f.code for f in document.findings} == {"metadata"}
    edited = text.replace("DEF skin Shape", "DEF other Shape", 1).replace("USE skin", "USE other")
    path.write_text(edited)
    document = read_face(path).scene.document
    assert isinstance(document, VrmlDocument)
    assert any(f.code == "feature-points" for f in document.findings)


def test_axes_of_a_standard_face_are_found(tmp_path: Path) -> None:
    """A Z-up file of another program: inside axes follow from featurePointsCoord, outputs keep the file's."""
    face = read_face(default_source())
    frame = Frame(np.array([[-1.0, 0, 0], [0, 0, 1], [0, 1, 0]]))
    turned = replace(turn_scene(face.scene, frame.axes.T), frame=Frame(), document=None)
    slopes = [
        replace(
            t,
            meshes=tuple(replace(m, displacements=frame.to_file(m.displacements)) for m in t.meshes),
            transforms=(),
        )
        for t in face.tables
    ]
    positions = face.feature_points.positions(face.scene)
    points = FeaturePoints({i: FeaturePoint.free(frame.to_file(p)) for i, p in positions.items()})
    path = tmp_path / "z_up.wrl"
    path.write_text(without_metadata(to_text(AnimatableFace(turned, points, FaceDefTables(tuple(slopes)), face.fapu))))
    found = read_face(path)
    assert np.array_equal(found.scene.frame.axes, frame.axes)
    assert np.array_equal(found.scene.world_neutral(), face.scene.world_neutral())
    for a, b in zip(found.tables, face.tables, strict=True):
        for m, n in zip(a.meshes, b.meshes, strict=True):
            assert np.array_equal(m.displacements, n.displacements)
    assert np.isclose(found.fapu.es0, face.fapu.es0)
    write(found, tmp_path / "again.wrl")
    assert_same_face(read_face(tmp_path / "again.wrl"), found)


# --- the standard's own syntax ------------------------------------------------------------------------------

BT = """
InitialObjectDescriptor { objectDescriptorID 1
  esDescr [ ES_Descriptor { ES_ID 1 decConfigDescr DecoderConfigDescriptor { streamType 3
    decSpecificInfo BIFSConfig { isCommandStream true pixelMetric true pixelWidth 320 pixelHeight 240 } } } ] }
Group { children [
  Viewpoint { position 0 0 5 }
  Face {
    fap DEF FAPS FAP { viseme Viseme { viseme_select1 1 viseme_blend 63 } open_jaw +I yaw_l_eyeball 0 }
    fdp FDP {
      featurePointsCoord Coordinate { point [ 0 -1 0.1 0 -0.5 0.2 +I +I +I 0.5 1 0 ] }
      faceSceneGraph [ DEF HeadT Transform { children [
        DEF EyeL Transform { translation 0.3 0.15 0
          children [ Shape { appearance Appearance { material Material { diffuseColor 1 1 1 } } geometry Sphere { radius 0.08 } } ] }
        DEF Skin Shape { appearance Appearance { material Material { diffuseColor 0.8 0.6 0.5 } }
          geometry DEF SkinIFS IndexedFaceSet {
            coord Coordinate { point [ -0.5 -1 0 0.5 -1 0 0.5 1 0 -0.5 1 0 ] } coordIndex [ 0 1 2 -1 0 2 3 -1 ] } }
      ] } ]
      faceDefTables [
        FaceDefTables { fapID 3 faceDefMesh [ FaceDefMesh { faceSceneGraphNode USE Skin intervalBorders [ 0 1080 ]
          coordIndex [ 0 1 ] displacements [ 0 -0.9 0 0 -1 0 ] } ] }
        FaceDefTables { fapID 5 faceDefMesh [ FaceDefMesh { faceSceneGraphNode USE Skin
          intervalBorders [ -1860 -400 0 600 ] coordIndex [ 0 1 ]
          displacements [ 0 -0.8 0 0 -1 0 0 1 0 0 -0.6 0 0 -0.9 0 0 0.9 0 ] } ] }
        FaceDefTables { fapID 23 faceDefTransform [ FaceDefTransform { faceSceneGraphNode USE EyeL fieldId 1
          rotationDef 0 1 0 1 } ] }
        FaceDefTables { fapID 1 highLevelSelect 1 faceDefMesh [ FaceDefMesh { faceSceneGraphNode USE Skin
          intervalBorders [ 0 63 ] coordIndex [ 2 ] displacements [ 0 0.001 0 ] } ] }
      ]
    }
    fit FIT { FAPs [ 37 ] }
  }
] }
AT 40 { REPLACE FAPS.open_jaw BY 600 }
RAP AT 80 { REPLACE FAPS.open_jaw BY 300 INSERT AT X.children[0] WorldInfo { title "}" } }
"""  # noqa: E501


def check_small_standard_face(face: AnimatableFace) -> None:
    assert [t.key for t in face.tables] == [(1, 1), (3, 1), (5, 1), (23, 1)]
    slopes = face.tables.get(5).meshes[0].displacements  # type: ignore[union-attr]
    assert slopes[0].tolist() == np.float32([[0, -0.8, 0], [0, -1, 0], [0, 1, 0]]).tolist()
    assert face.tables.get(5).meshes[0].interval_borders.tolist() == [-1860, -400, 0, 600]  # type: ignore[union-attr]
    assert face.tables.get(23).transforms[0].transform == face.scene.transforms[-1].name  # type: ignore[union-attr]
    assert list(face.feature_points) == ["2.1", "2.2", "2.4"]
    assert face.scene.shapes[0].mesh.face_count == 2


def test_bt_example(tmp_path: Path) -> None:
    path = tmp_path / "a.bt"
    path.write_text(BT)
    face = read_face(path)
    check_small_standard_face(face)
    assert [n.name for n, _ in face.scene.walk()] == ["HeadT", "EyeL", "Skin"]
    write(face, tmp_path / "b.wrl")
    write(face, tmp_path / "b.bt")
    for name in ("b.wrl", "b.bt"):
        assert_same_face(read_face(tmp_path / name), face)
        assert "FIT {" in (tmp_path / name).read_text()


def test_definitions_may_stand_in_the_tables(tmp_path: Path) -> None:
    """Decoders print the first DEF at the first textual use, tables before scene graph, and rename it."""
    path = tmp_path / "a.bt"
    path.write_text("""
Group { children [ Face { fdp FDP {
  faceDefTables [
    FaceDefTables { fapID 3 faceDefMesh [ FaceDefMesh {
      faceSceneGraphNode DEF N0 Shape { geometry IndexedFaceSet {
        coord Coordinate { point [ 0 0 0 1 0 0 0 1 0 ] } coordIndex [ 0 1 2 ] } }
      intervalBorders [ 0 512 ] coordIndex [ 2 ] displacements [ 0 -1 0 ] } ] }
    FaceDefTables { fapID 23 faceDefTransform [ FaceDefTransform { faceSceneGraphNode DEF N1 Transform {
      children [ USE N0 ] } rotationDef 0 1 0 1 } ] } ]
  faceSceneGraph [ USE N1 ] } } ] }
""")
    face = read_face(path)
    assert [n.name for n, _ in face.scene.walk()] == ["N1", "N0"]
    assert face.tables.get(3).meshes[0].shape == "N0"  # type: ignore[union-attr]
    write(face, tmp_path / "b.bt")
    assert_same_face(read_face(tmp_path / "b.bt"), face)


@pytest.mark.parametrize(
    ("target", "scene"),
    [
        ("Skin", "DEF HeadT Transform { children [ DEF Skin Shape { IFS } ] }"),
        ("Net", "DEF HeadT Transform { children [ Shape { IFS } ] }"),
        ("HeadT", "DEF HeadT Transform { children [ Group { children Shape { IFS } } ] }"),
    ],
)
def test_vrml_example_and_what_tables_may_refer_to(target: str, scene: str, tmp_path: Path) -> None:
    faces = "geometry DEF Net IndexedFaceSet { coord Coordinate { point [ -0.5 -1 0, 0.5 -1 0, 0.5 1 0, -0.5 1 0 ] } "
    text = "#VRML V2.0 utf8\n" + scene.replace("IFS", faces + "coordIndex [ 0 1 2 -1, 0 2 3 -1 ] }")
    text += (
        "\nDEF F Face { fdp FDP { faceSceneGraph [ USE HeadT ] faceDefTables [ FaceDefTables { fapID 3 faceDefMesh ["
        f" FaceDefMesh {{ faceSceneGraphNode USE {target} intervalBorders [ 0 1080 ] coordIndex [ 0 ]"
        " displacements [ 0 -1 0 ] } ] } ] } }\n"
    )
    (tmp_path / "a.wrl").write_text(text)
    face = read_face(tmp_path / "a.wrl")
    assert face.tables.get(3).meshes[0].shape == face.scene.shapes[0].name  # type: ignore[union-attr]
    write(face, tmp_path / "b.wrl")
    assert_same_face(read_face(tmp_path / "b.wrl"), face)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "USE Skin intervalBorders [ 0 1080 ]",
            "USE Nobody intervalBorders [ 0 1080 ]",
            "'Nobody', which is no polygon",
        ),
        ("USE Skin intervalBorders [ 0 1080 ]", "NULL intervalBorders [ 0 1080 ]", "no polygon mesh"),
        ("[ 0 1080 ]", "[ 10 1080 ]", "0 among them"),
        ("[ 0 1080 ]", "[ 0 1080.5 ]", "must hold integers"),
        ("coordIndex [ 2 ]", "coordIndex [ 4 ]", "runs from 4 to 4, but the shape has 4 vertices"),
        ("displacements [ 0 0.001 0 ]", "displacements [ 0 0.001 ]", "not a multiple of 3"),
        ("displacements [ 0 0.001 0 ]", "displacements [ 0 1e39 0 ]", "does not fit float32"),
        ("displacements [ 0 0.001 0 ]", "displacements [ 0 0 0 0 0 0 ]", "need 1 displacements"),
        ("USE EyeL", "USE Skin", "does not refer to a Transform"),
        ("fieldId 1", "fieldId 4", "fieldId 4"),
        ("fapID 23", "fapID 69", "fapID 69"),
    ],
)
def test_contradictions_are_errors_with_a_line(old: str, new: str, said: str, tmp_path: Path) -> None:
    assert old in BT
    path = tmp_path / "a.bt"
    path.write_text(BT.replace(old, new))
    with pytest.raises(FbaError, match=rf"line \d+: .*{said}"):
        read(path)


def test_writing_what_is_not_in_the_scene_is_an_error(tmp_path: Path) -> None:
    face = small_face()
    renamed = Shape("a", face.scene.shape("skin").mesh)
    lost = replace(face, scene=face.scene.map_shapes({"skin": renamed}))
    with pytest.raises(LandmarkError, match=r"2\.1 lies on 'skin'"):
        write(lost, tmp_path / "a.wrl")
    with pytest.raises(FaceDefTablesError, match="refers to 'skin'"):
        write(replace(lost, feature_points=FeaturePoints({})), tmp_path / "a.wrl")
    assert not (tmp_path / "a.wrl").exists()


def test_bt_holds_the_scene_in_the_face_and_no_protos() -> None:
    text = bt.to_text(small_face())
    assert text.startswith("InitialObjectDescriptor {")
    assert "PROTO" not in text
    assert "ProfileLevel" not in text
    tree = parse(text, bt=True)
    face = next(n for n in walk(tree) if isinstance(n, VrmlNode) and n.type == "Face")
    fdp = face.nodes("fdp")[0]
    assert isinstance(fdp, VrmlNode)
    assert [n.def_name for n in fdp.nodes("faceSceneGraph") if isinstance(n, VrmlNode)] == ["head"]
    uses = {n.name for n in walk([face]) if isinstance(n, Use)}
    assert {"skin", "teeth", "eye_left_yaw"} <= uses


def test_second_parser_reads_a_face() -> None:
    """PyVRML97 accepts the file and builds the Face from its PROTO."""
    loader = pytest.importorskip("vrml.vrml97.parser")
    text = to_text(small_face())
    ok, found, used = loader.buildParser().parse(text)
    scene = found[1]
    assert ok
    assert used == len(text)
    assert len(scene.getDEF("skin").geometry.coord.point) == 8
    face = scene.children[-1]
    tables = face.fdp.faceDefTables
    assert [t.fapID for t in tables] == [t.fap_id for t in small_face().tables]
    jaw = tables[2].faceDefMesh[0]
    assert jaw.faceSceneGraphNode is scene.getDEF("skin")
    expected = small_face().tables.get(3).meshes[0].displacements.reshape(-1, 3)  # type: ignore[union-attr]
    assert np.array_equal(np.asarray(jaw.displacements, np.float32), expected)
