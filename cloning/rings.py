"""One-rings of polygon meshes: each vertex with its neighbours along edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Ints


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
