"""Lay an aligned target smoothly onto the source, so that neighbours find neighbours.

The closest point alone jumps where skin folds (the crease above an eye, the corners of the mouth). Here the way from
each vertex to its place is smoothed along the target's skin, and the place is looked for again from there.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from cloning.factors import factored
from cloning.locate import Places
from cloning.surface import Surface
from fba.arrays import Floats, Ints

ROUNDS = (0.10, 0.06, 0.03)
"""Smoothing lengths of the rounds, in eye separations."""

GIVEN = 100.0
"""How much more a feature point counts than a vertex: alignment has put it in its place already."""


def settle(
    surface: Surface,
    moved: Floats,
    fixed: Any,
    locate: Callable[[Floats], tuple[Places, Floats]],
    farthest: float,
    least_facing: float,
) -> tuple[Floats, Places]:
    """Move aligned vertices towards the source's skin.

    Parameters
    ----------
    surface : the target.
    moved : (n, 3) its vertices in the source's space.
    fixed : (k, n) sparse, evaluates a field at the feature points: they stay.
    locate : gives the places of (n, 3) points on the source and their positions.
    farthest, least_facing : worse places do not pull.

    Returns
    -------
    moved : (n, 3) settled vertices.
    places : their places on the source.
    """
    stiffness = _laplacian(moved, np.concatenate([surface.edges, surface.links]))
    places, goals = locate(moved)
    for length in ROUNDS:
        good = (places.distances <= farthest) & (places.facing >= least_facing)
        way = _smoothed(goals - moved, good, stiffness, fixed, length)
        moved = moved + way
        places, goals = locate(moved)
    return moved, places


def _smoothed(way: Floats, good: Any, stiffness: Any, fixed: Any, length: float) -> Floats:
    """Minimise good * |x - way|^2 + length^2 |grad x|^2 + GIVEN |x at the feature points|^2."""
    from scipy.sparse import diags_array

    weight = np.where(good, 1.0, 1e-3)
    held = GIVEN * (fixed.T @ fixed)
    solver = factored(diags_array(weight) + length**2 * stiffness + held)
    right = np.where(good, 1.0, 0.0)[:, None] * way
    solved: Floats = solver.solve(np.asfortranarray(right))
    return solved


def _laplacian(vertices: Floats, edges: Ints) -> Any:
    """Graph Laplacian with weights 1/(2 length^2): the sum over a vertex's edges is about its squared slope."""
    from scipy.sparse import coo_array, diags_array

    n = len(vertices)
    squared = np.sum((vertices[edges[:, 0]] - vertices[edges[:, 1]]) ** 2, axis=1)
    weight = 1.0 / np.maximum(squared, 1e-6)
    a, b = edges[:, 0], edges[:, 1]
    graph = coo_array(
        (np.concatenate([weight, weight]), (np.concatenate([a, b]), np.concatenate([b, a]))), shape=(n, n)
    ).tocsr()
    total = np.asarray(graph.sum(axis=1)).ravel()
    return (0.5 * (diags_array(total) - graph)).tocsr()
