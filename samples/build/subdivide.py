"""Catmull-Clark subdivision as a matrix, so that motions subdivide exactly as positions do."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fba.arrays import Floats
from fba.mesh import PolyMesh

if TYPE_CHECKING:
    from scipy.sparse import csr_array


def catmull_clark(mesh: PolyMesh, smooth: bool = True) -> tuple[PolyMesh, csr_array]:
    """Subdivide once; E. Catmull and J. Clark, 1978, with the usual curve rule on open borders.

    Parameters
    ----------
    smooth : False splits every polygon without moving anything, for strips whose corners are meant.

    Returns
    -------
    mesh : quads only; vertices: the old ones, then one for each edge, then one for each polygon.
    matrix : sparse (new, old); new values = matrix @ old values.
    """
    from scipy.sparse import coo_array, csr_array, diags_array, vstack

    n, m = mesh.vertex_count, mesh.face_count
    corner_face = np.repeat(np.arange(m), mesh.arities)
    face = coo_array((1.0 / mesh.arities[corner_face], (corner_face, mesh.indices)), shape=(m, n)).tocsr()
    following = np.arange(mesh.indices.size) + 1
    following[mesh.offsets[1:] - 1] = mesh.offsets[:-1]
    pairs = np.sort(np.stack([mesh.indices, mesh.indices[following]], axis=1), axis=1)
    edges, corner_edge = np.unique(pairs, axis=0, return_inverse=True)
    e = len(edges)
    uses = np.bincount(corner_edge, minlength=e)
    middle = coo_array((np.full(2 * e, 0.5), (np.repeat(np.arange(e), 2), edges.reshape(-1))), shape=(e, n)).tocsr()
    beside = coo_array((np.full(corner_edge.size, 0.5), (corner_edge, corner_face)), shape=(e, m)).tocsr()
    inner = (uses == 2).astype(np.float64) * smooth
    edge = diags_array(1.0 - 0.5 * inner) @ middle + diags_array(0.5 * inner) @ (beside @ face)
    old = _old_vertices(mesh, face, middle, edges, uses) if smooth else diags_array(np.ones(n))
    matrix = csr_array(vstack([old, edge, face]))
    previous = np.arange(mesh.indices.size) - 1
    previous[mesh.offsets[:-1]] = mesh.offsets[1:] - 1
    quads = np.stack([mesh.indices, n + corner_edge, n + e + corner_face, n + corner_edge[previous]], axis=1)
    vertices: Floats = matrix @ mesh.vertices
    return PolyMesh.from_faces(vertices, quads), matrix


def _old_vertices(
    mesh: PolyMesh, face: csr_array, middle: csr_array, edges: NDArray[np.int32], uses: NDArray[np.int64]
) -> csr_array:
    """(F + 2R + (k - 3) P) / k inside, (1, 6, 1) / 8 on the border."""
    from scipy.sparse import coo_array, diags_array

    n, e = mesh.vertex_count, len(edges)
    at_face = coo_array(
        (np.ones(mesh.indices.size), (mesh.indices, np.repeat(np.arange(mesh.face_count), mesh.arities))),
        shape=(n, mesh.face_count),
    ).tocsr()
    at_edge = coo_array((np.ones(2 * e), (edges.reshape(-1), np.repeat(np.arange(e), 2))), shape=(n, e)).tocsr()
    valence = np.maximum(np.bincount(edges.reshape(-1), minlength=n), 1).astype(np.float64)
    faces = np.maximum(np.bincount(mesh.indices, minlength=n), 1).astype(np.float64)
    border_edge = diags_array((uses == 1).astype(np.float64))
    border = (at_edge @ (uses == 1).astype(np.float64)) > 0
    inside = diags_array((~border).astype(np.float64))
    mean_face = diags_array(1.0 / faces) @ at_face @ face
    mean_edge = diags_array(1.0 / valence) @ at_edge @ middle
    smooth = diags_array(1.0 / valence) @ (mean_face + 2.0 * mean_edge) + diags_array((valence - 3.0) / valence)
    curve = 0.25 * (at_edge @ border_edge @ middle) + diags_array(np.full(n, 0.5))
    rule: csr_array = inside @ smooth + diags_array(border.astype(np.float64)) @ curve
    return rule
