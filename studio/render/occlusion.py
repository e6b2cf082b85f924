"""How much light reaches each vertex of the neutral face: dark nostrils, lid folds and insides of the mouth.

Depth pictures are taken from many directions; a vertex is lit from those in which nothing lies before it. The
result belongs to the surface and moves with it: the inside of a mouth stays dark when it opens.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from fba.arrays import Floats, Ints
from studio.render.software import EMPTY, depth_keys

DIRECTIONS = 48
GRID = 160
SMOOTHING = 1
BIAS = 0.03
"""Depth, in radii of the region, below which a surface does not shade itself."""


def ambient_occlusion(
    meshes: Sequence[tuple[Floats, Ints]], normals: Sequence[Floats], center: Floats, radius: float
) -> list[Floats]:
    """Measure the open part of the sky above each vertex.

    Parameters
    ----------
    meshes : (vertices (n, 3), triangles (t, 3)) of everything that casts shade.
    normals : (n, 3) for each mesh.
    center, radius : the region of interest; vertices outside count as open.

    Returns
    -------
    For each mesh (n,) in 0..1, weighted by the cosine to the normal.
    """
    counts = np.cumsum([0, *(len(v) for v, _ in meshes)])
    vertices = np.concatenate([v for v, _ in meshes]) - center
    triangles = np.concatenate([t + start for (_, t), start in zip(meshes, counts[:-1], strict=True)])
    near = (np.einsum("ij,ij->i", vertices, vertices) < (1.4 * radius) ** 2)[triangles].all(axis=1)
    triangles = triangles[near]
    normal = np.concatenate(list(normals))
    lit, total = np.zeros(len(vertices)), np.zeros(len(vertices))
    for direction in sphere_directions(DIRECTIONS):
        weight = np.maximum(normal @ direction, 0.0)
        total += weight
        lit += weight * _visible(vertices, triangles, direction, radius)
    open_sky = np.divide(lit, total, out=np.ones_like(lit), where=total > 0)
    every = np.concatenate([t + start for (_, t), start in zip(meshes, counts[:-1], strict=True)])
    open_sky = _smoothed(open_sky, every)
    return [open_sky[a:b] for a, b in pairwise(counts)]


def _smoothed(values: Floats, triangles: Ints) -> Floats:
    """Average each vertex with its neighbours, so that single vertices do not stand out."""
    corners = triangles.T.ravel()
    degree = np.bincount(corners, minlength=len(values))
    for _ in range(SMOOTHING):
        sums = np.bincount(corners, np.tile(values[triangles].sum(axis=1), 3), len(values))
        values = np.where(degree > 0, sums / np.maximum(3 * degree, 1), values)
    return values


def _visible(vertices: Floats, triangles: Ints, direction: Floats, radius: float) -> Floats:
    across = np.cross(direction, [0.0, 0.0, 1.0] if abs(direction[2]) < 0.9 else [1.0, 0.0, 0.0])
    across /= np.linalg.norm(across)
    up = np.cross(direction, across)
    place = np.stack([vertices @ across, vertices @ up, -(vertices @ direction)], axis=1) / radius
    place[:, :2] = (place[:, :2] + 1.0) * (0.5 * GRID)
    depth = np.clip(place[:, 2] / 2.0, -1.0, 1.0)
    corners = np.concatenate([place[:, :2], depth[:, None]], axis=1)[triangles]
    keys = depth_keys(corners, GRID, GRID)
    column, row = np.floor(place[:, 0]).astype(np.int64), np.floor(place[:, 1]).astype(np.int64)
    inside = (column >= 0) & (column < GRID) & (row >= 0) & (row < GRID)
    key = keys[np.where(inside, row * GRID + column, 0)]
    nearest = (key >> 32).astype(np.int32).view(np.float32).astype(np.float64) - 2.0
    hidden = inside & (key != EMPTY) & (nearest < depth - BIAS / 2.0)
    return np.where(hidden, 0.0, 1.0)


def sphere_directions(count: int) -> Floats:
    """(count, 3) unit vectors spread evenly over the sphere (a golden spiral), always the same."""
    k = np.arange(count) + 0.5
    z = 1.0 - 2.0 * k / count
    angle = np.pi * (1.0 + 5.0**0.5) * k
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)
