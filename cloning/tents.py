"""Vertex tents: give one polygon mesh the deformation of another, one-ring by one-ring.

After Song et al., equations 1 to 7. A tent is a vertex, its neighbours along edges, and a tip above it: w = [v1 - v0,
..., vn - v0, tip - v0]. A pose turns w into w', and Q = w' w^T (w w^T)^-1 is the local deformation. The target takes
the shape whose own Q are nearest to the source's, sum of a_i |Q_T - Q_S|^2. Polygons of any arity have one-rings:
nothing is triangulated.

The tips are unknowns of the paper's system. Write M = w w^T, e_j for the edges and g for the tip's vector of the
target at rest: Q_T = (sum_j e'_j e_j^T + g' g^T) M^-1. The unknown g' only reaches what lies along h = M^-1 g, so its
best value makes that part zero whatever the vertices do, and what is left is

    sum of a_i |(Q_T - Q_S) P|^2,   P the two directions orthogonal to h,

with one unknown a vertex, in which g' no longer occurs. The minimum is the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from cloning.rings import Rings, one_rings
from cloning.shape_solver import POINT_WEIGHT, ShapeTransfer, shape_transfer, welded
from cloning.tips import Tips, tips_of
from fba.arrays import Bools, Floats, Ints

THINNEST = 1e-6
"""Tents whose smallest extent (squared) is below this share of their size (squared) span no space; left out."""


def tent_transfer(
    source: Floats,
    target: Floats,
    polygons: tuple[Ints, Ints],
    held: Floats,
    rows: Any = None,
    row_weight: float = POINT_WEIGHT,
    links: Ints | None = None,
    uniform: bool = False,
) -> ShapeTransfer:
    """Factor the transfer from one mesh to another of the same polygons.

    Parameters
    ----------
    source, target : (n, 3) vertices at rest.
    polygons : (indices, offsets) of both.
    held : (n,) how much each vertex is held to a wish of its own, in units of 1/h^2 with h the mean edge of the
        target. Each connected part needs a held vertex or a row: tents leave its place open.
    rows : (k, n) sparse, places on the target that have goals; None = none.
    row_weight : how much each of them counts, in the same units.
    links : (l, 2) pairs of vertices that are one, along seams; None = none.
    uniform : every tent counts the same, as the paper writes it, instead of as its area on the target.
    """
    from scipy.sparse import diags_array

    weld = welded(len(source), links)
    mean = (weld @ diags_array(1.0 / np.maximum(weld.sum(axis=0), 1.0))).T.tocsr()
    group = weld.indices
    rings = one_rings(group[polygons[0]], polygons[1], weld.shape[1])
    tips = tips_of(rings)
    mine, yours = _tents(rings, tips, mean @ source), _tents(rings, tips, mean @ target)
    stands = mine.stands & yours.stands
    area = _areas(rings, mean @ target)
    weights = np.where(stands, 1.0 if uniform else area / area[stands].mean(), 0.0)
    plane = _plane(yours.lean)
    goal, given = _rows(rings, yours, plane, stands), _rows(rings, mine, plane, stands)
    turning = _ring_sum(plane @ np.where(stands[:, None], mine.lean, 0.0)[:, :, None])
    pull = goal.T @ diags_array(np.repeat(weights, 2))
    return shape_transfer(
        pull @ goal,
        pull @ given @ mean,
        pull @ turning,
        partial(_turned, tips, mean @ source, mean),
        weld,
        float(np.linalg.norm(yours.edges, axis=1).mean()) ** -2,
        held,
        rows,
        row_weight,
    )


@dataclass(frozen=True, eq=False)
class _Tents:
    """The tents of a mesh at rest.

    Attributes
    ----------
    edges : (r, 3) from each owner to its neighbour.
    inverse : (n, 3, 3) of w w^T.
    lean : (n, 3) that inverse times the tip's vector; where the tip acts.
    stands : (n,) bool, False where a tent spans no space.
    """

    edges: Floats
    inverse: Floats
    lean: Floats
    stands: Bools


def _tents(rings: Rings, tips: Tips, vertices: Floats) -> _Tents:
    edges = vertices[rings.others] - vertices[rings.owners]
    tip = np.concatenate(tips.of([vertices[:, [k]] for k in range(3)]), axis=1)
    gram = tip[:, :, None] * tip[:, None, :]
    for a in range(3):
        for b in range(3):
            gram[:, a, b] += np.bincount(rings.owners, edges[:, a] * edges[:, b], rings.count)
    extents = np.linalg.eigvalsh(gram)
    stands = (extents[:, 0] > THINNEST * extents[:, 2]) & np.any(tip != 0.0, axis=1)
    gram[~stands] = np.eye(3)
    inverse = np.asarray(np.linalg.inv(gram), np.float64)
    return _Tents(edges, inverse, np.einsum("nij,nj->ni", inverse, tip), stands)


def _plane(lean: Floats) -> Floats:
    """(n, 2, 3) two directions orthogonal to each of (n, 3)."""
    length = np.linalg.norm(lean, axis=1, keepdims=True)
    axis = np.divide(lean, length, out=np.tile([0.0, 0.0, 1.0], (len(lean), 1)), where=length > 0.0)
    aside = np.eye(3)[np.argmin(np.abs(axis), axis=1)]
    first = np.cross(axis, aside)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(axis, first)], axis=1)


def _rows(rings: Rings, tents: _Tents, plane: Floats, stands: Bools) -> Any:
    """(2n, n) sparse: offsets of the vertices to Q - I without the tips' share, in each tent's two directions."""
    from scipy.sparse import csr_array

    n, o = rings.count, rings.owners
    weights = np.einsum("nij,njk->nik", plane, tents.inverse)[o] @ tents.edges[:, :, None]
    weights = np.where(stands[o, None], weights[:, :, 0], 0.0)
    row = np.stack([2 * o, 2 * o + 1], axis=1)
    columns = np.concatenate([np.repeat(rings.others, 2), np.repeat(o, 2)])
    entries = np.concatenate([weights.ravel(), -weights.ravel()])
    return csr_array((entries, (np.tile(row.ravel(), 2), columns)), shape=(2 * n, n))


def _ring_sum(values: Floats) -> Any:
    """(2n, n) sparse: two values a vertex, each times the vertex's own."""
    from scipy.sparse import csr_array

    n = len(values)
    return csr_array((values.ravel(), (np.arange(2 * n), np.repeat(np.arange(n), 2))), shape=(2 * n, n))


def _areas(rings: Rings, vertices: Floats) -> Floats:
    """(n,) each polygon's area, divided evenly among its corners; by the triangles at the corners."""
    before, middle, after = (vertices[rings.corners[:, k]] for k in range(3))
    size = 0.5 * np.linalg.norm(np.cross(after - middle, before - middle), axis=1)
    # The triangles at the corners of a regular polygon of k corners add up to 4 sin^2(pi / k) times its area.
    share = size / (4.0 * np.sin(np.pi / np.maximum(rings.arity, 3)) ** 2)
    return np.asarray(np.bincount(rings.corners[:, 1], share, rings.count), np.float64)


def _turned(tips: Tips, source: Floats, mean: Any, offsets: list[Floats]) -> list[Floats]:
    """How the source's tips change: three (n, K) arrays, x, y and z."""
    rest = [source[:, [axis]] for axis in range(3)]
    changes = tips.of([p + mean @ d for p, d in zip(rest, offsets, strict=True)])
    for change, before in zip(changes, tips.of(rest), strict=True):
        change -= before
    return changes
