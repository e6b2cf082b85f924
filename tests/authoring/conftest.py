"""Prepared faces that the tests of constructions share."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from cloning.prepare import PreparedFace, prepare
from formats import read_face, read_scene
from formats.landmarks import read_landmarks
from samples import sample


@cache
def _shipped(name: str) -> PreparedFace:
    if name == "source":
        face = read_face("default")
        return prepare(face.scene, face.feature_points, "source")
    scene = read_scene(sample(f"faces/{name}.obj"))
    return prepare(scene, read_landmarks(sample(f"faces/{name}.fps.json"), scene), "source")


@pytest.fixture(scope="session")
def shipped() -> Callable[[str], PreparedFace]:
    """A shipped face by name, "source" or one of the plain heads, at rest."""
    return _shipped


@pytest.fixture(scope="session")
def ict(shared: Path) -> PreparedFace:
    """ICT-FaceKit's neutral face: dense triangles, gums that are one mesh with the tongue, eyes of several layers."""
    scene = read_scene(shared / "faces" / "ict-facekit" / "generic_neutral_mesh.obj")
    return prepare(scene, read_landmarks(shared / "landmarks" / "ict.json", scene), "source")
