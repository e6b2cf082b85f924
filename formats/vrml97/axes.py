"""Turn scenes and table entries between the file's axes and the inside ones (see `fba.scene.Frame`); exact."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fba.arrays import Floats
from fba.orientation import turn_scene
from fba.scene import FaceScene, Frame, Node

Turn = Callable[[Floats], Floats]
"""`Frame.to_file` or `Frame.from_file` of one frame."""


def turn_axis(axis: tuple[float, ...], turn: Turn) -> tuple[float, float, float]:
    """Turn the axis of a rotation: it changes sign under a mirroring."""
    sign = np.sign(np.linalg.det(turn(np.eye(3))))
    x, y, z = (float(c) for c in turn(np.asarray(axis)) * sign)
    return x, y, z


def turn_point(point: tuple[float, ...], turn: Turn) -> tuple[float, float, float]:
    """Turn a point or vector."""
    x, y, z = (float(c) for c in turn(np.asarray(point, dtype=np.float64)))
    return x, y, z


def turn_sizes(sizes: tuple[float, ...], turn: Turn) -> tuple[float, float, float]:
    """Turn scale factors: they change places, not signs."""
    x, y, z = (float(c) for c in turn(np.asarray(sizes)) * turn(np.ones(3)))
    return x, y, z


def in_file_axes(scene: FaceScene) -> tuple[Node, ...]:
    """The roots of a scene in the file's own axes and winding."""
    return turn_scene(scene, scene.frame.axes.T, scene.frame.reversed_winding).roots


def from_file_axes(scene: FaceScene, frame: Frame) -> FaceScene:
    """Turn a scene that is still in its file's axes: the reverse of `in_file_axes`."""
    return replace(turn_scene(scene, frame.axes, frame.reversed_winding), frame=frame)
