from __future__ import annotations

import hashlib
import struct
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faces import assert_same_face, assert_same_scene, small_face, small_scene
from pxr import Usd, UsdGeom, UsdSkel

from fat import AnimatableFace, FaceDefMesh, FaceDefTable, FaceDefTables, FaceDefTransform
from fat.evaluate import Player
from fba import FaceScene, Frame, Material, PolyMesh, Shape, Transform
from fba.errors import FaceDefTablesError, FbaError, InputFileError, OutputFileError
from formats import read, read_face, usd, write
from formats.usd.validate import validate_stage

Z_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
TURNED = np.array([[0, 0, -1.0], [0, 1, 0], [1, 0, 0]])
MIRRORED = np.diag([-1.0, 1.0, 1.0])
X_UP = np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]])


def _face(path: Path) -> AnimatableFace:
    found = usd.read(path)
    assert isinstance(found, AnimatableFace)
    return found


@pytest.mark.parametrize("extension", ["usda", "usdc", "usd"])
@pytest.mark.parametrize("axes", [np.eye(3), Z_UP, TURNED, MIRRORED, X_UP], ids=["y", "z", "turned", "mirror", "x"])
def test_a_face_reads_back_exactly(tmp_path: Path, extension: str, axes: np.ndarray) -> None:
    face = small_face(Frame(axes, reversed_winding=bool(np.array_equal(axes, MIRRORED))))
    path = tmp_path / f"small.{extension}"
    write(face, path)
    assert path.read_bytes().startswith(b"#usda" if extension == "usda" else b"PXR-USDC")
    found = read(path)
    assert isinstance(found, AnimatableFace)
    assert_same_face(found, face)


@pytest.mark.parametrize("axes", [np.eye(3), Z_UP, TURNED])
def test_the_stage_has_the_files_own_axes(tmp_path: Path, axes: np.ndarray) -> None:
    face = small_face(Frame(axes))
    path = tmp_path / "face.usda"
    usd.write(face, path)
    stage = Usd.Stage.Open(str(path))
    up = UsdGeom.GetStageUpAxis(stage)
    assert np.array_equal(axes @ {"Y": (0, 1, 0), "Z": (0, 0, 1)}[up], (0, 1, 0))
    assert UsdGeom.GetStageMetersPerUnit(stage) == 0.1
    assert np.allclose(_world(stage, "skin"), face.scene.world_vertices("skin") @ axes, atol=1e-6)
    assert np.allclose(_world(stage, "eye_left"), face.scene.world_vertices("eye_left") @ axes, atol=1e-6)


@pytest.mark.parametrize("axes", [MIRRORED, X_UP])
def test_axes_that_usd_cannot_say_are_written_upright(tmp_path: Path, axes: np.ndarray) -> None:
    face = small_face(Frame(axes))
    path = tmp_path / "face.usda"
    usd.write(face, path)
    stage = Usd.Stage.Open(str(path))
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert np.allclose(_world(stage, "skin"), face.scene.world_vertices("skin"), atol=1e-6)


def _prim(stage: Usd.Stage, name: str) -> Usd.Prim:
    """The mesh of this name, or what else has it: a material may have the name of a mesh."""
    return min((p for p in stage.Traverse() if p.GetName() == name), key=lambda p: not p.IsA(UsdGeom.Mesh))


def _world(stage: Usd.Stage, name: str) -> np.ndarray:
    prim = _prim(stage, name)
    matrix = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim))
    points = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(), dtype=np.float64)
    return points @ matrix[:3, :3] + matrix[3, :3]


def _deformed(stage: Usd.Stage, mesh: str, weights: dict[str, float]) -> np.ndarray:
    """Points of a mesh as UsdSkel evaluates its blend shapes."""
    prim = _prim(stage, mesh)
    binding = UsdSkel.BindingAPI(prim)
    query = UsdSkel.BlendShapeQuery(binding)
    values = [weights.get(name, 0.0) for name in binding.GetBlendShapesAttr().Get()]
    sub_weights, shapes, subs = query.ComputeSubShapeWeights(values)
    attribute = UsdGeom.Mesh(prim).GetPointsAttr().Get()
    assert query.ComputeDeformedPoints(
        sub_weights, shapes, subs, query.ComputeBlendShapePointIndices(), query.ComputeSubShapePointOffsets(), attribute
    )
    return np.array(attribute)


@pytest.mark.parametrize("axes", [np.eye(3), Z_UP, MIRRORED])
@pytest.mark.parametrize("value", [-2500, -1860, -1000, -400, -150, 0, 60, 400, 600, 700, 1080, 1500])
def test_usdskel_moves_the_points_as_the_tables_do(tmp_path: Path, axes: np.ndarray, value: int) -> None:
    face = small_face(Frame(axes))
    path = tmp_path / "face.usdc"
    usd.write(face, path)
    stage = Usd.Stage.Open(str(path))
    stage_axes = np.eye(3) if np.array_equal(axes, MIRRORED) else axes
    pose = Player(face).pose({3: value, 5: value, 14: 0.5 * value})
    weights = {"open_jaw": value / 1080, "raise_b_midlip": value / 600, "thrust_jaw": 0.5 * value / 500}
    for shape in ("skin", "teeth"):
        wanted = pose.local[shape] @ stage_axes
        moved = np.abs(pose.local[shape] - face.scene.shape(shape).mesh.vertices).max()
        assert moved > 0.01 or value == 0
        assert np.allclose(_deformed(stage, shape, weights), wanted, rtol=0, atol=2e-6 * max(1.0, moved))


def test_usdskel_moves_visemes_and_expressions_as_the_tables_do(tmp_path: Path) -> None:
    face = small_face()
    path = tmp_path / "face.usdc"
    usd.write(face, path)
    stage = Usd.Stage.Open(str(path))
    pose = Player(face).pose(viseme=(1, 0, 20), expression=(6, 63, 0, 0))
    got = _deformed(stage, "skin", {"viseme_PP": 20 / 63, "expression_surprise": 1.0})
    assert np.allclose(got, pose.local["skin"], rtol=0, atol=1e-4)


@pytest.mark.parametrize("borders", [[-600, 0], [-600, -200, 0], [0, 300], [0, 100, 200, 300], [-9, -5, 0, 2, 9]])
def test_every_kind_of_intervals_evaluates_alike(tmp_path: Path, borders: list[int]) -> None:
    slopes = np.random.default_rng(3).normal(size=(2, len(borders) - 1, 3)).astype(np.float32)
    mesh = FaceDefMesh("skin", np.array(borders), np.array([1, 4]), slopes)
    face = replace(small_face(), tables=FaceDefTables((FaceDefTable(5, 1, (mesh,)),)))
    path = tmp_path / "face.usda"
    usd.write(face, path)
    assert_same_face(_face(path), face)
    stage = Usd.Stage.Open(str(path))
    full = borders[-1] or -borders[0]
    player = Player(face)
    for value in np.linspace(-1.5 * full, 1.5 * full, 13):
        wanted = player.pose({5: float(value)}).local["skin"]
        got = _deformed(stage, "skin", {"raise_b_midlip": float(value) / full})
        assert np.allclose(got, wanted, rtol=0, atol=2e-6 * max(1.0, float(np.abs(wanted).max())))


def test_baking_the_skinning_keeps_the_neutral_face_and_plays_the_weights(tmp_path: Path) -> None:
    face = small_face()
    path = tmp_path / "face.usda"
    usd.write(face, path)
    stage = Usd.Stage.Open(str(path))
    animation = UsdSkel.Animation(_prim(stage, "Animation"))
    names = list(animation.GetBlendShapesAttr().Get())
    assert not np.any(animation.GetBlendShapeWeightsAttr().Get())
    weights = np.zeros(len(names), np.float32)
    animation.GetBlendShapeWeightsAttr().Set(weights, 0)
    weights[names.index("open_jaw")] = 0.7
    animation.GetBlendShapeWeightsAttr().Set(weights, 10)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(10)
    assert UsdSkel.BakeSkinning(stage.Traverse())
    pose = Player(face).pose({3: 756})
    for shape in ("skin", "teeth"):
        points = UsdGeom.Mesh(_prim(stage, shape)).GetPointsAttr()
        assert np.allclose(points.Get(0), face.scene.shape(shape).mesh.vertices, atol=1e-6)
        assert np.allclose(points.Get(10), pose.local[shape], atol=1e-5)


@pytest.mark.parametrize("axes", [np.eye(3), Z_UP])
def test_normals_turn_with_the_blend_shapes(tmp_path: Path, axes: np.ndarray) -> None:
    face = small_face(Frame(axes))
    path = tmp_path / "face.usdc"
    usd.write(face, path)
    stage = Usd.Stage.Open(str(path))
    skin = UsdGeom.Mesh(_prim(stage, "skin"))
    assert skin.GetNormalsInterpolation() == "vertex"
    mesh = face.scene.shape("skin").mesh
    rest = np.array(skin.GetNormalsAttr().Get())
    assert np.allclose(rest, mesh.vertex_normals() @ axes, atol=1e-6)
    assert np.allclose(np.linalg.norm(rest, axis=1), 1.0)
    player = Player(face)
    for name, fap_id, values in (("open_jaw", 3, (1080, 400)), ("raise_b_midlip", 5, (600, -400, -1860))):
        blend = UsdSkel.BlendShape(_prim(stage, "skin").GetChild(name))
        index = np.array(blend.GetPointIndicesAttr().Get())
        between = {i.GetAttr().GetBaseName(): i for i in blend.GetInbetweens()}
        for value in values:
            label = f"at_{value}".replace("-", "minus_")
            stored = between[label].GetNormalOffsets() if label in between else blend.GetNormalOffsetsAttr().Get()
            moved = mesh.vertex_normals(player.pose({fap_id: value}).local["skin"]) @ axes
            assert np.abs(np.array(stored)).max() > 0.01
            assert np.allclose(rest[index] + np.array(stored), moved[index], atol=1e-5)


def _rich_scene() -> FaceScene:
    """What small_face leaves out: normals, corners without uv, faces without a group, odd names and transforms."""
    mesh = PolyMesh.from_faces(np.random.default_rng(2).normal(size=(5, 3)) / 3, [[0, 1, 2], [0, 2, 3, 4]])
    mesh = replace(
        mesh,
        texcoords=np.array([[0.1, 0.2], [0.3, 1.7]]),
        texcoord_indices=np.array([0, 1, -1, 1, -1, 0, 0]),
        normals=np.array([[0.0, 0.6, 0.8], [1.0, 0.0, 0.0]]),
        normal_indices=np.array([0, 0, 1, 1, 0, 1, 0]),
        face_groups=np.array([1, -1]),
        group_names=("unused", "Gruppe ä 1"),
        face_materials=np.array([-1, 1]),
    )
    same = Material("same", (0.1, 0.2, 0.3), 0.7, (0.4, 0.5, 0.6), (0.0, 0.01, 0.0), 0.9, 0.25, "images/ä b.png")
    first = Shape("8.3 skin/ä", mesh, materials=(same, same, Material("")), vertex_ids=np.array([9, 8, 7, 6, 5]))
    plain = PolyMesh.from_faces(np.eye(3) / 7, [[0, 1, 2]])
    second = Shape("8_3 skin/ä", plain, materials=(same,), vertex_ids=np.array([2, 1, 0]))
    third = Shape("Skeleton", replace(plain, face_materials=np.array([-1])), vertex_ids=np.array([3, 4, 10]))
    turned = Transform(
        "Materials",
        (first, second, third),
        (1 / 3, 2.0, -3.0),
        (0.3, 0.0, 2.0, -7.5),
        (1.0, 2.0, -0.5),
        (0.0, 3.0, 0.1, 0.2),
        (0.1, 0.2, 0.3),
    )
    return FaceScene((turned, Transform("empty", rotation=(0.0, 0.0, 0.0, 1.0))), Frame(Z_UP), None, "9 odd")


@pytest.mark.parametrize("extension", ["usda", "usdc"])
def test_a_scene_reads_back_exactly(tmp_path: Path, extension: str) -> None:
    path = tmp_path / f"odd.{extension}"
    for scene in (_rich_scene(), small_scene(), replace(small_scene(), meters_per_unit=1.0)):
        usd.write(scene, path)
        found = usd.read(path)
        assert isinstance(found, FaceScene)
        assert_same_scene(found, scene)


def test_what_another_program_changes_wins_over_the_exact_twins(tmp_path: Path) -> None:
    face = small_face()
    path = tmp_path / "face.usda"
    usd.write(face, path)
    stage = Usd.Stage.Open(str(path))
    skin = UsdGeom.Mesh(_prim(stage, "skin"))
    points = np.array(skin.GetPointsAttr().Get())
    points[0] += 1.0
    skin.GetPointsAttr().Set(points)
    blend = UsdSkel.BlendShape(_prim(stage, "skin").GetChild("open_jaw"))
    offsets = 2.0 * np.array(blend.GetOffsetsAttr().Get())
    blend.GetOffsetsAttr().Set(offsets)
    stage.GetRootLayer().Save()
    del stage
    found = _face(path)
    assert np.array_equal(found.scene.shape("skin").mesh.vertices, points.astype(np.float64))
    pose = Player(found).pose({3: 1080})
    assert np.allclose(pose.local["skin"][[0, 1, 7]] - points[[0, 1, 7]], offsets, atol=1e-5)
    half = Player(found).pose({3: 400}).local["skin"] - points
    before = Player(face).pose({3: 400}).local["skin"] - face.scene.shape("skin").mesh.vertices
    assert np.allclose(half, before, atol=1e-5)


@pytest.mark.parametrize("child", ["/small/head", "/small/skin"])
def test_a_tree_that_bites_its_tail_is_refused(tmp_path: Path, child: str) -> None:
    path = tmp_path / "face.usda"
    usd.write(small_face(), path)
    stage = Usd.Stage.Open(str(path))
    stage.GetPrimAtPath("/small/head/eye_left_yaw").GetRelationship("fba:children").AddTarget(child)
    stage.GetRootLayer().Save()
    del stage
    with pytest.raises(InputFileError, match="a second time"):
        usd.read(path)


def test_a_file_that_somebody_holds_open_is_read_as_it_is_now(tmp_path: Path) -> None:
    path = tmp_path / "face.usdc"
    usd.write(small_face(), path)
    held = Usd.Stage.Open(str(path))
    changed = replace(small_face(), notes={"changed": "yes"})
    usd.write(changed, path)
    assert_same_face(_face(path), changed)
    assert held


def test_the_shipped_source_reads_back_exactly(tmp_path: Path) -> None:
    source = read_face("default")
    path = tmp_path / "source.USDC"
    write(source, path)
    assert_same_face(read_face(path), source)
    assert validate_stage(path) == []


@pytest.mark.parametrize("extension", ["usda", "usdc"])
def test_the_same_face_gives_the_same_bytes(tmp_path: Path, extension: str) -> None:
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); from pathlib import Path; from faces import small_face; "
        "from formats import write; write(small_face(), Path(sys.argv[2]))"
    )
    sums = set()
    for seed in ("1", "2"):
        path = tmp_path / f"face{seed}.{extension}"
        tests = str(Path(__file__).resolve().parents[1])
        subprocess.run([sys.executable, "-c", code, tests, str(path)], check=True, env={"PYTHONHASHSEED": seed})
        sums.add(hashlib.sha256(path.read_bytes()).hexdigest())
    assert len(sums) == 1


def test_importing_formats_does_not_import_openusd() -> None:
    code = "import sys, formats, formats.usd; print('pxr' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("cut.usda", b'#usda 1.0\ndef Mesh "a" { int x = '),
        ("latin.usda", b'#usda 1.0\ndef Mesh "a" { string x = "\xe9" '),
        ("cut.usdc", b"PXR-USDC\0\0\0\0" + b"junk" * 40),
        ("other.usd", b"solid cube"),
        ("empty.usda", b""),
        ("none.usda", b'#usda 1.0\ndef Xform "a" {}\n'),
        ("payload.usda", b'#usda 1.0\n(defaultPrim = "a")\ndef "a" (payload = @gone.usdc@) {}\n'),
        ("points.usda", b'#usda 1.0\ndef PointInstancer "a" {}\n'),
        ("later.usda", b'#usda 1.0\ndef Mesh "a" { string fba:format = "fba-usd/99"\n}\n'),
        (
            "faces.usda",
            b'#usda 1.0\ndef Mesh "a" { int[] faceVertexCounts = [3]\n int[] faceVertexIndices = [0, 1, 2]\n}\n',
        ),
    ],
)
def test_a_damaged_file_gives_one_line(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str, data: bytes
) -> None:
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(FbaError) as caught:
        usd.read(path)
    assert "\n" not in str(caught.value)
    assert caught.value.args
    assert capfd.readouterr() == ("", "")


@pytest.fixture
def little_memory() -> Iterator[None]:
    """OpenUSD may ask for any amount of memory for damaged data; 8 GB are enough to be refused in time."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (8 << 30, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


@pytest.mark.parametrize("extension", ["usda", "usdc"])
def test_no_cut_or_changed_byte_brings_the_reader_down(tmp_path: Path, extension: str, little_memory: None) -> None:
    whole = tmp_path / f"face.{extension}"
    usd.write(small_face(), whole)
    data = whole.read_bytes()
    random = np.random.default_rng(11)
    refused = 0
    for number in range(60):
        broken = bytearray(data)
        if number % 2:
            del broken[int(random.integers(len(data))) :]
        else:
            for place in random.integers(len(data), size=8):
                broken[place] = int(random.integers(256))
        path = tmp_path / f"broken{number}.{extension}"
        path.write_bytes(broken)
        try:
            usd.read(path)
        except FbaError:
            refused += 1
    assert refused > 20


@pytest.mark.parametrize("section", [b"TOKENS", b"STRINGS", b"FIELDS", b"FIELDSETS", b"PATHS", b"SPECS"])
def test_a_binary_file_cannot_ask_for_all_memory(tmp_path: Path, section: bytes) -> None:
    path = tmp_path / "face.usdc"
    usd.write(small_face(), path)
    data = bytearray(path.read_bytes())
    (table,) = struct.unpack_from("<q", data, 16)
    entry = data.index(section + b"\0", table)
    (start,) = struct.unpack_from("<q", data, entry + 16)
    data[start + 4] = 0x7F
    path.write_bytes(data)
    with pytest.raises(InputFileError, match=section.decode()):
        usd.read(path)


def test_lost_attributes_are_named(tmp_path: Path) -> None:
    path = tmp_path / "face.usda"
    usd.write(small_face(), path)
    path.write_text(path.read_text().replace("fba:fapu:es0", "fba:fapu:lost"))
    with pytest.raises(InputFileError, match="fba:fapu:es0"):
        usd.read(path)


def test_tables_that_do_not_fit_the_scene_are_refused_and_no_file_is_left(tmp_path: Path) -> None:
    face = small_face()
    path = tmp_path / "face.usda"
    path.write_bytes(b"old")
    mesh = FaceDefMesh("skin", np.array([0, 9]), np.array([99]), np.ones((1, 1, 3), np.float32))
    bad = [
        FaceDefTable(3, 1, (mesh,)),
        FaceDefTable(3, 1, (replace(mesh, shape="hair"),)),
        FaceDefTable(23, 1, (), (FaceDefTransform("nowhere"),)),
    ]
    for table in bad:
        with pytest.raises(FaceDefTablesError):
            usd.write(replace(face, tables=FaceDefTables((table,))), path)
    assert path.read_bytes() == b"old"
    with pytest.raises(OutputFileError):
        usd.write(face, tmp_path / "no folder" / "face.usda")
    assert [p.name for p in tmp_path.iterdir()] == ["face.usda"]
