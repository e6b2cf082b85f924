"""How a mesh bends: its Laplacian with cotangent weights."""

from __future__ import annotations

from typing import Any

import numpy as np

from fba.arrays import Floats, Ints


def all_fans(indices: Ints, offsets: Ints) -> tuple[Ints, Floats]:
    """Triangles (t, 3) of all fans of all polygons, and the share (t,) with which each counts.

    A polygon bends as the mean of its fans from every corner, so that mirrored polygons bend alike.
    """
    arity = np.diff(offsets)
    triangles, shares = [], []
    for k in np.unique(arity):
        polygons = indices[offsets[:-1][arity == k][:, None] + np.arange(k)]
        if k == 3:
            triangles.append(polygons)
            shares.append(np.ones(len(polygons)))
            continue
        for start in range(k):
            turned = np.roll(polygons, -start, axis=1)
            for step in range(1, k - 1):
                triangles.append(turned[:, [0, step, step + 1]])
                shares.append(np.full(len(polygons), 1.0 / k))
    return np.concatenate(triangles), np.concatenate(shares)


def cotangents(
    places: Floats, share: Floats, corners: Ints, count: int, steepest: float = np.inf
) -> tuple[Any, Floats]:
    """The sums of cotangents (k, k) opposite to each edge, sparse and symmetric, and the area (k,) of each place.

    Parameters
    ----------
    places : (t, 3, 3) corners of triangles. share : (t,) with which each counts. corners : (t, 3) their numbers.
    count : of places.
    steepest : largest cotangent of a corner.
    """
    from scipy.sparse import coo_array

    area = np.zeros(count)
    rows, columns, values = [], [], []
    for k in range(3):
        apex, a, b = (places[:, (k + s) % 3] for s in range(3))
        u, v = a - apex, b - apex
        along = (u * v).sum(axis=1)
        cross = np.sqrt(np.maximum((u * u).sum(axis=1) * (v * v).sum(axis=1) - along**2, 0.0))
        cotangent = along / np.maximum(cross, 1e-12)
        rows.append(corners[:, (k + 1) % 3])
        columns.append(corners[:, (k + 2) % 3])
        values.append(0.5 * share * np.clip(cotangent, -steepest, steepest))
        area += np.bincount(corners[:, k], share * cross / 6.0, count)
    edges = coo_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(count, count))
    return (edges + edges.T).tocsr(), area


def laplacian(weights: Any) -> Any:
    """(k, k) sparse, positive semidefinite, from the weights of edges: none negative."""
    from scipy.sparse import diags_array

    return diags_array(np.asarray(weights.sum(axis=1)).ravel()) - weights
