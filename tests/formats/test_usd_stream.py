"""Streams in USD files, in both profiles, as OpenUSD plays them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faces import small_face
from pxr import Usd, UsdGeom, UsdSkel
from usd_played import played, smallest_unit

from fat import AnimatableFace, Player
from fat.tables import FaceDefMesh, FaceDefTable, FaceDefTables
from fba import Frame
from fba.errors import FapStreamError, UnsupportedFeatureError
from fba.scene import Transform
from fba.stream import FapStream
from formats import read, read_face, read_scene, usd, write
from formats.fap import read_fap
from formats.one_sided import one_sided
from formats.usd.validate import validate_stage
from samples import sample

Z_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])


def _stream() -> FapStream:
    """Both signs, values between borders, at them and beyond them, turns, a viseme and an expression; with a gap."""
    rows = {
        3: [0, 250, 400, 1080, 1500, -300],
        5: [-2500, -1860, -900, -100, 300, 900],
        14: [0, 120, -250, 500, 0, 700],
        23: [0, 8000, -20000, 30000, 0, 1],
        24: [9000, 0, 0, -30000, 12000, 3],
        25: [0, 0, 15000, -15000, 5000, 2],
    }
    blank = np.zeros((6, 4), np.int32)
    visemes, expressions = blank.copy(), np.zeros((6, 6), np.int32)
    visemes[2] = (1, 0, 40, 0)
    expressions[3, :2] = (6, 50)
    built = FapStream.build(30, 6, {k: np.array(v) for k, v in rows.items()}, visemes, expressions)
    return replace(built, frame_numbers=np.array([10, 11, 12, 13, 14, 20]))


TIMES = (0.0, 1.0, 2.0, 3.0, 4.0, 10.0)


def _turned(frame: Frame | None = None) -> AnimatableFace:
    """The small face below a head with a turned scale, itself below a transform that nothing drives."""
    face = small_face(frame)
    head = face.scene.roots[0]
    assert isinstance(head, Transform)
    head = replace(
        head, rotation=(0.6, 0.0, 0.8, 0.3), scale=(1.0, 1.2, 0.9), scale_orientation=(0.0, 1.0, 0.0, 0.5)
    )  # fmt: skip
    body = Transform("body", (head,), (0.5, 0.0, -0.5), (0.0, 0.0, 1.0, 0.4), (2.0, 2.0, 2.0))
    return replace(face, scene=replace(face.scene, roots=(body,)))


FACES = {
    "small": small_face(),
    "z up": small_face(Frame(Z_UP)),
    "turned": _turned(),
    "turned, z up": _turned(Frame(Z_UP)),
}


@pytest.mark.parametrize("portable", [False, True], ids=["native", "portable"])
@pytest.mark.parametrize("name", list(FACES))
def test_openusd_plays_what_the_player_plays(name: str, portable: bool, tmp_path: Path) -> None:
    face, stream = FACES[name], _stream()
    path = tmp_path / "face.usdc"
    write(face, path, stream, portable=portable)
    axes = np.eye(3) if face.scene.frame.identity else Z_UP
    moved = 0.0
    for pose, found in zip(Player(face).frames(stream), played(path, TIMES), strict=True):
        wanted = pose.world_shapes()
        assert set(found) == set(wanted)
        for shape, vertices in wanted.items():
            np.testing.assert_allclose(found[shape], vertices @ axes, rtol=0, atol=3e-6 * np.abs(vertices).max())
        moved = max(moved, float(np.abs(pose.world() - face.scene.world_neutral()).max()))
    assert moved > 0.3
    assert [f for f in validate_stage(path) if f.code != "UnresolvableDependency"] == []


def test_the_stage_has_the_rate_and_the_times_of_the_stream(tmp_path: Path) -> None:
    path = tmp_path / "face.usda"
    write(small_face(), path, _stream())
    stage = Usd.Stage.Open(str(path))
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0.0, 10.0)
    assert (stage.GetTimeCodesPerSecond(), stage.GetFramesPerSecond()) == (30.0, 30.0)
    animation = UsdSkel.Animation(stage.GetPrimAtPath("/small/Animation"))
    assert animation.GetBlendShapeWeightsAttr().GetTimeSamples() == list(TIMES)
    assert animation.GetRotationsAttr().GetTimeSamples() == list(TIMES)
    assert animation.GetScalesAttr().GetTimeSamples() == []


def test_head_and_eyes_are_joints(tmp_path: Path) -> None:
    path = tmp_path / "face.usda"
    write(small_face(), path)
    stage = Usd.Stage.Open(str(path))
    joints = UsdSkel.Skeleton(stage.GetPrimAtPath("/small/Skeleton")).GetJointsAttr().Get()
    eyes = ("root/head/eye_left_yaw", "root/head/eye_left_yaw/eye_left_pitch", "root/head/eye_right_yaw")
    assert list(joints) == ["root", "root/head", *eyes]
    binding = UsdSkel.BindingAPI(stage.GetPrimAtPath("/small/eye_left"))
    assert set(binding.GetJointIndicesAttr().Get()) == {3}
    source = UsdSkel.BindingAPI(stage.GetPrimAtPath("/small/Skeleton")).GetAnimationSourceRel().GetTargets()
    assert [str(p) for p in source] == ["/small/Animation"]


@pytest.mark.parametrize("extension", ["usda", "usdc", "usd", "usdz"])
def test_a_played_face_reads_back_with_its_tables(extension: str, tmp_path: Path) -> None:
    path, still = tmp_path / f"face.{extension}", tmp_path / f"still.{extension}"
    write(_turned(), path, _stream())
    write(_turned(), still)
    found, before = read_face(path), read_face(still)
    wanted = Player(before).pose({3: 700, 5: -900, 23: 9000}).world()
    assert np.array_equal(Player(found).pose({3: 700, 5: -900, 23: 9000}).world(), wanted)
    assert np.allclose(wanted, Player(_turned()).pose({3: 700, 5: -900, 23: 9000}).world(), rtol=0, atol=1e-12)


def test_the_portable_form_has_neither_inbetweens_nor_weights_outside_one(tmp_path: Path) -> None:
    path = tmp_path / "face.usdc"
    write(small_face(), path, _stream(), portable=True)
    stage = Usd.Stage.Open(str(path))
    names = {p.GetName() for p in stage.GetPrimAtPath("/small/skin").GetChildren() if p.IsA(UsdSkel.BlendShape)}
    assert {"open_jaw_pos", "open_jaw_neg", "raise_b_midlip_pos", "raise_b_midlip_neg", "viseme_PP"} <= names
    assert {"open_jaw_pos_400", "raise_b_midlip_neg_400"} <= names
    shapes = [UsdSkel.BlendShape(p) for p in stage.Traverse() if p.IsA(UsdSkel.BlendShape)]
    assert not any(shape.GetInbetweens() for shape in shapes)
    assert all(shape.GetNormalOffsetsAttr().Get() for shape in shapes)
    weights = UsdSkel.Animation(stage.GetPrimAtPath("/small/Animation")).GetBlendShapeWeightsAttr()
    values = np.array([weights.Get(time) for time in TIMES])
    assert values.min() >= 0.0
    assert values.max() == 1.0
    nodes = [p for p in stage.Traverse() if p.IsA(UsdGeom.Xformable) and UsdGeom.Xformable(p).GetOrderedXformOps()]
    assert nodes == []


def test_the_portable_form_reads_back_as_a_scene_with_its_shapes(tmp_path: Path) -> None:
    face, path = _turned(), tmp_path / "face.usdz"
    write(face, path, portable=True)
    assert not isinstance(read(path), AnimatableFace)
    assert np.array_equal(read_scene(path).world_neutral(), face.scene.world_neutral())
    shapes = usd.read_shape_set(path)
    assert shapes is not None
    at = shapes.names.index("raise_b_midlip_neg")
    wanted = Player(face).pose({5: -1860}).world() - face.scene.world_neutral()
    assert np.allclose(shapes.deltas[at], wanted, rtol=0, atol=1e-5)


def test_a_shape_of_one_sign_is_the_fap_at_its_border() -> None:
    face = small_face()
    shapes = {s.name: s for s in one_sided(face, dict.fromkeys(s.name for s in face.scene.shapes))["skin"]}
    assert {name: s.at for name, s in shapes.items() if name.startswith("open_jaw")} == {
        "open_jaw_pos": 1080.0, "open_jaw_pos_400": 400.0,
    }  # fmt: skip
    player, rest = Player(face, rules=()), face.scene.shape("skin").mesh.vertices
    for name, faps in (("open_jaw_pos", {3: 1080}), ("raise_b_midlip_neg", {5: -1860}), ("thrust_jaw_pos", {14: 500})):
        moved = (player.pose(faps).local["skin"] - rest)[shapes[name].index]
        assert np.allclose(shapes[name].offsets, moved, rtol=0, atol=1e-12)


def test_shapes_of_one_sign_sum_up_to_the_table_for_every_kind_of_intervals(tmp_path: Path) -> None:
    random = np.random.default_rng(5)
    values = np.linspace(-1500.0, 1500.0, 41)
    for borders in ([-600, 0], [-600, -200, 0], [0, 300], [0, 100, 200, 300], [-9, -5, 0, 2, 9]):
        slopes = random.normal(size=(2, len(borders) - 1, 3)).astype(np.float32)
        table = FaceDefTable(5, 1, (FaceDefMesh("skin", np.array(borders), np.array([1, 4]), slopes),))
        face = replace(small_face(), tables=FaceDefTables((table,)))
        shapes = one_sided(face, dict.fromkeys(s.name for s in face.scene.shapes), values[:, None])["skin"]
        rest = face.scene.shape("skin").mesh.vertices
        for value in values:
            moved = np.zeros_like(rest)
            for shape in shapes:
                weight = float(shape.weight(np.array([value]))[0])
                assert 0.0 <= weight <= 1.0
                moved[shape.index] += weight * shape.offsets
            wanted = Player(face, rules=()).pose({5: float(value)}).local["skin"] - rest
            # Correctives below what can be seen are left out.
            assert np.abs(moved - wanted).max() <= 0.03 * smallest_unit(face)


def test_meshes_of_one_table_share_what_weight_one_means(tmp_path: Path) -> None:
    """A table whose meshes have different borders still has one weight for all of them."""
    face = small_face()
    random = np.random.default_rng(8)
    meshes = tuple(
        FaceDefMesh(shape, np.array(borders), index, random.normal(size=(len(index), len(borders) - 1, 3)))
        for shape, borders, index in (
            ("skin", [0, 400, 1080], [0, 1]), ("skin", [-300, 0, 512], [2]), ("teeth", [0, 256], [1]),
        )
    )  # fmt: skip
    face = replace(face, tables=FaceDefTables((FaceDefTable(3, 1, meshes),)))
    stream = FapStream.build(25, 5, {3: np.array([-700, 200, 512, 900, 1300])})
    path = tmp_path / "face.usdc"
    write(face, path, stream)
    assert not [f for f in validate_stage(path) if f.severity == "error"]
    for pose, found in zip(Player(face).frames(stream), played(path, range(5)), strict=True):
        for shape, vertices in pose.world_shapes().items():
            np.testing.assert_allclose(found[shape], vertices, rtol=0, atol=5e-6 * np.abs(vertices).max())
    again = read_face(path).tables.get(3)
    assert again is not None
    assert all(np.array_equal(a.displacements, b.displacements) for a, b in zip(again.meshes, meshes, strict=True))


@pytest.fixture(scope="module")
def shipped() -> AnimatableFace:
    return read_face("default")


@pytest.mark.parametrize("portable", [False, True], ids=["native", "portable"])
def test_openusd_plays_the_shipped_face(portable: bool, shipped: AnimatableFace, tmp_path: Path) -> None:
    face, (stream, _) = shipped, read_fap(sample("streams/demo.fap"))
    path = tmp_path / "face.usdc"
    write(face, path, stream, portable=portable)
    frames = [36, 60, 84]
    poses = list(Player(face).frames(stream))
    unit = smallest_unit(face)
    for frame, found in zip(frames, played(path, frames), strict=True):
        wanted = poses[frame].world_shapes()
        away = max(float(np.linalg.norm(found[name] - wanted[name], axis=1).max()) for name in wanted)
        assert away < 0.05 * unit
        assert np.abs(poses[frame].world() - face.scene.world_neutral()).max() > 20.0 * unit


def test_what_cannot_be_played_is_said(tmp_path: Path) -> None:
    empty = FapStream.build(25, 0, {})
    for portable in (False, True):
        with pytest.raises(FapStreamError, match="no frames"):
            write(small_face(), tmp_path / "face.usda", empty, portable=portable)
    with pytest.raises(UnsupportedFeatureError, match="no Facial Animation Tables"):
        write(small_face().scene, tmp_path / "face.usda", _stream(), portable=True)
    assert list(tmp_path.iterdir()) == []
    write(small_face().scene, tmp_path / "scene.usda", portable=True)
    assert np.array_equal(read_scene(tmp_path / "scene.usda").world_neutral(), small_face().scene.world_neutral())
