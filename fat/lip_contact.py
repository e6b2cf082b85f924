"""How deep the lips sink into each other."""

from __future__ import annotations

import numpy as np

from fba.arrays import Floats, Ints

NEAR = 0.5
"""MNS; lips this far apart or more do not touch, and what is deeper is the other side of the mouth."""


def lip_depth(places: Floats, normals: Floats, upper: Ints, lower: Ints, mns0: float) -> tuple[Floats, Ints]:
    """How deep each lip vertex is below the other lip's skin.

    Parameters
    ----------
    places, normals : (n, 3) positions in a motion and the outward unit normals there.
    upper, lower : (u,), (l,) the vertices of the lips.
    mns0 : the mouth-nose distance in the units of `places`.

    Returns
    -------
    depths : (u + l,) in MNS; 0 outside.
    vertices : (u + l,) whose they are.
    """
    from scipy.spatial import cKDTree

    depths, whose = [np.zeros(0)], [np.zeros(0, dtype=np.int32)]
    for mine, other in ((upper, lower), (lower, upper)):
        if not len(mine) or not len(other):
            continue
        away, near = cKDTree(places[other]).query(places[mine], distance_upper_bound=NEAR * mns0)
        found = np.isfinite(away)
        nearest = other[np.asarray(near)[found]]
        height = np.einsum("ij,ij->i", places[mine[found]] - places[nearest], normals[nearest])
        depth = np.zeros(len(mine))
        depth[found] = np.maximum(-height, 0.0) / mns0
        depths.append(depth)
        whose.append(mine)
    return np.concatenate(depths), np.concatenate(whose)


__all__ = ["NEAR", "lip_depth"]
