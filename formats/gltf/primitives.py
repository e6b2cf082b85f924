"""Polygon meshes as what graphics hardware draws: triangles of one material over vertices with one normal and uv.

A vertex is split where texture coordinates or normals differ between the polygons around it, and where materials
meet; below a normal map also where its image is mirrored.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fba.arrays import Bools, Floats, Floats32, Ints
from fba.scene import Shape
from formats.gltf.buffers import Buffer, Json, Rows, to_single
from formats.gltf.materials import Materials
from formats.gltf.tangents import mirrored, normal_map_set, tangents
from formats.normals import SmoothNormals
from formats.targets import Target

VERTEX = "_VERTEX"
"""Attribute that says which vertex of the shape each vertex of a primitive is."""


@dataclass(frozen=True, eq=False)
class Primitive:
    """The triangles of one material.

    Attributes
    ----------
    material : index into the shape's materials, -1 for none.
    vertices : (p,) the shape's vertex of each vertex of the primitive.
    texcoords : (p, 2) from the upper left corner of the image, or None.
    normals : (p, 3) of length 1.
    triangles : (t, 3) into `vertices`.
    """

    material: int
    vertices: Ints
    texcoords: Floats | None
    normals: Floats
    triangles: Rows


def split(shape: Shape, smooth: Floats) -> list[Primitive]:
    """Take a shape apart into primitives; none if it has no polygons.

    smooth : (n, 3) vertex normals for corners that have none of their own.
    """
    mesh = shape.mesh
    if not mesh.face_count:
        return []
    if mesh.face_materials is None:
        numbers = np.full(len(mesh.triangle_faces), 0 if shape.materials else -1)
    else:
        numbers = mesh.face_materials[mesh.triangle_faces]
        numbers = np.where(numbers < len(shape.materials), numbers, -1)
    return [_primitive(shape, numbers == number, number, smooth) for number in dict.fromkeys(numbers.tolist())]


def _primitive(shape: Shape, chosen: Bools, material: int, smooth: Floats) -> Primitive:
    mesh = shape.mesh
    corners = mesh.triangle_corners[chosen].ravel()
    keys = [mesh.indices[corners]]
    for indices in (mesh.texcoord_indices, mesh.normal_indices):
        if indices is not None:
            keys.append(indices[corners])
    if normal_map_set(shape.materials[material] if material >= 0 else None) == 0:
        keys.append(mirrored(mesh, corners).astype(np.int32))
    first, order = _distinct(keys)
    corner = corners[first]
    vertices = mesh.indices[corner]
    texcoords = None
    if mesh.texcoords is not None and mesh.texcoord_indices is not None and (keys[1] >= 0).any():
        texcoords = _values(mesh.texcoords, mesh.texcoord_indices[corner], np.zeros((len(corner), 2)))
        texcoords = np.stack([texcoords[:, 0], 1.0 - texcoords[:, 1]], axis=1)
    normals = smooth[vertices]
    if mesh.normals is not None and mesh.normal_indices is not None:
        normals = _values(mesh.normals, mesh.normal_indices[corner], normals)
    return Primitive(material, vertices, texcoords, _unit(normals), order.reshape(-1, 3))


def _distinct(keys: list[Ints]) -> tuple[Rows, Rows]:
    """First place of each distinct row of the keys, sorted by them, and which of these every place holds."""
    joined = keys[-1].astype(np.int64)
    for key in reversed(keys[:-1]):
        joined = np.unique(joined, return_inverse=True)[1].astype(np.int64)
        joined += key.astype(np.int64) * (int(joined.max()) + 1)
    _, first, order = np.unique(joined, return_index=True, return_inverse=True)
    return first, order


def _values(values: Floats, indices: Ints, default: Floats) -> Floats:
    if not len(values):
        return default
    found: Floats = np.where((indices >= 0)[:, None], values[indices], default)
    return found


def _unit(normals: Floats) -> Floats:
    """Normals of length 1; where there is none, one to the front."""
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    none = length[:, 0] < 1e-12
    unit: Floats = normals / np.where(length < 1e-12, 1.0, length)
    unit[none] = (0.0, 0.0, 1.0)
    return unit


def write_mesh(
    buffer: Buffer,
    shape: Shape,
    targets: Sequence[Target],
    materials: Materials,
    attributes: Mapping[str, Floats],
) -> Json | None:
    """A glTF mesh with morph targets; None without polygons.

    attributes : of the shape's vertices, as `FaceScene.vertex_attributes`.
    """
    to_single(shape.mesh.vertices)  # Refused here, before anything is computed with them.
    smooth = SmoothNormals(shape.mesh)
    primitives = split(shape, smooth.rest)
    if not primitives:
        return None
    entries = [_write_primitive(buffer, shape, p, materials, attributes) for p in primitives]
    for target in targets:
        index, offsets = target.index, target.offsets
        turned = to_single(smooth.offsets(index, offsets))
        moved = to_single(offsets)
        place = np.full(shape.mesh.vertex_count, -1, dtype=np.int64)
        place[index] = np.arange(index.size)
        for primitive, entry in zip(primitives, entries, strict=True):
            at = place[primitive.vertices]
            rows = np.flatnonzero(at >= 0)
            position, normal = buffer.offsets(len(at), rows, [moved[at[rows]], turned[at[rows]]])
            entry.setdefault("targets", []).append({"POSITION": position, "NORMAL": normal})
    mesh: Json = {"name": shape.name, "primitives": entries}
    if targets:
        mesh["weights"] = [0.0] * len(targets)
        mesh["extras"] = {"targetNames": [t.name for t in targets]}
    return mesh


def _write_primitive(
    buffer: Buffer, shape: Shape, primitive: Primitive, materials: Materials, extra: Mapping[str, Floats]
) -> Json:
    points: Floats32 = to_single(shape.mesh.vertices[primitive.vertices])
    attributes: dict[str, Any] = {
        "POSITION": buffer.attribute(points, bounds=True),
        "NORMAL": buffer.attribute(to_single(primitive.normals)),
        VERTEX: buffer.attribute(primitive.vertices.astype(np.float32)),
    }
    texcoords = _texcoords(primitive, extra)
    attributes |= {f"TEXCOORD_{k}": buffer.attribute(to_single(uv)) for k, uv in enumerate(texcoords)}
    bent = normal_map_set(shape.materials[primitive.material] if primitive.material >= 0 else None)
    if bent is not None and bent < len(texcoords):
        turned = tangents(points.astype(np.float64), primitive.normals, texcoords[bent], primitive.triangles)
        attributes["TANGENT"] = buffer.attribute(to_single(turned))
    colors = _known(extra.get("color"), primitive.vertices, 1.0)
    if colors is not None:
        attributes["COLOR_0"] = buffer.attribute(to_single(np.clip(colors, 0.0, 1.0)))
    entry: Json = {"attributes": attributes, "indices": buffer.indices(primitive.triangles.ravel())}
    if primitive.material >= 0:
        entry["material"] = materials.number(shape.materials[primitive.material], len(texcoords))
    return entry


def _texcoords(primitive: Primitive, extra: Mapping[str, Floats]) -> list[Floats]:
    """All sets of texture coordinates, from the upper left corner; glTF numbers them without gaps."""
    sets = [] if primitive.texcoords is None else [primitive.texcoords]
    while (values := _known(extra.get(f"texcoord_{max(len(sets), 1)}"), primitive.vertices, 0.0)) is not None:
        if not sets:
            sets.append(np.zeros_like(values))
        sets.append(np.stack([values[:, 0], 1.0 - values[:, 1]], axis=1))
    return sets


def _known(values: Floats | None, vertices: Ints, default: float) -> Floats | None:
    """Values of these vertices, with a default where there is none; None where there is none at all."""
    if values is None:
        return None
    found = values[vertices]
    if np.isnan(found).all():
        return None
    filled: Floats = np.where(np.isnan(found), default, found)
    return filled
