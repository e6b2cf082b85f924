"""Smooth upsampling of a coarse source: one step of Catmull-Clark subdivision that keeps the given values.

Subdivision is linear in the vertices, so the same sparse matrix refines positions and motions. The vertex values
are first raised by the inverse of the scheme's smoothing (two terms of its series), so that the refined field
passes close to the source's own values instead of shrinking them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fba.arrays import Floats, Ints


@dataclass(frozen=True, eq=False)
class Refinement:
    """Subdivision as matrices.

    Attributes
    ----------
    matrix : (n', n) sparse; new values = matrix @ old values. Vertices first, then edges, then faces.
    parents : (n', n) sparse, the vertices that a new one directly comes from: where all of them rest, it rests.
    polygons : (indices, offsets) of the new quadrangles.
    """

    matrix: Any
    parents: Any
    polygons: tuple[Ints, Ints]

    def apply(self, values: Floats) -> Floats:
        """Refine (n, m) values; exactly 0 where everything around is 0."""
        moving = np.abs(self.parents) @ np.abs(values)
        refined: Floats = self.matrix @ values
        refined[moving == 0.0] = 0.0
        return refined


def refine(indices: Ints, offsets: Ints, n: int) -> Refinement:
    """Catmull-Clark subdivision of polygons of any arity; borders stay on their own curve.

    Parameters
    ----------
    indices, offsets : polygons as in PolyMesh.
    n : number of vertices.
    """
    from scipy.sparse import csr_array, diags_array, eye_array, vstack

    m, k = len(offsets) - 1, len(indices)
    arity = np.diff(offsets)
    face_of = np.repeat(np.arange(m, dtype=np.int32), arity)
    following = np.arange(k) + 1
    following[offsets[1:] - 1] = offsets[:-1]
    pairs = np.sort(np.stack([indices, indices[following]], axis=1), axis=1)
    edges, edge_of, count = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    edge_of = edge_of.ravel()
    e = len(edges)
    face_points = csr_array((1.0 / arity[face_of], (face_of, indices)), shape=(m, n))
    middles = csr_array((np.full(2 * e, 0.5), (np.repeat(np.arange(e), 2), edges.ravel())), shape=(e, n))
    inner = count == 2
    edge_faces = csr_array((np.full(k, 0.5), (edge_of, face_of)), shape=(e, m))
    smooth = 0.5 * middles + 0.5 * (edge_faces @ face_points)
    edge_points = diags_array(inner.astype(float)) @ smooth + diags_array((~inner).astype(float)) @ middles
    vertices = _vertex_rule(indices, edges, inner, face_of, face_points, middles, n)
    difference = eye_array(n) - vertices
    raised = eye_array(n) + difference + difference @ difference
    plain = vstack([vertices, edge_points, face_points], format="csr")
    parents = vstack([eye_array(n, format="csr"), middles, face_points], format="csr")
    previous = np.empty(k, dtype=np.int64)
    previous[following] = np.arange(k)
    corners = np.stack([indices, n + edge_of, n + e + face_of, n + edge_of[previous]], axis=1).astype(np.int32)
    return Refinement((plain @ raised).tocsr(), parents, (corners.ravel(), np.arange(k + 1, dtype=np.int32) * 4))


def _vertex_rule(indices: Ints, edges: Ints, inner: Any, face_of: Ints, face_points: Any, middles: Any, n: int) -> Any:
    """Where the old vertices go, as a sparse matrix (n, n)."""
    from scipy.sparse import csr_array, diags_array, eye_array

    e = len(edges)
    ends = edges.ravel()
    edge_ids = np.repeat(np.arange(e), 2)
    valence = np.bincount(ends, minlength=n)
    faces = np.bincount(indices, minlength=n)
    border_ids = np.flatnonzero(~inner)
    border = np.bincount(edges[border_ids].ravel(), minlength=n)
    regular = (border == 0) & (valence >= 3) & (faces == valence)
    to_faces = csr_array((1.0 / faces[indices], (indices, face_of)), shape=(n, face_points.shape[0]))
    to_edges = csr_array((1.0 / valence[ends], (ends, edge_ids)), shape=(n, e))
    v = np.maximum(valence, 1)[:, None].astype(float)
    inside = (to_faces @ face_points) / v + (to_edges @ middles) * (2.0 / v) + diags_array((v[:, 0] - 3) / v[:, 0])
    some = edges[border_ids].ravel()
    to_border = csr_array((np.full(len(some), 0.25), (some, np.repeat(border_ids, 2))), shape=(n, e))
    along = to_border @ middles + 0.5 * eye_array(n)
    curve = (border == 2) & (valence > 2)
    rest = ~(regular | curve)
    return (
        diags_array(regular.astype(float)) @ inside
        + diags_array(curve.astype(float)) @ along
        + diags_array(rest.astype(float))
    ).tocsr()
