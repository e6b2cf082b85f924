"""The standard's equations written out for one vertex at a time: slow, and meant to be compared with."""

from __future__ import annotations

import math

import numpy as np

from fat import AnimatableFace, FaceDefMesh, FaceDefTable, TransformField
from fba import FaceScene, Shape, Transform, fap
from fba.fapu import ANGLE_UNIT
from fba.scene import rotation_matrix, translation_matrix


def displacement(borders: list[int], slopes: list[np.ndarray], value: float) -> np.ndarray:
    """Displacement of one vertex in FAPU: the cases of the standard one after the other."""
    n = len(borders)
    if n == 2:
        return value * slopes[0]
    k = borders.index(0)
    total = np.zeros(3)
    if value >= 0 and k < n - 1:
        j = k
        while j + 2 < n and value >= borders[j + 1]:
            j += 1
        for i in range(k, j):
            total = total + (borders[i + 1] - borders[i]) * slopes[i]
        return total + (value - borders[j]) * slopes[j]
    if value <= 0 and k > 0:
        j = k - 1
        while j > 0 and value < borders[j]:
            j -= 1
        for i in range(j + 1, k):
            total = total + (borders[i + 1] - borders[i]) * slopes[i]
        return total + (borders[j + 1] - value) * slopes[j]
    if k == 0:
        return value * slopes[0]
    return -value * slopes[n - 2]


def mesh_displacements(mesh: FaceDefMesh, unit: float, value: float, count: int) -> np.ndarray:
    out = np.zeros((count, 3))
    borders = mesh.interval_borders.tolist()
    stored = mesh.displacements.reshape(-1, 3).astype(np.float64)
    for m, vertex in enumerate(mesh.coord_index.tolist()):
        slopes = [stored[m * (len(borders) - 1) + i] for i in range(len(borders) - 1)]
        out[vertex] += unit * displacement(borders, slopes, value)
    return out


def table_value(table: FaceDefTable, faps: dict, viseme: tuple | None, expression: tuple | None) -> float:
    if table.fap_id == 1:
        first, second, blend = viseme or (0, 0, 0)
        return blend * (first == table.high_level_select) + (63 - blend) * (second == table.high_level_select)
    if table.fap_id == 2:
        first, one, second, two = expression or (0, 0, 0, 0)
        return one * (first == table.high_level_select) + two * (second == table.high_level_select)
    return faps.get(table.fap_id, 0.0)


def play(face: AnimatableFace, faps: dict, viseme: tuple | None = None, expression: tuple | None = None) -> np.ndarray:
    """World vertices (N, 3) in file order."""
    fields: dict[str, dict] = {}
    moved = {s.name: s.mesh.vertices.copy() for s in face.scene.shapes}
    for table in face.tables:
        value = table_value(table, faps, viseme, expression)
        unit = face.fapu.unit(fap(table.fap_id).unit)
        for mesh in table.meshes:
            moved[mesh.shape] += mesh_displacements(mesh, unit, value, len(moved[mesh.shape]))
        for d in table.transforms:
            if value == 0:
                continue
            if d.field is TransformField.ROTATION:
                fields.setdefault(d.transform, {})["rotation"] = (
                    *d.rotation_def[:3],
                    d.rotation_def[3] * value * ANGLE_UNIT,
                )
            elif d.field is TransformField.TRANSLATION:
                fields.setdefault(d.transform, {})["translation"] = tuple(value * c for c in d.translation_def)
            else:
                fields.setdefault(d.transform, {})["scale"] = tuple(value * c for c in d.scale_def)
    world = {}
    for shape in face.scene.shapes:
        matrix = np.eye(4)
        for parent in face.scene.parents(shape.name):
            matrix = matrix @ node_matrix(parent, fields.get(parent.name, {}))
        world[shape.name] = moved[shape.name] @ matrix[:3, :3].T + matrix[:3, 3]
    return face.scene.gather(world)


def node_matrix(node: Transform, fields: dict) -> np.ndarray:
    t, c = fields.get("translation", node.translation), node.center
    r, s = fields.get("rotation", node.rotation), fields.get("scale", node.scale)
    so = node.scale_orientation
    back = (*so[:3], -so[3])
    return (
        translation_matrix(t)
        @ translation_matrix(c)
        @ rotation_matrix(r)
        @ rotation_matrix(so)
        @ np.diag([*s, 1.0])
        @ rotation_matrix(back)
        @ translation_matrix(tuple(-x for x in c))
    )


def strip(name: str, count: int, seed: int, **more: object) -> Shape:
    """A shape with `count` random vertices."""
    from fba import PolyMesh

    vertices = np.random.default_rng(seed).normal(size=(count, 3))
    return Shape(name, PolyMesh.from_faces(vertices, [[i, i + 1, i + 2] for i in range(count - 2)]), **more)


def turned_scene(skin: int = 80, eye: int = 12) -> FaceScene:
    """Skin and an eye, under transforms with every field in use."""
    socket = Transform(
        "socket",
        (Transform("eye_yaw", (Transform("eye_pitch", (strip("eye", eye, 2),), center=(0.1, 0.2, 0.3)),)),),
        translation=(0.3, -0.2, 0.4),
        rotation=(1.0, 2.0, -1.0, math.pi / 5),
        scale=(1.5, 0.5, 2.0),
        scale_orientation=(0.0, 1.0, 1.0, 0.4),
        center=(0.2, 0.1, -0.3),
    )
    head = Transform("head_yaw", (Transform("head_pitch", (strip("skin", skin, 1), socket), center=(0.0, -1.0, 0.2)),))
    return FaceScene((head, strip("lone", 9, 3)))
