"""Heads with known motion: MakeHuman phenotypes, as they are and decimated to another topology.

MakeHuman's face units are additive, so the same offsets are the truth on every phenotype; on a decimated head they
are carried over by normal-aware barycentric projection.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fba.arrays import Bools, Floats
from fba.fapu import Fapu
from fba.feature_points import FeaturePoint, FeaturePoints
from fba.mesh import PolyMesh
from fba.scene import FaceScene, Shape
from fba.shapes import ShapeSet
from samples.build.contact import LIDS, LIPS, PointedHead, side_mask, surface_edge
from samples.build.head import Head, build_head, macro, mean_mixture
from samples.build.makehuman import MakeHuman
from samples.build.neutral import neutral
from samples.build.surface import Places, nearest_facing

BENCHMARK_UNITS = (
    "jawOpen",
    "mouthSmileLeft",
    "mouthSmileRight",
    "eyeBlinkLeft",
    "eyeBlinkRight",
    "browInnerUp",
    "browDownLeft",
    "browOuterUpRight",
    "mouthFunnel",
    "mouthPucker",
    "mouthUpperUpLeft",
    "mouthLowerDownRight",
    "cheekPuff",
    "noseSneerLeft",
    "jawLeft",
    "mouthFrownLeft",
    "mouthStretchRight",
    "mouthPressLeft",
    "mouthRollLower",
    "mouthShrugUpper",
)
"""Twenty units that cover the face, both sides."""

SKIN_SHARE = 0.8
"""Of a decimated head's vertices; eyeballs, teeth and tongue get the rest."""


@dataclass(frozen=True)
class KnownHead:
    """A head whose motion is known.

    scene, points : the neutral face.
    units : ARKit unit -> shape -> (n, 3) offsets, decimetres; shapes that do not move may be absent.
    """

    scene: FaceScene
    points: FeaturePoints
    units: Mapping[str, Mapping[str, Floats]] = field(repr=False)

    @cached_property
    def positions(self) -> dict[str, Floats]:
        return self.points.positions(self.scene)

    @cached_property
    def fapu(self) -> Fapu:
        return Fapu.from_feature_points(self.positions)

    def shapes(self, names: Iterable[str] = BENCHMARK_UNITS) -> ShapeSet:
        """The units as morph targets in the scene's own vertex order."""
        chosen = tuple(names)
        zero = {s.name: np.zeros((s.mesh.vertex_count, 3)) for s in self.scene.shapes}
        deltas = np.stack([self.scene.gather({**zero, **self.units[name]}) for name in chosen])
        return ShapeSet(chosen, self.scene.world_neutral(), deltas)


def phenotype_mean(makehuman: MakeHuman) -> Head:
    """The shipped source's mixture as MakeHuman has it: its own polygons and units, neither smoothed nor symmetric."""
    return neutral(build_head(makehuman, mean_mixture(), "phenotype_mean"), 0.155)


def phenotype_a(makehuman: MakeHuman) -> Head:
    """African, between male and female, with a square head, a wide nose and a wide mouth.

    The male targets alone let the lids hang half over the pupil, far from the neutral pose.
    """
    mixture = macro("african", "male", "young", 0.45) | macro("african", "female", "young", 0.55)
    mixture |= {("head_targets", "head-square"): 1.0, ("nose_targets", "nose-scale-horiz-incr"): 0.7}
    head = build_head(makehuman, mixture, "phenotype_a")
    return neutral(_scaled(head, "8.1", (1.08, 1.0, 1.0), 0.45), 0.16)


def phenotype_b(makehuman: MakeHuman) -> Head:
    """Asian female with large eyes and a narrow mouth."""
    head = build_head(makehuman, macro("asian", "female", "young", 1.0), "phenotype_b")
    head = _scaled(head, "8.1", (0.88, 1.0, 1.0), 0.45)
    for eye in ("3.5", "3.6"):
        head = _scaled(head, eye, (1.12, 1.35, 1.12), 0.3)
    return neutral(head, 0.17)


def known(head: Head, names: Iterable[str] = BENCHMARK_UNITS) -> KnownHead:
    """A MakeHuman head with its own units as truth."""
    return KnownHead(head.scene, head.points, {name: head.unit(name) for name in names})


def decimated(head: Head, vertices: int = 2600, names: Iterable[str] = BENCHMARK_UNITS) -> KnownHead:
    """A MakeHuman head in another topology, see `in_other_topology`."""
    return in_other_topology(known(head, names), vertices)


def in_other_topology(head: KnownHead, vertices: int) -> KnownHead:
    """The same head as triangles in another topology, with about this many vertices, and the truth on it.

    Lashes are left out. Lip and lid feature points stay on their own side. The skin is the shape "skin".
    """
    shapes: list[Shape] = []
    places: dict[str, Places] = {}
    total = sum(s.mesh.vertex_count for s in head.scene.shapes if s.name != "skin" and not s.name.startswith("lashes"))
    for shape in head.scene.shapes:
        if shape.name.startswith("lashes"):
            continue
        share = SKIN_SHARE if shape.name == "skin" else (1.0 - SKIN_SHARE) * shape.mesh.vertex_count / total
        mesh = simplified(shape.mesh, int(share * vertices))
        places[shape.name] = nearest_facing(mesh.vertices, mesh.vertex_normals(), shape.mesh)
        shapes.append(Shape(shape.name, mesh, shape.role, shape.materials[:1]))
    unit = head.scene.meters_per_unit
    scene = FaceScene(tuple(shapes), meters_per_unit=unit, name=f"{head.scene.name}_decimated")
    points = FeaturePoints(transfer_points(head, scene, places))
    units = {
        name: {shape: place.carry(offsets[shape]) for shape, place in places.items()}
        for name, offsets in head.units.items()
    }
    return KnownHead(scene, points, units)


def simplified(mesh: PolyMesh, vertices: int) -> PolyMesh:
    """Decimate to triangles by quadric error; about this many vertices, none of them where one was before."""
    from fast_simplification import simplify

    out, faces = mesh.vertices, mesh.triangles
    target = 2 * vertices
    if target < len(faces):
        out, faces = simplify(out.astype(np.float64), faces.astype(np.int64), target_count=target, agg=7.0)
    used = np.unique(faces)
    new = np.zeros(len(out), dtype=np.int32)
    new[used] = np.arange(used.size)
    return PolyMesh.from_faces(np.asarray(out, dtype=np.float64)[used], new[np.asarray(faces)])


def transfer_points(head: PointedHead, scene: FaceScene, places: Mapping[str, Places]) -> dict[str, FeaturePoint]:
    """Feature points of a head on a scene whose vertices lie at `places` of the head's shapes.

    Points of lips and lids stay on their own side; those on a rim are placed on the rim of the new surface.
    """
    edges = (*LIPS.values(), *LIDS.values())
    sides = [places["skin"].carry(side_mask(head, e).astype(np.float64)[:, None])[:, 0] > 0.5 for e in edges]
    allowed = {key: side for edge, side in zip(edges, sides, strict=True) for key in edge.seeds}
    found = {key: _transfer(head, scene, key, allowed.get(key)) for key in head.points}
    skin = scene.shape("skin").mesh
    for edge, side in zip(edges, sides, strict=True):
        span = np.array([head.positions[key][0] for key in edge.guide[1:-1]])
        guide = np.array([head.positions[key] for key in edge.guide])
        triangles = skin.triangles[side[skin.triangles].all(axis=1)]
        line = surface_edge(skin.vertices, triangles, guide, span, edge, head.fapu.es0)
        for row, key in enumerate(edge.guide[1:-1]):
            found[key] = line.feature_point(row)
    return found


def _transfer(head: PointedHead, scene: FaceScene, key: str, allowed: Bools | None) -> FeaturePoint:
    point = head.points[key]
    if point.shape is None:
        return point
    weights = np.asarray(point.weights)
    normal = weights @ head.scene.shape(point.shape).mesh.vertex_normals()[list(point.vertices)]
    normal = normal / max(float(np.linalg.norm(normal)), 1e-300)
    mesh = scene.shape(point.shape).mesh
    side = allowed if point.shape == "skin" else None
    return nearest_facing(head.positions[key][None], normal[None], mesh, side).feature_point(0, point.shape)


def _scaled(head: Head, center: str, factors: tuple[float, float, float], reach: float) -> Head:
    """Scale everything around a feature point, fading out with the distance (Gaussian, sigma = reach x ES0)."""
    from dataclasses import replace

    origin = head.positions[center]
    away = head.body - origin
    fall = np.exp(-0.5 * (np.linalg.norm(away, axis=1) / (reach * head.fapu.es0)) ** 2)
    return replace(head, body=head.body + fall[:, None] * away * (np.asarray(factors) - 1.0))
