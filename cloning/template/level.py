"""What is fitted: a template's mesh without seams, and coarser versions of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from cloning.surface import Surface
from cloning.template.coarse import coarser
from cloning.template.energies import Energies, energies
from cloning.template.landmarks import Landmarks
from fba.arrays import Floats, Ints

FEWEST = 3000
"""Templates with fewer vertices than this are not made coarser."""


@dataclass(frozen=True, eq=False)
class Level:
    """One mesh that is fitted.

    Attributes
    ----------
    start : (n, 3) where it starts.
    triangles : (t, 3).
    marks : landmarks of its vertices.
    reach : (n,) how far each vertex looks for closest points, 0 = not at all.
    labels : (n,) of lips and lids, or None.
    """

    start: Floats
    triangles: Ints
    marks: Landmarks
    reach: Floats
    labels: Ints | None

    @cached_property
    def energies(self) -> Energies:
        """Those of the start."""
        return energies(self.start, self.triangles)

    def coarser(self) -> tuple[Level, Any]:
        """A mesh of about a quarter of the vertices, and (n, c) the sparse matrix that spreads its fields."""
        mesh = coarser(self.start, self.triangles)
        spread = mesh.spread(self.start)
        kept = mesh.kept
        start, rows = self.start[kept], self.marks.rows @ spread
        # Landmarks ask for the same ways as on the finer mesh.
        goals = self.marks.goals - self.marks.rows @ self.start + rows @ start
        marks = replace(self.marks, rows=rows, goals=goals)
        labels = None if self.labels is None else self.labels[kept]
        return Level(start, mesh.triangles, marks, self.reach[kept], labels), spread


def welded(surface: Surface, start: Floats, marks: Landmarks, reach: Floats, labels: Ints | None) -> Level:
    """The finest mesh: one vertex for all that lie at one place of a seam.

    Parameters
    ----------
    start, reach, labels : of the surface's (n,) vertices.
    marks : landmarks of the surface.
    """
    first = np.unique(surface.places, return_index=True)[1]
    return Level(
        start[first],
        surface.places[surface.triangles],
        replace(marks, rows=(marks.rows @ surface.place_sums.T).tocsr()),
        reach[first],
        None if labels is None else labels[first],
    )


def vertex_normals(vertices: Floats, triangles: Ints) -> Floats:
    """(n, 3) unit normals, triangles counted by area."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    normals = np.stack(
        [np.bincount(triangles.ravel(), np.repeat(cross[:, axis], 3), len(vertices)) for axis in range(3)], axis=1
    )
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    unit: Floats = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
    return unit
