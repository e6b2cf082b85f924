"""Subdivide some polygons of a mesh and leave others coarse, without cracks between them."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING

import numpy as np

from fba.arrays import Floats, Ints
from fba.mesh import PolyMesh
from samples.build.subdivide import catmull_clark

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Halves = dict[tuple[int, int], int]
"""Edge (a < b) -> the vertex that halves it on the next level."""


def refine(mesh: PolyMesh, levels: Ints) -> tuple[PolyMesh, csr_array]:
    """Subdivide each polygon as often as it says (E. Catmull and J. Clark, 1978).

    Parameters
    ----------
    levels : (m,) steps for each polygon, 0 = leave it as it is.

    Returns
    -------
    mesh : the old vertices first, then those of each level. A polygon beside finer ones takes their vertices on
        the common edge as corners of its own, so that the mesh stays closed.
    matrix : sparse (new, old). All vertices, also of polygons left coarse, are where as many steps as the
        highest level bring them.
    """
    from scipy.sparse import csr_array, eye_array

    steps = int(levels.max(initial=0))
    matrix = csr_array(eye_array(mesh.vertex_count))
    current, wanted = mesh, levels
    faces = [mesh.face(k).tolist() for k in np.flatnonzero(levels == 0).tolist()]
    halves: Halves = {}
    for level in range(1, steps + 1):
        finer, step = catmull_clark(current)
        halves |= _halves(current, finer)
        wanted = np.repeat(wanted, current.arities)
        faces += [finer.face(k).tolist() for k in np.flatnonzero(wanted == level).tolist()]
        matrix, current = csr_array(step @ matrix), finer
    used = np.unique([*range(mesh.vertex_count), *(v for face in faces for v in face)])
    kept = set(used.tolist())
    new = np.full(current.vertex_count, -1, dtype=np.int32)
    new[used] = np.arange(used.size)
    rows: csr_array = csr_array(matrix[used])
    closed = [new[_with_halves(face, halves, kept)].tolist() for face in faces]
    vertices: Floats = rows @ mesh.vertices
    return PolyMesh.from_faces(vertices, closed), rows


def _halves(mesh: PolyMesh, finer: PolyMesh) -> Halves:
    """The k-th quad of a subdivided mesh lies at the k-th corner: corner, edge after it, middle, edge before it."""
    quads = finer.indices.reshape(-1, 4)
    following = np.arange(mesh.indices.size) + 1
    following[mesh.offsets[1:] - 1] = mesh.offsets[:-1]
    ends = np.sort(np.stack([mesh.indices, mesh.indices[following]], axis=1), axis=1)
    return {(a, b): v for (a, b), v in zip(ends.tolist(), quads[:, 1].tolist(), strict=True)}


def _with_halves(face: list[int], halves: Halves, kept: Collection[int]) -> list[int]:
    """The polygon with the finer vertices on its edges; it starts at one, so that its fan has no empty triangle."""
    out: list[int] = []
    for a, b in zip(face, face[1:] + face[:1], strict=True):
        out += [a, *_between(a, b, halves, kept)]
    old = set(face)
    start = next((k for k, v in enumerate(out) if v not in old), 0)
    return out[start:] + out[:start]


def _between(a: int, b: int, halves: Halves, kept: Collection[int]) -> Iterator[int]:
    half = halves.get((min(a, b), max(a, b)))
    if half is not None and half in kept:
        yield from _between(a, half, halves, kept)
        yield half
        yield from _between(half, b, halves, kept)
