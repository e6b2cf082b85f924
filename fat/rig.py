"""Transform nodes for rigid motion: nested rotations of the eyeballs and of the head.

A FaceDefTransform overwrites the whole field of its Transform, so each rotating FAP needs a node of its own
(ISO/IEC 14496-1, FaceDefTransform). The nodes are inserted between what is there and its parent, with the pivot
in `center`; the rest pose of every existing node stays what it was.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fat.face import AnimatableFace
from fat.tables import FaceDefTransform, TransformField
from fba.arrays import Floats
from fba.faps import fap
from fba.scene import FaceScene, Node, Transform

HEAD_FAPS = (("head_yaw", 49), ("head_pitch", 48), ("head_roll", 50))
"""Outermost first: R = Ry * Rx * Rz. No public source states the standard's order; this one is documented."""

EYE_FAPS = {"left": (("yaw", 23), ("pitch", 25)), "right": (("yaw", 24), ("pitch", 26))}

OWN_NAMES = re.compile(r"(head_(yaw|pitch|roll)|eye_(left|right)(_.+)?_(yaw|pitch))(_\d+)?")
"""Names that `rig_head` and `rig_eye` give."""

RigTables = dict[tuple[int, int], tuple[FaceDefTransform, ...]]


def rig_head(scene: FaceScene, pivot: Floats) -> tuple[FaceScene, RigTables]:
    """Put every root that holds a shape under three nested head rotations about `pivot`.

    Parameters
    ----------
    pivot : (3,) world coordinates: feature point 7.1, or 7.2 as Facial Motion Cloning has it.

    Returns
    -------
    scene : with Transforms ``head_yaw`` > ``head_pitch`` > ``head_roll``.
    tables : (FAP, 1) -> its FaceDefTransform, for FAPs 48, 49 and 50.
    """
    holding = [root for root in scene.roots if _holds_shape(root)]
    names = _free_names(scene, [name for name, _ in HEAD_FAPS])
    node = _nest(tuple(holding), names, pivot)
    roots: list[Node] = []
    for root in scene.roots:
        if root is holding[0]:
            roots.append(node)
        elif root not in holding:
            roots.append(root)
    tables: RigTables = {
        (number, 1): (_rotation(name, number, np.eye(3)),) for name, (_, number) in zip(names, HEAD_FAPS, strict=True)
    }
    return replace(scene, roots=tuple(roots)), tables


def rig_eye(scene: FaceScene, side: str, shapes: Sequence[str], center: Floats) -> tuple[FaceScene, RigTables]:
    """Put each of these shapes under two nested rotations (yaw > pitch) about the centre of the eyeball.

    Every shape gets its own pair of nodes, so that the order of the shapes in the scene stays.

    Parameters
    ----------
    side : "left" or "right" (of the subject).
    shapes : names of the shapes that make up the eyeball (ball, cornea, iris).
    center : (3,) world coordinates.
    """
    collected: dict[tuple[int, int], list[FaceDefTransform]] = {}
    for shape in shapes:
        stem = f"eye_{side}" if len(shapes) == 1 else f"eye_{side}_{shape}"
        names = _free_names(scene, [f"{stem}_{suffix}" for suffix, _ in EYE_FAPS[side]])
        matrix = scene.world_matrix(shape)
        local = np.linalg.solve(matrix, np.append(center, 1.0))[:3]
        scene = _wrap(scene, shape, names, local)
        for name, (_, number) in zip(names, EYE_FAPS[side], strict=True):
            collected.setdefault((number, 1), []).append(_rotation(name, number, matrix[:3, :3]))
    return scene, {key: tuple(values) for key, values in collected.items()}


def unrig(face: AnimatableFace) -> FaceScene:
    """Return the scene without the Transforms that `rig_head` and `rig_eye` put into it.

    Known by their names, driven by the tables, doing nothing at rest. So a face that is cloned onto once more does
    not carry a second set of them; nodes of anybody else's stay.
    """
    driven = {entry.transform for table in face.tables for entry in table.transforms}

    def idle(node: Node) -> bool:
        if not (isinstance(node, Transform) and node.name in driven and OWN_NAMES.fullmatch(node.name)):
            return False
        return np.array_equal(node.matrix(), np.eye(4))

    def visit(node: Node) -> tuple[Node, ...]:
        if not isinstance(node, Transform):
            return (node,)
        children = tuple(kept for child in node.children for kept in visit(child))
        return children if idle(node) else (replace(node, children=children),)

    return replace(face.scene, roots=tuple(kept for root in face.scene.roots for kept in visit(root)))


def _rotation(name: str, number: int, linear: Floats) -> FaceDefTransform:
    """The table of a rotation about a world axis, written in the node's local axes: 1 unit of theta per AU."""
    axis = np.linalg.solve(linear, np.asarray(fap(number).rotation_axis, dtype=np.float64))
    axis /= np.linalg.norm(axis)
    turn = 1.0 if np.linalg.det(linear) > 0 else -1.0
    return FaceDefTransform(name, TransformField.ROTATION, (float(axis[0]), float(axis[1]), float(axis[2]), turn))


def _holds_shape(node: Node) -> bool:
    return not isinstance(node, Transform) or any(_holds_shape(child) for child in node.children)


def _nest(children: tuple[Node, ...], names: Sequence[str], center: Floats) -> Transform:
    x, y, z = (float(c) for c in center)
    for name in reversed(names):
        children = (Transform(name, children, center=(x, y, z)),)
    node = children[0]
    assert isinstance(node, Transform)
    return node


def _wrap(scene: FaceScene, target: str, names: Sequence[str], center: Floats) -> FaceScene:
    def visit(node: Node) -> Node:
        if node.name == target:
            return _nest((node,), names, center)
        if isinstance(node, Transform):
            return replace(node, children=tuple(visit(child) for child in node.children))
        return node

    return replace(scene, roots=tuple(visit(root) for root in scene.roots))


def _free_names(scene: FaceScene, wanted: Sequence[str]) -> list[str]:
    taken = {node.name for node, _ in scene.walk()}
    names = []
    for name in wanted:
        number = 2
        free = name
        while free in taken:
            free = f"{name}_{number}"
            number += 1
        taken.add(free)
        names.append(free)
    return names
