"""Nearest points on a surface that face the same way, and what is carried over through them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fba.arrays import Bools, Floats, Ints
from fba.closest import closest_on_triangles
from fba.feature_points import FeaturePoint
from fba.mesh import PolyMesh

CANDIDATES = 48
"""Triangles with the nearest centres that are looked at for each point."""
LEAST_COSINE = 0.3
"""Between the two normals: keeps the inside of lips, lids and nostrils apart from the outside."""


@dataclass(frozen=True)
class Places:
    """Points on a surface: corners (k, 3) vertex ids, weights (k, 3) barycentric, distances (k,)."""

    corners: Ints
    weights: Floats
    distances: Floats

    def carry(self, values: Floats) -> Floats:
        """Per-vertex values (n, c) of the surface at the points, (k, c)."""
        carried: Floats = np.einsum("kj,kjc->kc", self.weights, values[self.corners])
        return carried

    def feature_point(self, row: int, shape: str) -> FeaturePoint:
        """One of the places as a feature point."""
        pairs = zip(self.corners[row].tolist(), self.weights[row].tolist(), strict=True)
        kept = [(v, w) for v, w in pairs if w > 1e-9]
        return FeaturePoint(shape, tuple(v for v, _ in kept), tuple(w for _, w in kept))


def nearest_facing(
    points: Floats,
    normals: Floats,
    mesh: PolyMesh,
    allowed: Bools | None = None,
) -> Places:
    """Find for each point the nearest place of a mesh whose surface faces the same way.

    Parameters
    ----------
    points, normals : (k, 3).
    allowed : (n,) vertices of the mesh that may be used; None = all.
    """
    from scipy.spatial import cKDTree

    triangles = mesh.triangles
    if allowed is not None:
        triangles = triangles[allowed[triangles].all(axis=1)]
    corners = mesh.vertices[triangles]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-300)
    tree = cKDTree(corners.mean(axis=1))
    near: NDArray[np.intp] = np.atleast_2d(tree.query(points, k=min(CANDIDATES, len(triangles)))[1])
    chosen, weights, away = np.zeros((len(points), 3), np.int32), np.zeros((len(points), 3)), np.zeros(len(points))
    for row, (point, normal, some) in enumerate(zip(points, normals, near, strict=True)):
        same = some[facing[some] @ normal > LEAST_COSINE]
        rows = same if same.size else some
        bary, squared = closest_on_triangles(corners[rows], point)
        best = int(np.argmin(squared))
        chosen[row], weights[row], away[row] = triangles[rows[best]], bary[best], np.sqrt(squared[best])
    return Places(chosen, weights, away)
