"""Make every feature point move exactly as its FAPU says, by small local additions to the cloned motion.

Each feature point has a bump over the skin around it (distance measured along the surface, so that a bump never
jumps from lip to lip). For each motion the heights of all bumps are solved together. Where a motion leaves the
skin at rest the bumps are zero too, so static skin stays static.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from cloning.surface import Surface
from fba.arrays import Floats, Ints

WIDTH = 0.16
"""Largest width (sigma) of a bump, in eye separations."""

REACH = 2.8
"""A bump ends at this many widths."""

NARROWEST = 0.03
"""Smallest width of a bump, in eye separations."""

ACTIVE = 0.04
"""Skin that moves more than this share of a motion's largest offset takes the full correction."""

SOFT = 0.05
"""Regularization of the wide bumps, relative to the mean diagonal: they overlap and must not fight."""

EXACT = 1e-8
"""Regularization of the narrow bumps."""

STEEPEST = 12.0
"""No bump is higher than this times the largest error that it mends."""

TRUSTED = 0.3
"""Feature points on skin that is less active than this count less and less: nearly nothing moves there."""


@dataclass(frozen=True, eq=False)
class Correction:
    """Bumps of a target.

    Attributes
    ----------
    ids : the feature points.
    wide : (n, k) sparse, bumps of the largest width; they take what neighbouring points miss together.
    bumps : (n, k) sparse, bumps as wide as the next feature point is away; they make each point exact.
    evaluate : (k, n) sparse, a field at the feature points.
    """

    ids: tuple[str, ...]
    wide: Any
    bumps: Any
    evaluate: Any

    def apply(self, motion: Floats, goals: Floats) -> Floats:
        """Add the bumps to a motion, in place.

        Parameters
        ----------
        motion : (n, K, 3) cloned offsets of K motions.
        goals : (k, K, 3) wanted offsets of the feature points.

        Returns
        -------
        (k, K, 3) what the feature points still miss.
        """
        before = goals - self._at_points(motion)
        active = self._activity(motion, goals)
        wide, narrow = self._on_reached
        self._add(wide, SOFT, before, active, motion)
        self._add(narrow, EXACT, goals - self._at_points(motion), active, motion)
        left: Floats = goals - self._at_points(motion)
        return left

    @cached_property
    def _reached(self) -> Ints:
        """The vertices that lie on a bump; about a third of a head."""
        found: Ints = np.flatnonzero(np.diff(self.wide.indptr) + np.diff(self.bumps.indptr)).astype(np.int32)
        return found

    @cached_property
    def _on_reached(self) -> tuple[_Bumps, _Bumps]:
        """The wide and the narrow bumps on those vertices."""
        support = self._support[0]
        wide, narrow = self.wide[self._reached], self.bumps[self._reached]
        return _Bumps(wide, wide[support].toarray()), _Bumps(narrow, narrow[support].toarray())

    @cached_property
    def _columns(self) -> Any:
        """The narrow bumps one by one, on the vertices that bumps reach."""
        return self._on_reached[1].all.tocsc()

    @cached_property
    def _support(self) -> tuple[Ints, Floats]:
        """The vertices on which feature points lie, as places in `_reached`, and (k, s) their weights."""
        vertices = np.unique(self.evaluate.indices)
        return np.searchsorted(self._reached, vertices).astype(np.int32), self.evaluate[:, vertices].toarray()

    def _at_points(self, motion: Floats) -> Floats:
        at: Floats = (self.evaluate @ motion.reshape(len(motion), -1)).reshape(-1, *motion.shape[1:])
        return at

    def _add(self, bumps: _Bumps, ridge: float, missing: Floats, active: Floats, motion: Floats) -> None:
        """Solve for the heights of the bumps, motion by motion, and add them."""
        k, count = len(self.ids), motion.shape[1]
        support, at_points = self._support
        heights = np.zeros((k, count, 3))
        for m in range(count):
            here = active[support, m]
            rows = np.clip(at_points @ here / TRUSTED, 0.0, 1.0)
            # Points on skin that rests count nothing, and bumps that reach no moving one stay flat.
            counted, moving = np.flatnonzero(rows), np.flatnonzero(here)
            weighted = here[moving, None] * bumps.at_support[moving]
            raised = np.flatnonzero(weighted.any(axis=0))
            system = at_points[np.ix_(counted, moving)] @ weighted[:, raised]
            system *= rows[counted, None]
            right = system.T @ (rows[counted, None] * missing[counted, m])
            heights[raised, m] = _solve(system.T @ system, right, k, ridge, np.abs(missing[:, m]).max())
        added = (bumps.all @ heights.reshape(k, -1)).reshape(-1, *motion.shape[1:])
        added *= active[:, :, None]
        motion[self._reached] += added

    def _activity(self, motion: Floats, goals: Floats) -> Floats:
        """(r, K) of the vertices on bumps: 0 where the skin rests and may not be moved, up to 1 where it moves or a
        feature point must."""
        squared = np.einsum("nkc,nkc->nk", motion, motion)
        wanted = np.linalg.norm(goals, axis=2)
        limit = np.maximum(ACTIVE * np.maximum(np.sqrt(squared.max(axis=0)), wanted.max(axis=0)), 1e-300)
        active = smooth_step(np.sqrt(squared[self._reached]) / limit)
        columns, moves = self._columns, smooth_step(wanted / limit)
        for k in np.flatnonzero(moves.any(axis=1)):
            some, own = np.flatnonzero(moves[k]), slice(columns.indptr[k], columns.indptr[k + 1])
            here = np.ix_(columns.indices[own], some)
            active[here] = np.maximum(active[here], columns.data[own, None] * moves[k, some])
        return active


@dataclass(frozen=True, eq=False)
class _Bumps:
    """Bumps on the vertices that they reach.

    Attributes
    ----------
    all : (r, k) sparse.
    at_support : (s, k) of the vertices on which feature points lie.
    """

    all: Any
    at_support: Floats


def _solve(normal: Floats, right: Floats, count: int, ridge: float, size: float) -> Floats:
    """Heights of the bumps; smoother ones where feature points contradict each other on a coarse mesh.

    Parameters
    ----------
    count : of all bumps; those that are not among these stay flat.
    """
    mean = max(float(np.trace(normal)) / count, 1e-30)
    while True:
        system = normal.copy()
        system[np.diag_indices(len(system))] += ridge * mean
        heights = np.asarray(np.linalg.solve(system, right), dtype=np.float64)
        if ridge >= 1.0 or np.abs(heights).max(initial=0.0) <= STEEPEST * size:
            return heights
        ridge *= 10.0


def smooth_step(t: Floats) -> Floats:
    """0 below 0, 1 above 1, with level ends between."""
    t = np.clip(t, 0.0, 1.0)
    smooth: Floats = t * t * (3.0 - 2.0 * t)
    return smooth


def correction(surface: Surface, ids: Sequence[str]) -> Correction:
    """Build the bumps of these feature points of a target skin."""
    ids = tuple(ids)
    distances = surface.distances(ids, REACH * WIDTH)
    evaluate = surface.point_matrix(ids)
    between = np.array([(evaluate @ row.clip(max=1.0)) for row in distances]).reshape(len(ids), -1)
    np.fill_diagonal(between, np.inf)
    gap = between.min(axis=1) if len(ids) > 1 else np.full(len(ids), np.inf)
    narrow = _bumps(distances, np.clip(gap, NARROWEST, WIDTH))
    return Correction(ids, _bumps(distances, np.full(len(ids), WIDTH)), narrow, evaluate)


def _bumps(distances: Floats, widths: Floats) -> Any:
    """(n, k) sparse Gaussian bumps of these widths, from (k, n) distances, that end smoothly at REACH widths."""
    from scipy.sparse import csr_array

    scaled = distances / (REACH * widths[:, None])
    rows, columns = np.nonzero(scaled < 1.0)
    t = scaled[rows, columns]
    values = np.exp(-0.5 * (REACH * t) ** 2) * (1.0 - t * t) ** 2
    return csr_array((values, (columns, rows)), shape=distances.T.shape)
