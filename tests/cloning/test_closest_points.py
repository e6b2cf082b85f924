"""The exact search for closest points: by brute force, with numpy and compiled."""

from __future__ import annotations

import numpy as np
import pytest

from cloning.locate import Places, closest_on_triangles
from cloning.template import balls
from cloning.template.closest import Memory, TriangleSearch
from fba.arrays import Floats, Ints

Mesh = tuple[Floats, Ints]


@pytest.fixture(params=["numpy", "compiled"], autouse=True)
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Both ways to find closest points."""
    if request.param == "compiled":
        pytest.importorskip("numba")
        monkeypatch.delenv("FBA_FAST", raising=False)
    else:
        monkeypatch.setenv("FBA_FAST", "0")
    return str(request.param)


def loose(count: int = 400) -> Mesh:
    """Triangles of very different sizes, all over a cube."""
    random = np.random.default_rng(3)
    size = np.exp(random.uniform(-5.0, 0.0, count))
    corners = random.random((count, 3))[:, None] + size[:, None, None] * random.normal(size=(count, 3, 3))
    return corners.reshape(-1, 3), np.arange(3 * count, dtype=np.int32).reshape(count, 3)


def grid(n: int) -> Mesh:
    """The plane z = 0 from 0 to n, two triangles a square."""
    y, x = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    index = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = index[:-1, :-1].ravel(), index[:-1, 1:].ravel(), index[1:, 1:].ravel(), index[1:, :-1].ravel()
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    return np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1), triangles


def around(count: int, seed: int = 4) -> tuple[Floats, Floats]:
    """Points in and around the cube, and unit normals."""
    random = np.random.default_rng(seed)
    normals = random.normal(size=(count, 3))
    return random.uniform(-0.5, 1.5, (count, 3)), normals / np.linalg.norm(normals, axis=1, keepdims=True)


def same(a: Places, b: Places) -> bool:
    return all(np.array_equal(getattr(a, k), getattr(b, k)) for k in ("triangles", "weights", "distances", "facing"))


@pytest.mark.parametrize("facing", [-2.0, 0.5])
def test_closest_points_are_those_of_brute_force(facing: float) -> None:
    search = TriangleSearch(*loose())
    points, normals = around(300)
    found = search.closest(points, normals, None, facing)
    distances = closest_on_triangles(points[:, None], search.corners[None])[1]
    distances[normals @ search.normals.T < facing] = np.inf
    assert np.allclose(found.distances, distances.min(axis=1), rtol=0, atol=1e-12)
    assert np.allclose(np.linalg.norm(search.positions(found) - points, axis=1), found.distances, atol=1e-9)
    assert np.array_equal(found.triangles, distances.argmin(axis=1))
    assert np.allclose(found.facing, np.einsum("ij,ij->i", normals, search.normals[found.triangles]))
    near = search.closest(points, normals, None, facing, reach=0.1)
    assert np.array_equal(near.triangles >= 0, found.distances <= 0.1)
    assert 0 < np.sum(near.triangles >= 0) < 300
    limits = np.linspace(0.0, 0.3, 300)
    assert np.array_equal(
        search.closest(points, normals, None, facing, limits).triangles >= 0, found.distances <= limits
    )


def test_only_usable_triangles_are_found() -> None:
    usable = np.arange(400) % 7 == 3
    search = TriangleSearch(*loose(), usable=usable)
    points, _ = around(100)
    distances = closest_on_triangles(points[:, None], search.corners[None, usable])[1]
    found = search.closest(points)
    assert np.array_equal(found.triangles, np.flatnonzero(usable)[distances.argmin(axis=1)])
    none = TriangleSearch(*loose(), usable=np.zeros(400, bool)).closest(points)
    assert (none.triangles == -1).all()
    assert np.isinf(none.distances).all()
    assert len(search.closest(np.zeros((0, 3))).triangles) == 0
    assert TriangleSearch(*loose(1)).closest(points).triangles.tolist() == [0] * 100, "one triangle is a surface"


def test_closest_points_keep_to_their_own_lip() -> None:
    vertices, triangles = grid(10)
    vertices = vertices / 10.0
    search = TriangleSearch(vertices, triangles, np.where(vertices[:, 1] > 0.5, 1, 2))
    points = np.array([[0.32, 0.2, 0.1], [0.32, 0.2, 0.1], [0.32, 0.2, 0.1]])
    up = np.tile([0.0, 0.0, 1.0], (3, 1))
    found = search.positions(search.closest(points, up, np.array([0, 1, 2])))
    assert np.allclose(found[0], [0.32, 0.2, 0.0])
    assert np.allclose(found[1], [0.32, 0.6, 0.0]), "the upper lip begins at 0.6"
    assert np.allclose(found[2], [0.32, 0.2, 0.0])
    assert search.closest(points, -up).triangles.tolist() == [-1, -1, -1], "the back of the sheet does not count"


def test_the_lowest_of_equally_near_triangles_is_found() -> None:
    vertices, triangles = grid(8)
    for order in (np.arange(128), np.random.default_rng(0).permutation(128)):
        search = TriangleSearch(vertices, triangles[order])
        points = vertices + np.array([0.0, 0.0, 1.0])
        touching = (triangles[order][:, :, None] == np.arange(81)).any(axis=1)
        found = search.closest(points)
        assert np.array_equal(found.triangles, touching.argmax(axis=0))
        memory = Memory()
        for start in (points + np.array([0.3, 0.2, 0.0]), points):
            again = search.closest(start, memory=memory)
        assert same(again, found), "what was found before has no right of its own"


@pytest.mark.parametrize("step", [1e-4, 0.01, 0.2])
def test_points_that_are_looked_for_again_find_what_new_ones_find(step: float) -> None:
    search = TriangleSearch(*loose())
    points, normals = around(300)
    random, memory, reach = np.random.default_rng(6), Memory(), np.where(np.arange(300) % 5, 0.5, 0.05)
    for _ in range(6):
        fresh = search.closest(points, normals, None, 0.5, reach)
        assert same(search.closest(points, normals, None, 0.5, reach, memory), fresh)
        points = points + random.normal(scale=step, size=points.shape)
        normals = normals + random.normal(scale=step, size=points.shape)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)


def test_points_that_hardly_move_are_not_looked_for_among_all(way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if way == "compiled":
        pytest.skip("walks the tree each time")
    search = TriangleSearch(*loose())
    points, normals = around(300)
    memory, counts = Memory(), list[int]()
    within = balls.Balls._within

    def counted(self: balls.Balls, trial: object, rows: Ints, margin: float) -> object:
        counts.append(len(rows))
        return within(self, trial, rows, margin)  # type: ignore[arg-type]

    monkeypatch.setattr(balls.Balls, "_within", counted)
    for shift in (0.0, 1e-5, 2e-5):
        search.closest(points + shift, normals, memory=memory)
    assert sum(counts) == 300


def test_blocks_of_points_change_no_result(monkeypatch: pytest.MonkeyPatch) -> None:
    search = TriangleSearch(*loose())
    points, normals = around(300)
    whole = search.closest(points, normals)
    monkeypatch.setattr("cloning.template.closest.BLOCK", 100)
    assert same(search.closest(points, normals), whole)
    memory = Memory()
    for _ in range(2):
        assert same(search.closest(points, normals, memory=memory), whole)


def test_both_ways_find_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    points, normals = around(300)
    found = TriangleSearch(*loose()).closest(points, normals, reach=0.3)
    monkeypatch.setenv("FBA_FAST", "0")
    other = TriangleSearch(*loose()).closest(points, normals, reach=0.3)
    assert np.array_equal(found.triangles, other.triangles)
    assert np.allclose(found.distances, other.distances, rtol=0, atol=1e-12)
    assert np.allclose(found.weights, other.weights, rtol=0, atol=1e-9)
    assert np.allclose(found.facing, other.facing, rtol=0, atol=1e-12)
