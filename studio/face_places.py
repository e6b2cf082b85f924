"""The places of a face that two faces have in common: a motion is read place by place beside the source's own there.

A flaw that is plain at its place drowns in a percentile over the whole skin, and one face's eyelids hide another one's
forehead. A place is what lies nearest to a feature point; each lip and each lid, whose points lie close together, is a
place of its own, as the two sides of an opening must not be mixed.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator

import numpy as np

from fba.arrays import Bools, Floats, Ints
from studio.checked_skin import CheckedSkin

FEWEST = 40
"""Edges or hinges that a place needs, so that some of them can be bad without being it; coarse meshes have fewer
places, and all that moves counts as one place more."""

SIDES = ("upper lip", "lower lip", "left upper lid", "left lower lid", "right upper lid", "right lower lid")
"""The places of the labels of `cloning.labels`, from 1 on."""
MOVING = "what moves"


def place_names(points: Collection[str]) -> tuple[str, ...]:
    """All places of faces that have these feature points in common."""
    return (*sorted(points), *SIDES)


class Places:
    """Some edges or hinges of a skin, place by place.

    Parameters
    ----------
    points : feature points that the faces to be compared have in common, all of them on this skin.
    members : (m, k) vertices; what reaches from one place into another is left out.

    Attributes
    ----------
    members : (m, k) those that are left, place by place.
    """

    def __init__(self, skin: CheckedSkin, points: Collection[str], members: Ints) -> None:
        from scipy.spatial import cKDTree

        surface = skin.surface
        self._names = place_names(points)
        place = np.zeros(surface.vertex_count, dtype=np.int64)
        if points:
            where = np.array([surface.positions[k] for k in sorted(points)])
            place = np.asarray(cKDTree(where).query(surface.vertices)[1])
        place = np.where(skin.labels > 0, len(points) + skin.labels - 1, place)
        inside = np.flatnonzero(place[members[:, 0]] == place[members[:, 1]])
        order = np.argsort(place[members[inside, 0]], kind="stable")
        self.members: Ints = members[inside[order]]
        count = np.bincount(place[self.members[:, 0]], minlength=len(self._names))
        self._ends = np.cumsum(count)
        self._known = np.flatnonzero(count >= FEWEST)
        self._starts = self._ends - count

    def quantiles(self, share: float, moving: Bools, values: Floats) -> Iterator[tuple[str, float, int]]:
        """Each place, the value that a share of its members does not exceed, and which member is worst.

        Parameters
        ----------
        moving : (m,) which members move. values : those members' values; all others are still.
        """
        everything = np.zeros(len(self.members))
        everything[moving] = values
        for k in self._known.tolist():
            start, end = self._starts[k], self._ends[k]
            here = everything[start:end]
            stirs = moving[start:end].any()
            yield self._names[k], _quantile(here, share) if stirs else 0.0, int(start + np.argmax(here))
        if len(values):
            yield MOVING, _quantile(values, share), int(np.flatnonzero(moving)[np.argmax(values)])


def _quantile(values: Floats, share: float) -> float:
    at = min(int(share * len(values)), len(values) - 1)
    return float(np.partition(values, at)[at])


__all__ = ["FEWEST", "MOVING", "Places", "place_names"]
