"""Places along lips, brows and rims of lids, between the feature points, where a bump takes its outline.

A bump that is told nothing between two feature points ends in a peak at one and waves at the other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from weakref import WeakKeyDictionary

import numpy as np

from authoring.bumps import Place, bumps
from authoring.contact import Lips
from cloning.prepare import PreparedFace
from cloning.rims import eyes
from fba.arrays import Bools, Floats
from fba.closest import TriangleSearch

LIPS = (
    ("2.5", "2.7", "2.2", "2.6", "2.4"),
    ("2.5", "2.9", "2.3", "2.8", "2.4"),
    ("8.4", "8.6", "8.1", "8.5", "8.3"),
    ("8.4", "8.8", "8.2", "8.7", "8.3"),
)
BROWS = (("4.6", "4.4", "4.2"), ("4.1", "4.3", "4.5"))
"""Feature points along the contours of the lips and along the brows, from the subject's right to the left."""

CORNERS = ((("8.6", "8.8"), "8.4"), (("8.5", "8.7"), "8.3"))
"""The feature points before each outer corner, and the corner."""

BEYOND = {0.4: 1.05, 0.8: 0.95}
"""Where the cheek goes along beyond a corner, in lengths of the lip's last part, and how far."""

PARTS = (0.25, 0.5, 0.75)
"""Where places lie between two feature points."""

DOME = {0.15: 0.96, 0.3: 0.84}
"""Radius in eye separations -> the height of a dome there: 0 at 0.75, from the cheekbone to the jaw."""

AROUND = 8
"""Places on each ring of a dome."""

TOWARDS = 0.12
"""Half the way from the cheek's feature point to the corner of the mouth: nearer to it the dome comes down."""

RIM_STEP = 6
"""One place for so many slices of an eye: 8 a lid."""

CONTACT = slice(2, None, 3)
"""The slices of the line of contact that are kept together: 26 of 80, the same on both sides."""

OFF = 0.08
"""A place farther from the curve than this, in eye separations, is on other skin and left out."""


def lip_places(face: PreparedFace, values: Mapping[str, float]) -> list[Place]:
    """Places along all contours of the lips, where the feature points' weights (0 if absent) are blended."""
    return _blended(face, LIPS, values)


def shut_lip_places(face: PreparedFace, values: Mapping[str, float]) -> list[Place]:
    """Places along all contours of the lips, and the line of contact: what touches there goes together."""
    return [*lip_places(face, values), *contact_places(face)]


def corner_places(face: PreparedFace, values: Mapping[str, float]) -> list[Place]:
    """Places beyond the corners of the outer lips, as far as the lip's last part is long: the cheek goes along."""
    surface, at = face.skin, face.skin.positions
    found = []
    for before, corner in CORNERS:
        value = values.get(corner, 0.0)
        ends = [at[k] for k in before if k in surface.points]
        if corner not in surface.points or not ends or not value:
            continue
        way = at[corner] - np.mean(ends, axis=0)
        near = np.linalg.norm(surface.vertices - at[corner], axis=1) < 2.0 * float(np.linalg.norm(way))
        spots = at[corner] + np.outer(list(BEYOND), way)
        found += _nearest(face, near, spots, value * np.array(list(BEYOND.values())))
    return found


def contact_places(face: PreparedFace) -> list[Place]:
    """Pairs of places where the lips touch, the weight of the upper one less that of the lower one being 0."""
    if face not in _CONTACT:
        _CONTACT[face] = _contact_places(face)
    return _CONTACT[face]


_CONTACT: WeakKeyDictionary[PreparedFace, list[Place]] = WeakKeyDictionary()


def _contact_places(face: PreparedFace) -> list[Place]:
    lips = Lips(face)
    if not lips.apart:
        return []
    labels = face.labels.values
    found = []
    for lip, edge in enumerate(lips.edges_at_rest):
        spots = edge[CONTACT]
        found.append(_nearest(face, labels == lip + 1, spots, np.zeros(len(spots))))
    upper, lower = found
    if len(upper) != len(lower):
        return []
    return [
        Place(np.concatenate([a.vertices, b.vertices]), np.concatenate([a.weights, -b.weights]), 0.0)
        for a, b in zip(upper, lower, strict=True)
    ]


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


def dome_places(face: PreparedFace, values: Mapping[str, float]) -> list[Place]:
    """Places around feature points of a cheek, on a dome as wide as its soft part: no bump ends in a cone there.

    The dome reaches away from the mouth, whose corner lies near and stays.
    """
    surface, at = face.skin, face.skin.positions
    found = []
    for key, value in values.items():
        middle = at[key]
        normal = (surface.point_matrix([key]) @ surface.normals)[0]
        normal /= max(float(np.linalg.norm(normal)), 1e-12)
        up = np.array([0.0, 1.0, 0.0]) - normal[1] * normal
        up /= max(float(np.linalg.norm(up)), 1e-12)
        aside = np.cross(up, normal)
        corner = min((at[k] for _, k in CORNERS), key=lambda place: float(np.linalg.norm(place - middle)))
        away = (middle - corner) / max(float(np.linalg.norm(middle - corner)), 1e-12)
        near = (np.linalg.norm(surface.vertices - middle, axis=1) < 3.0 * max(DOME)) & bumps(face).side(key)
        angles = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
        ways = np.cos(angles)[:, None] * up + np.sin(angles)[:, None] * aside
        for radius, height in DOME.items():
            free = radius * (ways @ away) > -TOWARDS
            spots = middle + radius * ways[free]
            found += _nearest(face, near, spots, np.full(len(spots), value * height))
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
    spots, weights = [], []
    for k, ((a, b), (u, v)) in enumerate(zip(pairwise(knots), pairwise(values), strict=True)):
        for part in PARTS:
            spots.append(line(a[0] + part * (b[0] - a[0])))
            weights.append(u + (v - u) * _blend(part, k == 0, k == len(keys) - 2))
    return _nearest(face, side & near, np.array(spots), np.array(weights))


def _blend(part: float, first: bool, last: bool) -> float:
    """From 0 to 1, level at feature points but for the ends of a curve, where it does not bend.

    >>> _blend(0.5, False, False), _blend(0.5, True, False), _blend(0.5, False, True)
    (0.5, 0.6875, 0.3125)
    """
    if first:
        return 1.0 - _blend(1.0 - part, False, True)
    return part * part * ((3.0 - part) / 2.0 if last else 3.0 - 2.0 * part)


def _nearest(face: PreparedFace, where: Bools, spots: Floats, values: Floats) -> list[Place]:
    """The places on a part of the skin that are nearest to spots (k, 3), with values (k,)."""
    surface = face.skin
    triangles = surface.triangles[where[surface.triangles].all(axis=1)]
    if not len(triangles):
        return []
    search = TriangleSearch(surface.vertices, triangles)
    found = []
    for spot, value in zip(spots, values.tolist(), strict=True):
        triangle, weights, away = search.closest(spot)
        if away < OFF:
            found.append(Place(triangles[triangle], weights, value))
    return found
