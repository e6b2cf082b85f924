"""Polygon meshes of any arity that keep what the file said: vertex order, corners, uv, groups, materials."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from fba.arrays import Bools, Floats, Ints, frozen
from fba.errors import MeshError
from fba.shading import Shading


@dataclass(frozen=True, eq=False)
class PolyMesh:
    """A polygon mesh.

    Attributes
    ----------
    vertices : (n, 3) float64, in the unit of the file.
    indices : (k,) int32, the corners of all polygons, one polygon after the other.
    offsets : (m+1,) int32; polygon i has the corners ``indices[offsets[i]:offsets[i+1]]``.
    texcoords : (t, 2) float64 or None.
    texcoord_indices : (k,) int32 or None; -1 where a corner has no texture coordinate.
    normals, normal_indices : the same for normals (t, 3).
    face_groups : (m,) int32 or None; index into `group_names`.
    face_materials : (m,) int32 or None; index into the shape's materials, -1 = none.
    """

    vertices: Floats
    indices: Ints
    offsets: Ints
    texcoords: Floats | None = None
    texcoord_indices: Ints | None = None
    normals: Floats | None = None
    normal_indices: Ints | None = None
    face_groups: Ints | None = None
    group_names: tuple[str, ...] = ()
    face_materials: Ints | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "vertices", frozen(self.vertices, np.float64, (-1, 3)))
        put(self, "indices", frozen(self.indices, np.int32, (-1,)))
        put(self, "offsets", frozen(self.offsets, np.int32, (-1,)))
        for name, width in (("texcoords", 2), ("normals", 3)):
            if getattr(self, name) is not None:
                put(self, name, frozen(getattr(self, name), np.float64, (-1, width)))
        for name in ("texcoord_indices", "normal_indices", "face_groups", "face_materials"):
            if getattr(self, name) is not None:
                put(self, name, frozen(getattr(self, name), np.int32, (-1,)))
        self._check()

    def _check(self) -> None:
        if self.offsets.size == 0 or self.offsets[0] != 0 or self.offsets[-1] != self.indices.size:
            raise MeshError("polygon offsets must start at 0 and end at the number of corners")
        if np.any(np.diff(self.offsets) < 3):
            bad = int(np.argmax(np.diff(self.offsets) < 3))
            raise MeshError(f"polygon {bad} has fewer than 3 corners")
        for name, values, count in (
            ("vertex", self.indices, len(self.vertices)),
            (
                "texture coordinate",
                self.texcoord_indices,
                0 if self.texcoords is None else len(self.texcoords),
            ),
            ("normal", self.normal_indices, 0 if self.normals is None else len(self.normals)),
        ):
            if values is None:
                continue
            if values.size != self.indices.size:
                raise MeshError(f"{name} indices must match the {self.indices.size} corners")
            low = 0 if name == "vertex" else -1
            if values.size and (int(values.min()) < low or int(values.max()) >= count):
                raise MeshError(f"a polygon uses a {name} index outside 0..{count - 1}")
        for name in ("face_groups", "face_materials"):
            values = getattr(self, name)
            if values is not None and values.size != self.face_count:
                raise MeshError(f"{name} must have one entry for each of the {self.face_count} polygons")

    @classmethod
    def from_faces(cls, vertices: ArrayLike, faces: ArrayLike | list[list[int]]) -> PolyMesh:
        """Build a mesh from a list of polygons (corner lists of any length) or an (m, c) array."""
        rows = [np.asarray(f, dtype=np.int32) for f in faces]  # type: ignore[union-attr]
        offsets = np.concatenate([[0], np.cumsum([len(r) for r in rows])])
        indices = np.concatenate(rows) if rows else np.zeros(0, dtype=np.int32)
        return cls(np.asarray(vertices, dtype=np.float64), indices, offsets)

    @property
    def vertex_count(self) -> int:
        return len(self.vertices)

    @property
    def face_count(self) -> int:
        return len(self.offsets) - 1

    @cached_property
    def arities(self) -> Ints:
        """Number of corners of each polygon, (m,)."""
        return frozen(np.diff(self.offsets), np.int32)

    @cached_property
    def _fan(self) -> tuple[Ints, Ints]:
        counts = self.arities - 2
        face = np.repeat(np.arange(self.face_count), counts)
        step = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        first = self.offsets[:-1][face]
        corners = np.stack([first, first + step + 1, first + step + 2], axis=1)
        return frozen(corners, np.int32), frozen(face, np.int32)

    @property
    def triangle_corners(self) -> Ints:
        """Fan triangulation as positions into `indices`, (t, 3): works for uv and normals as well."""
        return self._fan[0]

    @property
    def triangle_faces(self) -> Ints:
        """The polygon that each triangle of `triangles` came from, (t,)."""
        return self._fan[1]

    @cached_property
    def triangles(self) -> Ints:
        """Fan triangulation as vertex indices, (t, 3)."""
        return frozen(self.indices[self.triangle_corners], np.int32)

    @cached_property
    def _edges(self) -> tuple[Ints, Ints]:
        following = np.arange(self.indices.size) + 1
        following[self.offsets[1:] - 1] = self.offsets[:-1]
        pairs = np.sort(np.stack([self.indices, self.indices[following]], axis=1), axis=1)
        edges, uses = np.unique(pairs, axis=0, return_counts=True)
        return frozen(edges, np.int32, (-1, 2)), frozen(uses, np.int32)

    @property
    def edges(self) -> Ints:
        """Undirected polygon edges, each once, (e, 2) with ``a < b``, sorted."""
        return self._edges[0]

    @property
    def edge_uses(self) -> Ints:
        """How many polygons use each edge, (e,): 1 on a border, 2 inside, more where it is not a manifold."""
        return self._edges[1]

    @cached_property
    def used_vertices(self) -> Bools:
        """True for each vertex that some polygon uses, (n,)."""
        used = np.zeros(self.vertex_count, dtype=bool)
        used[self.indices] = True
        return frozen(used, np.bool_)

    def face(self, index: int) -> Ints:
        """Vertex indices of one polygon."""
        return self.indices[self.offsets[index] : self.offsets[index + 1]]

    def with_vertices(self, vertices: ArrayLike) -> PolyMesh:
        """The same polygons over other vertex positions; stored normals are dropped as they no longer fit."""
        return PolyMesh(
            np.asarray(vertices, dtype=np.float64),
            self.indices,
            self.offsets,
            self.texcoords,
            self.texcoord_indices,
            None,
            None,
            self.face_groups,
            self.group_names,
            self.face_materials,
        )

    def reversed(self) -> PolyMesh:
        """The same mesh with every polygon wound the other way round (its own inverse)."""
        order = np.arange(self.indices.size)
        order = np.repeat(self.offsets[:-1] + self.offsets[1:] - 1, self.arities) - order

        def turn(values: Ints | None) -> Ints | None:
            return None if values is None else values[order]

        return PolyMesh(
            self.vertices,
            self.indices[order],
            self.offsets,
            self.texcoords,
            turn(self.texcoord_indices),
            None if self.normals is None else -self.normals,
            turn(self.normal_indices),
            self.face_groups,
            self.group_names,
            self.face_materials,
        )

    def components(self) -> Ints:
        """Number of the connected component of each vertex, (n,); lone vertices have their own."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        n = self.vertex_count
        first = np.repeat(self.indices[self.offsets[:-1]], self.arities)
        graph = coo_array((np.ones(self.indices.size, dtype=np.int8), (first, self.indices)), shape=(n, n))
        return frozen(connected_components(graph, directed=False)[1], np.int32)

    def submesh(self, vertex_mask: Bools) -> tuple[PolyMesh, Ints]:
        """Cut out the polygons whose corners are all in the mask.

        Parameters
        ----------
        vertex_mask : (n,) bool.

        Returns
        -------
        mesh : the part, vertices in their old order (unused masked vertices are kept).
        ids : (n',) int32, the old index of each of its vertices.
        """
        ids = np.flatnonzero(vertex_mask).astype(np.int32)
        new = np.full(self.vertex_count, -1, dtype=np.int32)
        new[ids] = np.arange(ids.size)
        inside = np.zeros(0, dtype=bool)
        if self.face_count:
            inside = np.logical_and.reduceat(vertex_mask[self.indices], self.offsets[:-1])
        corner = np.repeat(inside, self.arities)
        offsets = np.concatenate([[0], np.cumsum(self.arities[inside])])
        texcoords, texcoord_indices = _compact(self.texcoords, self.texcoord_indices, corner)
        normals, normal_indices = _compact(self.normals, self.normal_indices, corner)
        part = PolyMesh(
            self.vertices[ids],
            new[self.indices[corner]],
            offsets,
            texcoords,
            texcoord_indices,
            normals,
            normal_indices,
            None if self.face_groups is None else self.face_groups[inside],
            self.group_names,
            None if self.face_materials is None else self.face_materials[inside],
        )
        return part, ids

    def vertex_normals(self, vertices: Floats | None = None) -> Floats:
        """Area-weighted unit normals, (n, 3); zero where a vertex has no polygon of positive area."""
        points = self.vertices if vertices is None else vertices
        a, b, c = (points[self.triangles[:, k]] for k in range(3))
        cross = np.cross(b - a, c - a)
        normals = np.zeros((self.vertex_count, 3))
        for axis in range(3):
            for corner in range(3):
                normals[:, axis] += np.bincount(self.triangles[:, corner], cross[:, axis], self.vertex_count)
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        unit: Floats = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
        return unit


def _compact(values: Floats | None, indices: Ints | None, corner: Bools) -> tuple[Floats | None, Ints | None]:
    if values is None or indices is None:
        return None, None
    kept = indices[corner]
    used = np.unique(kept[kept >= 0])
    new = np.full(len(values) + 1, -1, dtype=np.int32)
    new[used] = np.arange(used.size)
    return values[used], new[kept]


@dataclass(frozen=True, slots=True)
class Material:
    """How a surface looks; what VRML97's Material says, plus a name and a texture image."""

    name: str = ""
    diffuse: tuple[float, float, float] = (0.8, 0.8, 0.8)
    ambient_intensity: float = 0.2
    specular: tuple[float, float, float] = (0.0, 0.0, 0.0)
    emissive: tuple[float, float, float] = (0.0, 0.0, 0.0)
    shininess: float = 0.2
    transparency: float = 0.0
    texture: str | None = field(default=None)
    """The image's path or URI exactly as the file wrote it."""
    shading: Shading | None = None
    """What a physically based renderer needs beyond this; None where the file does not say."""

    @property
    def images(self) -> tuple[str, ...]:
        """All images that the material names, each once; the texture first."""
        maps = () if self.shading is None else self.shading.maps
        named = (self.texture or "", *(m.image for m in maps))
        return tuple(dict.fromkeys(name for name in named if name))

    def renamed(self, names: Mapping[str, str]) -> Material:
        """The same material with other names of its images; those without a new one keep theirs."""

        texture = None if self.texture is None else names.get(self.texture, self.texture)
        shading = None if self.shading is None else self.shading.renamed(names)
        return replace(self, texture=texture, shading=shading)
