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
from typing import Any

import numpy as np

from fba.arrays import Bools, Floats, Ints

COLUMNS = 16
"""Right-hand sides solved in one go: SuperLU is fastest with about this many, in Fortran order."""

THINNEST = 1e-7
"""Triangles smaller than this share of the mean have no plane to speak of and are left out."""

POINT_WEIGHT = 10.0
"""How much a feature point's goal counts against the gradients of one triangle."""


@dataclass(frozen=True, eq=False)
class DeformationTransfer:
    """A factored transfer between two meshes of the same triangles; see `deformation_transfer`.

    Attributes
    ----------
    solver : SuperLU of the (g, g) normal matrix, one unknown for each vertex, or for its copies along a seam.
    weld : (n, g) sparse, from unknowns to vertices.
    linear : (g, n) sparse, right-hand side of the source's offsets.
    turning : (g, t) sparse, right-hand side of the changes of the triangles' fourth vectors.
    holding : (g, n) sparse, right-hand side of the wishes for single vertices.
    pulling : (g, k) sparse, right-hand side of the goals of the rows.
    source : (n, 3).
    triangles : (t, 3), those with a plane.
    """

    solver: Any
    weld: Any
    linear: Any
    turning: Any
    holding: Any
    pulling: Any
    source: Floats
    triangles: Ints

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
        for start in range(0, motions.shape[1], COLUMNS):
            some = slice(start, start + COLUMNS)
            offsets = [np.ascontiguousarray(motions[:, some, axis]) for axis in range(3)]
            turned = self._turned(offsets)
            for axis in range(3):
                right = self.linear @ offsets[axis] + self.turning @ turned[axis]
                if wishes is not None:
                    right += self.holding @ np.ascontiguousarray(wishes[:, some, axis])
                if goals is not None:
                    right += self.pulling @ np.ascontiguousarray(goals[:, some, axis])
                out[:, some, axis] = self.weld @ self._solved(right)
        return out

    def _solved(self, right: Floats) -> Floats:
        """(g, K) solutions; what rests costs nothing."""
        moving = np.flatnonzero(right.any(axis=0))
        out = np.zeros(right.shape)
        if len(moving):
            out[:, moving] = self.solver.solve(np.asfortranarray(right[:, moving]))
        return out

    def _turned(self, offsets: list[Floats]) -> list[Floats]:
        """How the fourth vectors of the source's triangles change: three (t, K) arrays, x, y and z."""
        a, b, c = self.triangles.T
        still = [self.source[:, axis, None] for axis in range(3)]
        rest = _fourth([p[b] - p[a] for p in still], [p[c] - p[a] for p in still])
        posed = [p + d for p, d in zip(still, offsets, strict=True)]
        moved = _fourth([p[b] - p[a] for p in posed], [p[c] - p[a] for p in posed])
        return [after - before for after, before in zip(moved, rest, strict=True)]


def deformation_transfer(
    source: Floats,
    target: Floats,
    triangles: Ints,
    held: Floats,
    rows: Any = None,
    row_weight: float = POINT_WEIGHT,
    links: Ints | None = None,
    uniform: bool = False,
) -> DeformationTransfer:
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
    from scipy.sparse import csr_array, diags_array
    from scipy.sparse.linalg import splu

    n = len(source)
    weld = _welded(n, links)
    mine, yours = _duals(source, triangles), _duals(target, triangles)
    flat = (mine.area > THINNEST * mine.area.mean()) & (yours.area > THINNEST * yours.area.mean())
    triangles, mine, yours = triangles[flat], mine.some(flat), yours.some(flat)
    weights = np.ones(len(triangles)) if uniform else yours.area / yours.area.mean()
    sides = target[triangles] - target[np.roll(triangles, 1, axis=1)]
    stiff = float(np.linalg.norm(sides, axis=2).mean()) ** -2
    rows = csr_array((0, n)) if rows is None else rows
    normal = _assembled(weights, yours.edges, yours.edges, triangles, n)
    normal = normal + diags_array(stiff * held) + stiff * row_weight * (rows.T @ rows)
    entries = weights[:, None] * np.einsum("tjd,td->tj", yours.edges, mine.normal)
    columns = np.repeat(np.arange(len(triangles)), 3)
    turning = csr_array((entries.ravel(), (triangles.ravel(), columns)), shape=(n, len(triangles)))
    return DeformationTransfer(
        splu(
            (weld.T @ normal @ weld).tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        ),
        weld,
        (weld.T @ _assembled(weights, yours.edges, mine.edges, triangles, n)).tocsr(),
        (weld.T @ turning).tocsr(),
        (weld.T @ diags_array(stiff * held)).tocsr(),
        (weld.T @ rows.T * (stiff * row_weight)).tocsr(),
        source,
        triangles,
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


def _fourth(e: list[Floats], f: list[Floats]) -> list[Floats]:
    """Fourth vectors over two edges each, x, y and z apart: cross product over the root of its length."""
    cross = [e[(k + 1) % 3] * f[(k + 2) % 3] - e[(k + 2) % 3] * f[(k + 1) % 3] for k in range(3)]
    root = np.sqrt(np.sqrt(cross[0] ** 2 + cross[1] ** 2 + cross[2] ** 2))
    root = np.maximum(root, 1e-150)
    return [part / root for part in cross]


def _welded(n: int, links: Ints | None) -> Any:
    """(n, g) sparse: each vertex's unknown; linked vertices share one."""
    from scipy.sparse import coo_array, csr_array
    from scipy.sparse.csgraph import connected_components

    pairs = np.zeros((0, 2), np.int32) if links is None else links
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    group = connected_components(graph, directed=False)[1]
    return csr_array((np.ones(n), (np.arange(n), group)))
