"""Three plain heads that cannot move yet, each in another topology, with feature points beside."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from fba.arrays import Floats
from fba.feature_points import FeaturePoint, FeaturePoints
from fba.mesh import PolyMesh
from fba.scene import FaceScene, Shape
from formats import write
from formats.landmarks import write_landmarks
from samples.build.closed import closed_head
from samples.build.head import Head
from samples.build.makehuman import MakeHuman
from samples.build.phenotypes import KnownHead, decimated, phenotype_a, phenotype_b, transfer_points
from samples.build.subdivide import catmull_clark
from samples.build.surface import nearest_facing

TRI_VERTICES = 2800
CENTIMETRES = 10.0
"""In one of MakeHuman's decimetres."""
DECIMALS = 5
"""Of the coordinates in the written files."""


def subdivided(head: Head, names: tuple[str, ...] = ()) -> KnownHead:
    """A head after one Catmull-Clark step, quads only, without lashes, and the truth of these units on it."""
    shapes, places, matrices = [], {}, {}
    for shape in head.scene.shapes:
        if shape.name.startswith("lashes"):
            continue
        mesh, matrices[shape.name] = catmull_clark(shape.mesh, smooth="teeth" not in shape.name)
        places[shape.name] = nearest_facing(mesh.vertices, mesh.vertex_normals(), shape.mesh)
        shapes.append(Shape(shape.name, mesh, shape.role, shape.materials[:1]))
    scene = FaceScene(tuple(shapes), meters_per_unit=0.1, name="quad_head")
    points = FeaturePoints(transfer_points(head, scene, places))
    units = {n: {s: matrix @ head.unit(n)[s] for s, matrix in matrices.items()} for n in names}
    return KnownHead(scene, points, units)


def write_heads(makehuman: MakeHuman, folder: Path) -> None:
    """Write quad_head.obj, tri_head.obj and closed_head.obj, and a landmark file beside each."""
    quad = subdivided(phenotype_a(makehuman))
    tri = decimated(phenotype_b(makehuman), TRI_VERTICES, ())
    middle = _box(tri.scene).mean(axis=0)
    for name, scene, points in (
        ("quad_head", *_placed(quad.scene, quad.points, 1.0, np.zeros(3))),
        ("tri_head", *_placed(tri.scene, tri.points, CENTIMETRES, middle)),
        ("closed_head", *_placed(*closed_head(makehuman), 1.0, np.zeros(3))),
    ):
        named = replace(scene, name=name)
        write(named, folder / f"{name}.obj")
        write_landmarks(points, named, folder / f"{name}.fps.json")


def _box(scene: FaceScene) -> Floats:
    vertices = scene.world_neutral()
    return np.stack([vertices.min(axis=0), vertices.max(axis=0)])


def _placed(scene: FaceScene, points: FeaturePoints, scale: float, middle: Floats) -> tuple[FaceScene, FeaturePoints]:
    """Move the middle to the origin, scale and round."""

    def turn(values: Floats) -> Floats:
        return np.round(scale * (values - middle), DECIMALS)

    shapes = {}
    for shape in scene.shapes:
        mesh = PolyMesh(turn(shape.mesh.vertices), shape.mesh.indices, shape.mesh.offsets)
        shapes[shape.name] = replace(shape, mesh=mesh, materials=())
    free = {
        key: FeaturePoint.free(turn(np.asarray(p.point)), p.source) for key, p in points.items() if p.point is not None
    }
    return scene.map_shapes(shapes), points.with_points(free)
