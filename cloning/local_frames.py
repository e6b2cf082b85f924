"""A frame and a size at every vertex of a surface: what Expression Cloning measures motion in."""

from __future__ import annotations

import numpy as np

from cloning.surface import Surface
from fba.arrays import Floats, Ints


def frames_of(surface: Surface, vertices: Floats) -> Floats:
    """Frames of a surface over any positions of its vertices.

    The first axis is the normal, the second an edge (the same on every position) laid into the tangent plane, the
    third completes them.

    Returns
    -------
    (n, 3, 3), rows are unit axes; the world's axes where a vertex has no edge or normal.
    """
    first = _first_neighbours(surface)
    normal = surface.normals_of(vertices)
    edge = vertices[first] - vertices
    flat = edge - np.einsum("nd,nd->n", edge, normal)[:, None] * normal
    length = np.linalg.norm(flat, axis=1, keepdims=True)
    flat = np.divide(flat, length, out=np.zeros_like(flat), where=length > 1e-12)
    frames = np.stack([normal, flat, np.cross(normal, flat)], axis=1)
    frames[(length[:, 0] <= 1e-12) | ~normal.any(axis=1)] = np.eye(3)
    return frames


def sizes_in(surface: Surface, vertices: Floats, frames: Floats) -> Floats:
    """(n, 3) extents of the box around the polygons at each vertex, along the axes of its frame."""
    owners, others = _around(surface)
    local = np.einsum("nad,nd->na", frames[owners], vertices[others])
    starts = np.searchsorted(owners, np.arange(surface.vertex_count))
    alone = np.bincount(owners, minlength=surface.vertex_count) == 0
    starts = np.minimum(starts, max(len(owners) - 1, 0))
    sizes: Floats = np.maximum.reduceat(local, starts) - np.minimum.reduceat(local, starts)
    sizes[alone] = 0.0
    return sizes


def _first_neighbours(surface: Surface) -> Ints:
    """(n,) the neighbour of lowest number along an edge; a vertex without edges is its own."""
    edges = surface.edges
    first = np.arange(surface.vertex_count)
    owners, others = np.concatenate([edges, edges[:, ::-1]]).T
    order = np.lexsort((others, owners))
    owners, others = owners[order], others[order]
    ids, places = np.unique(owners, return_index=True)
    first[ids] = others[places]
    return first.astype(np.int32)


def _around(surface: Surface) -> tuple[Ints, Ints]:
    """Pairs (vertex, vertex of one of its polygons), itself included, sorted by the first."""
    from scipy.sparse import csr_array

    indices, offsets = surface.polygons
    m = len(offsets) - 1
    polygon = np.repeat(np.arange(m), np.diff(offsets))
    member = csr_array((np.ones(len(indices)), (indices, polygon)), shape=(surface.vertex_count, m))
    near = (member @ member.T).tocsr()
    return np.repeat(np.arange(surface.vertex_count), np.diff(near.indptr)), near.indices
