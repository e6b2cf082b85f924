"""Sources made from shapes: what is given comes back, what is not is made, and the report tells which."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from authoring.author import author
from authoring.fitting import Fitting
from authoring.names import Meaning
from authoring.report import AuthorReport
from authoring.units import Units, sort_shapes
from cloning.prepare import PreparedFace, prepare
from fat import AnimatableFace, FaceMotion, Player, face_motions
from fat.quality import fap_values, feature_point_motion
from fat.rig import unrig
from fba import FeaturePoints, fap
from fba.errors import LandmarkError, MeshError
from fba.fapu import FAPU_POINTS
from formats import read_face, read_scene
from formats.landmarks import read_landmarks
from formats.shapes import read_shapes

DATA = Path(__file__).resolve().parents[1] / "data"


@cache
def source() -> AnimatableFace:
    return read_face("default")


@cache
def motion(fap_id: int, select: int = 1, sign: int = 1) -> FaceMotion:
    """The first border of one FAP of the shipped source on one side."""
    found = [m for m in face_motions(source(), [(fap_id, select)]) if m.value * sign > 0]
    return min(found, key=lambda m: abs(m.value))


@cache
def prepared() -> PreparedFace:
    return prepare(unrig(source()), source().feature_points, "source")


def made(shapes: dict[str, object], **options: object) -> tuple[AnimatableFace, AuthorReport]:
    return author(unrig(source()), source().feature_points, shapes, **{"construct": False, **options})  # type: ignore[arg-type]


def steps(report: AuthorReport, name: str) -> list[tuple[int, str]]:
    entry = next(e for e in report.entries if e.name == name)
    return [(step.value, step.how) for step in entry.steps]


def test_given_faps_visemes_and_expressions_come_back_as_they_are() -> None:
    joy, aa, smile, blink = motion(2, 1), motion(1, 10), motion(12), motion(19)
    shapes = {"expression_joy": joy, "viseme_aa": aa, "raise_l_cornerlip": smile, "FAP19": blink}
    face, report = made({name: m.offsets for name, m in shapes.items()})
    for m in shapes.values():
        found = next(x for x in face_motions(face, [(m.fap_id or 0, m.select)]) if x.value == m.value)
        for name in m.offsets:
            assert np.abs(found.offsets.get(name, 0.0) - m.offsets[name]).max() < 1e-4 * face.fapu.es0
    assert steps(report, "expression_joy") == [(63, "given")]
    assert steps(report, "close_t_l_eyelid") == [(blink.value, "given")]
    assert report.used["FAP19"] == "close_t_l_eyelid"


def test_a_map_says_the_value_and_the_shape_is_scaled_to_it() -> None:
    offsets = motion(12).offsets
    value = round(0.8 * motion(12).value)
    other = {name: 0.5 * part for name, part in offsets.items()}
    known = {"a": Meaning("fap", 12, value=value), "b": Meaning("fap", 12, value=value // 2), "c": Meaning("ignored")}
    face, report = made({"a": offsets, "b": other, "c": offsets}, map=known)
    entry = next(e for e in report.entries if e.fap_id == 12)
    assert [s.value for s in entry.steps] == [value // 2, value]
    assert entry.error is not None
    assert entry.error < 1e-3
    for m in face_motions(face, [(12, 1)]):
        moved = feature_point_motion(face.feature_points, m.offsets)
        assert fap_values(moved, face.fapu)[12] == pytest.approx(m.value, rel=1e-5)
    assert "c" in report.ignored


def test_what_cannot_be_used_is_told() -> None:
    still = {"skin": np.zeros_like(motion(3).offsets["skin"])}
    still["skin"][0] = 1e-3
    _, report = made({"open_jaw": still, "my smile": still, "jawOpen": still, "Jaw.jawOpen": still})
    assert report.unknown == ("my smile",)
    assert "means the same as 'jawOpen'" in report.ignored["Jaw.jawOpen"]
    codes = {f.code for f in report.findings}
    assert {"unknown-shape", "given-shape"} <= codes
    assert next(e for e in report.entries if e.fap_id == 3).missing
    assert json.loads(report.to_json())["unknown"] == ["my smile"]


def test_every_fap_viseme_and_expression_is_accounted_for() -> None:
    face, report = made({})
    assert [e.fap_id for e in report.entries[20:]] == list(range(3, 69))
    assert [(e.fap_id, e.select) for e in report.entries[:20]] == [(1, k) for k in range(1, 15)] + [
        (2, k) for k in range(1, 7)
    ]
    tables = {t.key for t in face.tables}
    assert {(e.fap_id, e.select) for e in report.entries if not e.missing} == tables
    assert all(e.why for e in report.missing)


def test_halves_make_the_whole_and_the_whole_makes_halves() -> None:
    face = prepared()
    both = sort_shapes(face, {"mouthSmile": motion(12).offsets}).units
    left, right = both.get("mouthSmileLeft"), both.get("mouthSmileRight")
    assert left is not None
    assert right is not None
    whole = motion(12).offsets["skin"]
    assert np.allclose(left["skin"] + right["skin"], whole)
    x = face.scene.shape("skin").mesh.vertices[:, 0]
    assert np.abs(right["skin"][x > 0.5 * face.fapu.es0]).max() < 1e-3 * np.abs(whole).max()
    joined = Units(face, {"browDownLeft": left, "browDownRight": right}, {}).get("browDown")
    assert joined is not None
    assert np.allclose(joined["skin"], whole)
    assert both.get("mouthFrownLeft") is None


def test_correction_is_exact_at_feature_points_and_leaves_the_rest_of_the_face() -> None:
    face = prepared()
    fitting = Fitting(face)
    unit = face.fapu.unit(fap(12).unit)
    away = np.linalg.norm(face.skin.vertices - face.skin.positions["2.4"], axis=1)
    bent = 150.0 * unit * np.maximum(1.0 - (away / 0.6) ** 2, 0.0)[:, None] ** 2 * [0.2, 1.0, 0.1]
    skin = fitting.corrected(bent, {("2.4", 1): 100.0 * unit, ("8.3", 1): 100.0 * unit})
    values = fap_values(feature_point_motion(face.points, face.skin.split(skin)), face.fapu)
    assert values[12] == pytest.approx(100.0, abs=1e-2)
    assert max(abs(values[k]) for k in (4, 5, 8, 10, 13, 39, 51, 55, 57)) < 0.5
    far = np.linalg.norm(bent, axis=1) == 0.0
    assert np.abs(skin[far]).max() < 0.05 * np.abs(bent).max()


def test_poses_leave_the_eyeballs_alone() -> None:
    """Lids drawn through the ball are pushed in front of it, up to the depth that they have at rest."""
    face = prepared()
    fitting = Fitting(face)
    ball = fitting._balls[0]
    skin = np.zeros_like(face.skin.vertices)
    skin[ball.vertices, 2] = -0.1 * face.fapu.es0
    rest = ball.clearance(ball.rest - ball.center)
    watched = (rest > -0.2) & (ball.rest[:, 2] > ball.center[2] + 0.5 * np.median(ball.radii))
    sunk = ball.clearance(ball.rest + skin[ball.vertices] - ball.center) - np.minimum(rest, 0.01)
    kept = ball.clearance(ball.rest + fitting.off_eyeballs(skin)[ball.vertices] - ball.center) - np.minimum(rest, 0.01)
    assert sunk[watched].min() < -0.1
    assert kept[watched].min() > -0.02


def test_the_fapus_alone_are_enough_for_shapes_but_not_for_constructions() -> None:
    few = FeaturePoints({k: p for k, p in source().feature_points.items() if k in FAPU_POINTS})
    face, report = author(unrig(source()), few, {"viseme_aa": motion(1, 10).offsets})
    assert [t.name for t in face.tables][:1] == ["viseme_aa"]
    assert "no-constructions" in {f.code for f in report.findings}
    assert not report.made("constructed")
    with pytest.raises(LandmarkError, match=r"lacks the feature points 8\.3, 8\.4"):
        author(unrig(source()), FeaturePoints({k: p for k, p in few.items() if k[0] != "8"}), {})
    with pytest.raises(LandmarkError, match="--landmarks"):
        author(unrig(source()), None, {})
    with pytest.raises(MeshError, match="'jawOpen'"):
        made({"jawOpen": {"skin": np.zeros((3, 3))}})


def test_a_strict_jaw_is_noted_and_leaves_the_lips() -> None:
    shapes = {"open_jaw": motion(3).offsets}
    loose, _ = made(shapes)
    tight, report = made(shapes, open_jaw="strict")
    assert (loose.notes["open_jaw"], tight.notes["open_jaw"], report.open_jaw) == ("practical", "strict", "strict")
    lips = [np.abs(Player(f).pose({3: 400}).world() - Player(f).pose().world()) for f in (loose, tight)]
    places = unrig(source()).file_order()["skin"][list(source().feature_points["2.3"].vertices)]
    assert lips[1][places].max() < 0.05 * lips[0][places].max()


def test_units_of_a_face_kit_make_a_source(shared: Path) -> None:
    """ICT-FaceKit's 57 shapes without constructions: jaw, lids and more from units, exact at every feature point."""
    scene = read_scene(shared / "faces/ict-facekit/generic_neutral_mesh.obj")
    points = read_landmarks(shared / "landmarks/ict.json", scene)
    shapes = read_shapes(shared / "faces/ict-facekit/expressions.npz", scene)
    face, report = author(scene, points, shapes, construct=False)
    units = {e.fap_id for e in report.made("units")}
    assert {3, 6, 7, 12, 13, 14, 15, 16, 17, 19, 20, 21, 22, 31, 32, 41, 42} <= units
    assert {s.how for e in report.entries[:20] for s in e.steps} == {"posed"}
    assert not report.unknown
    for entry in report.entries:
        if entry.steps and entry.fap_id > 2:
            assert entry.error is not None
            assert entry.error <= max(1.0, 0.005 * max(abs(s.value) for s in entry.steps)), entry.name
    jaw = next(e for e in report.entries if e.fap_id == 3)
    assert all(set(s.parts) == {"jawOpen"} for s in jaw.steps)
    assert face.notes["open_jaw"] == "practical"


def test_a_stylised_avatar_with_arkit_and_oculus_shapes(shared: Path) -> None:
    """Ready Player Me: the 14 visemes are its own; seams stay closed; spectacles, hair and clothes stay still."""
    scene = read_scene(shared / "faces/rpm-brunette/brunette-t.glb")
    points = read_landmarks(DATA / "rpm_brunette.fps.json", scene)
    face, report = author(scene, points, read_shapes(shared / "faces/rpm-brunette/brunette-t.glb", scene))
    assert [e.name for e in report.made("given")] == [
        f"viseme_{e.name.removeprefix('viseme_')}" for e in report.entries[:14]
    ]
    low = [e for e in report.entries if e.fap_id > 2]
    assert {e.fap_id for e in low if e.missing} <= {27, 28, 29, 30, 43, 44, 45, 46, 47}
    assert all(e.error is None or e.error < 1.0 for e in low)
    moving = {mesh.shape for table in face.tables for mesh in table.meshes}
    assert not moving & {"Wolf3D_Hair", "Wolf3D_Glasses", "Wolf3D_Body", "Wolf3D_Outfit_Top"}
    skin = scene.world_vertices("Wolf3D_Head")
    order = np.lexsort(np.round(skin, 6).T)
    same = np.all(np.abs(np.diff(skin[order], axis=0)) < 1e-7, axis=1)
    a, b = order[:-1][same], order[1:][same]
    for m in face_motions(face, [(12, 1), (31, 1), (51, 1)]):
        offsets = m.offsets["Wolf3D_Head"]
        assert np.abs(offsets[a] - offsets[b]).max() < 1e-3 * np.abs(offsets).max()


def test_a_mask_of_a_hundred_vertices(shared: Path) -> None:
    """Candide-3 with its own animation units: no eyeballs, no ears, no teeth; the rest is made and exact."""
    scene = read_scene(shared / "faces/candide3/candide3.obj")
    points = read_landmarks(DATA / "candide3.fps.json", scene)
    _, report = author(scene, points, read_shapes(shared / "faces/candide3/candide3.wfm", scene))
    assert not report.unknown
    assert len(report.used) == 14
    assert {e.fap_id for e in report.missing} == {*range(23, 31), *range(43, 48), *range(65, 69)}
    errors = [e.error for e in report.entries if e.error is not None]
    assert len(errors) > 45
    assert max(errors) < 1.0
