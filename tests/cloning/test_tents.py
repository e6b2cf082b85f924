"""Vertex tents against their definition, and against motion that is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array
from sheets import cells, grid, halves, held_border, offsets

from cloning.deformation import deformation_transfer
from cloning.prepare import prepare
from cloning.rings import one_rings
from cloning.shape_solver import COLUMNS
from cloning.source import source_motions
from cloning.tents import tent_transfer
from fat import AnimatableFace
from fba.arrays import Floats, Ints
from fba.scene import rotation_matrix

Polygons = tuple[Ints, Ints]


def quads(n: int) -> Polygons:
    """The n x n grid's quadrangles."""
    return cells(n).ravel(), 4 * np.arange(len(cells(n)) + 1, dtype=np.int32)


def triangles(n: int) -> Polygons:
    return halves(n).ravel(), 3 * np.arange(len(halves(n)) + 1, dtype=np.int32)


def mixed(n: int) -> Polygons:
    """Quadrangles; every third one as two triangles, and two neighbours as one hexagon."""
    four = [list(c) for c in cells(n)]
    first, second = four[0], four[n - 1]
    out = [[first[0], first[1], second[1], second[2], second[3], first[3]]]
    for k, c in enumerate(four):
        if k not in (0, n - 1):
            out += [[c[0], c[1], c[2]], [c[0], c[2], c[3]]] if k % 3 == 0 else [c]
    lengths = [len(c) for c in out]
    return np.concatenate(out).astype(np.int32), np.concatenate([[0], np.cumsum(lengths)]).astype(np.int32)


def rings_by_hand(polygons: Polygons, n: int) -> tuple[list[list[int]], list[list[tuple[int, int]]]]:
    """Neighbours of each vertex, and (before, after) at each of its corners."""
    ring: list[set[int]] = [set() for _ in range(n)]
    corners: list[list[tuple[int, int]]] = [[] for _ in range(n)]
    for start, stop in zip(polygons[1][:-1], polygons[1][1:], strict=True):
        cell = [int(v) for v in polygons[0][start:stop]]
        for k, v in enumerate(cell):
            before, after = cell[k - 1], cell[(k + 1) % len(cell)]
            ring[v] |= {before, after}
            corners[v].append((before, after))
    return [sorted(r) for r in ring], corners


def tent(vertices: Floats, v: int, ring: list[int], corners: list[tuple[int, int]]) -> Floats:
    """(3, k + 1) edges and the tip's vector."""
    edges = [vertices[j] - vertices[v] for j in ring]
    normal = np.sum([np.cross(vertices[b] - vertices[v], vertices[a] - vertices[v]) for a, b in corners], axis=0)
    long = float(np.mean([np.linalg.norm(e) for e in edges]))
    return np.stack([*edges, long * normal / np.linalg.norm(normal)], axis=1)


def full_solution(
    source: Floats, target: Floats, polygons: Polygons, motion: Floats, held: Floats, rows: Floats, goals: Floats
) -> Floats:
    """Equations 5 to 7 over vertices and tips together, as the paper writes them; dense. (n, 3) offsets."""
    n = len(source)
    ring, corners = rings_by_hand(polygons, n)
    stiff = 1.0 / np.mean([np.linalg.norm(target[j] - target[v]) for v in range(n) for j in ring[v]])
    system, right = [], []
    for v in range(n):
        still, posed, yours = (tent(x, v, ring[v], corners[v]) for x in (source, source + motion, target))
        # A (3 x k + 2) maps the tent's vertices to Q transposed; S is Q of the source, transposed.
        spread = np.concatenate([-np.ones((1, yours.shape[1])), np.eye(yours.shape[1])])
        a = (spread @ yours.T @ np.linalg.inv(yours @ yours.T)).T
        s = (posed @ still.T @ np.linalg.inv(still @ still.T)).T
        for k in range(3):
            row = np.zeros(2 * n)
            row[[v, *ring[v], n + v]] = a[k]
            system.append(row)
            right.append(s[k])
    for v in np.flatnonzero(held):
        row = np.zeros(2 * n)
        row[v] = stiff
        system.append(row)
        right.append(row[v] * target[v])
    for place, goal in zip(rows, goals, strict=True):
        system.append(stiff * np.sqrt(10.0) * np.concatenate([place, np.zeros(n)]))
        right.append(stiff * np.sqrt(10.0) * (place @ target + goal))
    solved = np.linalg.lstsq(np.array(system), np.array(right), rcond=None)[0]
    found: Floats = solved[:n] - target
    return found


@pytest.mark.parametrize("cells", [quads, triangles, mixed])
def test_minimum_is_that_of_the_paper_s_system_with_tips(cells: type) -> None:
    polygons: Polygons = cells(6)
    source = grid(6, 1)
    target = grid(6, 2) * np.array([1.3, 0.8, 1.6])
    motion = offsets(source, 2, 3)
    places = np.zeros((2, len(source)))
    places[0, [14, 15, 20]] = 0.5, 0.3, 0.2
    places[1, 21] = 1.0
    goals = np.random.default_rng(4).normal(size=(2, 2, 3)) * 0.1
    held = held_border(source)
    transfer = tent_transfer(source, target, polygons, held, csr_array(places), uniform=True)
    assert transfer.weld.shape == (36, 36), "one unknown a vertex, none for the tips"
    found = transfer.apply(motion, goals=goals)
    for k in range(2):
        full = full_solution(source, target, polygons, motion[:, k], held, places, goals[:, k])
        assert np.abs(full).max() > 0.1
        assert np.allclose(found[:, k], full, atol=1e-9)


def test_rings_are_those_of_the_polygons() -> None:
    polygons = mixed(7)
    rings = one_rings(*polygons, 49)
    by_hand = rings_by_hand(polygons, 49)[0]
    assert [list(rings.others[rings.owners == v]) for v in range(49)] == by_hand
    inner = one_rings(*quads(7), 49)
    assert inner.valence.reshape(7, 7)[1:-1, 1:-1].tolist() == [[4] * 5] * 5, "no diagonals across quadrangles"


def relative(found: Floats, truth: Floats) -> Floats:
    """(K,) largest error of each motion against its own largest offset."""
    size = np.linalg.norm(truth, axis=2).max(axis=0)
    moving = size > 0.0
    error: Floats = np.linalg.norm(found - truth, axis=2).max(axis=0)[moving] / size[moving]
    return error


@pytest.mark.parametrize("cells", [quads, triangles, mixed])
@pytest.mark.parametrize("uniform", [False, True])
def test_a_mesh_given_its_own_motions_makes_them_again(cells: type, uniform: bool) -> None:
    vertices = grid(25, 5)
    motion = offsets(vertices, 3, 6)
    transfer = tent_transfer(vertices, vertices, cells(25), held_border(vertices), uniform=uniform)
    assert relative(transfer.apply(motion), motion).max() < 1e-8


@pytest.mark.parametrize("triangulated", [False, True])
def test_a_face_given_its_own_motions_makes_them_again(source: AnimatableFace, triangulated: bool) -> None:
    face = prepare(source.scene, source.feature_points, "source")
    skin = face.skin
    motions = np.stack([skin.join(m.offsets) for m in source_motions(source)[::4]], axis=1) / face.fapu.es0
    cut = skin.triangles.ravel(), 3 * np.arange(len(skin.triangles) + 1, dtype=np.int32)
    still = (~motions.any(axis=(1, 2))).astype(float)
    polygons = cut if triangulated else skin.polygons
    assert set(np.diff(polygons[1])) == ({3} if triangulated else {4, 5, 6, 7})
    transfer = tent_transfer(skin.vertices, skin.vertices, polygons, still, links=skin.links)
    assert relative(transfer.apply(motions), motions).max() < 1e-8


def test_one_anchor_is_enough_to_place_everything_and_a_moving_one_misplaces_it() -> None:
    vertices = grid(15, 7)
    motion = offsets(vertices, 1, 8)
    for corner, wrong in ((0, False), (81, True)):
        held = np.zeros(len(vertices))
        held[corner] = 1.0
        error = relative(tent_transfer(vertices, vertices, quads(15), held).apply(motion), motion).max()
        assert (error > 0.1) == wrong


def test_motion_grows_with_the_face_and_ignores_its_place() -> None:
    source = grid(9, 9)
    motion = offsets(source, 2, 10)
    target = 2.5 * source + np.array([10.0, -3.0, 1.0])
    found = tent_transfer(source, target, quads(9), held_border(source)).apply(motion)
    assert np.allclose(found, 2.5 * motion, atol=1e-9)


def test_a_turned_source_turns_any_target() -> None:
    source = grid(8, 11)
    target = grid(8, 12) * np.array([1.2, 0.7, 1.4])
    turn = rotation_matrix((0.3, 0.9, -0.2, 0.8))[:3, :3]
    motion = (source @ turn.T - source)[:, None]
    one = np.zeros(len(source))
    one[5] = 1.0
    found = target + tent_transfer(source, target, quads(8), one).apply(motion)[:, 0]
    assert np.allclose(found - found[5], (target - target[5]) @ turn.T, atol=1e-9)


def test_tents_and_triangles_agree_where_motion_is_smooth() -> None:
    source = grid(30, 13, rough=0.0)
    target = source * np.array([1.4, 0.8, 1.1])
    motion = offsets(source, 2, 14)
    still = held_border(source)
    by_tents = tent_transfer(source, target, quads(30), still).apply(motion)
    by_triangles = deformation_transfer(source, target, halves(30), still).apply(motion)
    assert np.linalg.norm(by_tents - by_triangles) < 0.1 * np.linalg.norm(by_triangles)


def test_seams_do_not_open_and_change_nothing() -> None:
    n = 10
    source, polygons = grid(n, 15, rough=0.05), quads(n)
    target = source * np.array([1.4, 1.0, 0.6])
    motion = offsets(source, 2, 16)
    whole = tent_transfer(source, target, polygons, held_border(source)).apply(motion)
    cells = polygons[0].reshape(-1, 4)
    right = source[cells].mean(axis=1)[:, 0] > 0.0
    twice = np.intersect1d(cells[right], cells[~right])
    copy = np.arange(n * n)
    copy[twice] = n * n + np.arange(len(twice))
    apart = np.where(right[:, None], copy[cells], cells).astype(np.int32)
    of = np.concatenate([np.arange(n * n), twice])
    held = held_border(source[of])
    held[n * n :] = 0.0
    links = np.stack([twice, copy[twice]], axis=1).astype(np.int32)
    parts = tent_transfer(source[of], target[of], (apart.ravel(), polygons[1]), held, links=links)
    assert np.allclose(parts.apply(motion[of]), whole[of], atol=1e-9)


def test_tents_that_span_no_space_are_left_out() -> None:
    source = grid(8, 17)
    n = len(source)
    motion = offsets(source, 1, 18)
    plain = tent_transfer(source, source, quads(8), held_border(source)).apply(motion)
    line = np.array([[5.0, 0.0, 0.0], [6.0, 0.0, 0.0], [7.0, 0.0, 0.0], [9.0, 9.0, 9.0]])
    more = np.concatenate([source, line])
    indices = np.concatenate([quads(8)[0], [n, n + 1, n + 2]]).astype(np.int32)
    starts = np.concatenate([quads(8)[1], [len(indices)]]).astype(np.int32)
    held = np.concatenate([held_border(source), np.ones(4)])
    found = tent_transfer(more, more, (indices, starts), held).apply(np.concatenate([motion, np.zeros((4, 1, 3))]))
    assert np.allclose(found[:n], plain, atol=1e-9)
    assert not found[n:].any()


def test_many_motions_at_once_are_the_same_as_one_by_one() -> None:
    source = grid(9, 19)
    target = grid(9, 20)
    motion = offsets(source, COLUMNS + 3, 21)
    motion[:, 4] = 0.0
    transfer = tent_transfer(source, target, quads(9), held_border(source))
    together = transfer.apply(motion)
    assert not together[:, 4].any()
    alone = np.concatenate([transfer.apply(motion[:, [k]]) for k in range(COLUMNS + 3)], axis=1)
    assert np.allclose(together, alone, atol=1e-12)
