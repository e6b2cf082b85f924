"""The faces of a comparison: read, and their feature points found once, so that all clones of a face have the same."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from cloning.backends import find_backend
from cloning.detect import detect_points
from cloning.prepare import PreparedFace, prepare
from fat.face import AnimatableFace
from fba.errors import FbaError
from fba.feature_points import FeaturePoints
from fba.findings import Finding
from fba.scene import FaceScene
from formats import read, read_face
from studio.comparison import Way
from studio.inputs import points_of

AUTO = "auto"
"""The detector of all backends in their default mode."""


@dataclass(frozen=True, eq=False)
class Model:
    """A face of the comparison.

    Attributes
    ----------
    name : the file's, without its extension; with its folder where several files have one name.
    path : as given; two models of one path are one face.
    neutral : what was read, a plain scene or a face with tables.
    points : feature points in the file's axes; None where they have to be found.
    found : the points were found, not given.
    """

    name: str
    path: str
    neutral: FaceScene | AnimatableFace
    points: FeaturePoints | None
    found: bool = False

    def points_for(self, way: Way) -> FeaturePoints | None:
        """The points; None where a published backend is to find them by its own detector."""
        its_own = way.as_published and find_backend(way.backend).detector != AUTO
        return None if self.found and its_own else self.points


def read_model(path: str) -> Model:
    """Read a face with or without tables; "default" is the shipped source."""
    found = read(path)
    return Model(path if path == "default" else Path(path).stem, path, found, points_of(found, Path(path), None))


def read_models(paths: Sequence[str]) -> tuple[dict[str, Model], list[Finding]]:
    """Read faces and find their feature points; a face that cannot be used is left out, and a finding says why."""
    models: dict[str, Model] = {}
    findings: list[Finding] = []
    known: PreparedFace | None = None
    for path in dict.fromkeys(paths):
        try:
            model = read_model(path)
            if model.points is None and isinstance(model.neutral, FaceScene):
                known = known or _shipped()
                model = replace(model, points=detect_points(model.neutral, known).points, found=True)
            models[path] = model
        except FbaError as error:
            findings.append(Finding("error", "left-out", f"left out: {error}", path))
    return _told_apart(models), findings


def _told_apart(models: dict[str, Model]) -> dict[str, Model]:
    """Files of one name get their folder's before it."""
    names = [model.name for model in models.values()]

    def name(model: Model) -> str:
        return model.name if names.count(model.name) == 1 else f"{Path(model.path).absolute().parent.name}/{model.name}"

    return {path: replace(model, name=name(model)) for path, model in models.items()}


def _shipped() -> PreparedFace:
    face = read_face("default")
    return prepare(face.scene, face.feature_points, "source")
