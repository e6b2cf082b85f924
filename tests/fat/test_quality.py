from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fat import AnimatableFace, FaceMotion
from fat.build import build_tables
from fat.conformance import rotation_vector
from fat.quality import (
    asymmetry,
    conformance,
    cross_talk,
    edge_stretch,
    fap_error,
    fap_values,
    feature_point_motion,
    flips,
    largest_motion,
    lid_gap,
    lip_gap_change,
    mirror_map,
    roughness,
    truth_error,
)
from fat.rig import rig_eye, rig_head
from fat.tables import FaceDefTransform, TransformField
from fba import FaceScene, Fapu, FeaturePoint, FeaturePoints, PolyMesh, Role, Shape, faps
from fba.errors import MeshError
from fba.feature_points import standard_feature_points
from fba.scene import rotation_matrix

FAPU = Fapu(irisd0=0.1, es0=0.6, ens0=0.4, mns0=0.2, mw0=0.5)
SKIN = tuple(i for i in standard_feature_points() if i not in ("3.5", "3.6", "7.1", "11.5"))


def probe_face(errors: dict[int, float] | None = None) -> AnimatableFace:
    """A skin with one vertex for each feature point, two eyeballs with 3.5 and 3.6, and a table for every FAP.

    errors : FAP -> factor by which its motion is wrong.
    """
    rng = np.random.default_rng(0)
    wrong = errors or {}
    skin = rng.normal(size=(len(SKIN), 3))
    for point, place in {"6.3": (0.2, -1, 0), "6.4": (-0.2, -1, 0), "6.2": (0, -1, 0)}.items():
        skin[SKIN.index(point)] = place
    shapes = [Shape("skin", mesh(skin), Role.SKIN)]
    points = {k: FeaturePoint("skin", (n,), (1.0,)) for n, k in enumerate(SKIN)}
    for name, role, key, x in (("l", Role.EYE_LEFT, "3.5", 0.3), ("r", Role.EYE_RIGHT, "3.6", -0.3)):
        ring = np.array([(np.cos(a) * 0.03, np.sin(a) * 0.03, 0.1) for a in np.pi / 3 * np.arange(6)])
        rest = rng.normal(size=(20, 3)) * 0.05
        ball = np.concatenate([[[0, 0, 0.11]], ring, rest, rest * [-1, -1, 1]]) + np.array([x, 0.4, 1.0])
        shapes.append(Shape(name, mesh(ball), role))
        points[key] = FeaturePoint(name, (0,), (1.0,))
    scene = FaceScene(tuple(shapes))
    motions = []
    for f in faps()[2:]:
        sign = 1.0 + wrong.get(f.id, 0.0)
        for value in (600, -300) if f.bidirectional else (600,):
            motion = low_level_motion(scene, points, f.id, value * sign)
            motions += [FaceMotion(f.name, f.id, 1, value, motion)] if motion else []
    scene, transforms = rig_eye(scene, "left", ["l"], np.array([0.3, 0.4, 1.0]))
    scene, more = rig_eye(scene, "right", ["r"], np.array([-0.3, 0.4, 1.0]))
    scene, head = rig_head(scene, np.array([0, -1.0, 0]))
    transforms = {**transforms, **more, **head}
    for number, share in wrong.items():
        if (number, 1) in transforms:
            old = transforms[number, 1][0]
            turned = (*old.rotation_def[:3], old.rotation_def[3] * (1 + share))
            transforms[number, 1] = (replace(old, rotation_def=turned),)
    return AnimatableFace(scene, FeaturePoints(points), build_tables(scene, FAPU, motions, transforms), FAPU)


def mesh(vertices: np.ndarray) -> PolyMesh:
    return PolyMesh.from_faces(vertices, [[0, 1, 2]])


def low_level_motion(scene: FaceScene, points: dict, number: int, value: float) -> dict[str, np.ndarray]:
    """Own feature point exactly by its FAPU amount, with some motion across the axis."""
    f = faps()[number - 1]
    amount = FAPU.unit(f.unit) * value
    point = points.get(f.feature_points[0])
    if f.rotation_axis is not None:
        return {}
    if number == 47:
        offsets = np.zeros((len(SKIN), 3))
        for key, side in (("6.3", 1), ("6.4", -1)):
            index = SKIN.index(key)
            turn = rotation_matrix((0, 0, 1, side * amount))[:3, :3]
            offsets[index] = turn @ [side * 0.2, 0, 0] - [side * 0.2, 0, 0]
        return {"skin": offsets}
    vertices = scene.shape(point.shape).mesh.vertices
    offsets = np.zeros_like(vertices)
    if f.direction is None:
        out = vertices[1:7] - vertices[0]
        out[:, 2] = 0
        offsets[1:7] = out / 0.03 * (amount / 2)
        offsets[1:7, 2] = -0.3 * abs(amount)  # down on a bulge, which makes the pupil no wider
        return {point.shape: offsets}
    direction = np.array(f.direction)
    offsets[point.vertices[0]] = amount * (direction + 0.3 * direction[[1, 2, 0]])
    return {point.shape: offsets}


def test_a_conforming_face_passes_every_fap() -> None:
    results = {r.fap_id: r for r in conformance(probe_face())}
    assert list(results) == list(range(3, 69))
    for r in results.values():
        assert r.relative_error < 1e-5, r
        assert r.passed
    assert {r.kind for r in results.values()} == {"translation", "rotation", "roll", "dilation"}
    assert results[3].off_axis == pytest.approx(180, rel=1e-4)


@pytest.mark.parametrize("share", [-0.1, 0.02, 0.2])
def test_wrong_amounts_are_measured(share: float) -> None:
    wrong = dict.fromkeys((3, 19, 23, 26, 29, 31, 47, 48, 50), share)
    for r in conformance(probe_face(wrong)):
        expected = abs(wrong.get(r.fap_id, 0.0))
        assert r.relative_error == pytest.approx(expected, rel=1e-3, abs=1e-5), r
        assert r.passed == (r.fap_id not in wrong)


def test_one_unit_is_within_rounding() -> None:
    (result,) = [r for r in conformance(probe_face({3: 1 / 700})) if r.fap_id == 3]
    assert result.error_units < 1.0
    (result,) = [r for r in conformance(probe_face({15: 0.0049})) if r.fap_id == 15]
    assert result.error_units > 1.0
    assert result.passed


def test_eyes_thrust_by_a_transform_and_rotations_about_a_wrong_axis() -> None:
    face = probe_face()
    unit = FAPU.unit(faps()[26].unit)
    thrust = FaceDefTransform("eye_left_yaw", TransformField.TRANSLATION, translation_def=(0, 0, unit))
    askew = FaceDefTransform("eye_left_pitch", rotation_def=(1, 0.1, 0, 1))
    tables = {t.key: t for t in face.tables}
    tables[27, 1] = replace(tables[27, 1], meshes=(), transforms=(thrust,))
    tables[25, 1] = replace(tables[25, 1], transforms=(askew,))
    results = {
        r.fap_id: r for r in conformance(replace(face, tables=replace(face.tables, tables=tuple(tables.values()))))
    }
    assert results[27].relative_error < 1e-9
    assert results[25].relative_error == pytest.approx(0.1, rel=0.02)


def test_faps_that_cannot_be_seen_are_left_out() -> None:
    face = probe_face()
    kept = {k: p for k, p in face.feature_points.items() if k not in ("2.1", "6.3")}
    kept["9.3"] = FeaturePoint.free(np.zeros(3))
    bare = face.scene.map_shapes({n: replace(face.scene.shape(n), role=Role.SKIN) for n in ("l", "r")})
    results = {r.fap_id for r in conformance(replace(face, scene=bare, feature_points=FeaturePoints(kept)))}
    assert set(range(3, 69)) - results == {3, 14, 15, 47, 63, 64, *range(23, 31)}


@pytest.mark.parametrize("angle", [1e-7, 0.1, 1.5, 3.0])
def test_rotation_vector(angle: float) -> None:
    points = np.random.default_rng(1).normal(size=(30, 3))
    axis = np.array([1.0, -2.0, 0.5]) / np.linalg.norm([1.0, -2.0, 0.5])
    turned = points @ rotation_matrix((*axis, angle))[:3, :3].T + [5, 6, 7]
    assert rotation_vector(points, turned) == pytest.approx(axis * angle, rel=1e-6)
    assert rotation_vector(points, points) == pytest.approx([0, 0, 0], abs=1e-12)


def test_own_values_cross_talk_and_errors() -> None:
    face = probe_face()
    index = {k: n for n, k in enumerate(SKIN)}
    offsets = np.zeros((len(SKIN), 3))
    offsets[index["4.1"]] = np.array([0, 300, 0]) * FAPU.ens0 / 1024 + np.array([-90, 0, 0]) * FAPU.es0 / 1024
    offsets[index["4.3"]] = np.array([0, -6, 0]) * FAPU.ens0 / 1024
    motion = feature_point_motion(face.feature_points, {"skin": offsets})
    assert motion["3.5"].tolist() == [0, 0, 0]
    values = fap_values(motion, FAPU)
    assert (values[31], values[33], values[37]) == pytest.approx((300, -6, 90))
    share, other = cross_talk(values, 31)
    assert (share, other) == (pytest.approx(0.02), 33)
    assert cross_talk({12: 300.0, 59: 290.0, 4: 3.0}, 12) == (0.01, 4), "tied corners are no cross-talk"
    assert cross_talk({3: 300.0, 5: 290.0, 31: 3.0}, 3) == (0.01, 31), "the jaw carries the lip"
    assert cross_talk({31: 0.0, 33: 1.0}, 31) == (float("inf"), 33)
    other_size = Fapu(*(2 * v for v in (0.1, 0.6, 0.4, 0.2, 0.5)))
    twice = fap_values(feature_point_motion(face.feature_points, {"skin": 2 * offsets}), other_size)
    assert fap_error(values, twice).relative < 1e-12, "FAPU motions are compared, not lengths"
    error = fap_error(values, {**values, 37: 50.0})
    assert (error.relative, error.largest, error.fap_id) == (pytest.approx(40 / 396), pytest.approx(40), 37)


def test_flips_count_moving_triangles_that_turn_over() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 0, 0], [6, 0, 0], [5, 1, 0], [9, 9, 9]], float)
    triangles = np.array([[0, 1, 2], [3, 4, 5], [6, 6, 6]], np.int32)
    offsets = np.zeros((7, 3))
    assert flips(vertices, triangles, offsets) == 0.0
    offsets[2] = [0, -0.5, 0.2]
    assert flips(vertices, triangles, offsets) == 0.0
    offsets[2] = [0, -1.5, 0.2]
    assert flips(vertices, triangles, offsets) == 100.0
    offsets[3] = [0.1, 0, 0]
    assert flips(vertices, triangles, offsets) == 50.0


def test_lip_and_lid_gaps() -> None:
    still = {k: np.zeros(3) for k in ("2.2", "2.3", "2.6", "2.8", "2.7", "2.9", "3.1", "3.3", "3.2", "3.4")}
    opened = {**still, "2.2": np.array([0.3, 0.01, 0.2]), "2.3": np.array([0, -0.03, 0])}
    half = {**opened, "2.3": np.array([0, -0.01, 0])}
    assert lip_gap_change(opened, FAPU, opened, FAPU) == 0.0
    assert lip_gap_change(opened, FAPU, half, FAPU) == pytest.approx(0.1)
    assert lip_gap_change(opened, FAPU, still, FAPU) == pytest.approx(0.2)
    double = Fapu(0.2, 1.2, 0.8, 0.4, 1.0)
    assert lip_gap_change(opened, FAPU, {k: 2 * v for k, v in opened.items()}, double) < 1e-12
    rest = {"3.1": np.array([0, 0.1, 0]), "3.3": np.zeros(3), "3.2": np.array([0, 0.1, 0]), "3.4": np.zeros(3)}
    blink = {**still, "3.1": np.array([0, -0.1, 0]), "3.2": np.array([0, -0.12, 0])}
    assert lid_gap(rest, still, FAPU) == {"3.1/3.3": 1.0, "3.2/3.4": 1.0}
    assert lid_gap(rest, blink, FAPU) == {"3.1/3.3": 0.0, "3.2/3.4": pytest.approx(-0.2)}


def test_still_skin_truth_and_symmetry() -> None:
    rng = np.random.default_rng(0)
    half = rng.normal(size=(20, 3)) + np.array([5, 0, 0])
    vertices = np.concatenate([half, half * [-1, 1, 1], [[0, 1, 2]]])
    mirror = mirror_map(vertices, 1e-9)
    assert mirror.tolist() == [*range(20, 40), *range(20), 40]
    left = np.zeros((41, 3))
    left[:20] = rng.normal(size=(20, 3))
    right = left[mirror] * [-1, 1, 1]
    assert asymmetry(left, right, mirror) == 0.0
    assert asymmetry(left, 1.1 * right, mirror) == pytest.approx(0.1)
    assert asymmetry(left, left, mirror) > 1.0
    with pytest.raises(MeshError, match="not symmetric"):
        mirror_map(vertices + np.array([0.1, 0, 0]), 1e-3)
    where = np.arange(41) >= 20
    assert largest_motion(left, where, FAPU) == 0.0
    left[30] = [0, 0.3, 0.4]
    assert largest_motion(left, where, FAPU) == pytest.approx(0.5 / 0.6)
    assert truth_error(1.2 * left, left) == pytest.approx(0.2)
    assert truth_error(1.2 * left, left, np.arange(41) == 30) == pytest.approx(0.2)
    assert truth_error(left, left * 0) == float("inf")


def test_stretch_and_roughness() -> None:
    vertices = np.stack([np.arange(50.0), np.zeros(50), np.zeros(50)], axis=1)
    edges = np.stack([np.arange(49), np.arange(1, 50)], axis=1).astype(np.int32)
    longer = vertices * [1, 0, 0]
    assert edge_stretch(vertices, edges, longer) == pytest.approx(np.log(2))
    assert edge_stretch(vertices, edges, longer * 0) == 0.0
    smooth = np.ones((50, 3))
    noise = smooth * np.where(np.arange(50) % 2, 1, -1)[:, None]
    assert roughness(edges, smooth) == 0.0
    assert roughness(edges, noise) == pytest.approx(2.0)
