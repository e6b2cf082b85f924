from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fba import FaceScene, Fapu, FeaturePoint, FeaturePoints, PolyMesh, Role, Shape
from fba.findings import Finding
from fba.neutral import check_neutral
from fba.orientation import orient
from fba.scene import rotation_matrix
from fba.sphere import fit_sphere
from formats import read_scene
from formats.landmarks import read_landmarks

EYE = 0.012
"""Radius of an eyeball in metres."""

NEUTRAL = {
    "3.5": (0.0315, 0, 0.012), "3.6": (-0.0315, 0, 0.012),
    "3.1": (0.0315, 0.0058, 0.01), "3.3": (0.0315, -0.0058, 0.01),
    "3.2": (-0.0315, 0.0058, 0.01), "3.4": (-0.0315, -0.0058, 0.01),
    "3.7": (0.0465, 0, 0), "3.11": (0.0165, 0, 0), "3.12": (-0.0465, 0, 0), "3.8": (-0.0165, 0, 0),
    "9.15": (0, -0.04, 0.03), "2.2": (0, -0.06, 0.03), "2.3": (0, -0.06, 0.03),
    "2.4": (0.02, -0.06, 0.02), "2.5": (-0.02, -0.06, 0.02),
    "2.6": (0.01, -0.06, 0.025), "2.7": (-0.01, -0.06, 0.025),
    "2.8": (0.01, -0.06, 0.025), "2.9": (-0.01, -0.06, 0.025),
    "8.3": (0.026, -0.06, 0.02), "8.4": (-0.026, -0.06, 0.02),
    "9.10": (0, -0.061, 0.02), "9.11": (0, -0.061, 0.02), "6.1": (0, -0.062, 0.019), "6.2": (0, -0.062, 0),
}  # fmt: skip


def eyeball(name: str, role: Role, x: float) -> Shape:
    angles = np.stack(np.meshgrid(np.linspace(0.2, 2.9, 9), np.linspace(0, 6, 12)), axis=-1).reshape(-1, 2)
    theta, phi = angles.T
    ball = EYE * np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], axis=1)
    return Shape(name, PolyMesh.from_faces(ball + np.array([x, 0, 0]), [[0, 1, 2]]), role)


def check(
    change: dict | None = None, eyes: bool = True, turn: tuple | None = None, scale: float = 1.0
) -> list[Finding]:
    shapes = (eyeball("l", Role.EYE_LEFT, 0.0315), eyeball("r", Role.EYE_RIGHT, -0.0315)) if eyes else ()
    matrix = scale * (rotation_matrix(turn)[:3, :3] if turn else np.eye(3))
    places = {k: matrix @ np.array(p) for k, p in {**NEUTRAL, **(change or {})}.items() if p is not None}
    points = FeaturePoints({k: FeaturePoint.free(p) for k, p in places.items()})
    return check_neutral(FaceScene(shapes), points, Fapu(0.0116 * scale, 0.063 * scale, 0.04, 0.02 * scale, 0.052))


def moved(point: str, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> dict:
    return {point: tuple(np.array(NEUTRAL[point]) + np.array([x, y, z]))}


def test_a_neutral_face_gives_no_findings() -> None:
    assert check() == []
    assert check(eyes=False) == []


@pytest.mark.parametrize(
    ("change", "code", "words"),
    [
        ({**moved("2.3", y=-0.001), **moved("2.6", y=0.002)}, "lip-gap", "51 at 2.2/2.3 (0.001), 102 at 2.6/2.8"),
        (moved("2.7", y=-0.001), "lip-overlap", "by 51 at 2.7/2.9 (0.001)"),
        ({**moved("2.4", y=-0.002), **moved("2.5", y=-0.003)}, "lip-corners", "2.5 lies 154 MNS/1024"),
        ({"3.1": (0.0315, 0.0095, 0), "3.3": (0.0315, -0.0095, 0)}, "lid-opening", "0.30 of the eye separation"),
        ({"3.2": (-0.0315, 0.0025, 0), "3.4": (-0.0315, -0.0025, 0)}, "lid-opening", "narrow"),
        ({"3.2": (-0.0315, 0.0051, 0), "3.4": (-0.0315, -0.0051, 0)}, "lids-uneven", "left eye is open 0.0116"),
        (moved("3.5", y=0.004), "pupil-height", "0.34 lid openings above"),
        (moved("3.6", x=0.003), "gaze", "right eye gazes 14.0 degrees to the left"),
        (moved("9.11", y=-0.002), "teeth-gap", "apart by 102"),
        (moved("6.1", z=-0.01), "tongue-tip", "away from the top of the lower teeth"),
        ({**moved("6.2", y=-0.02)}, "tongue-slope", "rises by 46 degrees"),
    ],
)
def test_each_broken_rule_is_told_with_its_amount(change: dict, code: str, words: str) -> None:
    found = {f.code: f.message for f in check(change)}
    assert code in found
    assert words in found[code]
    assert not any(f.severity == "error" for f in check(change))


def test_points_that_are_missing_leave_their_checks_out() -> None:
    assert check(dict.fromkeys(NEUTRAL)) == []
    assert check({"2.3": None, "9.11": None, "3.3": None}) == []


def test_gaze_without_eyeballs_comes_from_the_pupils_between_the_corners() -> None:
    aside = {**moved("3.5", x=0.004), **moved("3.6", x=0.004)}
    assert "13 % of the eye width to the left" in {f.code: f.message for f in check(aside, eyes=False)}["gaze"]
    squint = {**moved("3.5", x=-0.002), **moved("3.6", x=0.002)}
    assert check(squint, eyes=False) == []


def test_a_tilted_or_turned_head_is_told() -> None:
    (roll,) = [f for f in check(eyes=False, turn=(0, 0, 1, np.radians(8))) if f.code == "head-tilt"]
    assert "tilted 8.0 degrees to its right shoulder and turned 0.0" in roll.message
    (yaw,) = [f for f in check(eyes=False, turn=(0, 1, 0, np.radians(-5))) if f.code == "head-tilt"]
    assert "turned 5.0 degrees to its right" in yaw.message


@pytest.mark.parametrize(("scale", "words"), [(1000, "millimetres"), (10, "decimetres"), (7, "no common unit")])
def test_the_unit_is_guessed_from_the_eye_separation(scale: float, words: str) -> None:
    (finding,) = check(eyes=False, scale=scale)
    assert finding.code == "unit"
    assert words in finding.message


def test_a_unit_that_contradicts_the_file_is_a_warning() -> None:
    fapu = Fapu(0.0116, 0.063, 0.04, 0.02, 0.052)
    assert check_neutral(FaceScene((), meters_per_unit=1.0), FeaturePoints({}), fapu) == []
    (finding,) = check_neutral(FaceScene((), meters_per_unit=0.01), FeaturePoints({}), fapu)
    assert (finding.severity, finding.code) == ("warning", "unit")


REAL = {
    "makehuman": ("faces/makehuman/base.obj", "38 at 2.2/2.3 (0.0067), 117 at 2.6/2.8", {"lip-gap", "teeth-gap"}),
    "ict": ("faces/ict-facekit/generic_neutral_mesh.obj", "37 at 2.2/2.3", {"lip-gap", "lip-corners"}),
}


@pytest.mark.parametrize("name", REAL)
def test_real_heads_are_off_by_the_amounts_measured_elsewhere(shared: Path, name: str) -> None:
    path, words, warnings = REAL[name]
    scene = read_scene(shared / path)
    scene, points, _ = orient(scene, read_landmarks(shared / "landmarks" / f"{name}.json", scene))
    findings = check_neutral(scene, points, Fapu.from_feature_points(points.positions(scene)))
    assert {f.code for f in findings if f.severity == "warning"} == warnings
    assert words in {f.code: f.message for f in findings}["lip-gap"]


def test_sphere_from_a_part_of_it() -> None:
    rng = np.random.default_rng(0)
    points = rng.normal(size=(50, 3))
    points[:, 2] = np.abs(points[:, 2])
    points = 3.0 * points / np.linalg.norm(points, axis=1, keepdims=True) + [10, -20, 500]
    center, radius, error = fit_sphere(points)
    assert center == pytest.approx([10, -20, 500], abs=1e-9)
    assert radius == pytest.approx(3.0)
    assert error < 1e-9
    flat = fit_sphere(np.concatenate([rng.normal(size=(20, 2)), np.zeros((20, 1))], axis=1))
    assert np.isfinite([*flat[0], *flat[1:]]).all()
