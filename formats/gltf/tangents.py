"""Tangents for normal maps: where an image's u goes on the surface.

glTF lets a client make them itself, but clients differ in how. A normal map's images say +X along u, +Y against
glTF's v (up in the image), +Z out of the surface.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Bools, Floats, Ints
from fba.mesh import Material, PolyMesh
from formats.gltf.buffers import Rows

_SLIM = 1e-6
"""Sine of the angle below which 32-bit texture coordinates no longer tell on which side an image lies."""


def normal_map_set(material: Material | None) -> int | None:
    """The set of texture coordinates of a material's normal map; None without one."""
    shading = None if material is None else material.shading
    return None if shading is None or shading.normal is None else shading.normal.texcoord


def mirrored(mesh: PolyMesh, corners: Ints) -> Bools:
    """Whether the image lies mirrored on the triangle of each corner; corners : (3 t,) places in the mesh's indices.

    Halves of a face often share one half of an image. A vertex where they meet has two tangents, so it is split.
    """
    if mesh.texcoords is None or mesh.texcoord_indices is None or not len(mesh.texcoords):
        return np.zeros(len(corners), dtype=bool)
    indices = mesh.texcoord_indices[corners].reshape(-1, 3)
    uv = mesh.texcoords[indices]
    first, second = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    slim = _SLIM * np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
    turned: Bools = (area < -slim) & (indices >= 0).all(axis=1)
    return np.repeat(turned, 3)


def tangents(points: Floats, normals: Floats, texcoords: Floats, triangles: Rows) -> Floats:
    """(p, 4) unit tangents and the side of the bitangent, for vertices (p, 3) with unit normals.

    texcoords : (p, 2) from the upper left corner of the image. Those of a vertex's triangles are weighted by their
    angles there; where an image shrinks to a point, any tangent is as good.
    """
    corners, uv = points[triangles], texcoords[triangles] * (1.0, -1.0)
    along_u, side = _directions(corners, uv)
    total, sides = np.zeros_like(points), np.zeros(len(points))
    for place in range(3):
        at = triangles[:, place]
        weight = _angles(corners, place)
        for axis in range(3):
            total[:, axis] += np.bincount(at, weight * along_u[:, axis], len(points))
        sides += np.bincount(at, weight * side, len(points))
    flat = total - normals * np.einsum("ij,ij->i", normals, total)[:, None]
    length = np.linalg.norm(flat, axis=1)
    any_axis = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    flat = np.where((length < 1e-6)[:, None], np.cross(any_axis, normals), flat)
    unit = flat / np.linalg.norm(flat, axis=1, keepdims=True)
    return np.column_stack([unit, np.where(sides < 0.0, -1.0, 1.0)])


def _directions(corners: Floats, uv: Floats) -> tuple[Floats, Floats]:
    """Unit direction of u in each triangle (t, 3), zero where it has none, and 1 or, where mirrored, -1."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    (ua, va), (ub, vb) = (uv[:, 1] - uv[:, 0]).T, (uv[:, 2] - uv[:, 0]).T
    side = np.sign(ua * vb - va * ub)
    along = (a * vb[:, None] - b * va[:, None]) * side[:, None]
    length = np.linalg.norm(along, axis=1, keepdims=True)
    return np.divide(along, length, out=np.zeros_like(along), where=length > 0.0), side


def _angles(corners: Floats, place: int) -> Floats:
    """The triangles' angles at one of their corners."""
    a = corners[:, (place + 1) % 3] - corners[:, place]
    b = corners[:, (place + 2) % 3] - corners[:, place]
    angle: Floats = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ij,ij->i", a, b))
    return angle
