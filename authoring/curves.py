"""Places along lips, brows and rims of lids, between the feature points, where a bump takes its outline.

A bump that is told nothing between two feature points ends in a peak at one and waves at the other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from weakref import WeakKeyDictionary

import numpy as np

from authoring.bumps import Place, bumps
from cloning.prepare import PreparedFace
from cloning.rims import eyes
from fba.arrays import Floats
from fba.closest import TriangleSearch

LIPS = (
    ("2.5", "2.7", "2.2", "2.6", "2.4"),
    ("2.5", "2.9", "2.3", "2.8", "2.4"),
    ("8.4", "8.6", "8.1", "8.5", "8.3"),
    ("8.4", "8.8", "8.2", "8.7", "8.3"),
)
BROWS = (("4.6", "4.4", "4.2"), ("4.1", "4.3", "4.5"))
"""Feature points along the contours of the lips and along the brows, from the subject's right to the left."""

PARTS = (0.25, 0.5, 0.75)
"""Where places lie between two feature points."""

RIM_STEP = 6
"""One place for so many slices of an eye: 8 a lid."""

OFF = 0.08
"""A place farther from the curve than this, in eye separations, is on other skin and left out."""


def lip_places(face: PreparedFace, values: Mapping[str, float]) -> list[Place]:
    """Places along all contours of the lips, where the feature points' weights (0 if absent) are blended."""
    return _blended(face, LIPS, values)


def brow_places(face: PreparedFace, values: Mapping[str, float]) -> list[Place]:
    """Places along the brows, where the feature points' weights (0 if absent) are blended."""
    return _blended(face, BROWS, values)


def _blended(face: PreparedFace, curves: Sequence[Sequence[str]], values: Mapping[str, float]) -> list[Place]:
    found = []
    for keys in curves:
        known = [k for k in keys if k in face.skin.points]
        if len(known) > 2:
            found += _along(face, known, [values.get(k, 0.0) for k in known])
    return found


def rim_places(face: PreparedFace) -> list[Place]:
    """Places along the rims of all lids, with weight 0."""
    if face not in _RIMS:
        _RIMS[face] = _rim_places(face)
    return _RIMS[face]


_RIMS: WeakKeyDictionary[PreparedFace, list[Place]] = WeakKeyDictionary()


def _rim_places(face: PreparedFace) -> list[Place]:
    found = []
    for eye in eyes(face):
        if eye is None:
            continue
        for lid in eye.lids:
            heights, edges, shares = lid.rim(lid.rest)
            known = np.flatnonzero(np.isfinite(heights))
            for k in known[(len(known) - 1) % RIM_STEP // 2 :: RIM_STEP]:
                found.append(Place(lid.vertices[edges[k]], np.array([1.0 - shares[k], shares[k]]), 0.0))
    return found


def _along(face: PreparedFace, keys: Sequence[str], values: Sequence[float]) -> list[Place]:
    from scipy.interpolate import PchipInterpolator

    surface, maker = face.skin, bumps(face)
    knots = np.array([surface.positions[k] for k in keys])
    if np.any(np.diff(knots[:, 0]) <= 0.0):
        return []
    line = PchipInterpolator(knots[:, 0], knots)
    side = maker.side(keys[len(keys) // 2])
    near = np.linalg.norm(surface.vertices[:, None] - knots[None], axis=2).min(axis=1) < 2.0 * np.ptp(knots[:, 0])
    triangles = surface.triangles[(side & near)[surface.triangles].all(axis=1)]
    if not len(triangles):
        return []
    search = TriangleSearch(surface.vertices, triangles)
    found = []
    for (a, b), (u, v) in zip(pairwise(knots), pairwise(values), strict=True):
        for part in PARTS:
            spot: Floats = line(a[0] + part * (b[0] - a[0]))
            triangle, weights, away = search.closest(spot)
            if away < OFF:
                found.append(Place(triangles[triangle], weights, u + (v - u) * part * part * (3.0 - 2.0 * part)))
    return found
