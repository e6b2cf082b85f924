"""Cut a head with eyes, teeth, tongue and lashes out of the MakeHuman body, along an edge ring of the neck."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from fba.arrays import Bools, Floats, Ints
from fba.errors import MeshError
from fba.mesh import PolyMesh
from fba.scene import Role
from samples.build.makehuman import BaseMesh

if TYPE_CHECKING:
    from scipy.sparse import csr_array

NECK_RING = (815, 7523)
"""An edge of the base mesh that lies in the cutting ring: front of the neck, just above the collar bones."""

PARTS: tuple[tuple[str, Role, tuple[str, ...]], ...] = (
    ("skin", Role.SKIN, ("body",)),
    ("upper_teeth", Role.UPPER_TEETH, ("helper-upper-teeth",)),
    ("lower_teeth", Role.LOWER_TEETH, ("helper-lower-teeth",)),
    ("tongue", Role.TONGUE, ("helper-tongue",)),
    ("lashes_left", Role.OTHER, ("helper-l-eyelashes-2",)),
    ("lashes_right", Role.OTHER, ("helper-r-eyelashes-2",)),
)
"""Shapes of the cropped head taken from the base mesh: name, role, groups. Lashes are those of the upper lids."""

NOSE_TIP = 297
"""Base vertex of feature point 9.3."""


@dataclass(frozen=True)
class Part:
    """One shape of the cropped head.

    ids : (k,) base vertices that it is made of.
    mesh : its polygons; the vertices' positions are those of the base mesh.
    matrix : sparse (n, k), the vertices as mixtures of the base's; None where they are the same.
    """

    ids: Ints
    mesh: PolyMesh
    matrix: csr_array | None = None

    def cut(self, values: Floats) -> Floats:
        """The part's share (n, 3) of values over the whole body."""
        own = values[self.ids]
        taken: Floats = own if self.matrix is None else self.matrix @ own
        return taken


@dataclass(frozen=True)
class HeadCrop:
    """Which vertices and polygons of the base mesh form the head without its eyeballs, by shape."""

    shapes: dict[str, Part]

    @cached_property
    def places(self) -> dict[int, tuple[str, int]]:
        """Base vertex -> (shape, its index there); shapes that were refined keep the base's vertices first."""
        return {int(b): (name, k) for name, part in self.shapes.items() for k, b in enumerate(part.ids)}

    def cut(self, values: Floats) -> dict[str, Floats]:
        """Take values (19158, 3) over the whole body apart: one (n, 3) array for each shape."""
        return {name: part.cut(values) for name, part in self.shapes.items()}


def crop_head(base: BaseMesh) -> HeadCrop:
    """Cut the head off along `NECK_RING`; every part keeps the base mesh's vertex order."""
    shapes = {}
    for name, _, groups in PARTS:
        quads = base.quads[np.sort(np.concatenate([base.groups[g] for g in groups]))]
        if name == "skin":
            quads = quads[_above_ring(quads, len(base.vertices))]
        ids = np.unique(quads).astype(np.int32)
        new = np.full(len(base.vertices), -1, dtype=np.int32)
        new[ids] = np.arange(ids.size)
        shapes[name] = Part(ids, PolyMesh.from_faces(base.vertices[ids], new[quads]))
    return HeadCrop(shapes)


def edge_ring(quads: Ints, first: int, second: int) -> list[int]:
    """Follow a quad mesh straight on from an edge until the ring closes; vertices in order.

    Raises
    ------
    MeshError
        If the ring meets a vertex of another valence than 4.
    """
    faces: dict[tuple[int, int], set[int]] = defaultdict(set)
    neighbours: dict[int, set[int]] = defaultdict(set)
    for index, quad in enumerate(quads.tolist()):
        for a, b in zip(quad, quad[1:] + quad[:1], strict=True):
            faces[min(a, b), max(a, b)].add(index)
            neighbours[a].add(b)
            neighbours[b].add(a)
    ring = [first, second]
    while True:
        before, here = ring[-2:]
        beside = faces[min(before, here), max(before, here)]
        onward = [v for v in neighbours[here] if not beside & faces[min(v, here), max(v, here)]]
        if len(onward) != 1:
            raise MeshError(f"the edge ring from {first} ends at vertex {here}")
        if onward[0] == first:
            return ring
        ring.append(onward[0])


def _above_ring(quads: Ints, count: int) -> Bools:
    """Mask of the quads on the head's side of the neck ring."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    ring = edge_ring(quads, *NECK_RING)
    on_ring = np.zeros(count, dtype=bool)
    on_ring[ring] = True
    a, b = quads.reshape(-1), np.roll(quads, -1, axis=1).reshape(-1)
    free = ~on_ring[a] & ~on_ring[b]
    graph = coo_array((np.ones(int(free.sum())), (a[free], b[free])), shape=(count, count))
    label = connected_components(graph, directed=False)[1]
    head = (label == label[NOSE_TIP]) & ~on_ring
    kept: Bools = head[quads].any(axis=1)
    return kept
