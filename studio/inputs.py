"""Finding a face's feature points: named on the command line, beside the file, or inside it."""

from __future__ import annotations

from pathlib import Path

from fat.face import AnimatableFace
from fba.feature_points import FeaturePoints
from fba.findings import Finding
from fba.orientation import orient
from fba.scene import FaceScene
from formats.landmarks import landmarks_beside, read_landmarks
from formats.textures import left_out, missing_textures


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


def left_behind(scene: FaceScene, read_from: Path, written_to: Path) -> list[Finding]:
    """Textures that the file that was read names, but that are neither beside nor in the one that was written."""
    gone = missing_textures(scene)
    if written_to.suffix.lower() in (".glb", ".gltf"):
        from formats.gltf.materials import left_out as not_in_gltf

        lost, advice = not_in_gltf(scene), "make a PNG or JPEG, which glTF can hold, of the texture {}"
    else:
        lost = left_out(scene)
        advice = "the texture {} is no image of a known kind and is not copied; make a PNG or JPEG of it"
    folder = read_from.parent
    found = [
        Finding("warning", "texture-missing", f"{name}: {read_from.name} names this texture, but it is not in {folder}")
        for name in gone
    ]
    return found + [
        Finding("warning", "texture-left-behind", advice.replace("{}", name, 1)) for name in lost if name not in gone
    ]


def target_points(
    scene: FaceScene, file: Path, landmarks: Path | None
) -> tuple[FaceScene, FeaturePoints | None, list[Finding]]:
    """Read a plain mesh's feature points and turn the scene upright by them; findings say what was turned."""
    points = points_of(scene, file, landmarks)
    if points is None:
        message = (
            "no feature points are given: fba clone detects them, fba landmarks shows them; --landmarks POINTS.json "
            f"or {file.stem}.fps.json beside the file gives them"
        )
        return scene, None, [Finding("info", "no-feature-points", message)]
    scene, points, findings = orient(scene, points)
    return scene, points, findings
