"""Left and right of the source are mirror images: its data are averaged with their own mirror image."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fat.quality import mirror_map
from fba.arrays import Floats, Ints
from fba.feature_points import FeaturePoint, feature_point_definitions
from fba.landmark_checks import LEFT_POINTS
from fba.mesh import PolyMesh
from samples.build.makehuman import MakeHuman

FLIP = np.array([-1.0, 1.0, 1.0])
CLOSE = 1e-6
"""Tolerance of a mirror image, decimetres: MakeHuman's base mesh is symmetric, its targets are not quite."""


@dataclass(frozen=True)
class SymmetricMakeHuman(MakeHuman):
    """MakeHuman whose left targets are the mirror images of the right ones, and whose middle ones are their own."""

    @cached_property
    def _mirror(self) -> Ints:
        return mirror_map(self.base.vertices, CLOSE)

    def target(self, kind: str, name: str) -> Floats:
        """The mean of a target and the mirrored target of the other side."""
        own, other = super().target(kind, name), super().target(kind, _other_side(name))
        mean: Floats = 0.5 * (own + other[self._mirror] * FLIP)
        return mean


def _other_side(name: str) -> str:
    for side, other in (("Left", "Right"), ("Right", "Left")):
        if name.endswith(side):
            return name.removesuffix(side) + other
    return name


def mirrored_polygons(mesh: PolyMesh) -> PolyMesh:
    """A symmetric mesh with the polygons of its right half written as mirror images of the left ones.

    Their fans of triangles are mirror images then, too.
    """
    mirror = mirror_map(mesh.vertices, CLOSE)
    faces = [mesh.face(k).tolist() for k in range(mesh.face_count)]
    left = [f for f in faces if mesh.vertices[f, 0].mean() > CLOSE]
    middle = [f for f in faces if abs(mesh.vertices[f, 0].mean()) <= CLOSE]
    right = [mirror[[f[0], *f[:0:-1]]].tolist() for f in left]
    return PolyMesh.from_faces(mesh.vertices, left + middle + right)


def mirrored_points(points: dict[str, FeaturePoint], mirrors: dict[str, Ints]) -> dict[str, FeaturePoint]:
    """Points with those of the right side replaced by the mirror images of the left ones.

    Parameters
    ----------
    mirrors : shape -> mirror image (n,) of each of its vertices; points on other shapes stay.
    """
    known = feature_point_definitions()
    out = dict(points)
    for key in LEFT_POINTS:
        point, other = points.get(key), known[key].counterpart
        if point is not None and other is not None and point.shape in mirrors:
            mirror = mirrors[point.shape]
            out[other] = FeaturePoint(point.shape, tuple(mirror[list(point.vertices)].tolist()), point.weights)
    return out
