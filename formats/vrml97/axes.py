"""Turn a scene between the file's axes and the inside ones (see `fba.scene.Frame`); exact both ways."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fba.arrays import Floats
from fba.mesh import PolyMesh
from fba.scene import FaceScene, Frame, Node, Shape

Turn = Callable[[Floats], Floats]


def turn_mesh(mesh: PolyMesh, turn: Turn, reverse: bool) -> PolyMesh:
    """Turn vertices and normals; then reverse the winding where asked."""
    normals = None if mesh.normals is None else turn(mesh.normals)
    turned = replace(mesh, vertices=turn(mesh.vertices), normals=normals)
    return turned.reversed() if reverse else turned


def turn_axis(axis: tuple[float, ...], turn: Turn) -> tuple[float, float, float]:
    """Turn the axis of a rotation: it changes sign under a mirroring."""
    sign = np.linalg.det(turn(np.eye(3)))
    x, y, z = (float(c) for c in turn(np.asarray(axis)) * np.sign(sign))
    return x, y, z


def turn_point(point: tuple[float, ...], turn: Turn) -> tuple[float, float, float]:
    """Turn a point or vector."""
    x, y, z = (float(c) for c in turn(np.asarray(point, dtype=np.float64)))
    return x, y, z


def turn_sizes(sizes: tuple[float, ...], turn: Turn) -> tuple[float, float, float]:
    """Turn scale factors: they change places, not signs."""
    x, y, z = (float(c) for c in turn(np.asarray(sizes)) * turn(np.ones(3)))
    return x, y, z


def turn_node(item: Node, turn: Turn, reverse: bool) -> Node:
    """Turn a node and everything below it."""
    if isinstance(item, Shape):
        return replace(item, mesh=turn_mesh(item.mesh, turn, reverse))
    return replace(
        item,
        children=tuple(turn_node(c, turn, reverse) for c in item.children),
        translation=turn_point(item.translation, turn),
        rotation=(*turn_axis(item.rotation[:3], turn), item.rotation[3]),
        scale=turn_sizes(item.scale, turn),
        scale_orientation=(*turn_axis(item.scale_orientation[:3], turn), item.scale_orientation[3]),
        center=turn_point(item.center, turn),
    )


def in_file_axes(scene: FaceScene) -> tuple[Node, ...]:
    """The roots of a scene in the file's own axes and winding."""
    frame = scene.frame
    if frame.identity and not frame.reversed_winding:
        return scene.roots
    return tuple(turn_node(r, frame.to_file, frame.reversed_winding) for r in scene.roots)


def from_file_axes(roots: tuple[Node, ...], frame: Frame) -> tuple[Node, ...]:
    """The reverse of `in_file_axes`."""
    if frame.identity and not frame.reversed_winding:
        return roots
    return tuple(turn_node(r, frame.from_file, frame.reversed_winding) for r in roots)
