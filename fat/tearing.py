"""Does skin tear? How abruptly a motion changes from one end of an edge to the other, and how sharply it bends.

Skin cannot jump: of two places close together one cannot stay while the other goes. Beside the length of an edge this
also sees one side slide along the other. Sources have steep places of their own (lids, corners of the mouth), so both
measures are read beside the source's.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Floats, Ints

SLACK = 0.02
"""Eye separations (1.2 mm) added to the length of an edge: a jump over less than that is a jump, however short."""

OUTLIERS = 99.9
"""Percentile of the edges that is read; a face has ten thousands of edges, so some ten may be worse."""


def jumps(vertices: Floats, edges: Ints, offsets: Floats) -> Floats:
    """How steep a motion is along each edge (e,): difference of the ends' offsets over the edge's length.

    Parameters
    ----------
    vertices, offsets : (n, 3) in eye separations. edges : (e, 2).

    >>> line = np.array([[0.0, 0, 0], [0.98, 0, 0]])
    >>> jumps(line, np.array([[0, 1]], np.int32), np.array([[0.0, 0, 0], [0, 0.5, 0]]))
    array([0.5])
    """
    a, b = edges[:, 0], edges[:, 1]
    length = np.linalg.norm(vertices[a] - vertices[b], axis=1)
    steep: Floats = np.linalg.norm(offsets[a] - offsets[b], axis=1) / (length + SLACK)
    return steep


def hinges(triangles: Ints) -> Ints:
    """Pairs of triangles with a common edge, (h, 4): the edge's ends, then the corners across it on either side.

    The first triangle runs along the edge forwards. Edges with one triangle, or with more than two, are no hinges.

    >>> hinges(np.array([[0, 1, 2], [1, 0, 3]], np.int32))
    array([[0, 1, 2, 3]], dtype=int32)
    """
    corners = triangles[:, [[0, 1, 2], [1, 2, 0], [2, 0, 1]]].reshape(-1, 3).astype(np.int64)
    low, high = corners[:, :2].min(axis=1), corners[:, :2].max(axis=1)
    key = low * (int(triangles.max(initial=0)) + 1) + high
    order = np.argsort(key, kind="stable")
    key = key[order]
    new = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]])) if len(key) else np.zeros(0, np.intp)
    count = np.diff(np.concatenate([new, [len(key)]]))
    first, second = order[new[count == 2]], order[new[count == 2] + 1]
    against = corners[first, 0] == corners[second, 1]
    first, second = first[against], second[against]
    found: Ints = np.column_stack([corners[first], corners[second, 2]]).astype(np.int32)
    return found


def bending(vertices: Floats, bends: Ints, offsets: Floats) -> Floats:
    """By how many degrees a motion changes the angle between the two triangles of each hinge (h,), 0 to 180.

    Parameters
    ----------
    vertices, offsets : (n, 3). bends : (h, 4), see `hinges`. Triangles of no area do not bend.
    """
    change = np.abs(_angles(vertices + offsets, bends) - _angles(vertices, bends))
    change = np.minimum(change, 2.0 * np.pi - change)
    degrees: Floats = np.degrees(change)
    return degrees


def _angles(vertices: Floats, bends: Ints) -> Floats:
    """Angle (h,) in radians by which the second triangle is turned out of the first one's plane."""
    a, b, c, d = (vertices[bends[:, k]] for k in range(4))
    along = b - a
    one, two = np.cross(along, c - a), np.cross(d - a, along)
    length = np.maximum(np.linalg.norm(along, axis=1), 1e-300)
    sine = np.einsum("ij,ij->i", np.cross(one, two), along) / length
    angles: Floats = np.arctan2(sine, np.einsum("ij,ij->i", one, two))
    return angles


__all__ = ["OUTLIERS", "SLACK", "bending", "hinges", "jumps"]
