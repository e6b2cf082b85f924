"""Points spread over a surface, and what of them is seen from one side."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from cloning.surface import Surface
from fba.arrays import Bools, Floats, Ints


@dataclass(frozen=True, eq=False)
class Samples:
    """Points on a surface, spread evenly by area, in random order.

    Attributes
    ----------
    points : (m, 3).
    normals : (m, 3) unit normals as the polygons are wound.
    triangles : (m,) triangle of each point.
    """

    points: Floats
    normals: Floats
    triangles: Ints

    def subset(self, chosen: Any) -> Samples:
        """Some of the points: an index, a mask or a slice."""
        return Samples(self.points[chosen], self.normals[chosen], self.triangles[chosen])

    @cached_property
    def tree(self) -> Any:
        """Search tree of the points."""
        from scipy.spatial import cKDTree

        return cKDTree(self.points, balanced_tree=False)


def sample(surface: Surface, count: int, triangles: Any = None) -> Samples:
    """Spread points over a surface (or over some of its triangles); the same ones on every run."""
    chosen = np.arange(len(surface.triangles)) if triangles is None else triangles
    corners = surface.vertices[surface.triangles[chosen]]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=1)
    total = np.cumsum(area)
    random = np.random.default_rng(0)
    # One point in each of `count` equal parts of the area: evener than independent points.
    place = (np.arange(count) + random.random(count)) * (total[-1] / count)
    picked = np.minimum(np.searchsorted(total, place), len(chosen) - 1)
    root, other = np.sqrt(random.random(count)), random.random(count)
    weights = np.stack([1.0 - root, root * (1.0 - other), root * other], axis=1)
    points = np.einsum("nk,nkd->nd", weights, corners[picked])
    normals = cross[picked] / np.maximum(area[picked], 1e-300)[:, None]
    order = random.permutation(count)
    return Samples(points[order], normals[order], chosen[picked[order]].astype(np.int32))


def depth_map(flat: Floats, depth: Floats, low: Floats, cell: float, shape: tuple[int, int]) -> Floats:
    """Largest depth in each cell of a picture, -inf where there is nothing.

    Parameters
    ----------
    flat : (m, 2) places to the right and up.
    low : (2,) lower left corner.
    shape : rows (up), columns (right).
    """
    column, row = (np.floor((flat[:, k] - low[k]) / cell).astype(np.int64) for k in range(2))
    inside = (column >= 0) & (column < shape[1]) & (row >= 0) & (row < shape[0])
    picture = np.full(shape[0] * shape[1], -np.inf)
    np.maximum.at(picture, row[inside] * shape[1] + column[inside], depth[inside])
    return picture.reshape(shape)


def seen(points: Floats, cell: float, behind: float) -> Bools:
    """Which points are seen from +z: not more than `behind` behind the foremost point of their cell."""
    low = np.array([points[:, k].min() for k in range(2)])
    column, row = (np.floor((points[:, k] - low[k]) / cell).astype(np.int64) for k in range(2))
    picture = depth_map(points[:, :2], points[:, 2], low, cell, (int(row.max()) + 1, int(column.max()) + 1))
    front: Bools = points[:, 2] > picture[row, column] - behind
    return front
