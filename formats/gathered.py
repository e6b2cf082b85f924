"""All shapes of a scene put back together as one mesh in the file's own vertex order, axes and winding."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Floats, Ints
from fba.mesh import Material, PolyMesh
from fba.scene import FaceScene


@dataclass(frozen=True, eq=False)
class GatheredMesh:
    """A scene as one polygon mesh.

    Attributes
    ----------
    mesh : vertices in file order and axes, polygons shape by shape; groups and materials numbered over all.
    materials : every different material once.
    shape_of_face : (m,) int32, index into `shape_names`.
    """

    mesh: PolyMesh
    materials: tuple[Material, ...]
    shape_of_face: Ints
    shape_names: tuple[str, ...]

    def reordered(self, order: Ints) -> GatheredMesh:
        """The same mesh with its polygons in another order; order : (m,) old number of each new polygon."""
        mesh = self.mesh
        arity = mesh.arities[order]
        offsets = np.concatenate([[0], np.cumsum(arity)])
        corner = np.repeat(mesh.offsets[:-1][order] - offsets[:-1], arity) + np.arange(offsets[-1])

        def pick(values: Ints | None, by: Ints) -> Ints | None:
            return None if values is None else values[by]

        turned = PolyMesh(
            mesh.vertices,
            mesh.indices[corner],
            offsets,
            mesh.texcoords,
            pick(mesh.texcoord_indices, corner),
            mesh.normals,
            pick(mesh.normal_indices, corner),
            pick(mesh.face_groups, order),
            mesh.group_names,
            pick(mesh.face_materials, order),
        )
        return GatheredMesh(turned, self.materials, self.shape_of_face[order], self.shape_names)


def gather_mesh(scene: FaceScene) -> GatheredMesh:
    """Put all shapes together: world coordinates turned to the file's axes, inside-out winding given back."""
    places = scene.file_order()
    vertices = scene.frame.to_file(scene.world_neutral())
    shapes = scene.shapes
    meshes = [s.mesh.reversed() if scene.frame.reversed_winding else s.mesh for s in shapes]
    corners = [places[s.name][m.indices] for s, m in zip(shapes, meshes, strict=True)]
    offsets = np.concatenate([[0], np.cumsum(np.concatenate([m.arities for m in meshes]))])
    texcoords, texcoord_indices = _stack([(m.texcoords, m.texcoord_indices, m.indices.size) for m in meshes])
    normals, normal_indices = _stack([(m.normals, m.normal_indices, m.indices.size) for m in meshes])
    if normals is not None:
        normals = scene.frame.to_file(_world_normals(scene, normals, [m.normals for m in meshes]))
    groups, group_names = _groups(meshes)
    materials: dict[Material, int] = {}
    used = []
    for s in shapes:
        table = np.array([materials.setdefault(m, len(materials)) for m in s.materials] + [-1], dtype=np.int32)
        own = s.mesh.face_materials
        # Without a list of its own, a shape wears its first material everywhere; a number without one is none.
        numbers = np.zeros(s.mesh.face_count, np.int32) if own is None else own
        used.append(table[np.where(numbers < len(s.materials), numbers, -1)])
    mesh = PolyMesh(
        vertices,
        np.concatenate(corners),
        offsets,
        texcoords,
        texcoord_indices,
        normals,
        normal_indices,
        groups,
        group_names,
        np.concatenate(used) if materials else None,
    )
    owner = np.repeat(np.arange(len(shapes), dtype=np.int32), [m.face_count for m in meshes])
    return GatheredMesh(mesh, tuple(materials), owner, tuple(s.name for s in shapes))


def _stack(parts: list[tuple[Floats | None, Ints | None, int]]) -> tuple[Floats | None, Ints | None]:
    """Concatenate texture coordinates or normals, with -1 for the corners of shapes that have none."""
    values: list[Floats] = []
    indices: list[Ints] = []
    start = 0
    for own, own_indices, corners in parts:
        if own is None or own_indices is None:
            indices.append(np.full(corners, -1, dtype=np.int32))
            continue
        values.append(own)
        indices.append(np.where(own_indices < 0, -1, own_indices + start).astype(np.int32))
        start += len(own)
    if not values:
        return None, None
    return np.concatenate(values), np.concatenate(indices)


def _world_normals(scene: FaceScene, normals: Floats, own: list[Floats | None]) -> Floats:
    """Turn stacked normals by their shapes' transforms (inverse transposed)."""
    out = np.array(normals)
    start = 0
    for shape, values in zip(scene.shapes, own, strict=True):
        if values is None:
            continue
        matrix = scene.world_matrix(shape.name)[:3, :3]
        if not np.array_equal(matrix, np.eye(3)) and np.linalg.det(matrix) != 0.0:
            turned = values @ np.linalg.inv(matrix)
            length = np.linalg.norm(turned, axis=1, keepdims=True)
            out[start : start + len(values)] = np.divide(turned, length, out=turned, where=length > 0)
        start += len(values)
    return out


def _groups(meshes: list[PolyMesh]) -> tuple[Ints | None, tuple[str, ...]]:
    names: dict[str, int] = {}
    numbers = []
    if all(m.face_groups is None for m in meshes):
        return None, ()
    for m in meshes:
        if m.face_groups is None:
            numbers.append(np.full(m.face_count, names.setdefault("default", len(names)), dtype=np.int32))
            continue
        table = np.array([names.setdefault(n, len(names)) for n in m.group_names], dtype=np.int32)
        numbers.append(table[m.face_groups])
    return np.concatenate(numbers), tuple(names)


def original_order(mesh: PolyMesh, indices: Ints, offsets: Ints) -> Ints | None:
    """Where the polygons of a file lie in a mesh that holds exactly these polygons, (m,); None if it does not.

    Polygons are compared by their number of corners and their first three vertices.
    """
    if len(offsets) != len(mesh.offsets) or len(indices) != len(mesh.indices):
        return None
    wanted, found = _keys(indices, offsets), _keys(mesh.indices, mesh.offsets)
    by_wanted, by_found = np.lexsort(wanted), np.lexsort(found)
    if not np.array_equal(wanted[:, by_wanted], found[:, by_found]):
        return None
    order = np.empty(len(by_wanted), dtype=np.int32)
    order[by_wanted] = by_found
    return order


def _keys(indices: Ints, offsets: Ints) -> Ints:
    first = offsets[:-1]
    return np.stack([np.diff(offsets), indices[first + 2], indices[first + 1], indices[first]])
