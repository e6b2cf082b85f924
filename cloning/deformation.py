"""Deformation transfer: give one mesh the deformation of another of the same triangles.

Sumner and Popovic (2004), as used by Xiang et al. (2008), section 3.3: each triangle of the source deforms by an
affine map S_i, and the target takes the shape whose own maps T_i are nearest, sum of w_i |S_i - T_i|^2. In the papers
a fourth vertex above each triangle gives T_i its third column. That column's direction is orthogonal to the triangle,
so its best value never disturbs the other two: it drops out exactly, and one unknown a vertex is left,

    sum of w_i |grad d - (S_i - I)|^2 within the plane of each target triangle,

where d are the target's offsets. The matrix is the same for x, y and z and for every motion: it is factored once.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from cloning.shape_solver import POINT_WEIGHT, ShapeTransfer, shape_transfer, welded
from cloning.vectors import ROWS, cross, edges, length
from fba.arrays import Bools, Floats, Ints

THINNEST = 1e-7
"""Triangles smaller than this share of the mean have no plane to speak of and are left out."""


def deformation_transfer(
    source: Floats,
    target: Floats,
    triangles: Ints,
    held: Floats,
    rows: Any = None,
    row_weight: float = POINT_WEIGHT,
    links: Ints | None = None,
    uniform: bool = False,
) -> ShapeTransfer:
    """Factor the transfer from one mesh to another.

    Parameters
    ----------
    source, target : (n, 3) vertices at rest.
    triangles : (t, 3) of both.
    held : (n,) how much each vertex is held to a wish of its own, in units of 1/h^2 with h the mean edge of the
        target. Each connected part needs a held vertex or a row: gradients leave its place open.
    rows : (k, n) sparse, places on the target that have goals; None = none.
    row_weight : how much each of them counts, in the same units.
    links : (l, 2) pairs of vertices that are one, along seams; None = none.
    uniform : every triangle counts the same, as the papers write it, instead of as its target's area.
    """
    from scipy.sparse import csr_array

    n = len(source)
    weld = welded(n, links)
    mine, yours = _duals(source, triangles), _duals(target, triangles)
    flat = (mine.area > THINNEST * mine.area.mean()) & (yours.area > THINNEST * yours.area.mean())
    triangles, mine, yours = triangles[flat], mine.some(flat), yours.some(flat)
    weights = np.ones(len(triangles)) if uniform else yours.area / yours.area.mean()
    sides = target[triangles] - target[np.roll(triangles, 1, axis=1)]
    entries = weights[:, None] * np.einsum("tjd,td->tj", yours.edges, mine.normal)
    columns = np.repeat(np.arange(len(triangles)), 3)
    turning = csr_array((entries.ravel(), (triangles.ravel(), columns)), shape=(n, len(triangles)))
    return shape_transfer(
        weld.T @ _assembled(weights, yours.edges, yours.edges, triangles, n) @ weld,
        weld.T @ _assembled(weights, yours.edges, mine.edges, triangles, n),
        weld.T @ turning,
        partial(_turned, source, triangles),
        weld,
        float(np.linalg.norm(sides, axis=2).mean()) ** -2,
        held,
        rows,
        row_weight,
    )


@dataclass(frozen=True, eq=False)
class _Duals:
    """What turns offsets of triangles into gradients.

    Attributes
    ----------
    edges : (t, 3, 3) gradient of each corner's hat function.
    normal : (t, 3) the same of the fourth vertex.
    area : (t,)
    """

    edges: Floats
    normal: Floats
    area: Floats

    def some(self, kept: Bools) -> _Duals:
        return _Duals(self.edges[kept], self.normal[kept], self.area[kept])


def _duals(vertices: Floats, triangles: Ints) -> _Duals:
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    size = np.linalg.norm(cross, axis=1)
    squared = np.maximum(size**2, 1e-300)[:, None]
    second, third = np.cross(c - a, cross) / squared, np.cross(cross, b - a) / squared
    # The fourth vector is cross / sqrt(size), so its dual is cross / size^1.5.
    normal = cross / np.maximum(size**1.5, 1e-300)[:, None]
    return _Duals(np.stack([-second - third, second, third], axis=1), normal, 0.5 * size)


def _assembled(weights: Floats, to: Floats, of: Floats, triangles: Ints, n: int) -> Any:
    """(n, n) sparse: sum over triangles of weight * (gradient of corner j) . (gradient of corner a)."""
    from scipy.sparse import csr_array

    entries = weights[:, None, None] * np.einsum("tjd,tad->tja", to, of)
    rows, columns = np.repeat(triangles, 3, axis=1), np.tile(triangles, (1, 3))
    return csr_array((entries.ravel(), (rows.ravel(), columns.ravel())), shape=(n, n))


def _turned(source: Floats, triangles: Ints, offsets: list[Floats]) -> list[Floats]:
    """How the fourth vectors of the source's triangles change: three (t, K) arrays, x, y and z."""
    moving = (offsets[0] != 0.0) | (offsets[1] != 0.0) | (offsets[2] != 0.0)
    some = np.flatnonzero(moving.any(axis=1)[triangles].any(axis=1))
    still = [source[:, axis, None] for axis in range(3)]
    posed = [p + d for p, d in zip(still, offsets, strict=True)]
    changes = [np.zeros((len(triangles), d.shape[1])) for d in offsets]
    corners: Any = np.ascontiguousarray(triangles[some].T, np.intp)
    rest = _fourth(still, corners)
    for start in range(0, len(some), ROWS):
        rows = slice(start, start + ROWS)
        for change, after, before in zip(changes, _fourth(posed, corners[:, rows]), rest, strict=True):
            change[some[rows]] = after - before[rows]
    return changes


def _fourth(places: list[Floats], corners: Ints) -> list[Floats]:
    """Fourth vectors, x, y and z apart: cross product of two edges over the root of its length."""
    a, b, c = corners
    normal = cross(edges(places, a, b), edges(places, a, c))
    root = np.maximum(np.sqrt(length(normal)), 1e-150)
    return [part / root for part in normal]
