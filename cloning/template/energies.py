"""Membrane and bending energy of a displaced triangle surface (Xiang et al. 2008, section 3.2), linearised.

With the stiffness S (cotangent weights) and vertex areas A the paper's operator is L = -A^-1 S. Its equation
(-k_s L + k_b L^2 + ...) d = b, multiplied by A, is symmetric: (k_s S + k_b S A^-1 S + ...) d = A b.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fba.arrays import Floats, Ints

STEEPEST = 20.0
"""Largest cotangent (an angle of 3 degrees): thinner triangles count as that thin, or they would rule the system."""

SMALLEST = 1e-2
"""Smallest area of a vertex, relative to the mean."""


def stiffness(vertices: Floats, triangles: Ints) -> Any:
    """(n, n) sparse, symmetric: x' S x is the integral of the squared gradient of a field x on the surface.

    Parameters
    ----------
    vertices : (n, 3).
    triangles : (t, 3).
    """
    from scipy.sparse import coo_array

    n = len(vertices)
    rows, columns, entries = [], [], []
    for k in range(3):
        apex, a, b = (triangles[:, (k + step) % 3] for step in range(3))
        u, v = vertices[a] - vertices[apex], vertices[b] - vertices[apex]
        area = np.maximum(np.linalg.norm(np.cross(u, v), axis=1), 1e-300)
        half = 0.5 * np.clip(np.einsum("ij,ij->i", u, v) / area, -STEEPEST, STEEPEST)
        rows += [a, b, a, b]
        columns += [b, a, a, b]
        entries += [-half, -half, half, half]
    where = (np.concatenate(rows), np.concatenate(columns))
    return coo_array((np.concatenate(entries), where), shape=(n, n)).tocsr()


def vertex_areas(vertices: Floats, triangles: Ints) -> Floats:
    """(n,) a third of the area of the triangles at each vertex, never much less than the mean."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    third = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
    total = np.bincount(triangles.ravel(), np.repeat(third, 3), len(vertices))
    areas: Floats = np.maximum(total, max(SMALLEST * float(total.mean()), 1e-300))
    return areas


@dataclass(frozen=True, eq=False)
class Energies:
    """Both energies of a surface.

    Attributes
    ----------
    membrane, bending : (n, n) sparse, symmetric, positive semidefinite; their null space are translations.
    areas : (n,) of the vertices.
    """

    membrane: Any
    bending: Any
    areas: Floats

    def system(self, k_s: float, k_b: float) -> Any:
        """(n, n) sparse, their weighted sum."""
        return k_s * self.membrane + k_b * self.bending


def energies(vertices: Floats, triangles: Ints) -> Energies:
    """Membrane and bending of (n, 3) vertices and (t, 3) triangles."""
    from scipy.sparse import diags_array

    s, areas = stiffness(vertices, triangles), vertex_areas(vertices, triangles)
    return Energies(s, s @ (diags_array(1.0 / areas) @ s), areas)
