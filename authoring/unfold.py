"""Spots of skin that a motion turned over are smoothed until they lie the right way again."""

from __future__ import annotations

from typing import Any

import numpy as np

from cloning.surface import Surface
from fba.arrays import Bools, Floats, Ints

UPRIGHT = 0.02
"""Cosine of the angle to its normal at rest at which a triangle counts as turned over."""

ROUNDS = 40
"""Most rounds of smoothing; what is still folded then is folded by more than a spot."""

STEP = 0.5
"""Share of the way to the mean of its neighbours that a vertex goes in one round."""


def unfold(skin: Surface, field: Floats) -> None:
    """Smooth a motion at folded spots, in place; the vertices of feature points keep theirs.

    Parameters
    ----------
    field : (n, 3) motion of the joined skin, in eye separations.
    """
    turned = _turned_over(skin, field)
    if not len(turned):
        return
    mean, same = _neighbours(skin)
    fixed = np.zeros(skin.vertex_count)
    for vertices, weights in skin.points.values():
        fixed[vertices[weights > 0.0]] = 1.0
    held = same.T @ (same @ fixed) > 0.0
    for _ in range(ROUNDS):
        near = _around(mean, turned) & ~held
        field[near] += STEP * ((mean @ field)[near] - field[near])
        turned = _turned_over(skin, field)
        if not len(turned):
            return


def _turned_over(skin: Surface, field: Floats) -> Ints:
    """Vertices of the triangles that are turned over."""
    moving = np.any(field != 0.0, axis=1)
    triangles = skin.triangles[moving[skin.triangles].any(axis=1)]
    before, after = (_normals(places, triangles) for places in (skin.vertices, skin.vertices + field))
    solid = np.einsum("ij,ij->i", before, before) > 0.0
    found: Ints = np.unique(triangles[solid & (np.einsum("ij,ij->i", before, after) < UPRIGHT)])
    return found


def _normals(places: Floats, triangles: Ints) -> Floats:
    a, b, c = (places[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    unit: Floats = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return unit


def _around(mean: Any, vertices: Ints) -> Bools:
    """(n,) these vertices and their neighbours."""
    chosen = np.zeros(mean.shape[0])
    chosen[vertices] = 1.0
    around: Bools = (chosen + mean @ chosen) > 0.0
    return around


def _neighbours(skin: Surface) -> tuple[Any, Any]:
    """(n, n) sparse mean over the neighbours of each vertex, and (m, n) sums over its copies along seams."""
    from scipy.sparse import coo_array, csr_array, diags_array

    same = skin.place_sums
    count, n = same.shape
    edges = coo_array((np.ones(len(skin.edges)), (skin.edges[:, 0], skin.edges[:, 1])), shape=(n, n))
    joined = (same @ (edges + edges.T) @ same.T).tocoo()
    apart = joined.row != joined.col
    graph = csr_array((np.ones(int(apart.sum())), (joined.row[apart], joined.col[apart])), shape=(count, count))
    each = diags_array(1.0 / np.maximum(np.asarray(graph.sum(axis=1)).ravel(), 1.0)) @ graph
    copies = diags_array(1.0 / np.bincount(skin.places)) @ same
    return same.T @ each @ copies, same
