"""Cylindrical projection of a normalized face (Facial Motion Cloning, section "Aligning source and target face")."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fba.arrays import Floats, Ints

MOUTH_HALF_ANGLE = 0.5
"""Half of the mouth's constant angular width, radians; the paper fixes that it is constant, not its value."""


@dataclass(frozen=True, slots=True)
class Cylinder:
    """Where the axis lies and which angle is zero.

    Attributes
    ----------
    x, z : position of the vertical axis.
    zero : angle of the nose tip.
    """

    x: float
    z: float
    zero: float

    def project(self, places: Floats) -> tuple[Floats, Floats]:
        """(n, 3) places to (n, 2) angle and height, and (n,) depth measured from outside."""
        x, z = places[:, 0] - self.x, places[:, 2] - self.z
        angle = np.arctan2(x, z) - self.zero
        angle = np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi
        return np.stack([angle, places[:, 1]], axis=1), -np.hypot(x, z)


def cylinder(positions: Mapping[str, Floats]) -> Cylinder:
    """The cylinder in which the mouth corners 8.3 and 8.4 span a constant angle and 9.3 is at angle zero."""
    left, right, tip = positions["8.3"], positions["8.4"], positions["9.3"]
    half = 0.5 * abs(float(left[0] - right[0]))
    x = 0.5 * float(left[0] + right[0])
    z = 0.5 * float(left[2] + right[2]) - half / np.tan(MOUTH_HALF_ANGLE)
    return Cylinder(x, float(z), float(np.arctan2(tip[0] - x, tip[2] - z)))


def head_cylinder(positions: Mapping[str, Floats]) -> Cylinder:
    """The cylinder about the spine: the axis goes through 7.1, the head's pivot, and 9.3 is at angle zero.

    An axis that lies before the throat would put the throat beside the nape.
    """
    pivot, tip = positions["7.1"], positions["9.3"]
    x, z = float(pivot[0]), float(pivot[2])
    return Cylinder(x, z, float(np.arctan2(tip[0] - x, tip[2] - z)))


def round_the_back(plane: Floats, triangles: Ints) -> tuple[Floats, Ints]:
    """Triangles that cross the seam at +-pi once at its left and once at its right.

    Returns
    -------
    points : (3n, 2), the plane, and the plane one turn to the left and to the right.
    triangles : (t', 3) into these points; modulo n they are the vertices.
    """
    n = len(plane)
    turn = np.array([2.0 * np.pi, 0.0])
    points = np.concatenate([plane, plane + turn, plane - turn])
    across = np.ptp(plane[triangles][:, :, 0], axis=1) > np.pi
    split = triangles[across]
    left = split + np.where(plane[split][:, :, 0] < 0.0, n, 0)
    right = split + np.where(plane[split][:, :, 0] > 0.0, 2 * n, 0)
    return points, np.concatenate([triangles[~across], left, right])
