"""The exact closest point on a triangle surface, among the triangles that face the same way and fit the label."""

from __future__ import annotations

from dataclasses import astuple
from itertools import chain
from typing import Any

import numpy as np

from cloning.labels import OPPOSITE
from cloning.locate import Places, closest_on_triangles
from fba.arrays import Bools, Floats, Ints

FIRST = 4
"""Triangles whose centres are nearest are tried first: they bound the distance."""

MORE = 48
"""Triangles tried where none of the first ones fits."""

BLOCK = 8192
"""So many points are looked for at once ..."""

OPEN_BLOCK = 256
"""... and so many of those for which no triangle near by fits: each of them has very many candidates."""

FEWEST = 0.05
"""A class of triangles of about one size holds at least this share of all, so that there are only a few."""


class TriangleSearch:
    """A triangle surface, ready for queries.

    Triangles are sorted into classes of about one size. The nearest centres give a bound for each point; a closer
    triangle can only be one whose centre is nearer than the bound plus the largest radius of its class.

    Parameters
    ----------
    vertices : (n, 3).
    triangles : (t, 3).
    labels : (n,) labels of lips and lids (see `cloning.labels`); None = none.
    usable : (t,) bool, triangles that may be found; None = all.
    """

    def __init__(
        self, vertices: Floats, triangles: Ints, labels: Ints | None = None, usable: Bools | None = None
    ) -> None:
        from scipy.spatial import cKDTree

        self.triangles = triangles
        self.corners = vertices[triangles]
        a, b, c = (self.corners[:, k] for k in range(3))
        cross = np.cross(b - a, c - a)
        length = np.linalg.norm(cross, axis=1, keepdims=True)
        self.normals = np.divide(cross, length, out=np.zeros_like(cross), where=length > 0.0)
        self._bits = np.zeros(len(triangles), np.int32)
        if labels is not None:
            self._bits = np.bitwise_or.reduce(1 << labels[triangles].astype(np.int32), axis=1)
        self._centers = self.corners.mean(axis=1)
        self._radii = np.linalg.norm(self.corners - self._centers[:, None], axis=2).max(axis=1, initial=0.0)
        some = np.arange(len(triangles)) if usable is None else np.flatnonzero(usable)
        self._some: Ints = some.astype(np.int32)
        self._all: Any = cKDTree(self._centers[some]) if len(some) else None
        self._classes = [
            (cKDTree(self._centers[ids]), ids, float(self._radii[ids].max())) for ids in _sizes(self._radii, self._some)
        ]

    def closest(
        self,
        points: Floats,
        normals: Floats | None = None,
        labels: Ints | None = None,
        least_facing: float = 0.5,
        reach: float | Floats = np.inf,
        guesses: Ints | None = None,
    ) -> Places:
        """Find the closest point of each query.

        Parameters
        ----------
        points : (m, 3).
        normals : (m, 3) unit normals; triangles whose own normal is turned away farther than `least_facing` (a
            cosine) do not count. None = all count.
        labels : (m,) labels of the points: triangles that touch the opposite label do not count.
        reach : nothing farther than this is found; one for all, or (m,).
        guesses : (m,) a triangle that is likely to be near, -1 for none; it saves time and changes no result.

        Returns
        -------
        Places; where there is none, the triangle is -1 and the distance infinite.
        """
        m = len(points)
        if m > BLOCK:
            limits = np.broadcast_to(reach, m)
            blocks = [
                self.closest(
                    points[some],
                    None if normals is None else normals[some],
                    None if labels is None else labels[some],
                    least_facing,
                    limits[some],
                    None if guesses is None else guesses[some],
                )
                for some in (slice(start, start + BLOCK) for start in range(0, m, BLOCK))
            ]
            return Places(*(np.concatenate(part) for part in zip(*map(astuple, blocks), strict=True)))
        best = Places(np.full(m, -1, np.int32), np.zeros((m, 3)), np.full(m, np.inf), np.full(m, -1.0))
        if self._all is None or m == 0:
            return best
        refused = np.zeros(m, np.int32)
        if labels is not None:
            opposite = OPPOSITE[labels]
            refused = np.where(opposite >= 0, 1 << np.maximum(opposite, 0), 0).astype(np.int32)
        query = _Query(self, points, normals, refused, least_facing, best)
        if guesses is not None:
            guessed = np.flatnonzero(guesses >= 0).astype(np.int32)
            query.offer(guessed, guesses[guessed])
        for count in (FIRST, MORE):
            open_rows = np.flatnonzero(best.triangles < 0)
            if not len(open_rows):
                break
            k = min(count, len(self._some))
            near = self._all.query(points[open_rows], k=k)[1].reshape(len(open_rows), k)
            query.offer(np.repeat(open_rows, k), self._some[near].ravel())
        limits = np.broadcast_to(reach, m)
        bounded = best.triangles >= 0
        still = np.flatnonzero(~bounded)
        starts = range(0, len(still), OPEN_BLOCK)
        for rows in (np.flatnonzero(bounded), *(still[start : start + OPEN_BLOCK] for start in starts)):
            self._search(query, points, rows.astype(np.int32), limits)
        far = best.distances > reach
        best.triangles[far], best.distances[far], best.facing[far], best.weights[far] = -1, np.inf, -1.0, 0.0
        return best

    def _search(self, query: _Query, points: Floats, rows: Ints, limits: Floats) -> None:
        """Try every triangle that can be nearer to some of the points than what they have."""
        for tree, ids, radius in self._classes:
            bound = np.minimum(query.best.distances[rows], limits[rows]) + radius
            found = tree.query_ball_point(points[rows], bound, return_sorted=False)
            counts = np.fromiter(map(len, found), np.int64, len(rows))
            flat = np.fromiter(chain.from_iterable(found), np.int64, int(counts.sum()))
            query.offer(np.repeat(rows, counts), ids[flat])

    def positions(self, places: Places) -> Floats:
        """(m, 3) the points found; meaningless where there is none."""
        found: Floats = np.einsum("nk,nkd->nd", places.weights, self.corners[places.triangles])
        return found


class _Query:
    """Pairs of points and triangles that are tried, and the best of them so far."""

    def __init__(
        self,
        search: TriangleSearch,
        points: Floats,
        normals: Floats | None,
        refused: Ints,
        least_facing: float,
        best: Places,
    ) -> None:
        self._search, self._points, self._normals = search, points, normals
        self._refused, self._least, self.best = refused, least_facing, best

    def offer(self, rows: Ints, triangles: Ints) -> None:
        """Try pairs: row of a point, in ascending order, and index of a triangle."""
        search, best = self._search, self.best
        away = self._points[rows] - search._centers[triangles]
        near = np.sqrt(np.einsum("nd,nd->n", away, away)) - search._radii[triangles] < best.distances[rows]
        kept = np.flatnonzero(near & (search._bits[triangles] & self._refused[rows] == 0))
        rows, triangles = rows[kept], triangles[kept]
        facing = np.ones(len(rows))
        if self._normals is not None:
            facing = np.einsum("nd,nd->n", self._normals[rows], search.normals[triangles])
            kept = np.flatnonzero(facing >= self._least)
            rows, triangles, facing = rows[kept], triangles[kept], facing[kept]
        if not len(rows):
            return
        weights, distances = closest_on_triangles(self._points[rows], search.corners[triangles])
        starts = np.flatnonzero(np.diff(rows, prepend=-1))
        count = np.diff(starts, append=len(rows))
        nearest = distances == np.repeat(np.minimum.reduceat(distances, starts), count)
        # The lowest index wins where triangles are equally near, as at a common edge.
        index = np.where(nearest, triangles, len(search.triangles))
        chosen = np.flatnonzero(index == np.repeat(np.minimum.reduceat(index, starts), count))
        chosen = chosen[distances[chosen] < best.distances[rows[chosen]]]
        at = rows[chosen]
        best.triangles[at], best.weights[at] = triangles[chosen], weights[chosen]
        best.distances[at], best.facing[at] = distances[chosen], facing[chosen]


def _sizes(radii: Floats, some: Ints) -> list[Ints]:
    """Classes of triangles whose radii differ by a factor of two, small classes joined to the next larger one."""
    if not len(some):
        return []
    size = np.floor(np.log2(np.maximum(radii[some], 1e-12)))
    classes: list[Ints] = []
    held = np.zeros(0, some.dtype)
    for step in np.unique(size):
        held = np.concatenate([held, some[size == step]])
        if len(held) >= FEWEST * len(some):
            classes.append(held)
            held = held[:0]
    return [*classes, held] if len(held) else classes
