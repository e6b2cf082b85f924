"""Smooth normals for meshes that bring none, and how blend shapes turn them.

USD and glTF meshes without normals are drawn with facets; with normals that their blend shapes do not turn, they are
drawn as if they did not move.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Floats, Ints
from fba.mesh import PolyMesh


class SmoothNormals:
    """The vertex normals of a mesh at rest and in motion; inside axes, local coordinates."""

    def __init__(self, mesh: PolyMesh) -> None:
        self._mesh = mesh
        self.rest = _vertex_normals(mesh.vertices, mesh.triangles)

    def offsets(self, index: Ints, displacements: Floats) -> Floats:
        """Changes (k, 3) of the unit normals of vertices `index` (k,) when these are displaced (k, 3)."""
        vertices = self._mesh.vertices.copy()
        for axis in range(3):
            vertices[:, axis] += np.bincount(index, displacements[:, axis], len(vertices))
        moved = np.zeros(len(vertices), dtype=bool)
        moved[index] = True
        a, b, c = self._mesh.triangles.T
        touched = self._mesh.triangles[moved[a] | moved[b] | moved[c]]
        changes: Floats = _vertex_normals(vertices, touched)[index] - self.rest[index]
        return changes


def _vertex_normals(vertices: Floats, triangles: Ints) -> Floats:
    """Area-weighted unit normals (n, 3), as `PolyMesh.vertex_normals` gives them, for a part of the triangles.

    One FAP moves a part of a mesh, and there are hundreds of borders: building a mesh for each would take most of
    the time of writing a file.
    """
    x, y, z = np.ascontiguousarray(vertices.T)
    a, b, c = np.ascontiguousarray(triangles.T)
    ux, uy, uz = x[b] - x[a], y[b] - y[a], z[b] - z[a]
    vx, vy, vz = x[c] - x[a], y[c] - y[a], z[c] - z[a]
    normals = np.zeros((len(vertices), 3))
    for axis, cross in enumerate((uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx)):
        for corner in (a, b, c):
            normals[:, axis] += np.bincount(corner, cross, len(vertices))
    length = np.sqrt(np.einsum("ij,ij->i", normals, normals))[:, None]
    unit: Floats = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
    return unit
