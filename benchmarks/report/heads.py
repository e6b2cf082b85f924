"""One shipped head at three sizes: as it is, subdivided once, and subdivided twice with more vertices on top."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cloning.prepare import PreparedFace, prepare
from cloning.refine import refine
from cloning.source import source_motions
from fat.face import AnimatableFace
from fba.arrays import Floats
from fba.feature_points import FeaturePoints
from fba.mesh import PolyMesh
from fba.scene import FaceScene, Shape
from formats import read_face, read_scene
from formats.landmarks import read_landmarks
from samples import sample

HEAD = "closed_head"
"""5,346 vertices in one skin: subdivided, all of them are skin."""

SIZES = {"5k": (0, 0), "20k": (1, 0), "100k": (2, 100_000)}
"""Subdivisions, each with four times the vertices, and how many vertices there are to be at least."""

MOTIONS = 88


@dataclass(frozen=True, eq=False)
class Sized:
    """A head of some size with its feature points."""

    scene: FaceScene
    points: FeaturePoints


def sized(size: str) -> Sized:
    """The head at one of the sizes."""
    path = sample(f"faces/{HEAD}.obj")
    scene = read_scene(path)
    points = read_landmarks(path.with_suffix(".fps.json"), scene)
    shape = scene.shapes[0]
    mesh = shape.mesh
    subdivisions, least = SIZES[size]
    for _ in range(subdivisions):
        step = refine(mesh.indices, mesh.offsets, mesh.vertex_count)
        # Old vertices come first, so feature points stay on theirs.
        mesh = PolyMesh(step.matrix @ mesh.vertices, *step.polygons)
    mesh = with_middles(mesh, least - mesh.vertex_count)
    return Sized(FaceScene((Shape(shape.name, mesh),), name=f"{HEAD}_{size}"), points)


def with_middles(mesh: PolyMesh, count: int) -> PolyMesh:
    """A mesh of quadrangles whose largest ones, `count` of them, are four triangles around a vertex in their middle."""
    if count <= 0:
        return mesh
    quads = mesh.indices.reshape(-1, 4)
    corners = mesh.vertices[quads]
    area = np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]), axis=1)
    split = np.zeros(len(quads), dtype=bool)
    split[np.argsort(-area, kind="stable")[:count]] = True
    middles = mesh.vertex_count + np.arange(count)
    fans = [np.stack([quads[split, k], quads[split, (k + 1) % 4], middles], axis=1) for k in range(4)]
    faces = [*quads[~split], *np.concatenate(fans)]
    return PolyMesh.from_faces(np.concatenate([mesh.vertices, corners[split].mean(axis=1)]), faces)


def source() -> tuple[AnimatableFace, PreparedFace]:
    """The shipped source, and the same made ready."""
    face = read_face("default")
    return face, prepare(face.scene, face.feature_points, "source")


def skin_motions(face: AnimatableFace, prepared: PreparedFace) -> Floats:
    """(n, 88, 3) motions of the source's skin, evenly taken from all of its tables."""
    skins = [prepared.skin.join(m.offsets) for m in source_motions(face)]
    return np.stack([skins[int(k * len(skins) / MOTIONS)] for k in range(MOTIONS)], axis=1)
