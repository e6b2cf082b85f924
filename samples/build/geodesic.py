"""Distances along a mesh, and the smooth step."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fba.arrays import Floats
from fba.feature_points import FeaturePoint
from fba.mesh import PolyMesh


def distances(mesh: PolyMesh, points: list[FeaturePoint], limit: float = np.inf) -> Floats:
    """Shortest paths along edges and quad diagonals from each of k points to all vertices, (k, n)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    a, b = _links(mesh)
    length = np.linalg.norm(mesh.vertices[a] - mesh.vertices[b], axis=1)
    n = mesh.vertex_count
    sources: list[tuple[int, int, float]] = []
    for row, point in enumerate(points):
        here = np.asarray(point.weights) @ mesh.vertices[list(point.vertices)]
        for v in point.vertices:
            sources.append((n + row, v, max(float(np.linalg.norm(mesh.vertices[v] - here)), 1e-9)))
    s, t, w = (np.array(c) for c in zip(*sources, strict=True))
    size = n + len(points)
    tail, head = np.concatenate([a, s.astype(np.int64)]), np.concatenate([b, t.astype(np.int64)])
    graph = coo_array((np.concatenate([length, w]), (tail, head)), shape=(size, size)).tocsr()
    found: Floats = dijkstra(graph, directed=True, indices=np.arange(n, size), limit=limit)[:, :n]
    return found


def smoothstep(value: Floats) -> Floats:
    """0 below 0, 1 above 1, with level ends between."""
    t = np.clip(value, 0.0, 1.0)
    smooth: Floats = t * t * (3.0 - 2.0 * t)
    return smooth


def _links(mesh: PolyMesh) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Both directions of every edge, and of both diagonals of every quad."""
    edges = mesh.edges.astype(np.int64)
    quads = mesh.indices[(mesh.offsets[:-1][mesh.arities == 4])[:, None] + np.arange(4)].astype(np.int64)
    pairs = np.vstack([edges, quads[:, [0, 2]], quads[:, [1, 3]]])
    return np.concatenate([pairs[:, 0], pairs[:, 1]]), np.concatenate([pairs[:, 1], pairs[:, 0]])
