"""The skin of one face as a single surface: shapes joined, seams linked, distances measured along it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from fba.arrays import Bools, Floats, Ints
from fba.errors import LandmarkError
from fba.feature_points import FeaturePoints
from fba.scene import FaceScene

_LIP_AND_LID_LINES = (
    ("2.4", "2.6", "2.2", "2.7", "2.5"),
    ("2.4", "2.8", "2.3", "2.9", "2.5"),
    ("3.7", "3.1", "3.11"),
    ("3.7", "3.3", "3.11"),
    ("3.8", "3.2", "3.12"),
    ("3.8", "3.4", "3.12"),
)


@dataclass(frozen=True, eq=False)
class Surface:
    """Several shapes of a face as one triangle surface, in world coordinates and eye separations.

    Attributes
    ----------
    shapes : names of the shapes, in scene order.
    starts : (s+1,) first vertex of each shape in the joined arrays.
    vertices : (n, 3) float64, world coordinates, inside axes, divided by ES0.
    polygons : (indices, offsets) of all polygons in joined numbering.
    triangles : (t, 3) int32, their fan triangulation.
    links : (l, 2) int32, pairs of vertices at one place that belong together (seams of texture maps).
    points : feature point -> (joined vertices, weights); those that lie on these shapes.
    positions : feature point -> (3,) position of *every* point given, also those elsewhere or free.
    """

    shapes: tuple[str, ...]
    starts: Ints
    vertices: Floats
    polygons: tuple[Ints, Ints]
    triangles: Ints
    links: Ints
    points: Mapping[str, tuple[Ints, Floats]]
    positions: Mapping[str, Floats]

    @property
    def vertex_count(self) -> int:
        return len(self.vertices)

    @cached_property
    def edges(self) -> Ints:
        """Undirected polygon edges, each once, (e, 2)."""
        return polygon_edges(*self.polygons)

    @cached_property
    def normals(self) -> Floats:
        """(n, 3) unit vertex normals, equal on both sides of a seam."""
        return self.normals_of(self.vertices)

    def normals_of(self, vertices: Floats) -> Floats:
        """Unit vertex normals of the same triangles over other positions."""
        a, b, c = (vertices[self.triangles[:, k]] for k in range(3))
        cross = np.cross(b - a, c - a)
        normals = np.zeros_like(vertices)
        for axis in range(3):
            for corner in range(3):
                normals[:, axis] += np.bincount(self.triangles[:, corner], cross[:, axis], len(vertices))
        if len(self.links):
            normals = self.seam_mean @ normals
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        unit: Floats = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
        return unit

    @cached_property
    def places(self) -> Ints:
        """(n,) number of the place of each vertex; copies along a seam share one."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        n = self.vertex_count
        pairs = coo_array((np.ones(len(self.links)), (self.links[:, 0], self.links[:, 1])), shape=(n, n))
        found: Ints = connected_components(pairs, directed=False)[1]
        return found

    @cached_property
    def place_sums(self) -> Any:
        """(m, n) sparse: the sum over the vertices at each place."""
        from scipy.sparse import csr_array

        return csr_array((np.ones(self.vertex_count), (self.places, np.arange(self.vertex_count))))

    @cached_property
    def seam_mean(self) -> Any:
        """(n, n) sparse: the mean over the copies of a vertex along a seam; the identity elsewhere."""
        from scipy.sparse import diags_array

        sums = self.place_sums
        return sums.T @ (diags_array(1.0 / np.bincount(self.places)) @ sums)

    @cached_property
    def graph(self) -> Any:
        """(n, n) sparse symmetric graph for shortest paths: edges, unfolded diagonals, and seams of length ~0."""
        pairs, lengths = _unfolded_diagonals(self.vertices, self.triangles)
        edges = np.concatenate([self.edges, self.triangles[:, [0, 2]], pairs])
        direct = edges[: len(self.edges) + len(self.triangles)]
        straight = np.linalg.norm(self.vertices[direct[:, 0]] - self.vertices[direct[:, 1]], axis=1)
        return symmetric_graph(
            np.concatenate([edges, self.links]),
            np.concatenate([straight, lengths, np.full(len(self.links), 1e-9)]),
            self.vertex_count,
        )

    def components(self) -> Ints:
        """(n,) number of the connected component, seams closed."""
        return _components(*self.polygons, self.vertex_count, self.links)

    def distances(self, ids: Iterable[str], limit: float = np.inf, without: Bools | None = None) -> Floats:
        """Distance along the surface from each of these feature points, (k, n); inf where not reached.

        Parameters
        ----------
        limit : farther vertices stay inf, in eye separations.
        without : (n,) bool, vertices that no path may use.
        """
        from scipy.sparse import coo_array, csr_array
        from scipy.sparse.csgraph import dijkstra

        ids = list(ids)
        n = self.vertex_count
        graph = self.graph
        if without is not None:
            keep = coo_array((~without).astype(np.float64)[:, None])
            graph = graph.multiply(keep).multiply(keep.T).tocsr()
        # Each point is a row of its own below the graph's, with ways to the vertices that it lies between.
        ends, columns, lengths = [graph.indptr], [graph.indices], [graph.data]
        for i in ids:
            vertices, weights = self.points[i]
            near = vertices[weights > 1e-6]
            columns.append(near)
            lengths.append(np.linalg.norm(self.vertices[near] - self.positions[i], axis=1) + 1e-12)
            ends.append(ends[-1][-1:] + len(near))
        whole = n + len(ids)
        parts = np.concatenate(lengths), np.concatenate(columns), np.concatenate(ends)
        joined = csr_array(parts, shape=(whole, whole))
        found: Floats = dijkstra(joined, directed=True, indices=np.arange(n, whole), limit=limit)[:, :n]
        return found

    def point_matrix(self, ids: Sequence[str]) -> Any:
        """(k, n) sparse matrix that evaluates a vertex field at these feature points."""
        from scipy.sparse import csr_array

        parts = [self.points[i] for i in ids]
        rows = np.repeat(np.arange(len(parts)), [len(v) for v, _ in parts])
        columns = np.concatenate([v for v, _ in parts]) if parts else np.zeros(0, np.int32)
        weights = np.concatenate([w for _, w in parts]) if parts else np.zeros(0)
        return csr_array((weights, (rows, columns)), shape=(len(parts), self.vertex_count))

    def split(self, joined: Floats) -> dict[str, Floats]:
        """Take an (n, ...) array apart: shape name -> its rows."""
        return {s: joined[self.starts[k] : self.starts[k + 1]] for k, s in enumerate(self.shapes)}

    def join(self, per_shape: Mapping[str, Floats]) -> Floats:
        """Put (n_s, 3) offsets of shapes together; absent shapes count as zero."""
        out = np.zeros((self.vertex_count, 3))
        for k, name in enumerate(self.shapes):
            if name in per_shape:
                out[self.starts[k] : self.starts[k + 1]] = per_shape[name]
        return out


def polygon_edges(indices: Ints, offsets: Ints) -> Ints:
    """Undirected edges of polygons, each once, (e, 2) with ``a < b``."""
    return _counted_edges(indices, offsets)[0]


def _counted_edges(indices: Ints, offsets: Ints) -> tuple[Ints, Ints]:
    """Undirected edges of polygons, in order, and how many polygons each has."""
    following = np.arange(indices.size) + 1
    following[offsets[1:] - 1] = offsets[:-1]
    others = indices[following]
    n = int(indices.max(initial=-1)) + 1
    # One number for each pair: sorting rows costs ten times as much.
    keys, count = np.unique(
        np.minimum(indices, others).astype(np.int64) * n + np.maximum(indices, others), return_counts=True
    )
    return np.stack(np.divmod(keys, max(n, 1)), axis=1).astype(np.int32), count.astype(np.int32)


def symmetric_graph(pairs: Ints, lengths: Floats, n: int) -> Any:
    """Sparse symmetric graph of the shortest length for each pair."""
    from scipy.sparse import csr_array

    one, other = pairs[:, 0].astype(np.int64), pairs[:, 1].astype(np.int64)
    keys = np.minimum(one, other) * n + np.maximum(one, other)
    order = np.lexsort((lengths, keys))
    keys, lengths = keys[order], np.maximum(lengths[order], 1e-12)
    a, b = np.divmod(keys, n)
    first = np.ones(len(a), dtype=bool)
    first[1:] = keys[1:] != keys[:-1]
    first &= a != b
    a, b, lengths = a[first], b[first], lengths[first]
    return csr_array(
        (np.concatenate([lengths, lengths]), (np.concatenate([a, b]), np.concatenate([b, a]))), shape=(n, n)
    )


def _unfolded_diagonals(vertices: Floats, triangles: Ints) -> tuple[Ints, Floats]:
    """Length across each pair of neighbour triangles unfolded into a plane, where the segment crosses their edge."""
    a = triangles[:, [0, 1, 2]].T.ravel()
    b = triangles[:, [1, 2, 0]].T.ravel()
    apex = triangles[:, [2, 0, 1]].T.ravel()
    low, high = np.minimum(a, b).astype(np.int64), np.maximum(a, b).astype(np.int64)
    order = np.argsort(low * len(vertices) + high, kind="stable")
    low, high, apex = low[order], high[order], apex[order]
    twin = np.flatnonzero((low[1:] == low[:-1]) & (high[1:] == high[:-1]))
    p, q, c, d = vertices[low[twin]], vertices[high[twin]], vertices[apex[twin]], vertices[apex[twin + 1]]
    edge = q - p
    length = np.maximum(np.linalg.norm(edge, axis=1), 1e-12)
    along = edge / length[:, None]

    def flat(point: Floats) -> tuple[Floats, Floats]:
        x = np.einsum("ij,ij->i", point - p, along)
        return x, np.sqrt(np.maximum(np.einsum("ij,ij->i", point - p, point - p) - x * x, 0.0))

    (cx, cy), (dx, dy) = flat(c), flat(d)
    total = np.maximum(cy + dy, 1e-12)
    crossing = (cx * dy + dx * cy) / total
    good = (crossing > 0) & (crossing < length)
    pairs = np.stack([apex[twin], apex[twin + 1]], axis=1)[good]
    return pairs.astype(np.int32), np.hypot(cx - dx, total)[good]


def build_surface(scene: FaceScene, points: FeaturePoints, shapes: Sequence[str], es0: float) -> Surface:
    """Join shapes of a scene.

    Parameters
    ----------
    scene : inside axes.
    shapes : names of the shapes to join.
    es0 : eye separation in mesh units; the surface is divided by it.
    """
    meshes = [scene.shape(name).mesh for name in shapes]
    starts = np.concatenate([[0], np.cumsum([m.vertex_count for m in meshes])]).astype(np.int32)
    if not meshes or starts[-1] == 0:
        raise LandmarkError(f"'{scene.name}': no shape carries the feature points of the skin; check their shape names")
    vertices = np.concatenate([scene.world_vertices(name) for name in shapes]) / es0
    indices = np.concatenate([m.indices + starts[k] for k, m in enumerate(meshes)]).astype(np.int32)
    corner = np.concatenate([[0], np.cumsum([m.indices.size for m in meshes])])
    offsets = np.concatenate([m.offsets[:-1] + corner[k] for k, m in enumerate(meshes)] + [corner[-1:]])
    triangles = np.concatenate([m.triangles + starts[k] for k, m in enumerate(meshes)]).astype(np.int32)
    place = {name: int(starts[k]) for k, name in enumerate(shapes)}
    on = {
        key: (np.asarray(p.vertices, np.int32) + place[p.shape], np.asarray(p.weights, np.float64))
        for key, p in points.items()
        if p.shape in place
    }
    positions = {key: position / es0 for key, position in points.positions(scene).items()}
    links = _seams(vertices, indices, offsets.astype(np.int32), positions)
    return Surface(
        tuple(shapes), starts, vertices, (indices, offsets.astype(np.int32)), triangles, links, on, positions
    )


def _seams(vertices: Floats, indices: Ints, offsets: Ints, positions: Mapping[str, Floats]) -> Ints:
    """Seams of a skin. Touching lips and lids are no seam: they stay apart."""
    links = seam_links(vertices, indices, offsets)
    if not len(links):
        return links
    near = _distance_to_lines(vertices[links[:, 0]], positions) < 0.02
    component = _components(indices, offsets, len(vertices), links[:0])
    same = component[links[:, 0]] == component[links[:, 1]]
    kept: Ints = links[~(near & same)]
    return kept


def seam_links(vertices: Floats, indices: Ints, offsets: Ints, tolerance: float = 1e-6) -> Ints:
    """Pairs of border vertices at one place, (l, 2) int32."""
    from scipy.spatial import cKDTree

    edges, count = _counted_edges(indices, offsets)
    border = np.unique(edges[count == 1])
    if border.size == 0:
        return np.zeros((0, 2), np.int32)
    found = cKDTree(vertices[border]).query_pairs(tolerance, output_type="ndarray")
    links: Ints = border[found].reshape(-1, 2).astype(np.int32)
    return links


def _components(indices: Ints, offsets: Ints, n: int, links: Ints) -> Ints:
    """(n,) number of the component that polygons and links make of each vertex."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    first = np.concatenate([np.repeat(indices[offsets[:-1]], np.diff(offsets)), links[:, 0]])
    other = np.concatenate([indices, links[:, 1]])
    joined = coo_array((np.ones(len(first)), (first, other)), shape=(n, n))
    found: Ints = connected_components(joined, directed=False)[1]
    return found


def _distance_to_lines(places: Floats, positions: Mapping[str, Floats]) -> Floats:
    best = np.full(len(places), np.inf)
    for line in _LIP_AND_LID_LINES:
        for a, b in pairwise(line):
            if a not in positions or b not in positions:
                continue
            start, step = positions[a], positions[b] - positions[a]
            t = np.clip((places - start) @ step / max(float(step @ step), 1e-18), 0.0, 1.0)
            best = np.minimum(best, np.linalg.norm(places - start - t[:, None] * step, axis=1))
    return best
