"""Transforms as translation, rotation and scale, which is all that other formats know, and how tables drive these.

``T C R SR S -SR -C`` falls into a first part, ``T C``, ``R SR`` and ``S``, and a second one below it, ``-SR -C``, which
stays still. So a table that turns, moves or scales the transform drives one field of the first part.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fat.tables import FaceDefTables, FaceDefTransform, TransformField
from fba.arrays import Floats
from fba.errors import FaceDefTablesError
from fba.fapu import ANGLE_UNIT
from fba.scene import FaceScene, Transform, rotation_matrix


def orientation(node: Transform) -> Floats:
    """The scale orientation as a (3, 3) matrix."""
    return rotation_matrix(node.scale_orientation)[:3, :3]


def translation(node: Transform, move: Sequence[float]) -> Floats:
    """(3,) translation of the first part where the transform's own is `move`."""
    return np.asarray(move, dtype=np.float64) + np.asarray(node.center, dtype=np.float64)


def quaternion(node: Transform, rotation: tuple[float, float, float, float]) -> Floats:
    """(4,) rotation of the first part where the transform's own is `rotation` (axis and angle)."""
    if node.scale_orientation[3] == 0.0:
        return _axis_angle(rotation)
    return quaternion_of(rotation_matrix(rotation)[:3, :3] @ orientation(node))


def _axis_angle(rotation: Sequence[float]) -> Floats:
    axis = np.asarray(rotation[:3], dtype=np.float64)
    length = float(np.linalg.norm(axis))
    if length == 0.0:
        return np.array([0.0, 0.0, 0.0, 1.0])
    half = 0.5 * rotation[3]
    return np.append(np.sin(half) * axis / length, np.cos(half)) + 0.0


def quaternion_of(matrix: Floats) -> Floats:
    """Unit quaternion (x, y, z, w) of a (3, 3) rotation: eigenvector of the matrix of I. Y. Bar-Itzhack (2000)."""
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    symmetric = np.array(
        [
            [a - e - i, d + b, g + c, h - f],
            [d + b, e - a - i, h + f, c - g],
            [g + c, h + f, i - a - e, d - b],
            [h - f, c - g, d - b, a + e + i],
        ]
    )
    found: Floats = np.linalg.eigh(symmetric)[1][:, -1]
    found = np.where(np.abs(found) < 1e-16, 0.0, found)
    return found if found[3] >= 0.0 else -found + 0.0


def driven_fields(scene: FaceScene, tables: FaceDefTables, values: Floats) -> dict[tuple[str, TransformField], Floats]:
    """What tables do to nodes: (transform, field) -> (f, 4) quaternions or (f, 3) vectors of its first part.

    values : (f, tables). Of several tables that drive one field, the last one whose value is not 0 holds; where all
    are 0, the field is as in the file (see `fat.chains`). Fields that stay so in every frame are left out.
    """
    transforms = {t.name: t for t in scene.transforms}
    found: dict[tuple[str, TransformField], Floats] = {}
    for number, table in enumerate(tables):
        for definition in table.transforms:
            if definition.transform not in transforms:
                raise FaceDefTablesError(f"{table.name}: there is no Transform '{definition.transform}' in the scene")
            active = np.flatnonzero(values[:, number])
            if not active.size:
                continue
            node = transforms[definition.transform]
            key = (node.name, definition.field)
            if key not in found:
                found[key] = np.tile(_field(node, definition, None), (len(values), 1))
            for frame in active.tolist():
                found[key][frame] = _field(node, definition, float(values[frame, number]))
    return found


def _field(node: Transform, definition: FaceDefTransform, value: float | None) -> Floats:
    """The field of the first part at a table value; None for the file's own."""
    if definition.field is TransformField.ROTATION:
        x, y, z, theta = definition.rotation_def
        return quaternion(node, node.rotation if value is None else (x, y, z, theta * value * ANGLE_UNIT))
    if definition.field is TransformField.TRANSLATION:
        move = node.translation if value is None else np.asarray(definition.translation_def) * value
        return translation(node, tuple(move))
    scale = node.scale if value is None else np.asarray(definition.scale_def) * value
    return np.asarray(scale, dtype=np.float64)
