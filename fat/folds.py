"""Folds: patches of skin that turn over together.

A triangle that turns over alone is a flaw of a coarse mesh. What lies side by side and turns over shows as a fold,
however small a share it is of all that moves.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Floats, Ints


def largest_fold(vertices: Floats, turned: Ints) -> float:
    """Size of the largest patch of triangles with common edges: the side of the square that has its area at rest.

    Parameters
    ----------
    vertices : (n, 3) at rest; the unit of the result.
    turned : (t, 3) the triangles that turn over.

    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 1, 0], [2, 2, 0]])
    >>> largest_fold(square, np.array([[0, 1, 2], [0, 2, 3], [2, 4, 5]], np.int32))
    1.0
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count = len(turned)
    if not count:
        return 0.0
    a, b, c = (vertices[turned[:, k]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2.0
    ends = np.sort(turned[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).astype(np.int64), axis=1)
    edge = ends[:, 0] * (int(ends.max()) + 1) + ends[:, 1]
    order = np.argsort(edge, kind="stable")
    same = np.flatnonzero(edge[order[1:]] == edge[order[:-1]])
    one, two = order[same] // 3, order[same + 1] // 3
    beside = coo_array((np.ones(len(one)), (one, two)), shape=(count, count))
    patch = connected_components(beside, directed=False)[1]
    return float(np.sqrt(np.bincount(patch, weights=areas).max()))


__all__ = ["largest_fold"]
