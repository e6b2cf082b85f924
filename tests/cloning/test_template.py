"""The elastic template: operators, energies, fits whose result is known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from remade import bare
from scipy.sparse import diags_array

from cloning.contours import contour_anchors
from cloning.prepare import PreparedFace, prepare
from cloning.similarity import fit_similarity
from cloning.surface import Surface, build_surface
from cloning.template.coarse import coarser
from cloning.template.correspondence import correspond
from cloning.template.energies import energies, stiffness, vertex_areas
from cloning.template.fitting import BENDING, PUBLISHED, Fitted, Schedule, fit_template
from cloning.template.landmarks import landmarks_of
from cloning.template.level import FEWEST, vertex_normals, welded
from cloning.template.solver import Solver
from cloning.visibility import visible
from fat import AnimatableFace
from fba import FaceScene, FeaturePoint, FeaturePoints, PolyMesh, Shape
from fba.arrays import Floats
from fba.scene import rotation_matrix


def sheet(n: int, size: float = 1.0, seed: int | None = None) -> PolyMesh:
    """n x n vertices in the plane z = 0, triangles; inner vertices jittered where a seed is given."""
    axis = np.linspace(0.0, size, n)
    y, x = np.meshgrid(axis, axis, indexing="ij")
    places = np.stack([x.ravel(), y.ravel(), np.zeros(n * n)], axis=1)
    if seed is not None:
        inner = np.all((places[:, :2] > 1e-9) & (places[:, :2] < size - 1e-9), axis=1)
        jitter = np.random.default_rng(seed).uniform(-0.25, 0.25, (n * n, 2)) * size / n
        places[inner, :2] += jitter[inner]
    index = np.arange(n * n).reshape(n, n)
    a, b, c, d = index[:-1, :-1].ravel(), index[:-1, 1:].ravel(), index[1:, 1:].ravel(), index[1:, :-1].ravel()
    return PolyMesh.from_faces(places, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def sphere(steps: int = 5) -> tuple[Floats, np.ndarray]:
    """A unit sphere from a subdivided octahedron."""
    vertices = np.concatenate([np.eye(3), -np.eye(3)])
    triangles = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])
    for _ in range(steps):
        pairs = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
        edges, which = np.unique(pairs, axis=0, return_inverse=True)
        m = len(vertices) + which.reshape(3, -1)
        vertices = np.concatenate([vertices, vertices[edges].mean(axis=1)])
        a, b, c = triangles.T
        triangles = np.concatenate(
            [np.stack(t, 1) for t in ((a, m[0], m[2]), (m[0], b, m[1]), (m[2], m[1], c), (m[0], m[1], m[2]))]
        )
        vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    return vertices, triangles


def surface_of(mesh: PolyMesh, points: dict[str, int]) -> Surface:
    scene = FaceScene((Shape("skin", mesh),), name="sheet")
    return build_surface(
        scene, FeaturePoints({k: FeaturePoint("skin", (v,), (1.0,)) for k, v in points.items()}), ["skin"], 1.0
    )


def moved(surface: Surface, warp: Callable[[Floats], Floats]) -> Surface:
    """The same surface with all vertices moved."""
    positions = {k: warp(p[None])[0] for k, p in surface.positions.items()}
    return replace(surface, vertices=warp(surface.vertices), positions=positions)


@pytest.fixture(scope="module")
def head(source: AnimatableFace) -> PreparedFace:
    scene, points = bare(source)
    return prepare(scene, points, "source")


def test_stiffness_is_the_squared_gradient_of_linear_fields_on_a_plane() -> None:
    mesh = sheet(9, size=2.0, seed=1)
    s = stiffness(mesh.vertices, mesh.triangles)
    field = mesh.vertices @ np.array([3.0, -4.0, 0.0])
    assert field @ (s @ field) == pytest.approx(25.0 * 4.0)
    inner = np.all((mesh.vertices[:, :2] > 1e-9) & (mesh.vertices[:, :2] < 2.0 - 1e-9), axis=1)
    assert np.allclose((s @ field)[inner], 0.0)
    assert np.allclose(s @ np.ones(81), 0.0)
    assert abs(s - s.T).max() < 1e-12
    assert vertex_areas(mesh.vertices, mesh.triangles).sum() == pytest.approx(4.0)


def test_laplacian_of_a_sphere_is_twice_its_coordinates() -> None:
    vertices, triangles = sphere()
    areas = vertex_areas(vertices, triangles)
    assert areas.sum() == pytest.approx(4.0 * np.pi, rel=2e-3)
    turned = stiffness(vertices, triangles) @ vertices
    whole = np.einsum("ij,ij->", vertices, turned)
    assert whole == pytest.approx(2.0 * 4.0 * np.pi, rel=5e-3), "the gradient of x, y, z on the unit sphere"
    direction = turned / np.linalg.norm(turned, axis=1, keepdims=True)
    assert np.einsum("ij,ij->i", direction, vertices).min() > 0.999


def test_membrane_interpolates_linearly_and_bending_smoothly() -> None:
    strip = sheet(33)
    x = strip.vertices[:, 0]
    held = np.where((x < 1e-9) | (x > 1.0 - 1e-9), 1e9, 0.0)
    middle = np.abs(x - 0.5) < 1e-9
    held[middle] = 1e9
    wanted = np.where(middle, 1.0, 0.0)
    solved = []
    for k_s, k_b in ((1.0, 0.0), (0.0, 1.0)):
        system = energies(strip.vertices, strip.triangles).system(k_s, k_b)
        solved.append(np.linalg.solve(system.toarray() + np.diag(held), held * wanted))
    row = np.argsort(x[16 * 33 : 17 * 33]) + 16 * 33
    t = x[row]
    tent = 1.0 - 2.0 * np.abs(t - 0.5)
    assert np.allclose(solved[0][row], tent, atol=1e-6)
    assert solved[1][row][14] > tent[14] + 0.03, "round at the top, no cusp"
    assert abs(solved[1][row][15] - 1.0) < 0.3 * abs(tent[15] - 1.0)


def test_a_similarity_is_found_exactly() -> None:
    random = np.random.default_rng(5)
    places = random.normal(size=(12, 3))
    turn = rotation_matrix((1.0, -2.0, 0.5, 2.0))[:3, :3]
    found = fit_similarity(places, 2.5 * places @ turn.T + [1.0, 2.0, 3.0])
    assert found.scale == pytest.approx(2.5)
    assert np.allclose(found.rotation, turn)
    assert np.allclose(found.shift, [1.0, 2.0, 3.0])
    assert np.linalg.det(fit_similarity(places, places * [-1.0, 1.0, 1.0]).rotation) == pytest.approx(1.0)


def test_schedules_run_from_their_first_to_their_last_weights() -> None:
    assert PUBLISHED.weights(0) == pytest.approx((1.0, 1e-9, 200.0, 0.0))
    assert PUBLISHED.weights(9) == pytest.approx((1e-3, 1e-12, 2000.0, 6000.0))
    assert [BENDING.weights(k)[3] for k in range(3)] == pytest.approx([0.0, 0.0, 3.0])
    assert BENDING.weights(19) == pytest.approx((5e-4, 1e-4, 1e4, 300.0))
    steps = np.array([BENDING.weights(k)[1] for k in range(20)])
    assert np.allclose(steps[1:] / steps[:-1], steps[1] / steps[0])


@pytest.mark.parametrize("schedule", [BENDING, PUBLISHED])
def test_a_template_that_was_turned_scaled_and_moved_comes_back(head: PreparedFace, schedule: Schedule) -> None:
    turn = rotation_matrix((0.3, 1.0, 0.2, 0.5))[:3, :3]
    target = moved(head.skin, lambda v: 1.3 * v @ turn.T + [4.0, -2.0, 1.0])
    fitted = fit_template(head.skin, target, schedule=replace(schedule, steps=3))
    assert np.abs(fitted.vertices - target.vertices).max() < 1e-6
    assert fitted.residual[fitted.valid].max() < 1e-6


def test_a_face_is_its_own_correspondence(head: PreparedFace) -> None:
    labels = head.labels.values, head.labels.values
    found = correspond(head.skin.vertices, head.skin.triangles, head.skin, labels=labels)
    assert found.valid.mean() > 0.99
    field = np.random.default_rng(1).normal(size=(head.skin.vertex_count, 2))
    field = head.skin.seam_mean @ field
    carried = found.matrix() @ field
    assert np.allclose(carried[found.valid], field[found.valid], atol=1e-6)
    assert found.normal_agreement[found.valid].min() >= 0.25


def test_landmarks_and_closest_points_bend_a_sheet_onto_a_wave() -> None:
    points = {"2.1": 0, "2.2": 32, "2.3": 33 * 32, "2.4": 33 * 33 - 1, "2.5": 33 * 16 + 16}
    flat = surface_of(sheet(33), points)

    def wave(v: Floats) -> Floats:
        return v + 0.15 * np.sin(3.0 * v[:, :1]) * np.array([0.0, 0.0, 1.0])

    target = moved(surface_of(sheet(41, seed=2), {}), wave)
    target = replace(target, positions=moved(flat, wave).positions)
    seen = np.ones(flat.vertex_count, bool)
    fitted = fit_template(flat, target, list(points), visible=seen)
    assert fitted.residual.max() < 8e-3, "it lies on the target"
    assert fitted.residual.mean() < 2e-3
    places = list(points.values())
    assert np.abs(fitted.vertices[places] - wave(flat.vertices[places])).max() < 2e-3
    sideways = np.abs(fitted.vertices - wave(flat.vertices))[:, :2]
    assert sideways.max() < 0.04, "a wave is 7 % longer than its shadow: it is stretched evenly, nothing slides far"


def test_bending_leaves_no_cusp_at_a_landmark_and_the_published_weights_do() -> None:
    flat = surface_of(sheet(33), {"2.1": 0, "2.2": 32, "2.3": 33 * 32, "2.4": 33 * 33 - 1, "9.3": 33 * 16 + 16})
    goals = dict(flat.positions)
    goals["9.3"] = goals["9.3"] + [0.0, 0.0, 0.2]
    target = replace(flat, positions=goals)

    def ring(schedule: Schedule) -> float:
        """How far the neighbours of the raised vertex come along."""
        fitted: Fitted = fit_template(flat, target, visible=np.zeros(flat.vertex_count, bool), schedule=schedule)
        raised = fitted.vertices.reshape(33, 33, 3)[:, :, 2]
        return float((raised[15, 16] + raised[17, 16]) / 2.0 / raised[16, 16])

    assert ring(BENDING) > 0.95
    assert ring(PUBLISHED) < 0.85


def test_vertices_without_landmarks_and_partners_stay(head: PreparedFace) -> None:
    still = replace(BENDING, steps=2)
    fitted = fit_template(head.skin, head.skin, (), visible=np.zeros(head.skin.vertex_count, bool), schedule=still)
    assert np.allclose(fitted.vertices, head.skin.vertices, atol=1e-9)
    assert not fitted.valid.any()


def test_a_coarser_mesh_keeps_the_shape_and_spreads_its_fields() -> None:
    vertices, triangles = sphere()
    mesh = coarser(vertices, triangles)
    count = len(mesh.kept)
    assert 0.2 * len(vertices) < count < 0.4 * len(vertices)
    edges = {
        tuple(sorted(pair)) for t in mesh.triangles.tolist() for pair in ((t[0], t[1]), (t[1], t[2]), (t[2], t[0]))
    }
    assert count - len(edges) + len(mesh.triangles) == 2, "a sphere still"
    a, b, c = (vertices[mesh.kept][mesh.triangles[:, k]] for k in range(3))
    outward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c)
    assert outward.min() > 0.0
    spread = mesh.spread(vertices)
    assert np.allclose(spread.sum(axis=1), 1.0)
    assert np.allclose((spread @ vertices[mesh.kept])[mesh.kept], vertices[mesh.kept])
    assert np.abs(spread @ vertices[mesh.kept] - vertices).max() < 0.02, "edges are 0.05 long"


def test_a_coarser_mesh_keeps_slits_and_single_vertices_apart() -> None:
    upper, lower = sheet(12), sheet(12)
    touching = lower.vertices * [1.0, -1.0, 1.0]
    vertices = np.concatenate([upper.vertices, touching, [[5.0, 5.0, 5.0]]])
    triangles = np.concatenate([upper.triangles, lower.triangles[:, ::-1] + 144])
    mesh = coarser(vertices, triangles)
    side = np.repeat([0, 1, 2], [144, 144, 1])
    assert np.array_equal(side[mesh.kept][mesh.owner], side)
    spread = mesh.spread(vertices)
    assert np.allclose(spread @ side[mesh.kept].astype(float), side), "nothing leaks over the slit"


def test_a_face_finds_its_own_warped_copy_from_coarse_to_fine(head: PreparedFace) -> None:
    def warp(v: Floats) -> Floats:
        return v * [1.15, 0.9, 1.05] + 0.05 * np.sin(4.0 * v[:, [1, 2, 0]])

    target = moved(head.skin, warp)
    assert BENDING.fine is not None
    assert head.skin.vertex_count > FEWEST, "there are coarser meshes"
    fitted = fit_template(head.skin, target, labels=(head.labels.values, head.labels.values))
    away = np.linalg.norm(fitted.vertices - target.vertices, axis=1)[visible(head.skin)]
    assert away.mean() < 0.02
    assert fitted.residual[fitted.valid].mean() < 2e-4


def test_anchors_on_the_lids_do_not_depend_on_how_the_head_is_held(head: PreparedFace) -> None:
    upright = contour_anchors(head.skin)
    turn = rotation_matrix((1.0, 0.3, -0.2, 0.6))[:3, :3]
    tilted = contour_anchors(moved(head.skin, lambda v: v @ turn.T))
    assert len(upright) == 48
    assert upright.keys() == tilted.keys()
    for name, (label, place) in upright.items():
        assert tilted[name][0] == label
        assert np.allclose(tilted[name][1], turn @ place, atol=1e-9)


def test_a_coarser_mesh_has_the_normals_of_the_finest(head: PreparedFace) -> None:
    marks = landmarks_of(head.skin, head.skin, (), None)
    finest = welded(head.skin, head.skin.vertices, marks, np.zeros(head.skin.vertex_count), None)
    coarse = finest.coarser().coarser()
    current = coarse.start + 0.1 * np.sin(5.0 * coarse.start[:, [1, 2, 0]])
    assert coarse.finer is not None
    finer = coarse.finer.level
    assert finer.finer is not None
    whole = finer.finer.spread(coarse.finer.spread(current - coarse.start) - finer.start)
    normals = vertex_normals(whole, finest.triangles)[finer.finer.kept[coarse.finer.kept]]
    assert np.allclose(coarse.normals(current), normals, rtol=0, atol=1e-12)


def test_the_order_of_elimination_is_kept_and_changes_no_solution() -> None:
    flat = sheet(12, seed=3)
    found, right = energies(flat.vertices, flat.triangles), np.random.default_rng(1).normal(size=(144, 3))
    solver = Solver()
    for k_s, k_b in ((1.0, 1e-3), (0.1, 1e-4), (0.0, 1.0)):
        system = found.system(k_s, k_b) + diags_array(found.areas)
        assert np.allclose(solver.solve(system, right), np.linalg.solve(system.toarray(), right), rtol=1e-9, atol=1e-9)
