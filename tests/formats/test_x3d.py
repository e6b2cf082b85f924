"""X3D: faces as HAnimHumanoids whose displacers are their tables."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faces import assert_same_face, assert_same_scene, small_face, small_scene

from fat import AnimatableFace, FaceDefMesh, FaceDefTable, FaceDefTables, FaceDefTransform, Player
from fba import Frame
from fba.errors import FaceDefTablesError, FbaError, InputFileError, TextSyntaxError, UnsupportedFeatureError
from fba.stream import FapStream
from formats import read, read_scene, write, x3d
from formats.vrml97.tree import Numbers, VrmlNode, definitions
from formats.x3d.displacers import border_offsets, slopes_of
from formats.x3d.xml_nodes import nodes_of
from formats.xml_tree import Element, read_xml

FRAME = Frame(np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]))
ROUTES = re.compile(r'<ROUTE fromNode="(\S+?)" fromField="\S+?" toNode="(\S+?)" toField="(\S+?)"/>')


def stream() -> FapStream:
    """A ramp of every kind of FAP, beyond the borders of the tables."""
    ramp = np.linspace(-700, 700, 8)
    visemes = np.array([[1, 0, 9 * k, 0] for k in range(8)])
    return FapStream.build(10.0, 8, {3: 2 * ramp, 5: 3 * ramp, 14: ramp, 23: 60 * ramp, 25: 80 * ramp}, visemes)


def scene_of(path: Path) -> Element:
    root = read_xml(path)
    return next(child for child in root.children if child.tag == "Scene")


def numbers(item: VrmlNode, name: str) -> np.ndarray:
    value = item.get(name)
    assert isinstance(value, Numbers)
    return value.values


@pytest.mark.parametrize("frame", [Frame(), FRAME], ids=["Y up", "Z up"])
@pytest.mark.parametrize("extension", ["x3d", "x3dz", "x3d.gz"])
def test_a_face_with_a_stream_comes_back_exactly(frame: Frame, extension: str, tmp_path: Path) -> None:
    face = small_face(frame)
    path = tmp_path / f"face.{extension}"
    write(face, path, stream())
    assert (path.read_bytes()[:2] == b"\x1f\x8b") == (extension != "x3d")
    found = read(path)
    assert isinstance(found, AnimatableFace)
    assert_same_face(found, face)
    write(face, tmp_path / f"portable.{extension}", stream(), portable=True)
    assert (tmp_path / f"portable.{extension}").read_bytes() == path.read_bytes()


def test_a_scene_comes_back_without_a_humanoid(tmp_path: Path) -> None:
    write(small_scene(FRAME), tmp_path / "scene.x3d")
    assert_same_scene(read_scene(tmp_path / "scene.x3d"), small_scene(FRAME))
    text = (tmp_path / "scene.x3d").read_text()
    assert "HAnimHumanoid" not in text
    assert "DirectionalLight" in text


@pytest.mark.parametrize("borders", [[0, 512], [-300, 0], [-1860, -400, 0, 600], [0, 1, 1080], [-2, -1, 0]])
def test_slopes_come_back_from_rounded_offsets(borders: list[int]) -> None:
    random = np.random.default_rng(len(borders))
    slopes = random.normal(size=(40, len(borders) - 1, 3)) * 10.0 ** random.integers(-12, 3, size=(40, 1, 3))
    mesh = FaceDefMesh("skin", np.array(borders), np.arange(40), slopes.astype(np.float32))
    found = border_offsets(mesh, 3.3e-5, FRAME)
    back = slopes_of(mesh.interval_borders, found.offsets, 3.3e-5)
    exact = FRAME.to_file(mesh.displacements)
    np.testing.assert_allclose(back.sum(axis=1), exact.sum(axis=1), rtol=1e-4, atol=1e-6 * np.abs(exact).max())
    flat = back.reshape(-1).copy()
    flat[found.fixes[0]] = found.fixes[1]
    assert np.array_equal(flat, exact.reshape(-1))


def test_what_nine_digits_cannot_say_is_noted_and_comes_back(tmp_path: Path) -> None:
    """A tiny slope above a steep one is lost in the sum."""
    slopes = np.array([[[1.0, 2.0, 3.0], [1e-9, -1e-10, 0.1]]], np.float32)
    table = FaceDefTable(4, 1, (FaceDefMesh("skin", np.array([0, 1000, 1001]), np.array([2]), slopes),))
    face = replace(small_face(), tables=FaceDefTables((table,)))
    write(face, tmp_path / "face.x3d")
    assert "fixes" in (tmp_path / "face.x3d").read_text()
    found = read(tmp_path / "face.x3d")
    assert isinstance(found, AnimatableFace)
    assert_same_face(found, face)


def displaced(path: Path, fractions: np.ndarray, shape: str) -> np.ndarray:
    """(f, n, 3) points of a shape: what a browser makes of the interpolators, ROUTEs and displacers."""
    known = definitions(nodes_of(scene_of(path)))
    above = {target: source for source, target, _ in ROUTES.findall(path.read_text())}
    points = numbers(known[f"{shape}_points"], "point").reshape(-1, 3)
    out = np.tile(points, (len(fractions), 1, 1))
    for displacer in known[f"{shape}_segment"].nodes("displacers"):
        assert isinstance(displacer, VrmlNode)
        chain: list[VrmlNode] = []
        name = above[displacer.def_name or ""]
        while name in above:
            chain.insert(0, known[name])
            name = above[name]
        if name != "fba_clock":
            continue
        value = fractions
        for interpolator in chain:
            value = np.interp(value, numbers(interpolator, "key"), numbers(interpolator, "keyValue"))
        moves = numbers(displacer, "displacements").reshape(-1, 3)
        np.add.at(out, (slice(None), numbers(displacer, "coordIndex").astype(int)), value[:, None, None] * moves)
    return out


@pytest.mark.parametrize("frame", [Frame(), FRAME], ids=["Y up", "Z up"])
def test_displacers_give_the_vertices_of_our_own_player(frame: Frame, tmp_path: Path) -> None:
    face = small_face(frame)
    write(face, tmp_path / "face.x3d", stream())
    poses = list(Player(face).frames(stream()))
    for shape in ("skin", "teeth"):
        found = displaced(tmp_path / "face.x3d", np.linspace(0, 1, 8), shape)
        expected = frame.to_file(np.array([pose.local[shape] for pose in poses]))
        assert np.abs(expected - expected[0]).max() > 0.1
        np.testing.assert_allclose(found, expected, atol=1e-5)


def test_joints_segments_and_weights_are_named(tmp_path: Path) -> None:
    write(small_face(), tmp_path / "face.x3d")
    known = definitions(nodes_of(scene_of(tmp_path / "face.x3d")))
    text = (tmp_path / "face.x3d").read_text()
    assert [known[n].type for n in ("fba_humanoid", "head", "skin_segment", "skin")] == [
        "HAnimHumanoid",
        "HAnimJoint",
        "HAnimSegment",
        "Shape",
    ]
    assert '<HAnimDisplacer DEF="fap_05_raise_b_midlip_neg_400_skin" containerField="displacers"' in text
    assert '<ScalarInterpolator DEF="fap_03_open_jaw_1080_weight"' in text
    table = known["fap_03_open_jaw"]
    assert np.array_equal(numbers(table, "key"), numbers(table, "keyValue"))
    driven = {target for source, target, _ in ROUTES.findall(text) if source == "fap_03_open_jaw"}
    assert driven == {"fap_03_open_jaw_400_weight", "fap_03_open_jaw_1080_weight", "fap_03_open_jaw_1080_weight_2"}
    assert "fba_clock" not in text
    targets = {target for _, target, field in ROUTES.findall(text) if field == "set_rotation"}
    assert targets == {"eye_left_yaw", "eye_right_yaw", "eye_left_pitch"}


def test_two_tables_on_one_field_are_refused(tmp_path: Path) -> None:
    again = FaceDefTable(26, 1, (), (FaceDefTransform("eye_left_yaw", rotation_def=(1.0, 0.0, 0.0, 1.0)),))
    face = small_face()
    with pytest.raises(UnsupportedFeatureError, match="both drive"):
        write(replace(face, tables=FaceDefTables((*face.tables, again))), tmp_path / "face.x3d")


def test_tables_that_point_nowhere_are_refused(tmp_path: Path) -> None:
    bad = FaceDefMesh("skin", np.array([0, 1]), np.array([99]), np.zeros((1, 1, 3), np.float32))
    far = FaceDefMesh("skin", np.array([0, 1]), np.array([1]), np.full((1, 1, 3), np.inf, np.float32))
    for mesh in (bad, far):
        face = replace(small_face(), tables=FaceDefTables((FaceDefTable(3, 1, (mesh,)),)))
        with pytest.raises(FaceDefTablesError):
            write(face, tmp_path / "face.x3d")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('DEF="fap_03_open_jaw_1080_teeth"', 'DEF="renamed"'),
        (r"\&quot;fapID\&quot;:3,", r"\&quot;fapID\&quot;:300,"),
        (r"\&quot;borders\&quot;:[0,1080]", r"\&quot;borders\&quot;:[0,5,1080]"),
        (r"&quot;table: {", r"&quot;table: ["),
    ],
)
def test_an_edited_file_reads_as_a_scene_and_says_so(old: str, new: str, tmp_path: Path) -> None:
    write(small_face(), tmp_path / "face.x3d")
    text = (tmp_path / "face.x3d").read_text()
    assert old in text
    (tmp_path / "face.x3d").write_text(text.replace(old, new))
    found = read(tmp_path / "face.x3d")
    assert not isinstance(found, AnimatableFace)
    assert_same_scene(found, small_scene())
    assert "tables" in "".join(found.document.remarks)  # type: ignore[union-attr]


FOREIGN = """<?xml version="1.0"?>
<!DOCTYPE X3D PUBLIC "ISO//Web3D//DTD X3D 4.0//EN" "https://www.web3d.org/specifications/x3d-4.0.dtd">
<X3D profile='Full' version='4.0' xmlns:xsd='http://www.w3.org/2001/XMLSchema-instance'><head/><Scene>
 <ProtoInstance name='odd'/>
 <Transform DEF='up' translation='0 1 0'>
  <Shape DEF='tri'><Appearance><Material diffuseColor='1 0 0'/><ImageTexture url='"a.png" "b.png"'/></Appearance>
   <PixelTexture image='1 1 4 0x00FFFFFF'/>
   <IndexedTriangleSet index='0 1 2 2 1 3'><Coordinate DEF='c' point='0 0 0, 1 0 0, 0 1 0, 1 1 0'/></IndexedTriangleSet>
  </Shape>
  <LOD><Shape DEF='quad'><IndexedFaceSet coordIndex='0 1 3 2 -1' solid='FALSE'><Coordinate USE='c'/></IndexedFaceSet>
  </Shape><Shape DEF='far'><Box/></Shape></LOD>
 </Transform>
 <HAnimHumanoid DEF='h' scale='2 2 2'>
  <HAnimJoint containerField='skeleton' name='root'><HAnimSegment><Coordinate DEF='s' point='0 0 0 1 0 0 0 1 0'/>
   <Shape DEF='in_segment'><IndexedFaceSet coordIndex='0 1 2'><Coordinate USE='s'/></IndexedFaceSet></Shape>
  </HAnimSegment></HAnimJoint>
  <Coordinate containerField='skinCoord' DEF='k' point='0 0 5 1 0 5 0 1 5'/>
  <Shape containerField='skin' DEF='skin'><IndexedFaceSet coordIndex='0 1 2 -1'><Coordinate USE='k'/></IndexedFaceSet>
  </Shape></HAnimHumanoid></Scene></X3D>
"""


def test_files_of_other_programs_give_their_meshes(tmp_path: Path) -> None:
    (tmp_path / "foreign.x3d").write_text(FOREIGN)
    scene = read_scene(tmp_path / "foreign.x3d")
    assert {s.name: s.mesh.face_count for s in scene.shapes} == {"tri": 2, "quad": 1, "in_segment": 1, "skin": 1}
    assert scene.shape("tri").materials[0].texture == "a.png"
    assert scene.shape("tri").materials[0].diffuse == (1.0, 0.0, 0.0)
    np.testing.assert_array_equal(scene.world_vertices("quad")[3], [1, 2, 0])
    np.testing.assert_array_equal(scene.world_vertices("skin")[1], [2, 0, 10])
    assert "PROTO" in "".join(scene.document.remarks)  # type: ignore[union-attr]
    write(scene, tmp_path / "again.wrl")
    assert read_scene(tmp_path / "again.wrl").vertex_count == scene.vertex_count


@pytest.mark.parametrize(
    ("text", "error", "said"),
    [
        ("<svg/>", InputFileError, "no X3D file"),
        ("<X3D><head/></X3D>", InputFileError, "no <Scene>"),
        ("<X3D><Scene/></X3D>", InputFileError, "no polygon mesh"),
        (FOREIGN.replace("0 1 2 2 1 3", "0 1 x"), InputFileError, r"line 8: IndexedTriangleSet.index must be numbers"),
        (FOREIGN.replace("solid='FALSE'", "solid='maybe'"), InputFileError, "must be true or false"),
        (FOREIGN.replace("0 1 2 2 1 3", "0 1 2 2 1 9"), FbaError, "9"),
        ('<!DOCTYPE X3D [<!ENTITY a "aaaa">]><X3D><Scene>&a;</Scene></X3D>', TextSyntaxError, "document type"),
        ("<X3D><Scene>&lol;</Scene></X3D>", TextSyntaxError, "entity"),
        (f"<X3D><Scene>{'<Group>' * 200}{'</Group>' * 200}</Scene></X3D>", InputFileError, "deeper than 128"),
    ],
)
def test_broken_files_are_refused_with_a_reason(text: str, error: type[Exception], said: str, tmp_path: Path) -> None:
    (tmp_path / "bad.x3d").write_text(text)
    with pytest.raises(error, match=said):
        x3d.read(tmp_path / "bad.x3d")
