"""4x4 matrices as the fields of a `Transform`."""

from __future__ import annotations

import numpy as np

from fba.arrays import Floats
from fba.errors import MeshError
from fba.scene import FaceScene


def transform_fields(matrix: Floats) -> dict[str, tuple[float, ...]]:
    """Take an affine matrix (column vectors) apart into translation, rotation, scale and scale orientation.

    Any shear becomes a scale along turned axes, so nothing is lost. Fields that stay neutral are left out.

    >>> transform_fields(np.diag([2.0, 2.0, 2.0, 1.0]))
    {'scale': (2.0, 2.0, 2.0)}
    """
    linear = np.asarray(matrix)[:3, :3]
    fields: dict[str, tuple[float, ...]] = {}
    if np.any(matrix[:3, 3] != 0.0):
        fields["translation"] = tuple(float(v) for v in matrix[:3, 3])
    if np.count_nonzero(linear - np.diag(np.diag(linear))) == 0:
        turn, axes, scale = np.eye(3), np.eye(3), np.diag(linear)
    else:
        # Polar decomposition: a rotation times a symmetric stretch, the stretch along its own axes.
        u, values, vt = np.linalg.svd(linear)
        turn, axes, scale = u @ vt, vt.T, values
        if np.linalg.det(turn) < 0.0:
            turn, scale = -turn, -scale
        if np.linalg.det(axes) < 0.0:
            axes = -axes
        if np.allclose(scale, scale[0], rtol=1e-12, atol=0.0):
            axes, scale = np.eye(3), np.full(3, scale.mean())
    for name, rotation in (("rotation", turn), ("scale_orientation", axes)):
        axis_angle = _axis_angle(rotation)
        if axis_angle[3] != 0.0:
            fields[name] = axis_angle
    if np.any(scale != 1.0):
        fields["scale"] = tuple(float(v) for v in scale)
    return fields


def _axis_angle(rotation: Floats) -> tuple[float, float, float, float]:
    """Axis and angle of a rotation matrix; angle 0 for the identity."""
    twist = np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    sine, cosine = 0.5 * float(np.linalg.norm(twist)), 0.5 * (float(np.trace(rotation)) - 1.0)
    angle = float(np.arctan2(sine, cosine))
    if angle < 1e-15:
        return (0.0, 0.0, 1.0, 0.0)
    if sine > 1e-6:
        axis = twist / (2.0 * sine)
    else:
        # Near a half turn the axis is the column of (R + I) / 2 with the largest diagonal.
        square = 0.5 * (rotation + np.eye(3))
        column = square[:, int(np.argmax(np.diag(square)))]
        axis = column / np.linalg.norm(column)
        axis = axis if axis @ twist >= 0.0 else -axis
    x, y, z = axis.tolist()
    return (x, y, z, angle)


def into_shape(scene: FaceScene, name: str) -> Floats:
    """(3, 3) that takes world offsets to a shape's own coordinates.

    Raises
    ------
    MeshError
        If a transform above the shape scales it to nothing.
    """
    linear: Floats = scene.world_matrix(name)[:3, :3]
    try:
        inverse = np.linalg.inv(linear)
    except np.linalg.LinAlgError:
        raise MeshError(f"shape '{name}' is scaled to nothing by the transforms above it") from None
    return np.asarray(inverse, dtype=np.float64)
