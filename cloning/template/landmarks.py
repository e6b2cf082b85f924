"""What draws a template to its target besides closest points: feature points, and the rims of the lids."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from cloning.contours import contour_anchors
from cloning.surface import Surface
from cloning.template.closest import TriangleSearch
from fba.arrays import Floats, Ints

LIDS = (3, 4, 5, 6)
"""Labels whose edges count. Lips have feature points enough; what lies between them is not evenly spaced."""


@dataclass(frozen=True, eq=False)
class Landmarks:
    """Places of a template and where they belong.

    Attributes
    ----------
    rows : (k, n) sparse, evaluates a field of the template at its landmarks.
    goals : (k, 3) on the target.
    """

    rows: Any
    goals: Floats

    @cached_property
    def _square(self) -> Any:
        return self.rows.T @ self.rows

    def term(self, current: Floats, size: float | Floats) -> tuple[Any, Floats]:
        """What they add to a system (n, n) and its right side (n, 3).

        Parameters
        ----------
        current : (n, 3) the template.
        size : weight of all, or (k,) weights.
        """
        from scipy.sparse import diags_array

        if isinstance(size, float):
            return size * self._square, size * (self.rows.T @ (self.goals - self.rows @ current))
        weighted = self.rows.T @ diags_array(size)
        return weighted @ self.rows, weighted @ (self.goals - self.rows @ current)


def landmarks_of(template: Surface, target: Surface, ids: Sequence[str], labels: Ints | None) -> Landmarks:
    """The landmarks of a fit.

    Parameters
    ----------
    ids : feature points of both.
    labels : (n,) the template's; with them, and with feature points, the rims of the lids are landmarks too.
    """
    from scipy.sparse import csr_array, vstack

    rows = template.point_matrix(ids)
    goals = np.array([target.positions[i] for i in ids]).reshape(-1, 3)
    mine, yours = ({}, {}) if labels is None or not ids else (contour_anchors(template), contour_anchors(target))
    names = [name for name in mine if name in yours and mine[name][0] in LIDS]
    if not names:
        return Landmarks(rows, goals)
    sides = np.array([mine[name][0] for name in names])
    search = TriangleSearch(template.vertices, template.triangles, labels)
    own, theirs = (np.array([anchors[name][1] for name in names]) for anchors in (mine, yours))
    places = search.closest(own, labels=sides)
    where = (np.repeat(np.arange(len(names)), 3), template.triangles[places.triangles].ravel())
    more = csr_array((places.weights.ravel(), where), shape=(len(names), template.vertex_count))
    # A way along an edge cuts corners by a hair; counted out, so that a face fits itself exactly.
    theirs = theirs + (more @ template.vertices - own)
    return Landmarks(vstack([rows, more], format="csr"), np.concatenate([goals, theirs]))
