"""Tips of vertex tents: along the normal of a one-ring, as long as the mean of its edges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cloning.rings import Rings
from cloning.vectors import ROWS, cross, edges, length
from fba.arrays import Floats, Ints


@dataclass(frozen=True, eq=False)
class Tips:
    """What the tips of all vertices are made of.

    Attributes
    ----------
    corners : (3, c) the vertex before, the vertex and the vertex after of every corner, in the order of the vertices.
    starts : (n+1,) where the corners of each vertex start.
    ends : (2, e) every edge, once.
    means : (n, e) sparse: the mean over the edges at each vertex.
    """

    corners: Ints
    starts: Ints
    ends: Ints
    means: Any

    def of(self, places: list[Floats]) -> list[Floats]:
        """Tip vectors, x, y and z of (n, K), of vertices in such places."""
        far = np.empty((self.ends.shape[1], places[0].shape[1]))
        for start in range(0, len(far), ROWS):
            rows = slice(start, start + ROWS)
            far[rows] = length(edges(places, *self.ends[:, rows]))
        size = self.means @ far
        tips = [np.empty(size.shape) for _ in places]
        for start in range(0, len(size), ROWS):
            rows = slice(start, start + ROWS)
            normal = self._normals(places, rows)
            factor = size[rows] / np.maximum(length(normal), 1e-150)
            for tip, part in zip(tips, normal, strict=True):
                np.multiply(part, factor, out=tip[rows])
        return tips

    def _normals(self, places: list[Floats], rows: slice) -> list[Floats]:
        """Cross products of the two edges at each corner, summed over the corners of some vertices."""
        from scipy.sparse import csr_array

        starts = self.starts[rows.start : rows.stop + 1]
        before, middle, after = self.corners[:, starts[0] : starts[-1]]
        at = np.arange(len(middle))
        sums = csr_array((np.ones(len(at)), at, starts - starts[0]), shape=(len(starts) - 1, len(at)))
        return [sums @ part for part in cross(edges(places, middle, after), edges(places, middle, before))]


def tips_of(rings: Rings) -> Tips:
    """Sort out the corners and edges of one-rings."""
    from scipy.sparse import csr_array

    n = rings.count
    order = np.argsort(rings.corners[:, 1], kind="stable")
    corners: Any = np.ascontiguousarray(rings.corners[order].T, np.intp)
    starts = np.concatenate([[0], np.cumsum(np.bincount(corners[1], minlength=n))])
    once = rings.owners < rings.others
    ends: Any = np.stack([rings.owners[once], rings.others[once]]).astype(np.intp)
    share = 1.0 / np.maximum(rings.valence, 1)
    edge = np.tile(np.arange(ends.shape[1]), 2)
    return Tips(corners, starts, ends, csr_array((share[ends].ravel(), (ends.ravel(), edge)), shape=(n, ends.shape[1])))
