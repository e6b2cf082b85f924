"""Closest triangles by trees of their centres: exact, with numpy and scipy alone.

Triangles are sorted into classes of about one size. The nearest centres give a bound for each point; a closer triangle
can only be one whose centre is nearer than the bound plus the largest radius of its class.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import chain
from typing import Any

import numpy as np

from cloning.locate import Places, closest_on_triangles
from cloning.template.queries import Queries, Triangles, nowhere
from fba.arrays import Bools, Floats, Ints

FIRST = 4
"""Triangles whose centres are nearest are tried first: they bound the distance."""

MORE = 48
"""Triangles tried where none of the first ones fits."""

OPEN_BLOCK = 256
"""So many points are looked for at once for which no triangle near by fits: each has very many candidates."""

FEWEST = 0.05
"""A class of triangles of about one size holds at least this share of all, so that there are only a few."""

TURN = 0.1
"""Points that are looked for again keep their candidates until their normal has moved by this, ..."""

MARGIN = 0.15
"""... and while they have gone no farther than this share of a middling triangle's radius, or come nearer instead."""


@dataclass(eq=False)
class Nearby:
    """Triangles that points can be closest to while they have moved and turned a little.

    Attributes
    ----------
    points, normals : (m, 3) the points when their triangles were gathered; no normals where none count.
    room : (m,) all triangles nearer than this, and turned so far at most, are among the gathered; -1 for none yet.
    last : (m,) the triangle that was found last, -1 for none.
    rows, triangles, distances : (p,) gathered pairs, sorted by point, and their distance when gathered.
    """

    points: Floats
    normals: Floats | None
    room: Floats
    last: Ints
    rows: Ints = field(default_factory=lambda: np.zeros(0, np.int32))
    triangles: Ints = field(default_factory=lambda: np.zeros(0, np.int32))
    distances: Floats = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def of(cls, queries: Queries) -> Nearby:
        """Nothing gathered yet."""
        m = len(queries)
        normals = None if queries.normals is None else np.zeros((m, 3))
        return cls(np.zeros((m, 3)), normals, np.full(m, -1.0), np.full(m, -1, np.int32))

    def gathered(self, queries: Queries, rows: Ints, room: Floats, pairs: tuple[Ints, Ints, Floats]) -> None:
        """Replace what some rows have.

        Parameters
        ----------
        rows : those points.
        room : (r,) theirs.
        pairs : rows, triangles, distances.
        """
        old = np.ones(len(self.room), bool)
        old[rows] = False
        self.points[rows], self.room[rows] = queries.points[rows], room
        if self.normals is not None and queries.normals is not None:
            self.normals[rows] = queries.normals[rows]
        kept = old[self.rows]
        near = np.concatenate([self.rows[kept], pairs[0]])
        order = np.argsort(near, kind="stable")
        self.rows = near[order]
        self.triangles = np.concatenate([self.triangles[kept], pairs[1]])[order]
        self.distances = np.concatenate([self.distances[kept], pairs[2]])[order]


class Balls:
    """Balls around triangles, in trees of their centres."""

    def __init__(self, triangles: Triangles) -> None:
        from scipy.spatial import cKDTree

        corners, some = triangles.corners, triangles.usable
        self.triangles = triangles
        self.centers = corners.mean(axis=1)
        self.radii = np.linalg.norm(corners - self.centers[:, None], axis=2).max(axis=1, initial=0.0)
        self._all: Any = cKDTree(self.centers[some])
        self._classes = [
            (cKDTree(self.centers[ids]), ids, float(self.radii[ids].max())) for ids in _sizes(self.radii[some], some)
        ]
        self._margin = MARGIN * float(np.median(self.radii[some]))

    def closest(self, queries: Queries, nearby: Nearby | None = None) -> Places:
        """Find the closest triangles.

        Parameters
        ----------
        nearby : what is known from the last time the same points were looked for, and is brought up to date.
        """
        trial = _Trial(self, queries)
        best = trial.best
        if nearby is None:
            self._search(trial, np.arange(len(queries), dtype=np.int32))
        else:
            stale = np.flatnonzero(~_found_again(trial, nearby)).astype(np.int32)
            if len(stale):
                room, pairs = self._search(trial, stale, self._margin)
                nearby.gathered(queries, stale, room, pairs)
            nearby.last = best.triangles.copy()
        far = best.distances > queries.limits
        best.triangles[far], best.distances[far], best.facing[far], best.weights[far] = -1, np.inf, -1.0, 0.0
        return best

    def _search(self, trial: _Trial, rows: Ints, margin: float = 0.0) -> tuple[Floats, tuple[Ints, Ints, Floats]]:
        """Find the best of all triangles for some rows, and gather those that are hardly worse.

        Returns
        -------
        (r,) room of the rows, and pairs (see `Nearby`).
        """
        points, best, some = trial.queries.points, trial.best, self.triangles.usable
        for count in (FIRST, MORE):
            unbound = rows[best.triangles[rows] < 0]
            if not len(unbound):
                break
            k = min(count, len(some))
            near = self._all.query(points[unbound], k=k)[1].reshape(len(unbound), k)
            trial.offer(np.repeat(unbound, k), some[near].ravel())
        bounded = best.triangles[rows] >= 0
        still = rows[~bounded]
        parts = (rows[bounded], *(still[start : start + OPEN_BLOCK] for start in range(0, len(still), OPEN_BLOCK)))
        tried = [pairs for part in parts if len(part) for pairs in self._within(trial, part, margin)]
        room = np.minimum(best.distances, trial.queries.limits) + margin
        near, found, distances = (np.concatenate(each) for each in zip(*tried, strict=True))
        kept = distances <= room[near]
        return room[rows], (near[kept], found[kept], distances[kept])

    def _within(self, trial: _Trial, rows: Ints, margin: float) -> Iterator[tuple[Ints, Ints, Floats]]:
        """Try every triangle that can be nearer to some of the points than what they have, or hardly farther."""
        queries = trial.queries
        for tree, ids, radius in self._classes:
            bound = np.minimum(trial.best.distances[rows], queries.limits[rows]) + (radius + margin)
            found = tree.query_ball_point(queries.points[rows], bound, return_sorted=False)
            counts = np.fromiter(map(len, found), np.int64, len(rows))
            flat = np.fromiter(chain.from_iterable(found), np.int64, int(counts.sum()))
            yield trial.offer(np.repeat(rows, counts), ids[flat], margin)


class _Trial:
    """Pairs of points and triangles that are tried, and the best of them so far."""

    def __init__(self, balls: Balls, queries: Queries) -> None:
        self._balls, self.queries, self.best = balls, queries, nowhere(len(queries))

    def offer(self, rows: Ints, triangles: Ints, margin: float = 0.0) -> tuple[Ints, Ints, Floats]:
        """Try pairs: row of a point, in ascending order, and index of a triangle.

        Returns
        -------
        rows, triangles and distances of those that can be nearer than the best and the margin; with a margin also of
        those that hardly face too far away.
        """
        balls, queries, best, all_ = self._balls, self.queries, self.best, self._balls.triangles
        away = queries.points[rows] - balls.centers[triangles]
        near = np.sqrt(np.einsum("nd,nd->n", away, away)) - balls.radii[triangles] <= best.distances[rows] + margin
        kept = np.flatnonzero(near & (all_.bits[triangles] & queries.refused[rows] == 0))
        rows, triangles = rows[kept], triangles[kept]
        facing = np.ones(len(rows))
        if queries.normals is not None:
            facing = np.einsum("nd,nd->n", queries.normals[rows], all_.normals[triangles])
            kept = np.flatnonzero(facing >= queries.least_facing - (TURN if margin else 0.0))
            rows, triangles, facing = rows[kept], triangles[kept], facing[kept]
        weights, distances = closest_on_triangles(queries.points[rows], all_.corners[triangles])
        pairs = rows, triangles, distances
        if margin:
            fit = np.flatnonzero(facing >= queries.least_facing)
            rows, triangles, facing = rows[fit], triangles[fit], facing[fit]
            weights, distances = weights[fit], distances[fit]
        if len(rows):
            self._keep(rows, triangles, weights, distances, facing)
        return pairs

    def _keep(self, rows: Ints, triangles: Ints, weights: Floats, distances: Floats, facing: Floats) -> None:
        """Keep the best pair of each row, if it is better than what there is."""
        best = self.best
        starts = np.flatnonzero(np.diff(rows, prepend=-1))
        count = np.diff(starts, append=len(rows))
        nearest = distances == np.repeat(np.minimum.reduceat(distances, starts), count)
        # The lowest index wins where triangles are equally near, as at a common edge.
        index = np.where(nearest, triangles, np.iinfo(np.int32).max)
        chosen = np.flatnonzero(index == np.repeat(np.minimum.reduceat(index, starts), count))
        now, before = distances[chosen], best.distances[rows[chosen]]
        lower = triangles[chosen] < best.triangles[rows[chosen]]
        chosen = chosen[(now < before) | ((now == before) & lower)]
        at = rows[chosen]
        best.triangles[at], best.weights[at] = triangles[chosen], weights[chosen]
        best.distances[at], best.facing[at] = distances[chosen], facing[chosen]


def _found_again(trial: _Trial, nearby: Nearby) -> Bools:
    """Try what was gathered near the points; (m,) bool, where the best of all triangles is among it for sure."""
    queries, best = trial.queries, trial.best
    known = np.flatnonzero(nearby.last >= 0).astype(np.int32)
    trial.offer(known, nearby.last[known])
    moved = np.linalg.norm(queries.points - nearby.points, axis=1)
    bound = np.minimum(best.distances, queries.limits) + moved
    near = np.flatnonzero(nearby.distances <= bound[nearby.rows])
    trial.offer(nearby.rows[near], nearby.triangles[near])
    sure: Bools = np.minimum(best.distances, queries.limits) + moved <= nearby.room
    if queries.normals is not None and nearby.normals is not None:
        sure &= np.linalg.norm(queries.normals - nearby.normals, axis=1) <= TURN
    return sure


def _sizes(radii: Floats, some: Ints) -> list[Ints]:
    """Classes of triangles whose radii differ by a factor of two, small classes joined to the next larger one.

    Parameters
    ----------
    radii : (s,) of the (s,) triangles.
    """
    size = np.floor(np.log2(np.maximum(radii, 1e-12)))
    classes: list[Ints] = []
    held = np.zeros(0, some.dtype)
    for step in np.unique(size):
        held = np.concatenate([held, some[size == step]])
        if len(held) >= FEWEST * len(some):
            classes.append(held)
            held = held[:0]
    return [*classes, held] if len(held) else classes
