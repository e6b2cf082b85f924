"""Shares in 0..1 spread smoothly over a mesh: how much of a motion each vertex follows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from authoring.laplacian import cotangents, laplacian
from cloning.surface import Surface
from fba.arrays import Floats

FLATTEST = 0.02
"""Least weight of an edge as a share of the median: cotangents of obtuse corners are negative and would overshoot."""

STEEPEST = 50.0
"""Largest weight of an edge: slivers would stiffen the skin around them."""

SMALLEST = 1e-3
"""Least area of a vertex, as a share of the mean: slivers would count without bound."""

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
    """The spread of a surface, in eye separations."""
    from scipy.sparse import diags_array

    join, triangles = surface.place_sums, surface.triangles
    corners = surface.vertices[triangles]
    links, area = cotangents(corners, np.ones(len(triangles)), triangles, surface.vertex_count)
    links.data = np.clip(links.data, FLATTEST * np.median(np.abs(links.data)), STEEPEST)
    stretch = (join @ laplacian(links) @ join.T).tocsr()
    area = join @ area
    area = np.maximum(area, SMALLEST * float(area.mean()))
    return Spread(join, area, stretch @ diags_array(1.0 / area) @ stretch)


def smoothstep(t: Floats) -> Floats:
    """From 0 at 0 to 1 at 1, without a slope at both ends."""
    t = np.clip(t, 0.0, 1.0)
    smooth: Floats = t * t * (3.0 - 2.0 * t)
    return smooth
