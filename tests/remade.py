"""Faces made from faces, for the tests of cloning."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fat import AnimatableFace
from fba import FaceScene, FeaturePoint, FeaturePoints, Role, Shape
from fba.arrays import Floats


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


def roleless(scene: FaceScene) -> FaceScene:
    """The same shapes without roles."""
    return replace(scene, roots=tuple(replace(s, role=Role.OTHER) for s in scene.shapes))
