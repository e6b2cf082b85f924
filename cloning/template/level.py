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
    finer : the mesh that this one is a coarser version of, or None.
    """

    start: Floats
    triangles: Ints
    marks: Landmarks
    reach: Floats
    labels: Ints | None
    finer: Finer | None = None

    @cached_property
    def energies(self) -> Energies:
        """Those of the start."""
        return energies(self.start, self.triangles)

    def normals(self, current: Floats) -> Floats:
        """(n, 3) unit normals of the template with its vertices at (n, 3).

        A coarser mesh has those of the finest: its own ones differ where skin is strongly curved.
        """
        if self.finer is None:
            return vertex_normals(current, self.triangles)
        return self._rings.normals(current - self.start)

    @cached_property
    def _rings(self) -> Rings:
        from scipy.sparse import eye_array

        finest, own, matrix = self, np.arange(len(self.start), dtype=np.int32), eye_array(len(self.start), format="csr")
        while finest.finer is not None:
            own, matrix = finest.finer.kept[own], finest.finer.matrix @ matrix
            finest = finest.finer.level
        touched = np.zeros(len(finest.start), bool)
        touched[own] = True
        triangles = finest.triangles[touched[finest.triangles].any(axis=1)]
        touched[triangles] = True
        number = np.cumsum(touched) - 1
        return Rings(finest.start[touched], matrix[np.flatnonzero(touched)], number[triangles], number[own])

    def coarser(self) -> Level:
        """A mesh of about a quarter of the vertices."""
        mesh = coarser(self.start, self.triangles)
        kept, spread = mesh.kept, mesh.spread(self.start)
        start, rows = self.start[kept], self.marks.rows @ spread
        # Landmarks ask for the same ways as on the finer mesh.
        goals = self.marks.goals - self.marks.rows @ self.start + rows @ start
        marks = replace(self.marks, rows=rows, goals=goals)
        labels = None if self.labels is None else self.labels[kept]
        return Level(start, mesh.triangles, marks, self.reach[kept], labels, Finer(self, kept, spread))


@dataclass(frozen=True, eq=False)
class Finer:
    """How a coarser mesh moves a finer one.

    Attributes
    ----------
    level : the finer mesh.
    kept : (c,) its vertices that the coarser mesh has.
    matrix : (n, c) sparse, spreads a field of them.
    """

    level: Level
    kept: Ints
    matrix: Any

    def spread(self, ways: Floats) -> Floats:
        """(n, 3) where the finer mesh's vertices are when the coarser one's have gone (c, 3) ways from their start."""
        places: Floats = self.level.start + self.matrix @ ways
        return places


@dataclass(frozen=True, eq=False)
class Rings:
    """The triangles of the finest mesh around the vertices of a coarser one.

    Attributes
    ----------
    start : (r, 3) where their vertices start.
    matrix : (r, c) sparse, spreads a field of the coarser mesh.
    triangles : (t, 3) over them.
    own : (c,) the coarser mesh's vertices among them.
    """

    start: Floats
    matrix: Any
    triangles: Ints
    own: Ints

    def normals(self, ways: Floats) -> Floats:
        """(c, 3) unit normals when the coarser mesh's vertices have gone (c, 3) ways from their start."""
        return vertex_normals(self.start + self.matrix @ ways, self.triangles)[self.own]


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
