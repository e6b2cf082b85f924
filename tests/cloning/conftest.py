"""Faces that the tests of cloning share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fat import AnimatableFace
from fba import FaceScene, FeaturePoint, FeaturePoints, Role, Shape
from fba.arrays import Floats
from formats import read_face


@pytest.fixture(scope="session")
def source() -> AnimatableFace:
    """The shipped source."""
    return read_face("default")


def bare(face: AnimatableFace) -> tuple[FaceScene, FeaturePoints]:
    """The shapes of a face without transforms, as a plain mesh file would hold them."""
    shapes = tuple(replace(s, mesh=s.mesh.with_vertices(face.scene.world_vertices(s.name))) for s in face.scene.shapes)
    return FaceScene(shapes, name="bare"), face.feature_points


def warped(
    scene: FaceScene, points: FeaturePoints, warp: Callable[[Floats], Floats]
) -> tuple[FaceScene, FeaturePoints]:
    """The same shapes with all vertices moved by a function, free points too."""
    shapes = tuple(
        Shape(s.name, s.mesh.with_vertices(warp(scene.world_vertices(s.name))), s.role, s.materials)
        for s in scene.shapes
    )
    moved = {
        key: p if p.point is None else FeaturePoint.free(warp(np.array([p.point]))[0]) for key, p in points.items()
    }
    return FaceScene(shapes, name="warped"), FeaturePoints(moved)


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


def roleless(scene: FaceScene) -> FaceScene:
    """The same shapes without roles."""
    return replace(scene, roots=tuple(replace(s, role=Role.OTHER) for s in scene.shapes))
