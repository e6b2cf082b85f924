"""Shares in 0..1 spread smoothly over a mesh: how much of a motion each vertex follows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cloning.surface import Surface
from fba.arrays import Floats, Ints

FLATTEST = 0.02
"""Least weight of an edge as a share of the mean: cotangents of obtuse corners are negative and would overshoot."""

FAINTEST = 1e-9
"""Firmness that every vertex has: pieces of a mesh on which nothing is wanted rest."""


@dataclass(frozen=True, eq=False)
class Spread:
    """Spreads shares over a mesh as a thin plate would bend, copies of a vertex along seams as one.

    Attributes
    ----------
    join : (m, n) sparse, sums over the copies of a vertex.
    area : (m,) of each joined vertex.
    bending : (m, m) sparse, bending energy of a field.
    """

    join: Any
    area: Floats
    bending: Any

    def __call__(self, wanted: Floats, firmness: Floats, length: float) -> Floats:
        """Return the smoothest field that keeps near to what is wanted.

        Parameters
        ----------
        wanted : (n,) shares in 0..1.
        firmness : (n,) how firmly each vertex holds what is wanted; 0 = follows its neighbours, inf = exactly.
        length : over about this distance a field of firmness 1 is smoothed, in the units of the mesh.

        Returns
        -------
        (n,) in 0..1.
        """
        from scipy.sparse import diags_array
        from scipy.sparse.linalg import splu

        exact = np.isinf(firmness)
        soft = np.where(exact, 0.0, firmness)
        total, copies = self.join @ soft, np.asarray(self.join.sum(axis=1)).ravel()
        goal = (self.join @ (soft * wanted)) / np.maximum(total, 1e-300)
        held = self.join @ exact.astype(np.float64) > 0.0
        goal[held] = ((self.join @ (exact * wanted)) / np.maximum(self.join @ exact.astype(np.float64), 1.0))[held]
        free = np.flatnonzero(~held)
        if len(free):
            firm = (self.area * (total / copies + FAINTEST))[free]
            rows = length**4 * self.bending[free]
            system = (rows[:, free] + diags_array(firm)).tocsc()
            right = firm * goal[free] - rows[:, np.flatnonzero(held)] @ goal[held]
            solver = splu(system, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
            goal[free] = solver.solve(right)
        field: Floats = np.clip(self.join.T @ goal, 0.0, 1.0)
        return field


def spread(surface: Surface) -> Spread:
    """The spread of a skin, in eye separations."""
    return mesh_spread(surface.vertices, surface.triangles, surface.links)


def mesh_spread(vertices: Floats, triangles: Ints, links: Ints) -> Spread:
    """The spread of a triangle mesh.

    Parameters
    ----------
    vertices : (n, 3). triangles : (t, 3). links : (l, 2) vertices at one place that move as one.
    """
    from scipy.sparse import coo_array, csr_array, diags_array
    from scipy.sparse.csgraph import connected_components

    n = len(vertices)
    pairs = coo_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(n, n))
    count, group = connected_components(pairs, directed=False)
    join = csr_array((np.ones(n), (group, np.arange(n))), shape=(count, n))
    stretch, area = _stretch(vertices, triangles)
    joined = (join @ stretch @ join.T).tocsr()
    sums = np.zeros(count)
    np.add.at(sums, group, area)
    sums = np.maximum(sums, 1e-3 * sums.mean())
    return Spread(join, sums, joined @ diags_array(1.0 / sums) @ joined)


def _stretch(vertices: Floats, triangles: Ints) -> tuple[Any, Floats]:
    """(n, n) sparse stretching energy with cotangent weights, and the (n,) area of each vertex."""
    from scipy.sparse import coo_array, diags_array

    n = len(vertices)
    pairs, weights = [], []
    for k in range(3):
        apex, a, b = (triangles[:, (k + j) % 3] for j in range(3))
        u, v = vertices[a] - vertices[apex], vertices[b] - vertices[apex]
        cross = np.linalg.norm(np.cross(u, v), axis=1)
        pairs.append(np.stack([a, b]))
        weights.append(0.5 * np.einsum("ij,ij->i", u, v) / np.maximum(cross, 1e-12))
    area = np.zeros(n)
    np.add.at(area, triangles.ravel(), np.repeat(cross / 6.0, 3))
    a, b = np.concatenate(pairs, axis=1)
    graph = coo_array((np.concatenate(weights), (a, b)), shape=(n, n)).tocsr()
    graph = (graph + graph.T).tocoo()
    values = np.clip(graph.data, FLATTEST * np.median(np.abs(graph.data)), 50.0)
    graph = coo_array((values, graph.coords), shape=(n, n)).tocsr()
    return diags_array(np.asarray(graph.sum(axis=1)).ravel()) - graph, area
