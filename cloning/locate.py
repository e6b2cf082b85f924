"""Find the place on a surface that belongs to a point: near, facing the same way, and of a label that fits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cloning.labels import OPPOSITE
from fba.arrays import Bools, Floats, Ints

NORMAL_WEIGHT = 0.12
"""Eye separations that a normal turned by 60 degrees counts as, when triangles are ranked."""

CANDIDATES = 12


@dataclass(frozen=True, eq=False)
class Places:
    """Where points lie on a triangle surface.

    Attributes
    ----------
    triangles : (n,) index of the triangle; -1 where there is none.
    weights : (n, 3) barycentric coordinates.
    distances : (n,) distance from the point to its place.
    facing : (n,) cosine between the point's normal and the surface's.
    """

    triangles: Ints
    weights: Floats
    distances: Floats
    facing: Floats


def closest(
    points: Floats,
    normals: Floats,
    labels: Ints,
    vertices: Floats,
    vertex_normals: Floats,
    triangles: Ints,
    vertex_labels: Ints,
    usable: Bools | None = None,
) -> Places:
    """Find the best fitting place of each point on a surface.

    Parameters
    ----------
    points, normals : (n, 3), unit normals.
    labels : (n,) labels of the points (see `cloning.labels`).
    vertices, vertex_normals, triangles, vertex_labels : the surface.
    usable : (t,) bool, triangles that may be chosen; None = all.
    """
    n = len(points)
    found = Places(np.full(n, -1, np.int32), np.zeros((n, 3)), np.full(n, np.inf), np.full(n, -1.0))
    corner_labels = vertex_labels[triangles]
    for number in np.unique(labels):
        mask = np.ones(len(triangles), bool) if usable is None else usable.copy()
        if number and OPPOSITE[number] >= 0:
            mask &= ~np.any(corner_labels == OPPOSITE[number], axis=1)
        here = np.flatnonzero(labels == number).astype(np.int32)
        if mask.any():
            _search(
                points, normals, here, vertices, vertex_normals, triangles, np.flatnonzero(mask).astype(np.int32), found
            )
    return found


def _search(
    points: Floats,
    normals: Floats,
    here: Ints,
    vertices: Floats,
    vertex_normals: Floats,
    triangles: Ints,
    some: Ints,
    found: Places,
) -> None:
    from scipy.spatial import cKDTree

    chosen = triangles[some]
    centers = vertices[chosen].mean(axis=1)
    facing = vertex_normals[chosen].mean(axis=1)
    tree = cKDTree(np.concatenate([centers, NORMAL_WEIGHT * facing], axis=1))
    query = np.concatenate([points[here], NORMAL_WEIGHT * normals[here]], axis=1)
    k = min(CANDIDATES, len(some))
    near = tree.query(query, k=k)[1].reshape(len(here), k)
    corners = vertices[chosen[near]]
    weights, distances = closest_on_triangles(points[here][:, None], corners)
    turned = np.einsum("nkc,nkcd->nkd", weights, vertex_normals[chosen[near]])
    length = np.maximum(np.linalg.norm(turned, axis=2), 1e-12)
    cosine = np.einsum("nkd,nd->nk", turned, normals[here]) / length
    score = distances**2 + 2.0 * NORMAL_WEIGHT**2 * np.maximum(1.0 - cosine, 0.0)
    best = np.argmin(score, axis=1)
    rows = np.arange(len(here))
    found.triangles[here] = some[near[rows, best]]
    found.weights[here] = weights[rows, best]
    found.distances[here] = distances[rows, best]
    found.facing[here] = cosine[rows, best]


def closest_on_triangles(points: Floats, corners: Floats) -> tuple[Floats, Floats]:
    """Closest point on each triangle.

    Parameters
    ----------
    points : (..., 3), broadcast against the triangles.
    corners : (..., 3, 3).

    Returns
    -------
    weights : (..., 3) barycentric coordinates, all >= 0.
    distances : (...).
    """
    a, b, c = corners[..., 0, :], corners[..., 1, :], corners[..., 2, :]
    ab, ac, ap = b - a, c - a, points - a
    d00, d01, d11 = (np.einsum("...i,...i->...", x, y) for x, y in ((ab, ab), (ab, ac), (ac, ac)))
    d20, d21 = np.einsum("...i,...i->...", ap, ab), np.einsum("...i,...i->...", ap, ac)
    app = np.einsum("...i,...i->...", ap, ap)

    def squared(v: Floats, w: Floats) -> Floats:
        found: Floats = app - 2 * (v * d20 + w * d21) + v * v * d00 + 2 * v * w * d01 + w * w * d11
        return found

    det = np.maximum(d00 * d11 - d01 * d01, 1e-30)
    v, w = (d11 * d20 - d01 * d21) / det, (d00 * d21 - d01 * d20) / det
    best = np.where((v >= 0) & (w >= 0) & (v + w <= 1), squared(v, w), np.inf)
    nothing = np.zeros_like(v)
    on_ab = np.clip(d20 / np.maximum(d00, 1e-30), 0, 1)
    on_ac = np.clip(d21 / np.maximum(d11, 1e-30), 0, 1)
    on_bc = np.clip((d21 - d20 - d01 + d00) / np.maximum(d00 - 2 * d01 + d11, 1e-30), 0, 1)
    for v_edge, w_edge in ((on_ab, nothing), (nothing, on_ac), (1 - on_bc, on_bc)):
        away = squared(v_edge, w_edge)
        nearer = away < best
        best, v, w = np.where(nearer, away, best), np.where(nearer, v_edge, v), np.where(nearer, w_edge, w)
    return np.stack([1 - v - w, v, w], axis=-1), np.sqrt(np.maximum(best, 0.0))
