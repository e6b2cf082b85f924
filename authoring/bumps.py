"""Smooth local fields on a skin: bumps that move one feature point and leave its neighbours still.

A bump is the weight of least bending over a part of the skin, with value and slope 0 at its border, that takes given
values at feature points. It is measured along the skin, so it never jumps from lip to lip or through the eye slit.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from authoring.laplacian import all_fans, cotangents, laplacian
from cloning.labels import OPPOSITE
from cloning.prepare import PreparedFace
from cloning.surface import Surface
from fba.arrays import Bools, Floats, Ints
from fba.faps import faps

FLATTEST = 0.02
"""Least weight of an edge, as a share of the mean: negative cotangents of obtuse corners fold the skin."""

STEEPEST = 20.0
"""Largest cotangent: corners sharper than 3 degrees count as that."""

SMALLEST = 1e-3
"""Least area of a vertex, as a share of the mean: slivers would count without bound."""

DEPENDENT = 1e-9
"""Feature points on the same vertices cannot move apart; below this relative size they count as one."""

SOFT = 0.02
"""How far, relative to its own stiffness, a place between feature points gives way: on a coarse mesh several lie in
one triangle and would tear at it."""

LOOSE = 1e-12
"""Stiffness of every place, relative to its bending: a piece of skin that hangs on nothing else must not fly off."""

UNTOUCHED = 1e-12
"""A place whose vertices have less weight than this is held still anyway."""


@dataclass(frozen=True, eq=False)
class Place:
    """A place on the skin, between vertices (k,) with weights (k,), and the weight a bump must have there.

    Weights that add up to 0 make it the difference of two places.
    """

    vertices: Ints
    weights: Floats
    value: float


@dataclass(frozen=True, eq=False)
class Goals:
    """What a bump must be at some places.

    Attributes
    ----------
    rows : (k, g) sparse, evaluates a weight there.
    values : (k, m) wanted, of m weights at once.
    softness : (k,) 0 where the weight must be exact.
    """

    rows: Any
    values: Floats
    softness: Floats


@dataclass(frozen=True, eq=False)
class Bumps:
    """Makes the bumps of one face; get it by `bumps`."""

    surface: Surface
    labels: Ints

    @cached_property
    def _fans(self) -> tuple[Ints, Floats]:
        return all_fans(*self.surface.polygons)

    def side(self, key: str) -> Bools:
        """(n,) the skin that may move with a feature point: all but the lip or lid opposite to its own."""
        vertices, weights = self.surface.points[key]
        own = int(self.labels[vertices[np.argmax(weights)]])
        return np.asarray(self.labels != OPPOSITE[own]) if own else np.ones(len(self.labels), dtype=bool)

    def within(self, keys: Collection[str], radius: float) -> Bools:
        """(n,) the skin nearer than a radius to one of these points, along the skin, on their own side of a slit."""
        near = np.zeros(self.surface.vertex_count, dtype=bool)
        for key in keys:
            side = self.side(key)
            near |= side & np.isfinite(self.surface.distances([key], radius, ~side)[0])
        return near

    def patch(self, free: Bools) -> Patch:
        """The part of the skin that may move: (n,) bool. Weights are 0 elsewhere and end without a slope."""
        triangles, share = self._fans
        group = self.surface.places
        corners = group[triangles]
        held = np.zeros(int(group.max()) + 1, dtype=bool)
        held[group[~free]] = True
        places = np.flatnonzero(~held).astype(np.int32)
        inside = ~held
        inside[corners[inside[corners].any(axis=1)]] = True
        used = inside[corners].any(axis=1)
        around, local = np.unique(corners[used], return_inverse=True)
        return Patch(
            group,
            places,
            triangles[used],
            share[used],
            local.reshape(-1, 3).astype(np.int32),
            np.searchsorted(around, places).astype(np.int32),
        )

    def goals(self, wanted: Mapping[str, float], pins: Collection[str] = (), more: Sequence[Place] = ()) -> Goals:
        """Put goals together.

        Parameters
        ----------
        wanted : feature point -> weight there, exactly.
        pins : feature points that stay still; those that are elsewhere than on the skin are left out.
        more : further places, with about the weight there.
        """
        from scipy.sparse import coo_array, csr_array, vstack

        keys = [*wanted, *(k for k in pins if k in self.surface.points and k not in wanted)]
        values = [*(wanted.get(k, 0.0) for k in keys), *(p.value for p in more)]
        row = np.repeat(np.arange(len(more)), [len(p.vertices) for p in more])
        column = np.concatenate([p.vertices for p in more]) if more else np.zeros(0, np.int32)
        weights = np.concatenate([p.weights for p in more]) if more else np.zeros(0)
        n = self.surface.vertex_count
        extra = coo_array((weights, (row, column)), shape=(len(more), n))
        spread = csr_array((np.ones(n), (np.arange(n), self.surface.places)))
        rows = (vstack([self.surface.point_matrix(keys), extra]) @ spread).tocsr()
        return Goals(rows, np.array(values)[:, None], np.repeat([0.0, SOFT], [len(keys), len(more)]))


@dataclass(frozen=True, eq=False)
class Patch:
    """A part of the skin that may move, and how it bends.

    Attributes
    ----------
    group : (n,) the place of each vertex.
    places : (k,) the places that may move.
    triangles : (t, 3) those that bend with them; share : (t,) with which each counts.
    corners : (t, 3) their corners, numbered among the places around; columns : (k,) the moving ones among these.
    """

    group: Ints
    places: Ints
    triangles: Ints
    share: Floats
    corners: Ints
    columns: Ints

    def weights(self, goals: Goals, lying: Floats) -> Floats:
        """The smoothest weights (n, m) with given values at places of the skin.

        Parameters
        ----------
        goals : where, and the weight there.
        lying : (n, 3) where the skin lies, in eye separations.
        """
        from scipy.sparse.linalg import splu

        values = np.zeros((int(self.group.max()) + 1, goals.values.shape[1]))
        rows = goals.rows[:, self.places]
        touched = np.asarray(abs(rows).sum(axis=1)).ravel() > UNTOUCHED
        if not touched.any():
            return values[self.group]
        rows, wanted = rows[touched].toarray(), goals.values[touched]
        factors = splu(
            self._bending(lying), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
        follow = factors.solve(np.ascontiguousarray(rows.T))
        between = rows @ follow
        size = np.sqrt(np.diag(between))
        between = between / np.outer(size, size) + np.diag(goals.softness[touched])
        heights = np.linalg.lstsq(between, wanted / size[:, None], rcond=DEPENDENT)[0] / size[:, None]
        values[self.places] = follow @ heights
        weights: Floats = values[self.group]
        return weights

    def _bending(self, lying: Floats) -> Any:
        """(k, k) sparse: ``w @ bending @ w`` is the bending of a weight over the places, 0 around them."""
        from scipy.sparse import csc_array, diags_array

        count = int(self.corners.max()) + 1
        links, area = cotangents(lying[self.triangles], self.share, self.corners, count, STEEPEST)
        links.setdiag(0.0)
        least = FLATTEST * float(np.abs(links.data).mean())
        links.data = np.where(links.data != 0.0, np.maximum(links.data, least), 0.0)
        links.eliminate_zeros()
        inverse = diags_array(1.0 / np.maximum(area, SMALLEST * float(area.mean())))
        columns = laplacian(links).tocsc()[:, self.columns]
        bending = csc_array(columns.T @ inverse @ columns)
        return bending + diags_array(np.full(len(self.places), LOOSE * float(bending.diagonal().mean())), format="csc")


_MADE: WeakKeyDictionary[PreparedFace, Bumps] = WeakKeyDictionary()


def bumps(face: PreparedFace) -> Bumps:
    """The maker of a face's bumps; made once for each face."""
    if face not in _MADE:
        _MADE[face] = Bumps(face.skin, face.labels.values)
    return _MADE[face]


def pinned(axis: int, but: Collection[str] = ()) -> list[str]:
    """Feature points that some FAP moves along an axis (0 x, 1 y, 2 z), without some: cross-talk is measured there."""
    found = {f.feature_points[0]: None for f in faps() if f.direction is not None and abs(f.direction[axis]) > 0.5}
    return [k for k in found if k not in but]
