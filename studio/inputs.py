"""Finding a face's feature points: named on the command line, beside the file, or inside it."""

from __future__ import annotations

from pathlib import Path

from fat.face import AnimatableFace
from fba.feature_points import FeaturePoints
from fba.findings import Finding
from fba.orientation import orient
from fba.scene import FaceScene
from formats.landmarks import landmarks_beside, read_landmarks


def scene_of(found: FaceScene | AnimatableFace) -> FaceScene:
    """The scene of what `formats.read` returned."""
    return found.scene if isinstance(found, AnimatableFace) else found


def points_of(found: FaceScene | AnimatableFace, file: Path, landmarks: Path | None) -> FeaturePoints | None:
    """Feature points of a file just read, in the file's own axes: given, beside the file, inside it, or None."""
    if landmarks is not None:
        return read_landmarks(landmarks, scene_of(found))
    if isinstance(found, AnimatableFace):
        return found.feature_points
    beside = landmarks_beside(file)
    return None if beside is None else read_landmarks(beside, scene_of(found))


def target_points(
    scene: FaceScene, file: Path, landmarks: Path | None
) -> tuple[FaceScene, FeaturePoints | None, list[Finding]]:
    """Read a plain mesh's feature points and turn the scene upright by them; findings say what was turned."""
    points = points_of(scene, file, landmarks)
    if points is None:
        message = (
            "no feature points: give --landmarks POINTS.json, or put "
            f"{file.stem}.fps.json beside the file, to make this face animatable"
        )
        return scene, None, [Finding("info", "no-feature-points", message)]
    scene, points, findings = orient(scene, points)
    return scene, points, findings
