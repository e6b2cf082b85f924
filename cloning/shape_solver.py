"""Least squares for shapes: local changes that shall be met, vertices that are held, feature points with goals.

What deformation transfer (gradients of triangles) and vertex tents (one-rings) have in common: one symmetric matrix,
the same for x, y and z and for every motion, is factored once; motions are right-hand sides.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from cloning.factors import factored
from fba.arrays import Floats, Ints

COLUMNS = 16
"""At most so many motions are solved in one go: SuperLU is fastest with a dozen right sides, in Fortran order."""

POINT_WEIGHT = 10.0
"""How much a feature point's goal counts against the local changes of one triangle or tent."""

Turned = Callable[[list[Floats]], list[Floats]]


@dataclass(frozen=True, eq=False)
class ShapeTransfer:
    """A factored transfer between two meshes of n vertices each that correspond one to one.

    Attributes
    ----------
    solver : SuperLU of the (g, g) normal matrix, one unknown for each vertex, or for its copies along a seam.
    weld : (n, g) sparse, from unknowns to vertices.
    linear : (g, n) sparse, right-hand side of the source's offsets.
    turning : (g, t) sparse, right-hand side of the changes of the source's normal vectors.
    holding : (g, n) sparse, right-hand side of the wishes for single vertices.
    pulling : (g, k) sparse, right-hand side of the goals of the rows.
    turned : how the source's t normal vectors change, from its offsets: three (n, K) arrays, x, y and z, to three
        (t, K).
    """

    solver: Any
    weld: Any
    linear: Any
    turning: Any
    holding: Any
    pulling: Any
    turned: Turned

    def apply(self, motions: Floats, wishes: Floats | None = None, goals: Floats | None = None) -> Floats:
        """Transfer K motions.

        Parameters
        ----------
        motions : (n, K, 3) offsets of the source's vertices.
        wishes : (n, K, 3) offsets that held vertices shall have; None = 0.
        goals : (k, K, 3) offsets that the rows shall have; None = 0.

        Returns
        -------
        (n, K, 3) offsets of the target's vertices.
        """
        out = np.empty(motions.shape)
        for some in column_blocks(motions.shape[1]):
            offsets = _apart(motions[:, some])
            rights = [
                self.linear @ d + self.turning @ turn for d, turn in zip(offsets, self.turned(offsets), strict=True)
            ]
            for matrix, wanted in ((self.holding, wishes), (self.pulling, goals)):
                if wanted is not None:
                    for right, part in zip(rights, _apart(wanted[:, some]), strict=True):
                        right += matrix @ part
            out[:, some] = np.stack([self.weld @ self._solved(right) for right in rights], axis=2)
        return out

    def _solved(self, right: Floats) -> Floats:
        """(g, K) solutions; what rests costs nothing."""
        moving = np.flatnonzero(right.any(axis=0))
        out = np.zeros(right.shape)
        if len(moving):
            out[:, moving] = self.solver.solve(np.asfortranarray(right[:, moving]))
        return out


def column_blocks(count: int) -> list[slice]:
    """Some motions at a time: as few blocks as there can be, of even sizes."""
    ends = np.linspace(0, count, -(-count // COLUMNS) + 1).astype(int)
    return [slice(start, end) for start, end in pairwise(ends)]


def _apart(offsets: Floats) -> list[Floats]:
    """x, y and z of (n, K, 3): three (n, K) arrays."""
    # A compact copy first: far apart in memory, single numbers cost ten times as much.
    return list(np.ascontiguousarray(np.ascontiguousarray(offsets).transpose(2, 0, 1)))


def shape_transfer(
    normal: Any,
    linear: Any,
    turning: Any,
    turned: Turned,
    weld: Any,
    stiff: float,
    held: Floats,
    rows: Any = None,
    row_weight: float = POINT_WEIGHT,
) -> ShapeTransfer:
    """Add what is held to the equations of the local changes, and factor them.

    Parameters
    ----------
    normal : (g, g) sparse normal matrix of the local changes.
    linear, turning, turned, weld : see `ShapeTransfer`.
    stiff : what a weight of 1 counts: 1/h^2, with h the mean edge of the target.
    held : (n,) how much each vertex is held to a wish of its own. Each connected part needs a held vertex or a row:
        local changes leave its place open.
    rows : (k, n) sparse, places on the target that have goals; None = none.
    row_weight : how much each of them counts.
    """
    from scipy.sparse import csr_array, diags_array

    rows = csr_array((0, weld.shape[0])) if rows is None else rows
    holding = (weld.T @ diags_array(stiff * held)).tocsr()
    pulling = (weld.T @ rows.T * (stiff * row_weight)).tocsr()
    return ShapeTransfer(
        factored(normal + holding @ weld + pulling @ rows @ weld),
        weld,
        linear.tocsr(),
        turning.tocsr(),
        holding,
        pulling,
        turned,
    )


def welded(n: int, links: Ints | None) -> Any:
    """(n, g) sparse: each vertex's unknown; linked vertices share one."""
    from scipy.sparse import coo_array, csr_array
    from scipy.sparse.csgraph import connected_components

    pairs = np.zeros((0, 2), np.int32) if links is None else links
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    group = connected_components(graph, directed=False)[1]
    return csr_array((np.ones(n), (np.arange(n), group)))
