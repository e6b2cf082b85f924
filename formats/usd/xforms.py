"""Transforms of a scene as xformOps, and back; any affine matrix of other origin is taken apart."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom

from fba.arrays import Floats
from fba.errors import UnsupportedFeatureError
from fba.scene import Node, Transform
from formats.usd.axes import StageAxes, Vector
from formats.usd.properties import get, put

Rotation = tuple[float, float, float, float]
NO_ROTATION: Rotation = (0.0, 0.0, 1.0, 0.0)
_PIVOT = "pivot"
_SCALE_AXES = "scaleAxes"
_ORDER = (
    "xformOp:translate",
    "xformOp:translate:pivot",
    "xformOp:orient",
    "xformOp:orient:scaleAxes",
    "xformOp:scale",
    "!invert!xformOp:orient:scaleAxes",
    "!invert!xformOp:translate:pivot",
)
_PLAIN_ORDER = tuple(name for name in _ORDER if _SCALE_AXES not in name)
SHEAR = 1e-12
"""Columns of a matrix whose scalar product is below this share of the largest are taken as perpendicular."""
LOSS = 1e-9
"""A matrix is taken apart correctly when what it is put together from differs by less than this share."""


@dataclass(frozen=True)
class Placement:
    """The fields of a Transform, without its name and children."""

    translation: Vector = (0.0, 0.0, 0.0)
    rotation: Rotation = NO_ROTATION
    scale: Vector = (1.0, 1.0, 1.0)
    scale_orientation: Rotation = NO_ROTATION
    center: Vector = (0.0, 0.0, 0.0)

    def node(self, name: str, children: tuple[Node, ...]) -> Transform:
        """The Transform."""
        return Transform(
            name, children, self.translation, self.rotation, self.scale, self.scale_orientation, self.center
        )


def write_transform(prim: Usd.Prim, transform: Transform, axes: StageAxes) -> None:
    """Author a Transform as ops of the same meaning; ``xformOp:orient`` is there for animation even at rest."""
    xform = UsdGeom.Xformable(prim)
    double = UsdGeom.XformOp.PrecisionDouble
    turned = transform.scale_orientation != NO_ROTATION
    xform.AddTranslateOp(double).Set(Gf.Vec3d(*axes.vector(transform.translation)))
    xform.AddTranslateOp(double, _PIVOT).Set(Gf.Vec3d(*axes.vector(transform.center)))
    _write_rotation(prim, xform.AddOrientOp(double), "rotation", transform.rotation, axes)
    if turned:
        _write_rotation(
            prim, xform.AddOrientOp(double, _SCALE_AXES), "scaleOrientation", transform.scale_orientation, axes
        )
    xform.AddScaleOp(double).Set(Gf.Vec3d(*axes.scale(transform.scale)))
    if turned:
        xform.AddOrientOp(double, _SCALE_AXES, True)
    xform.AddTranslateOp(double, _PIVOT, True)


def write_matrix(prim: Usd.Prim, matrix: Gf.Matrix4d) -> None:
    """Author a matrix as the one op of a prim; nothing for the identity."""
    if matrix != Gf.Matrix4d(1.0):
        UsdGeom.Xformable(prim).AddTransformOp(UsdGeom.XformOp.PrecisionDouble).Set(matrix)


def _write_rotation(prim: Usd.Prim, op: UsdGeom.XformOp, name: str, rotation: Rotation, axes: StageAxes) -> None:
    x, y, z = axes.vector(rotation[:3])
    turned = (x, y, z, rotation[3])
    op.Set(_quaternion(turned))
    if _axis_angle(_quaternion(turned)) != turned:
        put(prim, name, Sdf.ValueTypeNames.Double4, Gf.Vec4d(*turned))


def read_placement(prim: Usd.Prim, axes: StageAxes) -> Placement:
    """The fields of a Transform from a prim's ops, inside axes.

    Raises
    ------
    UnsupportedFeatureError
        If the ops reset the parents' transforms or make up a perspective.
    """
    xform = UsdGeom.Xformable(prim)
    if xform.GetResetXformStack():
        raise UnsupportedFeatureError(
            f"{prim.GetPath()} resets the transforms of its parents (resetXformStack); move it out of them first"
        )
    ops = {op.GetOpName(): op for op in xform.GetOrderedXformOps()}
    if tuple(ops) not in (_ORDER, _PLAIN_ORDER):
        return _from_matrix(_local_matrix(xform, list(ops.values())), str(prim.GetPath()), axes)

    def triple(name: str) -> Vector:
        x, y, z = value_of(ops[name].GetAttr())
        return float(x), float(y), float(z)

    turned = _ORDER[3] in ops
    return Placement(
        axes.back(triple(_ORDER[0])),
        _read_rotation(prim, ops[_ORDER[2]], "rotation", axes),
        axes.scale_back(triple(_ORDER[4])),
        _read_rotation(prim, ops[_ORDER[3]], "scaleOrientation", axes) if turned else NO_ROTATION,
        axes.back(triple(_ORDER[1])),
    )


def value_of(attribute: Usd.Attribute) -> Any:
    """The value of an attribute at rest: its default, or its first time sample when it has only these."""
    value = attribute.Get()
    return attribute.Get(Usd.TimeCode.EarliestTime()) if value is None else value


def _read_rotation(prim: Usd.Prim, op: UsdGeom.XformOp, name: str, axes: StageAxes) -> Rotation:
    stored = Gf.Quatd(value_of(op.GetAttr()))
    exact = get(prim, name)
    turned: Rotation = (exact[0], exact[1], exact[2], exact[3]) if exact is not None else NO_ROTATION
    if exact is None or _quaternion(turned) != stored:
        turned = _axis_angle(stored)
    x, y, z = axes.back(turned[:3])
    return x, y, z, turned[3]


def _quaternion(rotation: Rotation) -> Gf.Quatd:
    axis = np.asarray(rotation[:3], dtype=np.float64)
    length = float(np.linalg.norm(axis))
    if length == 0.0 or rotation[3] == 0.0:
        return Gf.Quatd(1.0)
    half = 0.5 * rotation[3]
    return Gf.Quatd(float(np.cos(half)), Gf.Vec3d(*(float(c) for c in np.sin(half) * axis / length)))


def _axis_angle(quaternion: Gf.Quatd) -> Rotation:
    real, axis = quaternion.GetReal(), np.array(quaternion.GetImaginary())
    length = float(np.linalg.norm(axis))
    if length == 0.0:
        return NO_ROTATION
    angle = 2.0 * float(np.arctan2(length, real))
    x, y, z = (float(c) for c in axis / length)
    return x, y, z, angle


def _local_matrix(xform: UsdGeom.Xformable, ops: list[UsdGeom.XformOp]) -> Floats:
    still = all(op.GetAttr().Get() is not None for op in ops)
    time = Usd.TimeCode.Default() if still else Usd.TimeCode.EarliestTime()
    matrix: Floats = np.array(xform.GetLocalTransformation(time), dtype=np.float64).T
    return matrix


def _from_matrix(matrix: Floats, where: str, axes: StageAxes) -> Placement:
    """Take a matrix (column vectors, stage axes) apart as rotation times stretch along some axes."""
    if not np.all(np.isfinite(matrix)) or not np.array_equal(matrix[3], [0.0, 0.0, 0.0, 1.0]):
        raise UnsupportedFeatureError(f"{where} has a transform that is not affine; bake it into the points first")
    turn = np.eye(4)
    turn[:3, :3] = axes.frame.axes
    matrix = turn @ matrix @ turn.T
    rotation, factors, orientation = _polar(matrix[:3, :3])
    x, y, z = (float(c) for c in matrix[:3, 3])
    a, b, c = (float(f) for f in factors)
    placement = Placement((x, y, z), _of_matrix(rotation), (a, b, c), _of_matrix(orientation))
    error = np.abs(placement.node("", ()).matrix() - matrix).max()
    if error > LOSS * max(float(np.abs(matrix).max()), 1.0):
        raise UnsupportedFeatureError(f"{where} has a transform that cannot be taken apart; bake it into the points")
    return placement


def _polar(linear: Floats) -> tuple[Floats, Floats, Floats]:
    """Rotation R, factors s and rotation V with ``linear = R V diag(s) V^T``; V is I unless there is shear."""
    gram = linear.T @ linear
    factors = np.sqrt(np.diag(gram))
    orientation = np.eye(3)
    if np.all(np.abs(gram - np.diag(np.diag(gram))) <= SHEAR * gram.max()) and factors.min() > 0.0:
        rotation = linear / factors
    else:
        left, factors, right = np.linalg.svd(linear)
        rotation = left @ right
        orientation = right.T * np.sign(np.linalg.det(right))
    if np.linalg.det(rotation) < 0.0:
        return -rotation, -factors, orientation
    return rotation, factors, orientation


def _of_matrix(rotation: Floats) -> Rotation:
    from scipy.spatial.transform import Rotation as ScipyRotation

    if np.array_equal(rotation, np.eye(3)):
        return NO_ROTATION
    x, y, z, real = (float(c) for c in ScipyRotation.from_matrix(rotation).as_quat())
    return _axis_angle(Gf.Quatd(real, Gf.Vec3d(x, y, z)))
