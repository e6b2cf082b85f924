"""A FAP stream as the SkelAnimation of a stage: weights of blend shapes and motion of joints over time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from pxr import Sdf, Usd, UsdSkel, Vt

from fat.evaluate import Player
from fat.face import AnimatableFace
from fat.tables import TransformField
from fba.arrays import Floats
from fba.errors import FapStreamError
from fba.stream import FapStream
from formats.node_motion import driven_fields
from formats.usd.axes import StageAxes
from formats.usd.joints import Rig


@dataclass(frozen=True, eq=False)
class Motion:
    """A stream, played on the tables of a face.

    Attributes
    ----------
    times : (f,) time codes, one a frame of the stream's rate; the first is 0.
    values : (f, tables), fighting FAPs already combined.
    driven : what the tables do to transforms; see `formats.node_motion.driven_fields`.
    """

    times: Floats
    frame_rate: float
    values: Floats
    driven: Mapping[tuple[str, TransformField], Floats]


def motion_of(face: AnimatableFace, stream: FapStream) -> Motion:
    """Play a stream.

    Raises
    ------
    FapStreamError
        If it has no frames.
    """
    if not len(stream):
        raise FapStreamError(f"the stream '{stream.name}' has no frames")
    values = Player(face).table_values(stream)
    times = (stream.frame_numbers - stream.frame_numbers[0]).astype(np.float64)
    return Motion(times, stream.frame_rate, values, driven_fields(face.scene, face.tables, values))


def write_animation(
    stage: Usd.Stage,
    path: Sdf.Path,
    tokens: Iterable[str],
    rig: Rig,
    axes: StageAxes,
    motion: Motion | None,
    weights: Mapping[str, Floats],
) -> None:
    """Author the animation of a stage; without a motion all weights are 0 and the joints rest.

    Parameters
    ----------
    tokens : names of the blend shapes of all meshes, each once.
    weights : (f,) weights over the motion's times; names that are absent stay 0.
    """
    names = list(tokens)
    animation = UsdSkel.Animation.Define(stage, path)
    if names:
        animation.CreateBlendShapesAttr(names)
        attribute = animation.CreateBlendShapeWeightsAttr()
        attribute.Set(Vt.FloatArray.FromNumpy(np.zeros(len(names), np.float32)))
    if motion is None:
        return
    stage.SetTimeCodesPerSecond(motion.frame_rate)
    stage.SetFramesPerSecond(motion.frame_rate)
    stage.SetStartTimeCode(float(motion.times[0]))
    stage.SetEndTimeCode(float(motion.times[-1]))
    if names:
        still = np.zeros(len(motion.times))
        rows = np.stack([weights.get(name, still) for name in names], axis=1).astype(np.float32)
        for time, row in zip(motion.times.tolist(), rows, strict=True):
            attribute.Set(Vt.FloatArray.FromNumpy(row), time)
    rig.animate(animation, axes, motion.driven, motion.times)
