"""Transforms as glTF nodes, which have neither a centre nor a scale orientation, and their motion.

The two parts of a transform (`formats.node_motion`) are two nodes; the second one, ``-SR -C``, is left out where it
would do nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from fat.tables import TransformField
from fba.arrays import Floats
from fba.scene import FaceScene, Node, Shape
from formats.gltf.buffers import Json
from formats.node_motion import orientation, quaternion, quaternion_of, translation

PATHS = {
    TransformField.ROTATION: "rotation",
    TransformField.TRANSLATION: "translation",
    TransformField.SCALE: "scale",
}


class Nodes:
    """The node tree of a scene.

    Attributes
    ----------
    entries : all nodes; the root is the first.
    of : name of a scene node -> its number.
    """

    def __init__(self, scene: FaceScene, mesh_of: Callable[[Shape], int | None]) -> None:
        self.entries: list[Json] = []
        self.of: dict[str, int] = {}
        self._mesh_of = mesh_of
        root: Json = {"name": scene.name}
        meters = scene.meters_per_unit
        if meters is not None and meters != 1.0:
            root["scale"] = [meters] * 3
        self.entries.append(root)
        children = [self._add(node) for node in scene.roots]
        if children:
            root["children"] = children

    def _add(self, node: Node) -> int:
        number = len(self.entries)
        entry: Json = {"name": node.name}
        self.entries.append(entry)
        self.of[node.name] = number
        if isinstance(node, Shape):
            mesh = self._mesh_of(node)
            if mesh is not None:
                entry["mesh"] = mesh
            return number
        _put(entry, translation(node, node.translation), quaternion(node, node.rotation), node.scale)
        below = entry
        back = orientation(node).T
        shift = -(back @ np.asarray(node.center, dtype=np.float64))
        if shift.any() or not np.array_equal(back, np.eye(3)):
            below = {"name": f"{node.name}_pivot"}
            entry["children"] = [len(self.entries)]
            self.entries.append(below)
            _put(below, shift, quaternion_of(back), (1.0, 1.0, 1.0))
        children = [self._add(child) for child in node.children]
        if children:
            below["children"] = children
        return number


def _put(entry: Json, move: Floats, turn: Floats, scale: Sequence[float]) -> None:
    """Fields that are not neutral."""
    if move.any():
        entry["translation"] = (move + 0.0).tolist()
    if turn[:3].any():
        entry["rotation"] = turn.tolist()
    if tuple(scale) != (1.0, 1.0, 1.0):
        entry["scale"] = [float(s) for s in scale]
