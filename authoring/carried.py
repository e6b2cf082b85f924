"""Hidden skin, such as the lining of the cheeks or of the nostrils, that goes along with the skin in front of it.

It lies close behind the outer skin, but far away along the surface: a bump measured along the skin leaves it where it
is, and the outer skin would run through it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from cloning.labels import OPPOSITE
from cloning.prepare import PreparedFace
from cloning.surface import Surface
from cloning.visibility import visible
from fba.arrays import Bools, Floats

NEIGHBOURS = 80
"""Vertices of the outer skin whose motions a hidden vertex takes the mean of; fewer fold the lining on dense meshes."""

BEHIND = (0.2, 0.6)
"""Hidden skin up to the first distance behind the outer one (eye separations) goes all the way along, beyond the
second not at all: a cheek is about 0.25 thick."""

DEEP = (0.0, 0.15)
"""From the edge of what can be seen, along the skin, hidden skin passes over from moving with it as one, as the red of
the lips behind their contact does, to lining, which it is wholly beyond the second distance."""

VIEWS = 7
"""Directions that the face is seen from: ahead, above, below, and half a radian to both sides."""


def carrier(face: PreparedFace) -> Any:
    """(n, n) sparse: takes a weight over the skin to the one that hidden vertices have from the skin before them.

    Vertices that feature points lie on keep their own, so that these move exactly.
    """
    if face not in _MADE:
        _MADE[face] = _carrier(face)
    return _MADE[face]


_MADE: WeakKeyDictionary[PreparedFace, Any] = WeakKeyDictionary()


def _carrier(face: PreparedFace) -> Any:
    from scipy.sparse import csr_array, diags_array
    from scipy.sparse.csgraph import dijkstra
    from scipy.spatial import cKDTree

    places = face.skin.vertices
    seen = _seen(face.skin)
    outer, hidden = np.flatnonzero(seen), np.flatnonzero(~seen)
    if not len(outer) or not len(hidden):
        return diags_array(np.ones(len(places)))
    inside = dijkstra(face.skin.graph, indices=outer, min_only=True, limit=DEEP[1])
    deep = np.zeros(len(places))
    deep[hidden] = _rise(inside[hidden], DEEP)
    deep[[vertex for vertices, _ in face.skin.points.values() for vertex in vertices]] = 0.0
    labels, size = face.labels.values, (len(places), len(places))
    carried = csr_array(size)
    for side in np.unique(labels[hidden]).tolist():
        behind = hidden[labels[hidden] == side]
        before = outer[labels[outer] != OPPOSITE[side]]
        if not len(before):
            continue
        found = cKDTree(places[before]).query(places[behind], k=min(NEIGHBOURS, len(before)))
        away, near = (np.asarray(part).reshape(len(behind), -1) for part in found)
        share = 1.0 / np.maximum(away**2 + away[:, :1] ** 2, 1e-12)
        share *= (deep[behind] * (1.0 - _rise(away[:, 0], BEHIND)) / share.sum(axis=1))[:, None]
        rows = np.repeat(behind, near.shape[1])
        carried = carried + csr_array((share.ravel(), (rows, before[near].ravel())), shape=size)
    return (diags_array(1.0 - deep) + carried).tocsr()


def _seen(skin: Surface) -> Bools:
    """(n,) what can be seen from before the face, the same on both sides of a symmetric one.

    Seen is what is seen on the face or on its mirror image: near the edge of sight the cells of the picture decide.
    """
    mirrored = replace(skin, vertices=skin.vertices * [-1.0, 1.0, 1.0], triangles=skin.triangles[:, ::-1])
    seen: Bools = visible(skin, VIEWS) | visible(mirrored, VIEWS)
    return seen


def _rise(length: Floats, ends: tuple[float, float]) -> Floats:
    """Smoothly from 0 at the first end to 1 at the second."""
    t = np.clip((length - ends[0]) / (ends[1] - ends[0]), 0.0, 1.0)
    rise: Floats = t * t * (3.0 - 2.0 * t)
    return rise
