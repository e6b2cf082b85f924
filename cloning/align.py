"""Bring a target face onto the source by their feature points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cloning.contours import contour_anchors
from cloning.labels import OPPOSITE, SIDES
from cloning.surface import Surface
from fba.arrays import Floats, Ints

TOUCHING = 1e-3
"""Anchors nearer than this count as one, in eye separations."""


def radial_warp(places: Floats, anchors: Floats, goals: Floats) -> Floats:
    """Move points by the smoothest field that takes each anchor to its goal.

    Triharmonic-free: the kernel is the distance itself (the biharmonic spline of space) plus an affine part.

    Parameters
    ----------
    places : (n, d) points to move.
    anchors, goals : (k, d), k > d + 1, anchors distinct.

    Returns
    -------
    (n, d) moved points.
    """
    k, d = anchors.shape
    # About their own middle: far from the origin the affine part would drown the rest of the system.
    middle = anchors.mean(axis=0)
    anchors, places = anchors - middle, places - middle
    kernel = np.linalg.norm(anchors[:, None] - anchors[None], axis=2)
    affine = np.concatenate([np.ones((k, 1)), anchors], axis=1)
    system = np.zeros((k + d + 1, k + d + 1))
    system[:k, :k], system[:k, k:], system[k:, :k] = kernel, affine, affine.T
    right = np.concatenate([goals, np.zeros((d + 1, d))])
    solution = np.linalg.lstsq(system, right, rcond=1e-10)[0]
    out = np.empty((len(places), d))
    for start in range(0, len(places), 4096):
        block = places[start : start + 4096]
        far = np.linalg.norm(block[:, None] - anchors[None], axis=2)
        out[start : start + 4096] = far @ solution[:k] + solution[k] + block @ solution[k + 1 :]
    return out


def anchor_ids(source: Surface, target: Surface) -> list[str]:
    """Feature points that lie on both skins, without those that share a place with an earlier one."""
    kept: list[str] = []
    for i in target.points:
        if i not in source.points:
            continue
        apart = all(np.linalg.norm(target.positions[i] - target.positions[j]) > 1e-4 for j in kept)
        if apart:
            kept.append(i)
    return kept


def points_for_label(ids: Sequence[str], label: int) -> list[str]:
    """Drop the feature points of the opposite lip or lid; their motion must not bend this side."""
    opposite = int(OPPOSITE[label]) if label else -1
    dropped = next((points for number, points in SIDES if number == opposite), ())
    return [i for i in ids if i not in dropped]


def _apart(anchors: Floats, goals: Floats) -> list[int]:
    """Leave out anchors that touch an earlier one: closed lips and lids would pull one place two ways."""
    kept: list[int] = []
    for k in range(len(anchors)):
        gaps = [np.linalg.norm(places[kept] - places[k], axis=1) for places in (anchors, goals)]
        if not kept or min(float(gap.min()) for gap in gaps) > TOUCHING:
            kept.append(k)
    return kept


def warp_by_points(surface: Surface, target: Surface, ids: Sequence[str]) -> Floats:
    """(n, 3) vertices of a surface, moved by the spline of space that takes its feature points to a target's."""
    anchors, goals = (np.array([s.positions[i] for i in ids]) for s in (surface, target))
    kept = _apart(anchors, goals)
    return radial_warp(surface.vertices, anchors[kept], goals[kept])


def align(source: Surface, target: Surface, labels: Ints) -> Floats:
    """Move the target's vertices into the source's space, side by side of the lips and lids.

    Parameters
    ----------
    labels : (n_t,) label of each target vertex.

    Returns
    -------
    (n_t, 3) positions in the source's space (eye separations of the source).
    """
    ids = anchor_ids(source, target)
    mine, yours = contour_anchors(source), contour_anchors(target)
    shared = [name for name in yours if name in mine]
    moved = np.empty_like(target.vertices)
    for number in np.unique(labels):
        some = points_for_label(ids, int(number))
        more = [name for name in shared if not number or yours[name][0] != OPPOSITE[number]]
        anchors = np.array([target.positions[i] for i in some] + [yours[name][1] for name in more])
        goals = np.array([source.positions[i] for i in some] + [mine[name][1] for name in more])
        kept = _apart(anchors, goals)
        here = labels == number
        moved[here] = radial_warp(target.vertices[here], anchors[kept], goals[kept])
    return moved
