"""The axes of a stage: USD is right-handed with Y or Z up, faces come in any axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdGeom

from fba.arrays import Floats
from fba.scene import FaceScene, Frame
from formats.usd.properties import get, put, put_array

Vector = tuple[float, float, float]
FALLBACK_METERS_PER_UNIT = 0.01
"""What USD takes for a stage that does not say."""


@dataclass(frozen=True)
class UsdDocument:
    """What a stage says besides its geometry; kept in FaceScene.document."""

    up_axis: str


@dataclass(frozen=True, eq=False)
class StageAxes:
    """How inside vectors lie in the stage.

    Attributes
    ----------
    frame : ``inside = frame.axes @ stage``; never mirrored.
    up_axis : "Y" or "Z".
    """

    frame: Frame
    up_axis: str

    def vectors(self, values: NDArray[Any]) -> Floats:
        """(..., 3) vectors or points from inside axes to the stage's; exact."""
        return self.frame.to_file(values)

    def vector(self, value: Vector) -> Vector:
        """One vector, point or rotation axis to the stage's axes; exact, as the axes are not mirrored."""
        return _triple(self.frame.to_file(np.asarray(value, dtype=np.float64)))

    def back(self, value: Vector) -> Vector:
        """One vector, point or rotation axis from the stage's axes; exact."""
        return _triple(self.frame.from_file(np.asarray(value, dtype=np.float64)))

    def scale(self, value: Vector) -> Vector:
        """Scale factors along the inside axes, as factors along the stage's; exact."""
        return _triple(np.abs(self.frame.axes.T) @ np.asarray(value, dtype=np.float64))

    def scales(self, values: Floats) -> Floats:
        """(..., 3) scale factors along the inside axes, as factors along the stage's; exact."""
        factors: Floats = values @ np.abs(self.frame.axes)
        return factors

    def scale_back(self, value: Vector) -> Vector:
        """Scale factors along the stage's axes, as factors along the inside ones; exact."""
        return _triple(np.abs(self.frame.axes) @ np.asarray(value, dtype=np.float64))


def _triple(values: Floats) -> Vector:
    # Adding zero turns -0.0 into 0.0.
    x, y, z = (float(v) + 0.0 for v in values)
    return x, y, z


def axes_for(scene: FaceScene) -> StageAxes:
    """The file's own axes where USD knows them: right-handed, Y or Z up; else the inside axes."""
    frame = scene.frame
    if frame.identity and isinstance(scene.document, UsdDocument):
        return StageAxes(frame, scene.document.up_axis)
    up = frame.to_file(np.array([0.0, 1.0, 0.0]))
    if round(float(np.linalg.det(frame.axes))) == 1:
        if up[1] == 1.0:
            return StageAxes(frame, "Y")
        if up[2] == 1.0:
            return StageAxes(frame, "Z")
    return StageAxes(Frame(), "Y")


def write_axes(stage: Usd.Stage, root: Usd.Prim, scene: FaceScene, axes: StageAxes) -> None:
    """Author up axis and unit of the stage, and keep the scene's own frame."""
    UsdGeom.SetStageUpAxis(stage, axes.up_axis)
    known = scene.meters_per_unit is not None
    UsdGeom.SetStageMetersPerUnit(stage, scene.meters_per_unit if known else FALLBACK_METERS_PER_UNIT)
    put(root, "metersPerUnitKnown", Sdf.ValueTypeNames.Bool, known)
    put_array(root, "stageAxes", axes.frame.axes)
    put_array(root, "fileAxes", scene.frame.axes)
    put(root, "reversedWinding", Sdf.ValueTypeNames.Bool, scene.frame.reversed_winding)


def read_axes(stage: Usd.Stage, root: Usd.Prim | None) -> tuple[StageAxes, Frame, float | None]:
    """Axes of the stage, frame of the scene, metres per unit if the file knows them.

    root : the prim that `write_axes` wrote to; None for a stage of other origin.
    """
    up = str(UsdGeom.GetStageUpAxis(stage))
    meters = float(UsdGeom.GetStageMetersPerUnit(stage)) if UsdGeom.StageHasAuthoredMetersPerUnit(stage) else None
    if root is None or get(root, "stageAxes") is None:
        return StageAxes(Frame(), up), Frame(), meters
    stage_frame = Frame(np.array(get(root, "stageAxes"), dtype=np.float64))
    frame = Frame(np.array(get(root, "fileAxes"), dtype=np.float64), bool(get(root, "reversedWinding")))
    return StageAxes(stage_frame, up), frame, meters if get(root, "metersPerUnitKnown") else None
