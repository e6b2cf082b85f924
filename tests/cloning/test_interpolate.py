from __future__ import annotations

import numpy as np
import pytest

from cloning.interpolate import TriangleMesh2D, interpolate

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


def test_linear_functions_are_exact_inside() -> None:
    values = SQUARE @ np.array([[2.0, -1.0], [3.0, 5.0]]) + 7.0
    wanted = np.random.default_rng(1).random((200, 2))
    assert np.allclose(interpolate(SQUARE, values, HALVES, wanted), wanted @ np.array([[2.0, -1.0], [3.0, 5.0]]) + 7.0)


def test_corners_and_edges_are_inside() -> None:
    place = TriangleMesh2D(SQUARE, HALVES).locate(np.array([[0.0, 0.0], [0.5, 0.5], [1.0, 0.3], [0.0, 1.0]]))
    assert place.inside.all()


def test_outside_takes_the_closest_point_by_excess_coordinates() -> None:
    # Barycentric coordinates of (2, 0.25) in the lower half are (-1, 1.75, 0.25): truncated (0, 1, 0.25) / 1.25.
    place = TriangleMesh2D(SQUARE, HALVES[:1]).locate(np.array([[2.0, 0.25]]))
    assert not place.inside[0]
    assert np.allclose(place.weights[0], [0.0, 0.8, 0.2])


def test_the_triangle_with_less_excess_is_closer() -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [3.0, 0.0], [13.0, 0.0], [3.0, 10.0]])
    place = TriangleMesh2D(points, np.array([[0, 1, 2], [3, 4, 5]])).locate(np.array([[1.9, 0.0]]))
    # One unit from the small triangle is an excess of 1.8; 1.1 from the large one only 0.22.
    assert place.triangles[0] == 1


def test_the_smallest_depth_wins_where_triangles_overlap() -> None:
    points = np.concatenate([SQUARE, SQUARE])
    triangles = np.concatenate([HALVES, HALVES + 4])
    values = np.repeat([[1.0], [2.0]], 4, axis=0)
    depth = np.array([0.0, 0.0, 0.0, 0.0, 1.0, -2.0, 1.0, 1.0])
    wanted = np.array([[0.05, 0.02], [0.9, 0.1]])
    assert interpolate(points, values, triangles, wanted, depth).ravel().tolist() == [1.0, 2.0]


def test_flat_triangles_never_win() -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 1.0]])
    place = TriangleMesh2D(points, np.array([[0, 1, 2], [0, 1, 3]])).locate(np.array([[0.25, 0.0], [5.0, 0.0]]))
    assert place.triangles.tolist() == [1, 1]


@pytest.mark.parametrize("count", [3, 50])
def test_location_agrees_with_delaunay(count: int) -> None:
    from scipy.spatial import Delaunay

    random = np.random.default_rng(count)
    points = random.random((count, 2))
    tiles = Delaunay(points)
    wanted = random.random((500, 2))
    place = TriangleMesh2D(points, tiles.simplices).locate(wanted)
    assert np.array_equal(place.inside, tiles.find_simplex(wanted) >= 0)
    back = np.einsum("nk,nkd->nd", place.weights, points[tiles.simplices[place.triangles]])
    assert np.allclose(back[place.inside], wanted[place.inside])
