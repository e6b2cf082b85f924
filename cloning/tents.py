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

from cloning.shape_solver import POINT_WEIGHT, ShapeTransfer, shape_transfer, welded
from fba.arrays import Bools, Floats, Ints

THINNEST = 1e-6
"""Tents whose smallest extent (squared) is below this share of their size (squared) span no space; left out."""


@dataclass(frozen=True, eq=False)
class Rings:
    """The one-rings of a polygon mesh.

    Attributes
    ----------
    owners, others : (r,) every edge from both of its ends: a vertex, and a neighbour of it.
    corners : (c, 3) at every corner of a polygon: the vertex before, the vertex, the vertex after.
    arity : (c,) number of corners of the polygon that each corner belongs to.
    count : number of vertices.
    """

    owners: Ints
    others: Ints
    corners: Ints
    arity: Ints
    count: int

    @property
    def valence(self) -> Ints:
        """(n,) number of neighbours."""
        return np.bincount(self.owners, minlength=self.count).astype(np.int32)


def one_rings(indices: Ints, offsets: Ints, count: int) -> Rings:
    """One-rings of polygons of any arity.

    Parameters
    ----------
    indices, offsets : polygons as in PolyMesh.
    count : number of vertices.
    """
    arity = np.diff(offsets)
    after, before = np.arange(indices.size) + 1, np.arange(indices.size) - 1
    filled = arity > 0
    after[offsets[1:][filled] - 1] = offsets[:-1][filled]
    before[offsets[:-1][filled]] = offsets[1:][filled] - 1
    corners = np.stack([indices[before], indices, indices[after]], axis=1)
    pairs = np.concatenate([corners[:, [1, 2]], corners[:, [2, 1]]])
    keys = np.unique(pairs[:, 0].astype(np.int64) * count + pairs[:, 1])
    owners, others = keys // count, keys % count
    apart = owners != others
    return Rings(owners[apart], others[apart], corners, np.repeat(arity, arity), count)


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
    mine, yours = _tents(rings, mean @ source), _tents(rings, mean @ target)
    stands = mine.stands & yours.stands
    area = _areas(rings, mean @ target)
    weights = np.where(stands, 1.0 if uniform else area / area[stands].mean(), 0.0)
    plane = _plane(yours.lean)
    goal, given = _rows(rings, yours, plane, stands), _rows(rings, mine, plane, stands)
    tips = _ring_sum(plane @ np.where(stands[:, None], mine.lean, 0.0)[:, :, None])
    pull = goal.T @ diags_array(np.repeat(weights, 2))
    return shape_transfer(
        pull @ goal,
        pull @ given @ mean,
        pull @ tips,
        partial(_turned, rings, mean @ source, mean, _sums(rings)),
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


def _tents(rings: Rings, vertices: Floats) -> _Tents:
    edges = vertices[rings.others] - vertices[rings.owners]
    tip = np.stack([t[:, 0] for t in _tips(rings, [vertices[:, [k]] for k in range(3)], _sums(rings))], axis=1)
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


def _sums(rings: Rings) -> Any:
    """(n, c) sparse: sums over the corners at each vertex."""
    from scipy.sparse import csr_array

    c = len(rings.corners)
    return csr_array((np.ones(c), (rings.corners[:, 1], np.arange(c))), shape=(rings.count, c))


def _tips(rings: Rings, places: list[Floats], sums: Any) -> list[Floats]:
    """Tip vectors, x, y and z of (n, K): along the normal of the corners, as long as the mean edge of the ring."""
    before, middle, after = rings.corners.T
    e, f = ([p[end] - p[middle] for p in places] for end in (after, before))
    normal = [sums @ (e[(k + 1) % 3] * f[(k + 2) % 3] - e[(k + 2) % 3] * f[(k + 1) % 3]) for k in range(3)]
    size = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    factor = _mean_edge(rings, places) / np.maximum(size, 1e-150)
    return [part * factor for part in normal]


def _mean_edge(rings: Rings, places: list[Floats]) -> Floats:
    """(n, K) mean length of the edges at each vertex."""
    from scipy.sparse import csr_array

    once = rings.owners < rings.others
    a, b = rings.owners[once], rings.others[once]
    x, y, z = (p[b] - p[a] for p in places)
    length = np.sqrt(x**2 + y**2 + z**2)
    share = 1.0 / np.maximum(rings.valence, 1)
    edge = np.arange(len(a))
    where = (np.concatenate([a, b]), np.concatenate([edge, edge]))
    mean: Floats = csr_array((np.concatenate([share[a], share[b]]), where), shape=(rings.count, len(a))) @ length
    return mean


def _areas(rings: Rings, vertices: Floats) -> Floats:
    """(n,) each polygon's area, divided evenly among its corners; by the triangles at the corners."""
    before, middle, after = (vertices[rings.corners[:, k]] for k in range(3))
    size = 0.5 * np.linalg.norm(np.cross(after - middle, before - middle), axis=1)
    # The triangles at the corners of a regular polygon of k corners add up to 4 sin^2(pi / k) times its area.
    share = size / (4.0 * np.sin(np.pi / np.maximum(rings.arity, 3)) ** 2)
    return np.asarray(np.bincount(rings.corners[:, 1], share, rings.count), np.float64)


def _turned(rings: Rings, source: Floats, mean: Any, sums: Any, offsets: list[Floats]) -> list[Floats]:
    """How the source's tips change: three (n, K) arrays, x, y and z."""
    rest = [source[:, [axis]] for axis in range(3)]
    posed = [p + mean @ d for p, d in zip(rest, offsets, strict=True)]
    tips = zip(_tips(rings, posed, sums), _tips(rings, rest, sums), strict=True)
    return [after - before for after, before in tips]
