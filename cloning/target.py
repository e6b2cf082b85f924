"""A target as it is given: its scene, and its feature points, detected where none or too few are given."""

from __future__ import annotations

from dataclasses import replace

from cloning.detect.detect import detect_points
from cloning.prepare import DERIVED, NECESSARY, PreparedFace, prepare, require_finite
from fat.face import AnimatableFace
from fat.rig import unrig
from fba.feature_points import FeaturePoints
from fba.findings import Finding
from fba.scene import FaceScene


def target_points(
    source: PreparedFace,
    onto: FaceScene | AnimatableFace,
    landmarks: FeaturePoints | None,
    detector: str = "auto",
) -> tuple[FaceScene, FeaturePoints, tuple[Finding, ...]]:
    """The target without transforms of its own, its feature points, and what is uncertain about them.

    Where some of the points that cloning needs are not given, they are detected, and those given hold the others.

    Parameters
    ----------
    detector : how they are detected (see `cloning.detect`).

    Raises
    ------
    LandmarkError
        If there are no points and no face is found.
    MeshError
        If a vertex is not finite.
    """
    if isinstance(onto, AnimatableFace):
        return unrig(onto), onto.feature_points if landmarks is None else landmarks, ()
    if landmarks is not None and all(key in landmarks or key in DERIVED for key in NECESSARY):
        return onto, landmarks, ()
    require_finite(onto)
    found = detect_points(onto, source, landmarks, detector=detector)
    return onto, found.points, found.findings


def prepare_target(
    source: PreparedFace, onto: FaceScene | AnimatableFace, landmarks: FeaturePoints | None
) -> PreparedFace:
    """Make a target ready for cloning."""
    scene, points, findings = target_points(source, onto, landmarks)
    face = prepare(scene, points, "target")
    return replace(face, findings=(*findings, *face.findings))
