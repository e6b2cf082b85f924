"""Bumps against a clamped plate's exact solution, and what must hold for any skin."""

from __future__ import annotations

import numpy as np
import pytest

from authoring.bumps import Bumps, pinned
from cloning.surface import build_surface
from fba import FaceScene, FeaturePoint, FeaturePoints, PolyMesh, Role, Shape
from fba.arrays import Bools, Floats, Ints

SIZE = 48


def grid(size: int = SIZE, quads: bool = True, sheared: float = 0.0) -> tuple[Floats, list[list[int]]]:
    """A square of side 2 around 0, as quads or as triangles whose diagonals all run one way."""
    line = np.linspace(-1.0, 1.0, size + 1)
    x, y = np.meshgrid(line, line)
    vertices = np.stack([x.ravel() + sheared * y.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    faces = []
    for row in range(size):
        for column in range(size):
            a = row * (size + 1) + column
            b, c, d = a + 1, a + size + 2, a + size + 1
            faces += [[a, b, c, d]] if quads else [[a, b, c], [a, c, d]]
    return vertices, faces


def plate(vertices: Floats, faces: list[list[int]], labels: Ints | None = None, **at: tuple[float, float]) -> Bumps:
    """The bumps of a flat skin whose feature points ("p9_3" for 9.3) lie at the vertices next to places."""
    points = {
        name[1:].replace("_", "."): FeaturePoint(
            "skin", (int(np.argmin(np.linalg.norm(vertices[:, :2] - place, axis=1))),), (1.0,)
        )
        for name, place in at.items()
    }
    scene = FaceScene((Shape("skin", PolyMesh.from_faces(vertices.tolist(), faces), Role.SKIN),))
    surface = build_surface(scene, FeaturePoints(points), ["skin"], 1.0)
    return Bumps(surface, np.zeros(surface.vertex_count, np.int32) if labels is None else labels)


def bump(maker: Bumps, free: Bools, goals: dict[str, float], pins: tuple[str, ...] = ()) -> Floats:
    """One weight of the skin at rest."""
    return maker.patch(free).weights(maker.goals(goals, pins), maker.surface.vertices)[:, 0]


@pytest.mark.parametrize("quads", [True, False])
def test_a_bump_is_the_clamped_round_plate_under_a_point_load(quads: bool) -> None:
    vertices, faces = grid(quads=quads)
    maker = plate(vertices, faces, p9_3=(0.0, 0.0))
    rho = np.linalg.norm(vertices, axis=1) / 0.9
    weight = bump(maker, rho < 1.0, {"9.3": 1.0})
    inside = (rho > 0.0) & (rho < 1.0)
    exact = 1.0 - rho[inside] ** 2 + 2.0 * rho[inside] ** 2 * np.log(rho[inside])
    assert weight[rho >= 1.0].max() == 0.0
    assert np.abs(weight[inside] - exact).max() < 0.03


def test_goals_are_exact_and_pins_still() -> None:
    vertices, faces = grid(24, quads=False, sheared=0.4)
    maker = plate(vertices, faces, p8_1=(0.0, 0.1), p2_2=(0.0, -0.1), p8_5=(0.3, 0.1), p9_3=(0.1, 0.6))
    weight = bump(maker, np.abs(vertices).max(axis=1) < 0.9, {"8.1": 1.0, "8.5": 0.25}, ("2.2", "9.3", "3.1"))
    found = maker.surface.point_matrix(["8.1", "8.5", "2.2", "9.3"]) @ weight
    assert found == pytest.approx([1.0, 0.25, 0.0, 0.0], abs=1e-9)


def test_mirrored_polygons_bend_alike() -> None:
    """Quads of a mirrored mesh start at other corners, so their fans differ; the bump must not."""
    vertices, faces = grid(20)
    turned = [face if k % 3 else face[1:] + face[:1] for k, face in enumerate(faces)]
    free = np.linalg.norm(vertices[:, :2] - [0.2, 0.1], axis=1) < 0.6
    one, other = (bump(plate(vertices, f, p9_3=(0.2, 0.1)), free, {"9.3": 1.0}) for f in (faces, turned))
    assert np.abs(one - other).max() < 1e-9


def test_both_sides_of_a_texture_seam_move_together() -> None:
    vertices, faces = grid(20)
    whole = bump(plate(vertices, faces, p9_3=(0.1, 0.0)), np.linalg.norm(vertices, axis=1) < 0.7, {"9.3": 1.0})
    middle = np.flatnonzero(np.abs(vertices[:, 0]) < 1e-9)
    copies = {int(v): len(vertices) + k for k, v in enumerate(middle)}
    right = {f for f, face in enumerate(faces) if vertices[face, 0].mean() > 0.0}
    cut = [[copies.get(v, v) if f in right else v for v in face] for f, face in enumerate(faces)]
    doubled = np.concatenate([vertices, vertices[middle]])
    apart = bump(plate(doubled, cut, p9_3=(0.1, 0.0)), np.linalg.norm(doubled, axis=1) < 0.7, {"9.3": 1.0})
    assert np.abs(apart[: len(vertices)] - whole).max() < 1e-9
    assert np.array_equal(apart[len(vertices) :], apart[middle])


def test_a_bump_does_not_cross_to_the_opposite_lip() -> None:
    vertices, faces = grid(20)
    labels = np.where(vertices[:, 1] > 0.0, 1, 2).astype(np.int32)
    maker = plate(vertices, faces, labels, p2_2=(0.0, 0.1), p2_3=(0.0, -0.1))
    free = maker.within(["2.2"], 0.5)
    assert free.any()
    assert not free[labels == 2].any()
    assert maker.within(["2.3"], 0.5)[labels == 2].any()


def test_a_radius_is_measured_along_the_skin() -> None:
    vertices, faces = grid(40)
    maker = plate(vertices, faces, p9_3=(0.0, 0.0))
    away = np.linalg.norm(vertices, axis=1)
    free = maker.within(["9.3"], 0.5)
    assert free[away < 0.45].all()
    assert not free[away > 0.5 + 1e-9].any()


def test_points_on_one_vertex_do_not_tear_the_skin() -> None:
    vertices, faces = grid(10)
    maker = plate(vertices, faces, p2_4=(0.0, 0.0), p8_3=(0.01, 0.0))
    weight = bump(maker, np.abs(vertices).max(axis=1) < 0.9, {"8.3": 1.0}, ("2.4",))
    assert np.abs(weight).max() <= 1.0


def test_places_between_points_are_met_about() -> None:
    from authoring.bumps import Place

    vertices, faces = grid(40)
    maker = plate(vertices, faces, p8_1=(0.0, 0.0), p8_5=(0.4, 0.0))
    spot = int(np.argmin(np.linalg.norm(vertices[:, :2] - [0.2, 0.0], axis=1)))
    free = np.abs(vertices).max(axis=1) < 0.9
    found = []
    for value in (0.2, 0.8):
        goals = maker.goals({"8.1": 1.0}, ("8.5",), [Place(np.array([spot], np.int32), np.ones(1), value)])
        found.append(maker.patch(free).weights(goals, vertices)[spot, 0])
    assert found == pytest.approx([0.2, 0.8], abs=0.1)


def test_a_loose_piece_goes_along_as_a_whole() -> None:
    """Where no skin around is held, nothing bends: the whole piece moves with its point."""
    vertices, faces = grid(10)
    maker = plate(vertices, faces, p10_1=(0.0, 0.5))
    weight = bump(maker, np.ones(len(vertices), dtype=bool), {"10.1": 1.0})
    assert weight == pytest.approx(np.ones(len(vertices)), abs=0.01)


def test_pins_are_the_points_that_faps_move_along_an_axis() -> None:
    assert {"2.2", "2.3", "8.1", "4.3"} <= set(pinned(1))
    assert "4.3" not in pinned(0)
    assert {"2.1", "2.3"} <= set(pinned(2, ("2.2",)))
    assert not {"2.2", "8.1"} & set(pinned(2, ("2.2",)))
