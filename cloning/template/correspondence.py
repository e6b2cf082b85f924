"""Where each vertex of a target lies on the template: the map that carries every motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cloning.surface import Surface
from cloning.template.closest import TriangleSearch
from fba.arrays import Bools, Floats, Ints

FARTHEST = 0.10
"""A vertex that is farther from the fitted template than this, in eye separations, has no partner."""

LEAST_FACING = 0.25
"""A vertex has no partner where the normals differ by more than about 75 degrees."""


@dataclass(frozen=True, eq=False)
class Correspondence:
    """The place of each of a target's m vertices on a template of n vertices.

    Attributes
    ----------
    triangles : (m,) index of the template's triangle; -1 where there is none.
    corners : (m, 3) its vertices.
    weights : (m, 3) barycentric coordinates.
    residual : (m,) distance from the fitted template, eye separations; inf where nothing fits.
    normal_agreement : (m,) cosine between the normals.
    valid : (m,) bool, False where a vertex has no partner: its motion is continued from its neighbours'.
    size : n.
    """

    triangles: Ints
    corners: Ints
    weights: Floats
    residual: Floats
    normal_agreement: Floats
    valid: Bools
    size: int

    def matrix(self) -> Any:
        """(m, n) sparse: template values to target values; rows of vertices without a partner are empty."""
        from scipy.sparse import csr_array

        rows = np.flatnonzero(self.valid)
        where = (np.repeat(rows, 3), self.corners[rows].ravel())
        return csr_array((self.weights[rows].ravel(), where), shape=(len(self.valid), self.size))


def correspond(
    fitted: Floats,
    triangles: Ints,
    target: Surface,
    *,
    labels: tuple[Ints, Ints] | None = None,
    farthest: float = FARTHEST,
    least_facing: float = LEAST_FACING,
) -> Correspondence:
    """Find the place of each target vertex on a fitted template.

    Parameters
    ----------
    fitted : (n, 3) the template's vertices in the target's place.
    triangles : (t, 3) the template's.
    labels : labels of lips and lids of template and target.
    farthest, least_facing : worse places are no partner.
    """
    mine, yours = (None, None) if labels is None else labels
    search = TriangleSearch(fitted, triangles, mine)
    found = search.closest(target.vertices, target.normals, yours, least_facing, farthest)
    return Correspondence(
        found.triangles,
        triangles[found.triangles],
        found.weights,
        found.distances,
        found.facing,
        found.triangles >= 0,
        len(fitted),
    )
