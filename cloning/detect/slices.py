"""Slices through a face: the edges of lips and lids, the profile, the wings of the nose."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from cloning.surface import Surface
from fba.arrays import Floats

TURN = 0.006
"""How far a contour must go back up before the edge counts as passed, in eye separations: less is a wrinkle."""


@dataclass(frozen=True, eq=False)
class Slice:
    """The cut of a surface with a plane x = constant; or y = constant, with x in place of every height below.

    Attributes
    ----------
    ends : (s, 2, 2) y and z of both ends of each segment.
    neighbours : (s, 2) int64, at each end the other segment's end that lies there, twice its segment plus 0 or 1; -1
        at a border.
    """

    ends: Floats
    neighbours: Any

    @cached_property
    def _span(self) -> tuple[Floats, Floats]:
        """Lowest and highest place of each segment."""
        first, last = self.ends[:, 0, 0], self.ends[:, 1, 0]
        return np.minimum(first, last), np.maximum(first, last)

    def foremost(self, y: float) -> int:
        """The segment that is seen from the front at this height; -1 if there is none."""
        low, high = self._span
        here = np.flatnonzero((low <= y) & (y <= high) & (high > low))
        if not len(here):
            return -1
        first, last = self.ends[here, 0], self.ends[here, 1]
        share = (y - first[:, 0]) / (last[:, 0] - first[:, 0])
        return int(here[np.argmax(first[:, 1] + share * (last[:, 1] - first[:, 1]))])

    def edge(self, start: float, down: bool, limit: float) -> Floats | None:
        """Follow the skin from the front at height `start` down (or up) to where it turns inwards.

        Parameters
        ----------
        limit : a height; skin that goes on to there has no edge.

        Returns
        -------
        (2,) y and z of the edge; None where there is none.
        """
        sign = 1.0 if down else -1.0
        segment = self.foremost(start)
        if segment < 0:
            return None
        end = int(np.argmin(sign * self.ends[segment, :, 0]))
        heights, neighbours = self.ends[:, :, 0].ravel(), self.neighbours.ravel()
        here = 2 * segment + end
        best, lowest = here, sign * float(heights[here])
        for _ in range(len(self.ends)):
            height = sign * float(heights[here])
            if height < lowest:
                best, lowest = here, height
            if lowest < sign * limit:
                return None
            following = int(neighbours[here])
            if height - lowest > TURN or following < 0:
                found: Floats = self.ends[best // 2, best % 2]
                return found
            here = following ^ 1
        return None

    def profile(self, heights: Floats) -> Floats:
        """z of the foremost skin at each height; nan where there is none."""
        low, high = self._span
        first, step = self.ends[:, 0], self.ends[:, 1] - self.ends[:, 0]
        inside = (low[:, None] <= heights) & (heights <= high[:, None]) & (high > low)[:, None]
        slope = np.divide(step[:, 1], step[:, 0], out=np.zeros(len(step)), where=step[:, 0] != 0)
        z = np.where(inside, first[:, 1:] + slope[:, None] * (heights - first[:, :1]), -np.inf)
        found = z.max(axis=0, initial=-np.inf)
        return np.where(np.isfinite(found), found, np.nan)


def deepest(along: Floats, depths: Floats) -> tuple[int, float]:
    """Where a curve lies farthest behind the line between its ends: the place's index, and how far."""
    way = np.array([along[-1] - along[0], depths[-1] - depths[0]])
    behind = ((along - along[0]) * way[1] - (depths - depths[0]) * way[0]) / np.linalg.norm(way)
    best = int(np.argmax(behind))
    return best, float(behind[best])


class Slicer:
    """Cuts slices through a part of a surface."""

    def __init__(self, surface: Surface, low: Floats, high: Floats, axis: int = 0) -> None:
        """Keep the triangles whose bounding boxes reach into a box, given by its two corners (3,).

        Parameters
        ----------
        axis : 0 for upright slices at one x, 1 for level ones at one y.
        """
        a, b, c = (surface.vertices[surface.triangles[:, k]] for k in range(3))
        reaches = np.minimum(np.minimum(a, b), c) <= high
        reaches &= np.maximum(np.maximum(a, b), c) >= low
        near = reaches[:, 0] & reaches[:, 1] & reaches[:, 2]
        # Seams are closed: both copies of a vertex count as one.
        self._number = surface.places.astype(np.int64)
        self._triangles = surface.triangles[near]
        self._vertices = surface.vertices[:, [axis, 1 - axis, 2]]
        self._sides = [np.ascontiguousarray(self._vertices[self._triangles[:, k], 0]) for k in range(3)]

    def at(self, x: float) -> Slice:
        """The slice at one x (or y)."""
        a, b, c = (side > x for side in self._sides)
        cut = np.flatnonzero((a != b) | (b != c))
        triangles, above = self._triangles[cut], np.stack([a[cut], b[cut], c[cut]], axis=1)
        # The corner that lies alone on its side; the two edges from it are cut.
        lone = np.where(above.sum(axis=1) == 1, np.argmax(above, axis=1), np.argmin(above, axis=1))
        rows = np.arange(len(triangles))
        ends = np.empty((len(triangles), 2, 2))
        keys = np.empty((len(triangles), 2), np.int64)
        for k in range(2):
            a, b = triangles[rows, lone], triangles[rows, (lone + 1 + k) % 3]
            va, vb = self._vertices[a], self._vertices[b]
            share = (x - va[:, 0]) / (vb[:, 0] - va[:, 0])
            ends[:, k] = va[:, 1:] + share[:, None] * (vb[:, 1:] - va[:, 1:])
            na, nb = self._number[a], self._number[b]
            keys[:, k] = np.minimum(na, nb) * len(self._number) + np.maximum(na, nb)
        return Slice(ends, _joined(keys))


def _joined(keys: Any) -> Any:
    """The other end at each end's edge, from (s, 2) int64 numbers of edges; -1 where there is none."""
    order = np.argsort(keys, axis=None, kind="stable")
    numbers = keys.ravel()[order]
    same = np.zeros(keys.size + 1, bool)
    same[1:-1] = numbers[1:] == numbers[:-1]
    # An edge of three triangles goes nowhere certain.
    first = np.flatnonzero(same[1:-1] & ~same[:-2] & ~same[2:])
    a, b = order[first], order[first + 1]
    found = np.full(keys.size, -1, np.int64)
    found[a], found[b] = b, a
    return found.reshape(keys.shape)
