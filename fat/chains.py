"""Where the Transforms of a scene put its shapes while FaceDefTransforms drive some of their fields."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fat.tables import FaceDefTable, FaceDefTransform, TransformField
from fba.arrays import Bools, Floats
from fba.errors import FaceDefTablesError
from fba.fapu import ANGLE_UNIT
from fba.scene import FaceScene, Node, Shape, Transform, rotation_matrix


@dataclass(frozen=True, slots=True)
class _Driver:
    table: int
    definition: FaceDefTransform


@dataclass(frozen=True, slots=True)
class ShapeMotion:
    """World matrices (f, 4, 4) of a shape, and the frames (f,) in which some Transform above it is driven."""

    matrices: Floats
    moving: Bools


class Chains:
    """The Transform nodes above the shapes, with the FaceDefTransforms that drive them.

    Notes
    -----
    A driven field is overwritten: rotation by ``theta * FAP * AU`` about the axis, translation by
    ``FAP * translationDef``, scale by ``FAP * scaleDef`` (ISO/IEC 14496-1, FaceDefTransform). At FAP 0 the field
    has the value of the neutral face, which is the file's own; on a well-made face both are the same. Of several
    tables that drive one field, the last one whose FAP is not 0 holds.
    """

    def __init__(self, scene: FaceScene, tables: Sequence[FaceDefTable]) -> None:
        self._scene = scene
        self._drivers: dict[str, list[_Driver]] = {}
        names = {t.name for t in scene.transforms}
        for number, table in enumerate(tables):
            for definition in table.transforms:
                if definition.transform not in names:
                    raise FaceDefTablesError(
                        f"{table.name}: there is no Transform '{definition.transform}' in the scene"
                    )
                if not np.isfinite(definition.rotation_def + definition.scale_def + definition.translation_def).all():
                    raise FaceDefTablesError(
                        f"{table.name}: the definition for '{definition.transform}' is not made of finite numbers"
                    )
                self._drivers.setdefault(definition.transform, []).append(_Driver(number, definition))
        self.rest = {shape.name: scene.world_matrix(shape.name) for shape in scene.shapes}

    def rest_inverse(self, name: str) -> Floats:
        """Matrix (4, 4) from world to local coordinates of a shape at rest.

        Raises
        ------
        FaceDefTablesError
            If the Transforms above the shape scale it to nothing.
        """
        try:
            inverse: Floats = np.linalg.inv(self.rest[name]).astype(np.float64, copy=False)
        except np.linalg.LinAlgError:
            raise FaceDefTablesError(f"shape '{name}' is scaled to nothing by the transforms above it") from None
        return inverse

    def motions(self, values: Floats) -> dict[str, ShapeMotion]:
        """Return how the shapes move at table values (f, tables); shapes that stay at rest are absent."""
        found: dict[str, ShapeMotion] = {}
        if not self._drivers or not values.any():
            return found
        still = np.zeros(len(values), dtype=bool)

        def visit(node: Node, world: Floats, moving: Bools) -> None:
            if isinstance(node, Shape):
                if moving.any():
                    world[~moving] = self.rest[node.name]
                    found[node.name] = ShapeMotion(world, moving)
                return
            matrices, driven = self._matrices(node, values)
            for child in node.children:
                visit(child, world @ matrices, moving | driven)

        for root in self._scene.roots:
            visit(root, np.tile(np.eye(4), (len(values), 1, 1)), still)
        return found

    def _matrices(self, node: Transform, values: Floats) -> tuple[Floats, Bools]:
        """Matrices of one Transform, (f, 4, 4) or (1, 4, 4) at rest, and the frames in which it is driven."""
        driven = np.zeros(len(values), dtype=bool)
        drivers = [d for d in self._drivers.get(node.name, ()) if values[:, d.table].any()]
        if not drivers:
            return node.matrix()[None], driven
        count = len(values)
        turn = np.tile(rotation_matrix(node.rotation)[:3, :3], (count, 1, 1))
        move = np.tile(np.asarray(node.translation), (count, 1))
        scale = np.tile(np.asarray(node.scale), (count, 1))
        for driver in drivers:
            value = values[:, driver.table]
            active = value != 0.0
            driven |= active
            definition = driver.definition
            if definition.field is TransformField.ROTATION:
                turn[active] = _rotations(definition.rotation_def, value[active])
            elif definition.field is TransformField.TRANSLATION:
                move[active] = value[active, None] * np.asarray(definition.translation_def)
            else:
                scale[active] = value[active, None] * np.asarray(definition.scale_def)
        orient = rotation_matrix(node.scale_orientation)[:3, :3]
        center = np.asarray(node.center)
        linear = turn @ (orient * scale[:, None, :]) @ orient.T
        matrices = np.tile(np.eye(4), (count, 1, 1))
        matrices[:, :3, :3] = linear
        matrices[:, :3, 3] = move + center - linear @ center
        return matrices, driven


def _rotations(definition: tuple[float, float, float, float], values: Floats) -> Floats:
    """Rotation matrices (f, 3, 3) of a rotationDef at FAP values (f,)."""
    angle = definition[3] * values * ANGLE_UNIT
    axis = np.asarray(definition[:3], dtype=np.float64)
    length = float(np.linalg.norm(axis))
    if length == 0.0:
        return np.tile(np.eye(3), (len(values), 1, 1))
    x, y, z = axis / length
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turns: Floats = (
        np.eye(3) + np.sin(angle)[:, None, None] * cross + (1.0 - np.cos(angle))[:, None, None] * (cross @ cross)
    )
    return turns
