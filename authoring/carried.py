"""Hidden skin, such as the lining of the cheeks or of the nostrils, that goes along with the skin in front of it.

It lies close behind the outer skin, but far away along the surface: a bump measured along the skin leaves it where it
is, and the outer skin would run through it.
"""

from __future__ import annotations

from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from cloning.prepare import PreparedFace
from cloning.visibility import visible
from fba.arrays import Floats

NEIGHBOURS = 12
"""Vertices of the outer skin whose motions a hidden vertex takes the mean of."""

BEHIND = (0.2, 0.6)
"""Hidden skin up to the first distance behind the outer one (eye separations) goes all the way along, beyond the
second not at all: a cheek is about 0.25 thick."""


def carrier(face: PreparedFace) -> Any:
    """(n, n) sparse: takes a weight over the skin to the one that hidden vertices have from the skin before them."""
    if face not in _MADE:
        _MADE[face] = _carrier(face)
    return _MADE[face]


_MADE: WeakKeyDictionary[PreparedFace, Any] = WeakKeyDictionary()


def _carrier(face: PreparedFace) -> Any:
    from scipy.sparse import csr_array, diags_array
    from scipy.spatial import cKDTree

    places = face.skin.vertices
    seen = visible(face.skin)
    outer, hidden = np.flatnonzero(seen), np.flatnonzero(~seen)
    if not len(outer) or not len(hidden):
        return diags_array(np.ones(len(places)))
    found = cKDTree(places[outer]).query(places[hidden], k=min(NEIGHBOURS, len(outer)))
    away, near = (np.asarray(part).reshape(len(hidden), -1) for part in found)
    share = 1.0 / np.maximum(away, 1e-6) ** 2
    share *= (_fade(away[:, 0]) / share.sum(axis=1))[:, None]
    rows = np.repeat(hidden, near.shape[1])
    carried = csr_array((share.ravel(), (rows, outer[near].ravel())), shape=(len(places), len(places)))
    return (diags_array(seen.astype(np.float64)) + carried).tocsr()


def _fade(away: Floats) -> Floats:
    t = np.clip((away - BEHIND[0]) / (BEHIND[1] - BEHIND[0]), 0.0, 1.0)
    fade: Floats = 1.0 - t * t * (3.0 - 2.0 * t)
    return fade
