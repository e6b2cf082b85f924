"""Analytic checks of the parts of the pipeline."""

from __future__ import annotations

import numpy as np
import pytest

from cloning.align import radial_warp
from cloning.antialias import circle_samples, edge_samples
from cloning.cylinder import cylinder
from cloning.eyeballs import Ball, EyeGuard
from cloning.fill import HarmonicFill
from cloning.locate import closest, closest_on_triangles
from cloning.normalize import blend, units_of
from cloning.published import inside_polygon
from cloning.refine import refine
from cloning.rigid import fit_rigid
from fba import PolyMesh
from fba.scene import rotation_matrix


def grid(n: int, spread: float = 1.0) -> PolyMesh:
    """n x n vertices in the plane z = 0, quads."""
    axis = np.linspace(0.0, spread, n)
    y, x = np.meshgrid(axis, axis, indexing="ij")
    index = np.arange(n * n).reshape(n, n)
    quads = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1).reshape(-1, 4)
    return PolyMesh.from_faces(np.stack([x.ravel(), y.ravel(), 0.0 * x.ravel()], axis=1), quads)


def test_warp_takes_anchors_to_goals_and_keeps_affine_maps() -> None:
    random = np.random.default_rng(2)
    anchors = random.random((12, 3))
    goals = anchors + 0.1 * random.random((12, 3))
    assert np.allclose(radial_warp(anchors, anchors, goals), goals, atol=1e-9)
    matrix = random.random((3, 3))
    places = random.random((30, 3)) * 3.0
    assert np.allclose(radial_warp(places, anchors, anchors @ matrix + 2.0), places @ matrix + 2.0, atol=1e-8)


def test_blend_is_exact_at_anchors_and_stays_between_the_values() -> None:
    random = np.random.default_rng(3)
    anchors, values = random.random((8, 3)), random.random((8, 3))
    assert np.allclose(blend(anchors, anchors, values), values, atol=1e-6)
    between = blend(random.random((100, 3)), anchors, values)
    assert np.all(between >= values.min(axis=0) - 1e-12)
    assert np.all(between <= values.max(axis=0) + 1e-12)


def test_every_feature_point_has_units() -> None:
    from fba import feature_point_definitions

    assert all(len(units_of(i)) == 3 for i in feature_point_definitions())
    assert [u.value for u in units_of("9.11")] == ["MW", "MNS", "MNS"]


def test_cylinder_spans_the_mouth_by_one_radian_with_the_nose_at_zero() -> None:
    places = {"8.3": np.array([0.6, 0.0, 1.0]), "8.4": np.array([-0.4, 0.0, 1.0]), "9.3": np.array([0.15, 0.4, 1.5])}
    around = cylinder(places)
    plane, depth = around.project(np.array([places["8.3"], places["8.4"], places["9.3"]]))
    assert plane[0, 0] - plane[1, 0] == pytest.approx(1.0)
    assert plane[2, 0] == pytest.approx(0.0)
    assert depth[2] < depth[0], "the nose is nearer to the outside than the lips"


def test_polygon_test() -> None:
    outline = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]])
    inside = inside_polygon(np.array([[1.0, 1.0], [2.0, 2.0], [3.5, 2.0], [-1.0, 1.0]]), outline)
    assert inside.tolist() == [True, False, True, False]


def test_harmonic_fill_continues_linear_fields_and_rests_where_nothing_is_known() -> None:
    mesh = grid(6)
    interior = np.zeros((6, 6), bool)
    interior[1:-1, 1:-1] = True
    unknown = np.append(interior.ravel(), [True, True])
    vertices = np.concatenate([mesh.vertices, [[5.0, 5.0, 0.0], [6.0, 5.0, 0.0]]])
    edges = np.concatenate([mesh.edges, [[36, 37]]])
    truth = vertices @ np.array([[1.0, 2.0], [0.5, -1.0], [0.0, 0.0]])
    values = np.where(unknown[:, None], 99.0, truth)
    fill = HarmonicFill(vertices, edges, unknown)
    fill.apply(values)
    assert np.allclose(values[:36], truth[:36])
    assert np.all(values[36:] == 0.0)
    still = np.zeros((38, 3))
    still[unknown] = 1.0
    fill.apply(still)
    assert not still.any(), "rest stays exactly rest"


def test_closest_point_on_triangles_agrees_with_sampling() -> None:
    random = np.random.default_rng(4)
    corners = random.random((20, 3, 3))
    points = random.random((20, 3)) * 2.0 - 0.5
    weights, distances = closest_on_triangles(points, corners)
    steps = np.linspace(0.0, 1.0, 41)
    bary = np.array([(a, b, 1.0 - a - b) for a in steps for b in steps if a + b <= 1.0 + 1e-12])
    sampled = np.linalg.norm(np.einsum("sk,tkd->tsd", bary, corners) - points[:, None], axis=2).min(axis=1)
    assert np.all(weights >= -1e-12)
    assert np.allclose(weights.sum(axis=1), 1.0)
    assert np.allclose(np.linalg.norm(np.einsum("tk,tkd->td", weights, corners) - points, axis=1), distances, atol=1e-9)
    assert np.all(distances <= sampled + 1e-12)
    assert np.all(sampled - distances < 0.06)


def test_places_never_cross_to_the_opposite_label_or_the_other_sheet() -> None:
    sheet = grid(5)
    n = sheet.vertex_count
    vertices = np.concatenate([sheet.vertices, sheet.vertices - np.array([0.0, 0.0, 0.02])])
    triangles = np.concatenate([sheet.triangles, sheet.triangles[:, ::-1] + n])
    normals = np.repeat([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]], n, axis=0)
    labels = np.where(vertices[:, 0] < 0.5, 1, 2)
    labels[np.isclose(vertices[:, 0], 0.5)] = 0
    points = np.array([[0.6, 0.5, -0.015], [0.4, 0.5, -0.015]])
    found = closest(points, np.array([[0.0, 0.0, 1.0]] * 2), np.array([1, 1]), vertices, normals, triangles, labels)
    assert np.all(found.facing > 0.99)
    places = np.einsum("nk,nkd->nd", found.weights, vertices[triangles[found.triangles]])
    assert np.allclose(places[:, 0], [0.5, 0.4]), "the point beyond the border stops at it"
    assert np.allclose(places[:, 2], 0.0)


def test_refinement_keeps_constants_and_planes_and_rest() -> None:
    mesh = grid(7)
    step = refine(mesh.indices, mesh.offsets, mesh.vertex_count)
    assert step.matrix.shape[0] == 49 + len(mesh.edges) + mesh.face_count
    assert np.allclose(np.asarray(step.matrix.sum(axis=1)).ravel(), 1.0)
    assert np.allclose((step.matrix @ mesh.vertices)[:, 2], 0.0)
    bump = np.zeros((49, 3))
    bump[24] = [0.0, 0.0, 1.0]
    refined = step.apply(bump)
    assert refined[24, 2] == pytest.approx(1.0, abs=0.25)
    assert np.count_nonzero(refined[:, 2]) == 9, "only the vertex, its four edges and its four faces move"


def test_refinement_of_a_smooth_field_is_better_than_linear() -> None:
    mesh = grid(9)
    step = refine(mesh.indices, mesh.offsets, mesh.vertex_count)

    def field(v: np.ndarray) -> np.ndarray:
        return np.sin(5.0 * v[:, :1]) * np.cos(4.0 * v[:, 1:2])

    places = step.parents @ mesh.vertices
    inner = np.all((places[:, :2] > 0.3) & (places[:, :2] < 0.7), axis=1)
    smooth = np.abs(step.matrix @ field(mesh.vertices) - field(places))[inner].max()
    linear = np.abs(step.parents @ field(mesh.vertices) - field(places))[inner].max()
    assert smooth < 0.5 * linear


def test_rigid_fit_finds_rotation_and_path() -> None:
    random = np.random.default_rng(5)
    vertices = random.random((20, 3))
    turn = rotation_matrix((1.0, 2.0, 0.5, 0.4))[:3, :3]
    center = np.array([0.3, 0.2, 0.1])
    offsets = (vertices - center) @ turn.T + center + [0.1, 0.0, -0.2] - vertices
    motion = fit_rigid(vertices, np.stack([offsets, 0.0 * offsets], axis=1), center)
    assert np.allclose(motion.turns[0], turn)
    assert np.allclose(motion.shifts[0], [0.1, 0.0, -0.2])
    assert motion.residual[0] < 1e-12
    assert not motion.offsets(vertices, center, np.ones(3))[:, 1].any()
    assert np.allclose(motion.offsets(vertices, center, np.ones(3))[:, 0], offsets)
    small = motion.offsets(0.5 * vertices, 0.5 * center, np.full(3, 0.5))[:, 0]
    assert np.allclose(small, 0.5 * offsets), "a body half as large moves half as far and turns as far"


def test_filter_stays_within_support_and_label() -> None:
    mesh = grid(3)
    labels = np.array([1, 1, 2] * 3)
    normals = np.repeat([[0.0, 0.0, 1.0]], 9, axis=0)
    samples = edge_samples(mesh.vertices, normals, mesh.edges, labels, np.full(9, 0.1), support=0.02)
    away = np.linalg.norm(samples.points - mesh.vertices[samples.owners], axis=1)
    assert np.allclose(away, 0.02)
    sideways = samples.points[:, 0] - mesh.vertices[samples.owners][:, 0]
    assert not np.any(sideways[labels[samples.owners] == 2]), "the column of label 2 is sampled along itself only"
    dense = edge_samples(mesh.vertices, normals, mesh.edges, labels, np.full(9, 0.5))
    assert len(dense.owners) == 0, "a coarse source needs no filter"
    assert np.allclose(np.linalg.norm(circle_samples(np.zeros((1, 2)))[0], axis=1), 0.02)


def ball(radius: float, skin: np.ndarray) -> Ball:
    """A sphere about the origin and skin points near it."""
    way = np.random.default_rng(8).normal(size=(2000, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    return Ball(np.zeros(3), way, np.full(2000, radius), np.arange(len(skin)), skin)


def test_lids_are_pushed_off_a_larger_ball_but_only_forward() -> None:
    place = np.array([[0.0, 0.8, 0.82], [0.0, -0.9, 0.9]])
    down = np.zeros((2, 1, 3))
    down[0, 0, 1] = -0.7
    mine, yours = ball(0.8, place), ball(1.0, place)
    motion = down.copy()
    EyeGuard([mine], [yours], lambda field: field).apply(down, motion)
    assert np.array_equal(motion[:, :, :2], down[:, :, :2]), "x and y hold the FAP's amount"
    assert not motion[1].any(), "what rests stays"
    assert np.linalg.norm(place[0] + motion[0, 0]) >= 1.0
    assert motion[0, 0, 2] > 0.0


def test_a_face_of_its_own_kind_is_not_pushed() -> None:
    random = np.random.default_rng(9)
    place = np.concatenate([random.normal(size=(50, 2)) * 0.5, 1.0 + 0.2 * random.random((50, 1))], axis=1)
    offsets = random.normal(size=(50, 3, 3)) * 0.3
    same = ball(1.0, place)
    motion = offsets.copy()
    EyeGuard([same], [same], lambda field: field).apply(offsets, motion)
    assert np.allclose(motion, offsets)
