"""Feature points found from shape alone: against known ones, from any pose, and a clear refusal of what is no face."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import maximum_filter

from cloning.detect import Detection, detect_points
from cloning.detect.lips import on_own_lip
from cloning.detect.model import ready
from cloning.detect.neighbours import by_neighbours
from cloning.detect.patches import by_patches
from cloning.detect.search import GAZES, _foremost, turns
from cloning.detect.xiang import LANDMARKS
from cloning.prepare import DERIVED, NECESSARY, PreparedFace, prepare
from cloning.surface import Surface
from cloning.template.closest import TriangleSearch
from fat import AnimatableFace
from fba import FaceScene, FeaturePoints, PolyMesh, Shape
from fba.arrays import Floats
from fba.errors import LandmarkError
from fba.orientation import orient
from formats import read_scene
from formats.landmarks import read_landmarks
from samples import sample

SHARP = ("2.2", "2.3", "2.4", "2.5", "3.1", "3.2", "3.3", "3.4", "3.7", "3.8", "3.11", "3.12", "8.1", "8.2", "9.3")
"""Points that lie on an edge or a tip."""

DATA = Path(__file__).resolve().parents[1] / "data"

TURN = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""Gaze along x, up along z."""


@pytest.fixture(scope="module")
def known(source: AnimatableFace) -> PreparedFace:
    return prepare(source.scene, source.feature_points, "source")


@pytest.fixture(scope="module")
def tri() -> tuple[FaceScene, FeaturePoints]:
    path = sample("faces/tri_head.obj")
    scene = read_scene(path)
    return scene, read_landmarks(path.with_name("tri_head.fps.json"), scene)


@pytest.fixture(scope="module")
def posed(tri: tuple[FaceScene, FeaturePoints]) -> FaceScene:
    """The head with other axes, tilted by some degrees, in another unit, far from the origin, wound inside out."""
    angle = np.radians(8.0)
    tilt = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    turn = TURN @ tilt

    def moved(vertices: Floats) -> Floats:
        there: Floats = 730.0 * vertices @ turn.T + np.array([9e3, -4e3, 2e4])
        return there

    shapes = {s.name: replace(s, mesh=s.mesh.with_vertices(moved(s.mesh.vertices)).reversed()) for s in tri[0].shapes}
    return tri[0].map_shapes(shapes)


@pytest.fixture(scope="module")
def detected(posed: FaceScene, known: PreparedFace) -> Detection:
    return detect_points(posed, known)


def errors(scene: FaceScene, found: FeaturePoints, truth: FeaturePoints) -> dict[str, float]:
    """Distances from the truth in eye widths."""
    at, wanted = found.positions(scene), truth.positions(scene)
    width = 0.5 * sum(np.linalg.norm(wanted[a] - wanted[b]) for a, b in (("3.7", "3.11"), ("3.8", "3.12")))
    return {k: float(np.linalg.norm(at[k] - wanted[k]) / width) for k in at if k in wanted}


def test_points_are_found_whatever_the_pose(
    tri: tuple[FaceScene, FeaturePoints], posed: FaceScene, detected: Detection
) -> None:
    surface = FeaturePoints({k: p for k, p in tri[1].items() if p.shape is not None})
    off = errors(posed, detected.points, surface)
    assert np.mean([off[k] for k in SHARP]) < 0.08
    assert max(off[k] for k in SHARP) < 0.25
    face = [v for k, v in off.items() if k.split(".")[0] in ("2", "3", "4", "5", "8", "9")]
    assert np.mean(face) < 0.1


def test_the_axes_follow_from_detected_points(posed: FaceScene, detected: Detection) -> None:
    turned, _, findings = orient(posed, detected.points)
    np.testing.assert_array_equal(turned.frame.axes, TURN.T)
    assert "inside-out" in {f.code for f in findings}


def test_parts_inside_the_head_are_found(posed: FaceScene, detected: Detection) -> None:
    where = {key: p.shape for key, p in detected.points.items()}
    assert (where["3.5"], where["3.6"]) == ("eye_left", "eye_right")
    assert (where["9.10"], where["9.11"], where["6.1"]) == ("upper_teeth", "lower_teeth", "tongue")


def test_sharp_points_are_surer_than_vague_ones(detected: Detection) -> None:
    trust = {key: p.confidence for key, p in detected.points.items()}
    assert all(0.0 < c <= 1.0 for c in trust.values())
    assert min(trust[k] for k in ("2.2", "2.4", "3.1", "9.3")) > max(trust[k] for k in ("5.1", "11.1", "2.13"))
    assert all(p.source == "detected" for p in detected.points.values())


def test_given_points_are_kept_and_place_the_head(tri: tuple[FaceScene, FeaturePoints], known: PreparedFace) -> None:
    scene, truth = tri
    clicks = FeaturePoints({k: truth[k] for k in ("9.3", "2.1", "8.3", "8.4", "3.7", "3.12")})
    found = detect_points(scene, known, clicks)
    for key, point in clicks.items():
        assert found.points[key] == point
    off = errors(scene, found.points, truth)
    assert np.mean([off[k] for k in SHARP]) < 0.08


def test_a_tongue_is_found_only_where_there_is_one(posed: FaceScene, known: PreparedFace) -> None:
    """Teeth are not taken for it."""
    without = FaceScene(tuple(s for s in posed.shapes if s.name != "tongue"), name="toothed")
    found = detect_points(without, known).points
    assert {"9.8", "9.9", "9.10", "9.11"} <= set(found)
    assert not {"6.1", "6.2", "6.3", "6.4"} & set(found)


def test_xiang_finds_its_landmarks(tri: tuple[FaceScene, FeaturePoints], known: PreparedFace) -> None:
    found = detect_points(tri[0], known, detector="xiang")
    off = errors(tri[0], found.points, tri[1])
    assert np.mean([off[k] for k in LANDMARKS]) < 0.15
    assert max(off[k] for k in LANDMARKS) < 0.4
    once = errors(tri[0], detect_points(tri[0], known, detector="xiang-once").points, tri[1])
    assert np.mean([once[k] for k in LANDMARKS]) < 0.15
    assert any(once[k] != off[k] for k in LANDMARKS)
    with pytest.raises(LandmarkError, match="no detector 'magic'"):
        detect_points(tri[0], known, detector="magic")


def test_a_cheek_lies_beside_the_mouth_below_the_nose(known: PreparedFace) -> None:
    """On the source moved as a whole, neighbours say where the points are; a wider mouth takes the cheek along."""
    skin = ready(known).skin
    places = dict(skin.positions)
    same = by_neighbours(skin, skin, places)
    assert {"5.1", "5.2", "4.5", "2.11", "9.5"} <= set(same)
    assert max(float(np.linalg.norm(same[key] - places[key])) for key in same) < 0.02
    wider = {**places, "2.4": places["2.4"] + (0.05, 0.0, 0.0)}
    moved = by_neighbours(skin, skin, wider)
    assert moved["5.1"][0] - same["5.1"][0] == pytest.approx(0.05)
    assert moved["2.11"][0] - same["2.11"][0] == pytest.approx(0.025)
    np.testing.assert_array_equal(moved["5.2"], same["5.2"])


def test_nostrils_and_chin_follow_their_rules(
    tri: tuple[FaceScene, FeaturePoints], detected: Detection, posed: FaceScene
) -> None:
    surface = FeaturePoints({k: p for k, p in tri[1].items() if p.shape is not None})
    off = errors(posed, detected.points, surface)
    assert max(off[k] for k in ("9.1", "9.2", "9.4", "9.5", "2.10", "2.11", "2.12", "5.1", "5.2")) < 0.2


def test_touching_lips_keep_their_own_points(known: PreparedFace) -> None:
    skin = known.skin
    pairs = (("2.2", "2.3"), ("2.6", "2.8"), ("2.7", "2.9"))
    middle = {key: 0.5 * (skin.positions[a] + skin.positions[b]) for a, b in pairs for key in (a, b)}
    found = on_own_lip(skin, _search(skin), {**skin.positions, **middle})
    upper, lower = skin.distances(["8.1", "8.2"])
    for a, b in pairs:
        assert np.all(upper[found[a][0]] < lower[found[a][0]])
        assert np.all(lower[found[b][0]] < upper[found[b][0]])
        for key in (a, b):
            vertices, weights = found[key]
            assert np.linalg.norm(weights @ skin.vertices[vertices] - middle[key]) < 0.02


def test_ears_and_skull_follow_their_shape(known: PreparedFace) -> None:
    """On the source as it is nothing moves; ears that lie elsewhere are found there from where they were."""
    skin = ready(known).skin
    own = skin.positions
    same = by_patches(skin, _search(skin), skin, own)
    assert {*(f"10.{k}" for k in range(1, 11)), "11.1", "11.4", "11.6", "2.13", "2.14"} <= set(same)
    assert max(float(np.linalg.norm(same[key] - own[key])) for key in same) < 0.01
    off = {key: place + np.array([0.0, 0.05, -0.05]) if key[:2] == "10" else place for key, place in own.items()}
    again = by_patches(skin, _search(skin), skin, off)
    assert max(float(np.linalg.norm(again[key] - own[key])) for key in again if key[:2] != "11") < 0.03
    # A mask has neither.
    mask = replace(skin, triangles=skin.triangles[skin.vertices[skin.triangles][:, :, 2].min(axis=1) > -0.4])
    assert by_patches(mask, _search(mask), skin, own) == {}


def test_vague_points_are_found_too(
    posed: FaceScene, detected: Detection, tri: tuple[FaceScene, FeaturePoints]
) -> None:
    surface = FeaturePoints({k: p for k, p in tri[1].items() if p.shape is not None})
    off = {k: v for k, v in errors(posed, detected.points, surface).items() if k[:3] in ("10.", "11.", "2.1")}
    assert np.mean(list(off.values())) < 0.1
    assert max(off.values()) < 0.25


def torus() -> FaceScene:
    """A ring of 24 x 24 quads: of all simple shapes the one most like a face."""
    u, v = np.meshgrid(*[np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)] * 2)
    out = 1.0 + 0.4 * np.cos(v)
    places = np.stack([out * np.cos(u), out * np.sin(u), 0.4 * np.sin(v)], axis=2).reshape(-1, 3)
    faces = [
        [24 * r + c, 24 * r + (c + 1) % 24, 24 * ((r + 1) % 24) + (c + 1) % 24, 24 * ((r + 1) % 24) + c]
        for r in range(24)
        for c in range(24)
    ]
    return FaceScene((Shape("torus", PolyMesh.from_faces(places, faces)),), name="torus")


def test_what_is_no_face_is_refused(known: PreparedFace) -> None:
    with pytest.raises(LandmarkError, match="no face was found"):
        detect_points(torus(), known)
    nothing = FaceScene((Shape("points", PolyMesh.from_faces(np.eye(3), [])),), name="points")
    with pytest.raises(LandmarkError, match="no polygons"):
        detect_points(nothing, known)


def test_a_creature_is_refused_without_points(shared: Path, known: PreparedFace) -> None:
    scene = read_scene(shared / "faces" / "suzanne" / "suzanne.obj")
    with pytest.raises(LandmarkError, match="no face was found"):
        detect_points(scene, known)
    given = read_landmarks(DATA / "suzanne.fps.json", scene)
    found = detect_points(scene, known, given).points
    assert set(NECESSARY) - set(DERIVED) <= set(found)
    assert {key: found[key] for key in given} == dict(given)
    # Left and right, upper and lower: what cloning asks of points, whatever the face.
    prepare(scene, found, "target")


def test_every_way_to_look_is_searched_once() -> None:
    found = [turn for gaze in GAZES for turn in turns(*gaze)]
    assert len({turn.tobytes() for turn in np.array(found) + 0.0}) == 24
    assert all(np.isclose(np.linalg.det(turn), 1.0) for turn in found)
    assert any(np.array_equal(turn, np.eye(3)) for turn in turns(*GAZES[0]))


@pytest.mark.parametrize("shape", [(40, 50), (3, 9), (16, 1)])
def test_the_foremost_depth_around_is_that_of_a_maximum_filter(shape: tuple[int, int]) -> None:
    depth = np.random.default_rng(0).random(shape)
    depth[depth < 0.3] = -np.inf
    for reach in (1, 2, 7):
        assert np.array_equal(_foremost(depth, reach), maximum_filter(depth, 2 * reach + 1))


def _search(skin: Surface) -> TriangleSearch:
    return TriangleSearch(skin.vertices, skin.triangles)
