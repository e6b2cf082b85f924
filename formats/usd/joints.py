"""The transforms that tables drive, as joints of one skeleton, and which joint every mesh hangs on.

A joint is the first part of a transform (`formats.node_motion`), with its scale only if a table drives that. What lies
between two joints, or between a joint and a mesh, stays still: where that is more than a shift it becomes a joint of
its own above the next one, or part of the mesh's bind transform.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd, UsdSkel, Vt

from fat.tables import FaceDefTables, TransformField
from fba.arrays import Floats
from fba.errors import FaceDefTablesError
from fba.scene import FaceScene, Node, Shape, Transform, rotation_matrix, translation_matrix
from formats.node_motion import orientation, quaternion, translation
from formats.usd.axes import StageAxes
from formats.usd.names import Namer

ROOT_JOINT = "root"
"""The joint of everything that no transform moves, so that every mesh has one."""


@dataclass(frozen=True, eq=False)
class Joint:
    """One joint.

    Attributes
    ----------
    path : names from the root joint to this one, as UsdSkel has them.
    rest : (4, 4) from its own coordinates to those of the joint above; bind : to those of the skeleton. Inside axes.
    node : the transform that drives it; None for one that stays still.
    shift : (3,) added to that transform's translation.
    """

    path: str
    rest: Floats
    bind: Floats
    node: Transform | None
    shift: Floats


class Rig:
    """The joints of a scene.

    Attributes
    ----------
    joints : parents first.
    of_shape : name of a shape -> number of its joint.

    Raises
    ------
    FaceDefTablesError
        If a table drives a transform that is not there, or one that is scaled to nothing.
    """

    def __init__(self, scene: FaceScene, tables: FaceDefTables) -> None:
        known = {node.name for node in scene.transforms}
        for table in tables:
            for entry in table.transforms:
                if entry.transform not in known:
                    raise FaceDefTablesError(f"{table.name}: there is no transform '{entry.transform}' in the scene")
        self._driven = {(entry.transform, entry.field) for table in tables for entry in table.transforms}
        self._moving = {name for name, _ in self._driven}
        self._namer = Namer((ROOT_JOINT,))
        still = np.eye(4)
        self.joints = [Joint(ROOT_JOINT, still, still, None, np.zeros(3))]
        self.of_shape: dict[str, int] = {}
        for node in scene.roots:
            self._visit(node, 0, still)

    def _visit(self, node: Node, above: int, between: Floats) -> None:
        """between : (4, 4) from the coordinates around `node` to those of the joint above."""
        if isinstance(node, Shape):
            self.of_shape[node.name] = above
            return
        matrix = between @ node.matrix()
        if node.name in self._moving:
            above, matrix = self._add(node, above, between)
        for child in node.children:
            self._visit(child, above, matrix)

    def _add(self, node: Transform, above: int, between: Floats) -> tuple[int, Floats]:
        """Add the joint of a transform; return its number and the second part of the transform."""
        if not np.array_equal(between[:3, :3], np.eye(3)):
            above = self._append(f"{node.name}_base", above, between, None, np.zeros(3))
            between = np.eye(4)
        turn, orient = rotation_matrix(node.rotation), np.eye(4)
        orient[:3, :3] = orientation(node)
        below = orient.T @ translation_matrix((-node.center[0], -node.center[1], -node.center[2]))
        rest = between @ translation_matrix(tuple(translation(node, node.translation))) @ turn @ orient
        scale = np.diag([*node.scale, 1.0])
        if self.scaled(node):
            rest = rest @ scale
        else:
            below = scale @ below
        if np.linalg.matrix_rank(rest[:3, :3]) < 3:
            raise FaceDefTablesError(f"the transform '{node.name}' scales the face to nothing, so it cannot be a joint")
        return self._append(node.name, above, rest, node, between[:3, 3]), below

    def scaled(self, node: Transform) -> bool:
        """Does a joint have the scale of its transform? UsdSkel keeps only 11 bits of it: not where it stays still."""
        return (node.name, TransformField.SCALE) in self._driven

    def _append(self, name: str, above: int, rest: Floats, node: Transform | None, shift: Floats) -> int:
        parent = self.joints[above]
        path = f"{parent.path}/{self._namer.name(name)}"
        self.joints.append(Joint(path, rest, parent.bind @ rest, node, shift))
        return len(self.joints) - 1

    def write(self, stage: Usd.Stage, path: Sdf.Path, axes: StageAxes, animation: Sdf.Path) -> None:
        """Author the skeleton."""
        skeleton = UsdSkel.Skeleton.Define(stage, path)
        skeleton.CreateJointsAttr([joint.path for joint in self.joints])
        skeleton.CreateBindTransformsAttr([gf_matrix(joint.bind, axes) for joint in self.joints])
        skeleton.CreateRestTransformsAttr([gf_matrix(joint.rest, axes) for joint in self.joints])
        binding = UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
        binding.CreateAnimationSourceRel().SetTargets([animation])

    def bind(self, mesh: Usd.Prim, shape: Shape, world: Floats, skeleton: Sdf.Path, axes: StageAxes) -> None:
        """Hang a mesh on its joint.

        world : (4, 4) the matrix of the shape at rest.
        """
        binding = UsdSkel.BindingAPI.Apply(mesh)
        binding.CreateSkeletonRel().SetTargets([skeleton])
        binding.CreateGeomBindTransformAttr(gf_matrix(world, axes))
        # One influence a vertex, though one for the mesh would say the same: not every client takes that.
        count = shape.mesh.vertex_count
        numbers = np.full(count, self.of_shape[shape.name], dtype=np.int32)
        binding.CreateJointIndicesPrimvar(False, 1).Set(Vt.IntArray.FromNumpy(numbers))
        binding.CreateJointWeightsPrimvar(False, 1).Set(Vt.FloatArray.FromNumpy(np.ones(count, np.float32)))

    def animate(
        self,
        animation: UsdSkel.Animation,
        axes: StageAxes,
        driven: Mapping[tuple[str, TransformField], Floats],
        times: Floats,
    ) -> None:
        """Author the motion of the joints that move.

        driven : what `formats.node_motion.driven_fields` gives, over these (f,) times.
        """
        moving = {name for name, _ in driven}
        joints = [joint for joint in self.joints if joint.node is not None and joint.node.name in moving]
        if not joints:
            return
        animation.CreateJointsAttr([joint.path for joint in joints])
        turns, moves, scales = [], [], []
        for joint in joints:
            node = joint.node
            assert node is not None
            turn = driven.get((node.name, TransformField.ROTATION), quaternion(node, node.rotation)[None])
            move = driven.get((node.name, TransformField.TRANSLATION), translation(node, node.translation)[None])
            rest = np.array([node.scale]) if self.scaled(node) else np.ones((1, 3))
            scale = driven.get((node.name, TransformField.SCALE), rest)
            turns.append(np.concatenate([axes.vectors(turn[:, :3]), turn[:, 3:]], axis=1))
            moves.append(axes.vectors(move + joint.shift))
            scales.append(axes.scales(scale))
        _sample(animation.CreateRotationsAttr(), _joined(turns), times, _quaternions)
        _sample(animation.CreateTranslationsAttr(), _joined(moves), times, _singles)
        _sample(animation.CreateScalesAttr(), _joined(scales), times, _halves)


def gf_matrix(matrix: Floats, axes: StageAxes) -> Gf.Matrix4d:
    """A (4, 4) matrix between inside coordinates as one between those of the stage; USD multiplies from the right."""
    turn = np.eye(4)
    turn[:3, :3] = axes.frame.axes
    # Adding zero turns -0.0 into 0.0.
    return Gf.Matrix4d((turn.T @ matrix @ turn + 0.0).T.tolist())


def _joined(values: list[Floats]) -> Floats:
    """(f, joints, k) of one (f, k) or (1, k) a joint; f = 1 where none of them moves."""
    return np.stack(np.broadcast_arrays(*values), axis=1)


def _quaternions(values: Floats) -> Vt.QuatfArray:
    return Vt.QuatfArray([Gf.Quatf(w, Gf.Vec3f(x, y, z)) for x, y, z, w in values.tolist()])


def _singles(values: Floats) -> Vt.Vec3fArray:
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(values, dtype=np.float32))


def _halves(values: Floats) -> Vt.Vec3hArray:
    return Vt.Vec3hArray.FromNumpy(np.ascontiguousarray(values, dtype=np.float16))


def _sample(attribute: Usd.Attribute, values: Floats, times: Floats, convert: Callable[[Floats], Any]) -> None:
    if len(values) == 1:
        attribute.Set(convert(values[0]))
        return
    for time, row in zip(times.tolist(), values, strict=True):
        attribute.Set(convert(row), time)
