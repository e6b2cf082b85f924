"""A coarser mesh of the same surface: a template finds its rough place with fewer unknowns.

About every second vertex in each direction stays; each other belongs to the nearest of them along the surface. Where
three such neighbourhoods meet in a triangle, a triangle of the coarser mesh lies. So density, borders and the slits
between lips and lids stay as they are, with about a quarter of the vertices.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cloning.locate import closest_on_triangles
from cloning.surface import symmetric_graph
from fba.arrays import Floats, Ints

GOLDEN = 0.5 * (5.0**0.5 - 1.0)
"""Fractions of its multiples put the vertices into an order without any pattern, the same each time."""


@dataclass(frozen=True, eq=False)
class Coarser:
    """A coarser mesh.

    Attributes
    ----------
    kept : (c,) the vertices that stay.
    triangles : (t, 3) over them.
    owner : (n,) the kept one that each vertex belongs to, as an index into `kept`.
    """

    kept: Ints
    triangles: Ints
    owner: Ints

    def spread(self, vertices: Floats) -> Any:
        """(n, c) sparse, rows add up to 1: a field of the kept vertices, interpolated at (n, 3) all vertices.

        Each lies in the closest of the triangles around its owner.
        """
        from scipy.sparse import csr_array

        n = len(vertices)
        order = np.argsort(self.triangles.ravel(), kind="stable")
        count = np.bincount(self.triangles.ravel(), minlength=len(self.kept))
        first = np.concatenate([[0], np.cumsum(count)])
        some = count[self.owner]
        rows = np.repeat(np.arange(n), some)
        within = np.arange(len(rows)) - np.repeat(np.cumsum(some) - some, some)
        tried = order[first[self.owner[rows]] + within] // 3
        weights, distances = closest_on_triangles(vertices[rows], vertices[self.kept][self.triangles[tried]])
        corners, shares = np.repeat(self.owner[:, None], 3, axis=1), np.tile([1.0, 0.0, 0.0], (n, 1))
        best = np.lexsort((distances, rows))
        best = best[np.unique(rows[best], return_index=True)[1]]
        corners[rows[best]], shares[rows[best]] = self.triangles[tried[best]], weights[best]
        return csr_array((shares.ravel(), (np.repeat(np.arange(n), 3), corners.ravel())), shape=(n, len(self.kept)))


def coarser(vertices: Floats, triangles: Ints) -> Coarser:
    """Keep about a quarter of the vertices.

    Parameters
    ----------
    vertices : (n, 3), seams closed.
    triangles : (t, 3).
    """
    from scipy.sparse.csgraph import dijkstra

    n = len(vertices)
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    kept = _independent(pairs, n)
    lengths = np.linalg.norm(vertices[pairs[:, 0]] - vertices[pairs[:, 1]], axis=1)
    graph = symmetric_graph(pairs, lengths, n)
    nearest = dijkstra(graph, indices=kept, min_only=True, return_predecessors=True)[2]
    number = np.full(n, -1, np.int32)
    number[kept] = np.arange(len(kept))
    owner = number[nearest]
    cells = owner[triangles]
    a, b, c = cells.T
    cells = cells[(a != b) & (b != c) & (c != a)]
    turn = np.argmin(cells, axis=1)[:, None]
    cells = np.take_along_axis(cells, (turn + np.arange(3)) % 3, axis=1)
    return Coarser(kept, np.unique(cells, axis=0), owner)


def _independent(pairs: Ints, n: int) -> Ints:
    """Vertices no two of which are neighbours, and as many that all others have one among theirs."""
    rank = (np.arange(n) * GOLDEN) % 1.0
    both = np.concatenate([pairs, pairs[:, ::-1]])
    is_open, chosen = np.ones(n, bool), np.zeros(n, bool)
    while is_open.any():
        both = both[is_open[both].all(axis=1)]
        highest = np.full(n, -1.0)
        np.maximum.at(highest, both[:, 0], rank[both[:, 1]])
        new = is_open & (rank > highest)
        chosen |= new
        is_open &= ~new
        is_open[both[new[both[:, 1]], 0]] = False
    found: Ints = np.flatnonzero(chosen).astype(np.int32)
    return found
