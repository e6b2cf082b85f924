"""Faces that the tests of cloning share."""

from __future__ import annotations

import numpy as np
import pytest
from remade import bare, warped

from cloning.prepare import PreparedFace, prepare
from fat import AnimatableFace
from fba import FaceScene, FeaturePoints
from fba.arrays import Floats
from formats import read_face


@pytest.fixture(scope="session")
def source() -> AnimatableFace:
    """The shipped source."""
    return read_face("default")


@pytest.fixture(scope="session")
def wide(source: AnimatableFace) -> tuple[FaceScene, FeaturePoints]:
    """The source's head with other proportions: wider, longer chin; symmetric like the source."""
    scene, points = bare(source)
    place = points.positions(scene)
    es0 = float(place["3.5"][0] - place["3.6"][0])
    middle = 0.5 * (place["3.5"] + place["3.6"])

    def warp(v: Floats) -> Floats:
        local = (v - middle) / es0
        below = np.clip(-local[:, 1], 0.0, None)
        x = local[:, 0] * (1.1 + 0.06 * np.tanh(below))
        y = local[:, 1] - 0.08 * below**1.5
        z = local[:, 2] * 0.95 + 0.05 * np.tanh(below)
        return np.stack([x, y, z], axis=1) * es0 * 1.3

    return warped(scene, points, warp)


@pytest.fixture(scope="session")
def mine(source: AnimatableFace) -> PreparedFace:
    """The shipped source, prepared."""
    return prepare(source.scene, source.feature_points, "source")


@pytest.fixture(scope="session")
def yours(wide: tuple[FaceScene, FeaturePoints]) -> PreparedFace:
    """The head with other proportions, prepared."""
    return prepare(*wide, "target")
