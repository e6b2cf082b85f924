"""Interpolation from a 2D triangle mesh (Facial Motion Cloning, section of that name, equations 1 and 2).

Triangles may overlap; the caller says by a depth which one wins. Outside all triangles the closest point of the
closest triangle counts, where closeness is the sum of the excess of the barycentric coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Bools, Floats, Ints

EDGE = 1e-12
"""Points on an edge are inside: the printed strict inequalities would lose them."""

_PAIRS = 2_000_000
"""Point-triangle pairs that are looked at in one go."""


@dataclass(frozen=True, eq=False)
class Located:
    """Points in a triangle mesh.

    Attributes
    ----------
    triangles : (n,) int32.
    weights : (n, 3) barycentric coordinates, all in 0..1.
    inside : (n,) False where the point lies outside all triangles.
    """

    triangles: Ints
    weights: Floats
    inside: Bools


class TriangleMesh2D:
    """A triangle mesh in the plane, ready to locate points.

    Parameters
    ----------
    points : (n, 2).
    triangles : (t, 3) int.
    depth : (n,) or None; among overlapping triangles the one with the smallest depth at the point wins.
    """

    def __init__(self, points: Floats, triangles: Ints, depth: Floats | None = None) -> None:
        self.triangles = np.asarray(triangles)
        corners = points[self.triangles]
        self._origin = corners[:, 0]
        ab, ac = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        det = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
        self._flat = np.abs(det) < 1e-18
        det = np.where(self._flat, 1.0, det)
        inverse = np.stack([ac[:, 1], -ac[:, 0], -ab[:, 1], ab[:, 0]], axis=1) / det[:, None]
        self._inverse = inverse.reshape(-1, 2, 2)
        self._depth = None if depth is None else depth[self.triangles]
        self._grid(corners)

    def barycentric(self, points: Floats, triangles: Ints) -> Floats:
        """Equation (1): coordinates of points (n, 2) in one triangle each, (n, 3)."""
        local = points - self._origin[triangles]
        two = np.einsum("nij,nj->ni", self._inverse[triangles], local)
        return np.concatenate([1.0 - two.sum(axis=1, keepdims=True), two], axis=1)

    def locate(self, points: Floats) -> Located:
        """Find the triangle and the coordinates of each point, (n, 2)."""
        n = len(points)
        triangles = np.full(n, -1, dtype=np.int32)
        weights = np.zeros((n, 3))
        cell = self._cells(points)
        counts = np.where(cell >= 0, self._counts[np.maximum(cell, 0)], 0)
        stops = np.cumsum(counts)
        start = 0
        while start < n:
            base = stops[start - 1] if start else 0
            end = max(start + 1, int(np.searchsorted(stops, base + _PAIRS, side="right")))
            self._inside(points, np.arange(start, min(end, n), dtype=np.int32), cell, counts, triangles, weights)
            start = end
        outside = np.flatnonzero(triangles < 0)
        for some in np.array_split(outside, max(1, int(np.ceil(len(outside) * len(self.triangles) / _PAIRS)))):
            if len(some):
                triangles[some], weights[some] = self._nearest(points[some])
        inside = np.ones(n, dtype=bool)
        inside[outside] = False
        return Located(triangles, weights, inside)

    def _grid(self, corners: Floats) -> None:
        """Sort the triangles into the cells that their bounding boxes touch."""
        low, high = corners.min(axis=1), corners.max(axis=1)
        self._low = low.min(axis=0)
        extent = np.maximum(high.max(axis=0) - self._low, 1e-12)
        side = int(np.clip(np.sqrt(len(corners)), 1, 512))
        self._size = extent / side * (1.0 + 1e-9)
        self._side = side
        first = np.clip(((low - self._low) / self._size).astype(int), 0, side - 1)
        last = np.clip(((high - self._low) / self._size).astype(int), 0, side - 1)
        span = last - first + 1
        total = span[:, 0] * span[:, 1]
        total[self._flat] = 0
        owner = np.repeat(np.arange(len(corners), dtype=np.int32), total)
        step = np.arange(len(owner)) - np.repeat(np.cumsum(total) - total, total)
        column = first[owner, 0] + step % span[owner, 0]
        row = first[owner, 1] + step // span[owner, 0]
        cell = row * side + column
        order = np.argsort(cell, kind="stable")
        self._owners = owner[order]
        self._counts = np.bincount(cell, minlength=side * side)
        self._starts = np.cumsum(self._counts) - self._counts

    def _cells(self, points: Floats) -> Ints:
        place = np.floor((points - self._low) / self._size).astype(int)
        good = np.all((place >= 0) & (place < self._side), axis=1)
        cells: Ints = np.where(good, place[:, 1] * self._side + place[:, 0], -1)
        return cells

    def _inside(self, points: Floats, some: Ints, cell: Ints, counts: Ints, triangles: Ints, weights: Floats) -> None:
        """Write the winner of each point that lies in a triangle."""
        count = counts[some]
        owner = np.repeat(some, count)
        step = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
        candidate = self._owners[np.repeat(self._starts[np.maximum(cell[some], 0)], count) + step]
        found = self.barycentric(points[owner], candidate)
        hit = np.all(found >= -EDGE, axis=1)
        owner, candidate, found = owner[hit], candidate[hit], found[hit]
        depth = np.zeros(len(owner)) if self._depth is None else np.einsum("nk,nk->n", found, self._depth[candidate])
        order = np.lexsort((candidate, depth, owner))
        owner = owner[order]
        first = np.ones(len(owner), dtype=bool)
        first[1:] = owner[1:] != owner[:-1]
        best = order[first]
        triangles[owner[first]] = candidate[best]
        inner = np.clip(found[best], 0.0, 1.0)
        weights[owner[first]] = inner / inner.sum(axis=1, keepdims=True)

    def _nearest(self, points: Floats) -> tuple[Ints, Floats]:
        """The closest triangle by excess barycentric coordinates, and the truncated coordinates in it."""
        offset = np.einsum("tij,tj->ti", self._inverse, self._origin)
        second, third = (points @ self._inverse[:, i].T - offset[:, i] for i in (0, 1))
        first = 1.0 - second - third
        excess = np.zeros(first.shape)
        for b in (first, second, third):
            excess += np.maximum(np.abs(b - 0.5) - 0.5, 0.0)
        excess[:, self._flat] = np.inf
        best = np.argmin(excess, axis=1)
        rows = np.arange(len(points))
        weights = np.stack([b[rows, best] for b in (first, second, third)], axis=1).clip(0.0, 1.0)
        return best.astype(np.int32), weights / weights.sum(axis=1, keepdims=True)


def interpolate(points: Floats, values: Floats, triangles: Ints, wanted: Floats, depth: Floats | None = None) -> Floats:
    """Equation (2): values at any points of the plane.

    Parameters
    ----------
    points : (n, 2) input points.
    values : (n, d) function values.
    triangles : (t, 3).
    wanted : (m, 2).
    depth : see `TriangleMesh2D`.

    Returns
    -------
    (m, d)

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    >>> interpolate(corners, np.array([[0.0], [1.0], [2.0]]), np.array([[0, 1, 2]]), np.array([[0.25, 0.5]]))
    array([[1.25]])
    """
    place = TriangleMesh2D(points, triangles, depth).locate(wanted)
    result: Floats = np.einsum("nk,nkd->nd", place.weights, values[np.asarray(triangles)[place.triangles]])
    return result
