"""The exact closest point on a triangle surface, among the triangles that face the same way and fit the label."""

from __future__ import annotations

from dataclasses import astuple
from functools import cached_property

import numpy as np

from cloning.locate import Places
from cloning.template.balls import Balls, Nearby
from cloning.template.boxes import BoxTree, box_tree, closest_loop
from cloning.template.queries import Queries, Triangles, nowhere
from fba.arrays import Bools, Floats, Ints
from fba.compiled import compiled

BLOCK = 8192
"""So many points are looked for at once."""


class Memory:
    """What is kept of points that are looked for again and again and move little: it saves time, changes no result."""

    def __init__(self) -> None:
        self.last: Ints | None = None
        self.nearby: dict[int, Nearby] = {}


class TriangleSearch:
    """A triangle surface, ready for queries.

    Parameters
    ----------
    vertices : (n, 3).
    triangles : (t, 3).
    labels : (n,) labels of lips and lids (see `cloning.labels`); None = none.
    usable : (t,) bool, triangles that may be found; None = all.
    """

    def __init__(
        self, vertices: Floats, triangles: Ints, labels: Ints | None = None, usable: Bools | None = None
    ) -> None:
        self.triangles = triangles
        self._triangles = Triangles.of(vertices, triangles, labels, usable)
        self.corners, self.normals = self._triangles.corners, self._triangles.normals

    def closest(
        self,
        points: Floats,
        normals: Floats | None = None,
        labels: Ints | None = None,
        least_facing: float = 0.5,
        reach: float | Floats = np.inf,
        memory: Memory | None = None,
    ) -> Places:
        """Find the closest point of each query; the triangle of the lowest index where some are equally near.

        Parameters
        ----------
        points : (m, 3).
        normals : (m, 3) unit normals; triangles whose own normal is turned away farther than `least_facing` (a
            cosine) do not count. None = all count.
        labels : (m,) labels of the points: triangles that touch the opposite label do not count.
        reach : nothing farther than this is found; one for all, or (m,).
        memory : of these points, with these labels and reach, and of this search alone.

        Returns
        -------
        Places; where there is none, the triangle is -1 and the distance infinite.
        """
        queries = Queries.of(points, normals, least_facing, labels, reach)
        if not len(points) or not len(self._triangles.usable):
            return nowhere(len(points))
        found = self._walked(queries, memory)
        return self._among_balls(queries, memory) if found is None else found

    def positions(self, places: Places) -> Floats:
        """(m, 3) the points found; meaningless where there is none."""
        found: Floats = np.einsum("nk,nkd->nd", places.weights, self.corners[places.triangles])
        return found

    def _walked(self, queries: Queries, memory: Memory | None) -> Places | None:
        """Closest points by the compiled loop, if there is one."""
        loop = compiled(closest_loop)
        if loop is None:
            return None
        tree, place = self._boxes
        found = nowhere(len(queries))
        guesses = np.full(len(queries), -1, np.int32)
        if memory is not None and memory.last is not None:
            guesses = np.where(memory.last >= 0, place[memory.last], -1).astype(np.int32)
        points = np.ascontiguousarray(queries.points, np.float64)
        normals = np.zeros((0, 3)) if queries.normals is None else np.ascontiguousarray(queries.normals, np.float64)
        asked = points, normals, queries.refused, queries.least_facing, queries.limits, guesses
        loop(*asked, tree, found.triangles, found.weights, found.distances, found.facing)
        if memory is not None:
            memory.last = found.triangles
        return found

    def _among_balls(self, queries: Queries, memory: Memory | None) -> Places:
        """Closest points by scipy's trees."""
        blocks = []
        for start in range(0, len(queries), BLOCK):
            part = queries.part(slice(start, start + BLOCK))
            nearby = None if memory is None else memory.nearby.setdefault(start, Nearby.of(part))
            blocks.append(self._balls.closest(part, nearby))
        if len(blocks) == 1:
            return blocks[0]
        return Places(*(np.concatenate(each) for each in zip(*map(astuple, blocks), strict=True)))

    @cached_property
    def _balls(self) -> Balls:
        return Balls(self._triangles)

    @cached_property
    def _boxes(self) -> tuple[BoxTree, Ints]:
        """A tree of boxes, and (t,) the place of each triangle in it, -1 for none."""
        some = self._triangles
        tree = box_tree(some.usable, some.corners, some.normals, some.bits)
        place = np.full(len(some.corners), -1, np.int32)
        place[tree.triangles] = np.arange(len(tree.triangles), dtype=np.int32)
        return tree, place
