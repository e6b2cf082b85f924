"""Closed eyes: their lids rest, since they cannot close any further and nobody knows what is behind them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cloning.openings import EYES, between_lids
from cloning.surface import Surface
from fba.arrays import Floats

RESTS, MOVES = 0.05, 0.4
"""Distances along the skin from the lids, in eye separations, up to which it rests and from which it moves freely: a
brow lies 0.35 above a lid, and a cheek that rises below it needs room to fold."""

HALF = 0.5
"""A motion of which less than this share is left is the lids' alone and left out; a feature point with less rests."""


def closed_lids(surface: Surface, eyes: Sequence[int]) -> Floats | None:
    """(n,) share of its motion that is left to skin around closed eyes; None where none is closed.

    Parameters
    ----------
    eyes : first labels of the closed eyes.
    """
    from scipy.sparse.csgraph import dijkstra

    if not eyes:
        return None
    lids = np.zeros(surface.vertex_count, dtype=bool)
    for number, *points in EYES:
        if number in eyes:
            lids |= between_lids(surface, number)
            for key in points:
                lids[surface.points[key][0]] = True
    away = dijkstra(surface.graph, indices=np.flatnonzero(lids).astype(np.int32), min_only=True, limit=MOVES)
    share = np.clip((away - RESTS) / (MOVES - RESTS), 0.0, 1.0)
    calm: Floats = share * share * (3.0 - 2.0 * share)
    return calm


def calm_lids(motion: Floats, calm: Floats) -> None:
    """Hold the lids still in (n, K, 3) offsets, in place; motions of the lids alone become nothing."""
    before = np.linalg.norm(motion, axis=2).max(axis=0)
    motion *= calm[:, None, None]
    after = np.linalg.norm(motion, axis=2).max(axis=0)
    motion[:, after < HALF * before] = 0.0
