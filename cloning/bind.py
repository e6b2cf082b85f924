"""Meshes that ride on the skin: lashes, brows, tear lines, hair roots."""

from __future__ import annotations

from typing import Any

import numpy as np

from cloning.fill import HarmonicFill
from cloning.locate import closest_on_triangles
from cloning.surface import Surface, polygon_edges
from fba.arrays import Bools, Floats, Ints

NEAR = 0.06
"""A piece rides on the skin where part of it is nearer than this, in eye separations."""

ROOT = 0.015
"""How much farther than its nearest vertex a vertex may be to count as attached itself, in eye separations."""

NOTHING: Bools = np.zeros(0, dtype=bool)


class Binding:
    """Binds a mesh to the skin below it, piece by piece.

    Vertices close to the skin take its motion; the rest of each piece continues it smoothly. Pieces that do not
    touch the skin rest (they still turn with the head), and so do those that must not bend.
    """

    def __init__(
        self,
        vertices: Floats,
        indices: Ints,
        offsets: Ints,
        skin: Surface,
        resting: Bools = NOTHING,
        lying: Bools = NOTHING,
    ) -> None:
        """Find the attachment.

        Parameters
        ----------
        vertices : (n, 3) world coordinates, in eye separations.
        indices, offsets : its polygons.
        resting : (n,) what rests though it may touch the skin; () = nothing.
        lying : (n,) what is attached all over, not only where it is nearest; () = nothing.
        """
        from scipy.sparse import coo_array, csr_array
        from scipy.sparse.csgraph import connected_components

        n = len(vertices)
        triangles, weights, distances = nearest_on(vertices, skin.vertices, skin.triangles)
        edges = polygon_edges(indices, offsets) if indices.size else np.zeros((0, 2), np.int32)
        graph = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(n, n))
        count, piece = connected_components(graph, directed=False)
        nearest = np.full(count, np.inf)
        np.minimum.at(nearest, piece, distances)
        if len(resting):
            nearest[piece[resting]] = np.inf
        root = (nearest[piece] < NEAR) & (
            distances <= nearest[piece] + (np.where(lying, NEAR, ROOT) if len(lying) else ROOT)
        )
        rows = np.flatnonzero(root)
        self.matrix: Any = csr_array(
            (weights[rows].ravel(), (np.repeat(rows, 3), skin.triangles[triangles[rows]].ravel())),
            shape=(n, skin.vertex_count),
        )
        self._fill = HarmonicFill(vertices, edges, ~root)

    def apply(self, skin_motion: Floats) -> Floats:
        """(n_skin, K, 3) offsets of the skin to (n, K, 3) offsets of the mesh."""
        out: Floats = self.matrix @ skin_motion.reshape(len(skin_motion), -1)
        self._fill.apply(out)
        return out.reshape(len(out), skin_motion.shape[1], 3)


def nearest_on(points: Floats, vertices: Floats, triangles: Ints) -> tuple[Ints, Floats, Floats]:
    """Nearest triangle, barycentric weights and distance of each point, among the 16 triangles of nearest centre."""
    from scipy.spatial import cKDTree

    k = min(16, len(triangles))
    near = cKDTree(vertices[triangles].mean(axis=1)).query(points, k=k)[1].reshape(len(points), k)
    weights, distances = closest_on_triangles(points[:, None], vertices[triangles[near]])
    best = np.argmin(distances, axis=1)
    rows = np.arange(len(points))
    return near[rows, best], weights[rows, best], distances[rows, best]
