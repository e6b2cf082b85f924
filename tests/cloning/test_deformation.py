"""Deformation transfer against its definition, and against motion that is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array
from sheets import grid, halves, held_border, offsets

from cloning.deformation import deformation_transfer
from cloning.prepare import prepare
from cloning.shape_solver import COLUMNS, ShapeTransfer
from cloning.source import source_motions
from cloning.surface import Surface
from fat import AnimatableFace
from fba.arrays import Floats, Ints
from fba.scene import rotation_matrix


def sheet(n: int, seed: int, rough: float = 0.15) -> tuple[Floats, Ints]:
    """A curved, uneven square of n x n vertices and its triangles."""
    return grid(n, seed, rough), halves(n)


def with_fourth(vertices: Floats, triangles: Ints) -> Floats:
    """(t, 3, 3) columns v2 - v1, v3 - v1, v4 - v1 of Xiang et al., equations 7 and 8."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    fourth = cross / np.sqrt(np.linalg.norm(cross, axis=1, keepdims=True))
    return np.stack([b - a, c - a, fourth], axis=2)


def full_solution(
    source: Floats,
    target: Floats,
    triangles: Ints,
    motion: Floats,
    held: Floats,
    rows: Floats,
    goals: Floats,
    even: bool,
) -> Floats:
    """Least squares over vertices and fourth vertices together, as the papers write it; dense. (n, 3) offsets."""
    n, t = len(source), len(triangles)
    wanted = with_fourth(source + motion, triangles) @ np.linalg.inv(with_fourth(source, triangles))
    inverse = np.linalg.inv(with_fourth(target, triangles))
    first, second = (target[triangles[:, k]] - target[triangles[:, 0]] for k in (1, 2))
    area = np.linalg.norm(np.cross(first, second), axis=1)
    weights = np.ones(t) if even else area / area.mean()
    lengths = np.concatenate(
        [np.linalg.norm(target[triangles[:, k]] - target[triangles[:, k - 1]], axis=1) for k in range(3)]
    )
    stiff = 1.0 / lengths.mean()
    system, right = [], []
    for i, (a, b, c) in enumerate(triangles):
        for column in range(3):
            row = np.zeros(n + t)
            for vertex, part in ((b, inverse[i, 0]), (c, inverse[i, 1]), (n + i, inverse[i, 2])):
                row[vertex] += part[column]
                row[a] -= part[column]
            system.append(np.sqrt(weights[i]) * row)
            right.append(np.sqrt(weights[i]) * wanted[i, :, column])
    for vertex in np.flatnonzero(held):
        row = np.zeros(n + t)
        row[vertex] = stiff * np.sqrt(held[vertex])
        system.append(row)
        right.append(row[vertex] * target[vertex])
    for place, goal in zip(rows, goals, strict=True):
        system.append(stiff * np.sqrt(10.0) * np.concatenate([place, np.zeros(t)]))
        right.append(stiff * np.sqrt(10.0) * (place @ target + goal))
    solved = np.linalg.lstsq(np.array(system), np.array(right), rcond=None)[0]
    found: Floats = solved[:n] - target
    return found


@pytest.mark.parametrize("even", [False, True])
def test_minimum_is_that_of_the_full_system_with_fourth_vertices(even: bool) -> None:
    source, triangles = sheet(6, 1)
    target = sheet(6, 2)[0] * np.array([1.3, 0.8, 1.6])
    motion = offsets(source, 2, 3)
    held = held_border(source)
    places = np.zeros((2, len(source)))
    places[0, [14, 15, 20]] = 0.5, 0.3, 0.2
    places[1, 21] = 1.0
    goals = np.random.default_rng(4).normal(size=(2, 2, 3)) * 0.1
    transfer = deformation_transfer(source, target, triangles, held, csr_array(places), uniform=even)
    found = transfer.apply(motion, goals=goals)
    for k in range(2):
        full = full_solution(source, target, triangles, motion[:, k], held, places, goals[:, k], even)
        assert np.abs(full).max() > 0.1
        assert np.allclose(found[:, k], full, atol=1e-9)


def skin_motions(source: AnimatableFace) -> tuple[Surface, Floats, Floats]:
    """The shipped source's skin, (n, K, 3) all its motions, and its vertices that never move."""
    face = prepare(source.scene, source.feature_points, "source")
    motions = np.stack([face.skin.join(m.offsets) for m in source_motions(source)], axis=1) / face.fapu.es0
    return face.skin, motions, (~motions.any(axis=(1, 2))).astype(float)


def relative(found: Floats, truth: Floats) -> Floats:
    """(K,) largest error of each motion against its own largest offset."""
    size = np.linalg.norm(truth, axis=2).max(axis=0)
    moving = size > 0.0
    error: Floats = np.linalg.norm(found - truth, axis=2).max(axis=0)[moving] / size[moving]
    return error


@pytest.mark.parametrize("even", [False, True])
def test_a_face_given_its_own_motions_makes_them_again(source: AnimatableFace, even: bool) -> None:
    skin, motions, still = skin_motions(source)
    ids = list(skin.points)
    rows = None if even else skin.point_matrix(ids)
    goals = None if rows is None else (rows @ motions.reshape(len(motions), -1)).reshape(len(ids), -1, 3)
    transfer = deformation_transfer(
        skin.vertices, skin.vertices, skin.triangles, still, rows, links=skin.links, uniform=even
    )
    assert relative(transfer.apply(motions, goals=goals), motions).max() < 1e-8


def test_quads_give_their_own_motion_again_by_either_diagonal() -> None:
    vertices, triangles = sheet(30, 5)
    motion = offsets(vertices, 3, 6)
    first, second = np.split(triangles, 2)
    a, b, c, d = first[:, 0], first[:, 1], first[:, 2], second[:, 2]
    turned = np.concatenate([np.stack([a, b, d], axis=1), np.stack([b, c, d], axis=1)])
    for cells in (triangles, turned):
        transfer = deformation_transfer(vertices, vertices, cells, held_border(vertices))
        assert relative(transfer.apply(motion), motion).max() < 1e-8


def test_motion_grows_with_the_face_and_ignores_its_place() -> None:
    source, triangles = sheet(9, 7)
    motion = offsets(source, 2, 8)
    target = 2.5 * source + np.array([10.0, -3.0, 1.0])
    found = deformation_transfer(source, target, triangles, held_border(source)).apply(motion)
    assert np.allclose(found, 2.5 * motion, atol=1e-9)


def test_a_turned_source_turns_any_target() -> None:
    source, triangles = sheet(8, 9)
    target = sheet(8, 10)[0] * np.array([1.2, 0.7, 1.4])
    turn = rotation_matrix((0.3, 0.9, -0.2, 0.8))[:3, :3]
    motion = (source @ turn.T - source)[:, None]
    one = np.zeros(len(source))
    one[5] = 1.0
    found = target + deformation_transfer(source, target, triangles, one).apply(motion)[:, 0]
    assert np.allclose(found - found[5], (target - target[5]) @ turn.T, atol=1e-9)


def test_feature_points_come_near_their_goals_and_wishes_are_granted() -> None:
    source, triangles = sheet(15, 11)
    motion = offsets(source, 1, 12)
    rows = csr_array((np.ones(1), ([0], [112])), shape=(1, len(source)))
    goals = 1.5 * motion[[112]]
    still = held_border(source)

    def missed(weight: float) -> float:
        transfer = deformation_transfer(source, source, triangles, still, rows, weight)
        return float(np.linalg.norm(transfer.apply(motion, goals=goals)[112] - goals[0]))

    assert missed(10.0) < 0.4 * missed(1e-9)
    assert missed(1e6) < 1e-3 * missed(1e-9)
    wishes = 2.0 * motion
    held = deformation_transfer(source, source, triangles, np.full(len(source), 1e8))
    assert np.allclose(held.apply(motion, wishes=wishes), wishes, atol=1e-6)


def cut(vertices: Floats, triangles: Ints) -> tuple[Floats, Ints, Ints, Ints]:
    """The sheet with its right half on vertices of its own: vertices, triangles, links and each one's original."""
    right = vertices[triangles].mean(axis=1)[:, 0] > 0.0
    twice = np.intersect1d(triangles[right], triangles[~right])
    copy = np.arange(len(vertices))
    copy[twice] = len(vertices) + np.arange(len(twice))
    apart = triangles.copy()
    apart[right] = copy[triangles[right]]
    links = np.stack([twice, copy[twice]], axis=1).astype(np.int32)
    return np.concatenate([vertices, vertices[twice]]), apart, links, np.concatenate([np.arange(len(vertices)), twice])


def test_seams_do_not_open_and_change_nothing() -> None:
    source, triangles = sheet(10, 13, rough=0.05)
    target = source * np.array([1.4, 1.0, 0.6])
    motion = offsets(source, 2, 14)
    whole = deformation_transfer(source, target, triangles, held_border(source)).apply(motion)
    vertices, apart, links, of = cut(source, triangles)
    held = held_border(vertices)
    held[len(source) :] = 0.0
    parts = deformation_transfer(vertices, target[of], apart, held, links=links)
    assert np.allclose(parts.apply(motion[of]), whole[of], atol=1e-9)


def test_a_part_that_never_rests_is_placed_by_faint_wishes() -> None:
    source, triangles = sheet(8, 20)
    target = sheet(8, 21)[0] * np.array([1.5, 1.0, 0.7])
    n = len(source)
    both = np.concatenate([source, source + 5.0])
    places = np.concatenate([target, target + 5.0])
    cells = np.concatenate([triangles, triangles + n]).astype(np.int32)
    motion = np.concatenate([offsets(source, 1, 22), np.full((n, 1, 3), 0.2)])
    held = np.where(motion.any(axis=(1, 2)), 1e-3, 1.0)
    found = deformation_transfer(both, places, cells, held).apply(motion, wishes=1.5 * motion)
    assert np.allclose(found[n:], 0.3, atol=1e-9)
    alone = deformation_transfer(source, target, triangles, held[:n]).apply(motion[:n], wishes=1.5 * motion[:n])
    assert np.allclose(found[:n], alone, atol=1e-9)


def test_triangles_without_a_plane_are_left_out() -> None:
    source, triangles = sheet(8, 15)
    motion = offsets(source, 1, 16)
    thin = np.concatenate([triangles, [[9, 9, 10], [20, 21, 20]]]).astype(np.int32)
    plain, more = (
        deformation_transfer(source, source, t, held_border(source)).apply(motion) for t in (triangles, thin)
    )
    assert np.allclose(plain, more, atol=1e-9)


def test_many_motions_at_once_are_the_same_as_one_by_one() -> None:
    source, triangles = sheet(9, 17)
    target = sheet(9, 18)[0]
    motion = offsets(source, 2 * COLUMNS + 3, 19)
    motion[:, 4] = 0.0
    transfer = deformation_transfer(source, target, triangles, held_border(source))
    together = transfer.apply(motion)
    assert not together[:, 4].any()
    assert np.allclose(together, one_by_one(transfer, motion), atol=1e-12)


def one_by_one(transfer: ShapeTransfer, motions: Floats) -> Floats:
    return np.concatenate([transfer.apply(motions[:, [k]]) for k in range(motions.shape[1])], axis=1)
