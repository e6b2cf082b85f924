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

SHORT = 0.005
"""Eye separations (.3 mm) added to an edge's length before and after: how much a tiny edge stretches shows nowhere."""


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


def angles(vertices: Floats, bends: Ints) -> Floats:
    """By how many radians the second triangle of each hinge is turned out of the first one's plane, (h,)."""
    a, b, c, d = (vertices[bends[:, k]] for k in range(4))
    along = b - a
    one, two = _cross(along, c - a), _cross(d - a, along)
    length = np.maximum(np.sqrt(np.einsum("ij,ij->i", along, along)), 1e-300)
    sine = np.einsum("ij,ij->i", _cross(one, two), along) / length
    found: Floats = np.arctan2(sine, np.einsum("ij,ij->i", one, two))
    return found


def bending(before: Floats, after: Floats) -> Floats:
    """By how many degrees the angle between the two triangles of each hinge changes (h,), 0 to 180.

    Parameters
    ----------
    before, after : (h,) see `angles`. Triangles of no area do not bend.
    """
    change = np.abs(after - before)
    degrees: Floats = np.degrees(np.minimum(change, 2.0 * np.pi - change))
    return degrees


def reach(vertices: Floats, bends: Ints) -> Floats:
    """How far the skin goes on either side of each hinge (h,): a third of both triangles' height.

    A bend by one angle is as sharp as this is short: the fold of a paper, or a ball's facets.
    """
    a, b, c, d = (vertices[bends[:, k]] for k in range(4))
    along = b - a
    area = np.linalg.norm(_cross(along, c - a), axis=1) + np.linalg.norm(_cross(d - a, along), axis=1)
    width: Floats = area / 3.0 / np.maximum(np.linalg.norm(along, axis=1), 1e-300)
    return width


def stretching(before: Floats, after: Floats) -> Floats:
    """How much longer or shorter edges get (e,): the size of log(after / before), SHORT added to both lengths.

    >>> stretching(np.array([0.195]), np.array([0.395])).round(3).tolist()
    [0.693]
    """
    ratio: Floats = np.abs(np.log((after + SHORT) / (before + SHORT)))
    return ratio


def _cross(a: Floats, b: Floats) -> Floats:
    """Like `numpy.cross`, several times faster."""
    x, y, z = a.T
    u, v, w = b.T
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=1)


__all__ = ["SHORT", "SLACK", "angles", "bending", "hinges", "jumps", "reach", "stretching"]
