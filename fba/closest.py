"""The closest point on a triangle mesh, without an index structure: exact, for a handful of queries."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fba.arrays import Floats, Ints


def closest_on_triangles(corners: Floats, point: Floats) -> tuple[Floats, Floats]:
    """Closest point of each triangle to one point.

    Parameters
    ----------
    corners : (t, 3, 3), the corners of each triangle; triangles of no area are allowed.
    point : (3,)

    Returns
    -------
    weights : (t, 3) barycentric weights of the closest points, none negative, each row adds up to 1.
    squared : (t,) squared distances.
    """
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    weights = np.zeros((len(corners), 3))
    squared = np.full(len(corners), np.inf)
    for first, second in ((0, 1), (1, 2), (2, 0)):
        start = corners[:, first]
        along = corners[:, second] - start
        length = np.einsum("ij,ij->i", along, along)
        part = np.einsum("ij,ij->i", point - start, along)
        part = np.clip(np.divide(part, length, out=np.zeros_like(part), where=length > 0), 0.0, 1.0)
        rest = point - start - part[:, None] * along
        distance = np.einsum("ij,ij->i", rest, rest)
        nearer = distance < squared
        squared[nearer] = distance[nearer]
        weights[nearer] = 0.0
        weights[nearer, first] = 1.0 - part[nearer]
        weights[nearer, second] = part[nearer]
    normal = np.cross(b - a, c - a)
    area = np.einsum("ij,ij->i", normal, normal)
    inner = np.empty_like(weights)
    for k, (p, q) in enumerate(((b, c), (c, a), (a, b))):
        inner[:, k] = np.einsum("ij,ij->i", np.cross(p - point, q - point), normal)
    inside = (area > 0) & (inner >= 0).all(axis=1)
    inside[inside] &= inner[inside].sum(axis=1) > 0
    weights[inside] = inner[inside] / inner[inside].sum(axis=1, keepdims=True)
    height = np.einsum("ij,ij->i", point - a, normal)[inside] ** 2 / area[inside]
    squared[inside] = np.minimum(squared[inside], height)
    return weights, squared


class TriangleSearch:
    """Closest-point queries on one mesh.

    Parameters
    ----------
    vertices : (n, 3)
    triangles : (t, 3), at least one.
    """

    def __init__(self, vertices: Floats, triangles: Ints) -> None:
        self._corners = vertices[triangles]
        self._centers = self._corners.mean(axis=1)
        reach = self._corners - self._centers[:, None]
        self._radii = np.sqrt(np.einsum("ijk,ijk->ij", reach, reach).max(axis=1))

    def closest(self, point: Floats) -> tuple[int, Floats, float]:
        """Return the triangle, the three weights and the distance of the closest point."""
        gap = point - self._centers
        distance = np.sqrt(np.einsum("ij,ij->i", gap, gap))
        # A triangle is nowhere nearer than its centre less its radius, and the best one no farther than the
        # nearest centre: all others drop out.
        near: NDArray[np.intp] = np.flatnonzero(distance - self._radii <= distance.min() * (1.0 + 1e-9))
        weights, squared = closest_on_triangles(self._corners[near], point)
        best = int(np.argmin(squared))
        return int(near[best]), weights[best], float(np.sqrt(squared[best]))
