"""The correspondence of Song et al., section V-A: a target's skin in the source's topology, by way of a cylinder.

The faces are aligned by their feature points; both are projected to one cylinder; the feature points and the corners
of the projected source are triangulated, and each source vertex goes to the same coordinates between the target's; the
target's mesh image there gives its place. Vertices without a place are redundant: they go, and their polygons with
them, and what no polygon is left for. So does what the source's own mesh image does not show: mouth lining and eye
sockets lie behind other skin, and would read the lips' and the cheeks' places. A scanner's faces have none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cloning.align import anchor_ids
from cloning.cylinder import head_cylinder
from cloning.interpolate import TriangleMesh2D
from cloning.mesh_image import MeshImage, draw_mesh
from cloning.similarity import Similarity, fit_similarity
from cloning.surface import Surface
from fba.arrays import Bools, Floats, Ints

Polygons = tuple[Ints, Ints]

SHOWN = 1e-6
"""A vertex is shown where its mesh image gives its own place, in eye separations."""


@dataclass(frozen=True, eq=False)
class Resampled:
    """A target's skin with the vertices of a source's.

    Attributes
    ----------
    vertices : (n, 3) one for each of the source's, in the target's space and eye separations; 0 where there is none.
    kept : (n,) bool, False for redundant vertices.
    polygons : (indices, offsets) those of the source's that are left.
    alignment : takes the target's eye separations to the source's.
    image : the target's mesh image.
    """

    vertices: Floats
    kept: Bools
    polygons: Polygons
    alignment: Similarity
    image: MeshImage

    @property
    def triangles(self) -> Ints:
        """(t, 3) the fans of the polygons."""
        indices, offsets = self.polygons
        fans = np.maximum(np.diff(offsets) - 2, 0)
        first = np.repeat(offsets[:-1], fans)
        step = np.arange(len(first)) - np.repeat(np.cumsum(fans) - fans, fans)
        found: Ints = np.stack([indices[first], indices[first + step + 1], indices[first + step + 2]], axis=1)
        return found


def resample(source: Surface, target: Surface) -> Resampled:
    """Give a target the vertices and polygons of a source."""
    ids = anchor_ids(source, target)
    mine, yours = (np.array([surface.positions[i] for i in ids]) for surface in (source, target))
    alignment = fit_similarity(yours, mine)
    around = head_cylinder(source.positions)
    aligned = alignment.apply(target.vertices)
    plane, depth = around.project(aligned)
    image = draw_mesh(plane, depth, target.triangles, target.vertices)
    own_plane, own_depth = around.project(source.vertices)
    points = [around.project(places)[0] for places in (mine, alignment.apply(yours))]
    vertices, kept = image.sample(parameterised(own_plane, plane, *points))
    kept &= shown(source, draw_mesh(own_plane, own_depth, source.triangles, source.vertices), own_plane)
    polygons = without_redundant(source.polygons, kept)
    kept &= np.bincount(polygons[0], minlength=len(kept)) > 0
    return Resampled(vertices, kept, polygons, alignment, image)


def shown(surface: Surface, image: MeshImage, plane: Floats) -> Bools:
    """(n,) bool, vertices of a surface that its mesh image shows: no other skin lies outside of them."""
    found: Bools = np.linalg.norm(image.sample(plane)[0] - surface.vertices, axis=1) < SHOWN
    return found


def parameterised(source: Floats, target: Floats, source_points: Floats, target_points: Floats) -> Floats:
    """Equation 8: where the vertices of a source lie in a target's plane.

    Parameters
    ----------
    source, target : (n, 2), (m, 2) all vertices: a whole turn wide, their heights give the corners of the boxes.
    source_points, target_points : (k, 2) the feature points; a pair across the seam counts as near.

    Returns
    -------
    (n, 2)
    """
    from scipy.spatial import Delaunay

    turns = np.rint((source_points[:, 0] - target_points[:, 0]) / (2.0 * np.pi))
    target_points = target_points + np.stack([2.0 * np.pi * turns, 0.0 * turns], axis=1)
    corners = [
        np.concatenate([points, [[x, y] for x in (-np.pi, np.pi) for y in (plane[:, 1].min(), plane[:, 1].max())]])
        for points, plane in ((source_points, source), (target_points, target))
    ]
    triangles = Delaunay(corners[0]).simplices
    place = TriangleMesh2D(corners[0], triangles).locate(source)
    moved: Floats = np.einsum("nk,nkd->nd", place.weights, corners[1][triangles[place.triangles]])
    return moved


def without_redundant(polygons: Polygons, kept: Bools) -> Polygons:
    """The polygons all of whose vertices are kept."""
    indices, offsets = polygons
    arity = np.diff(offsets)
    polygon = np.repeat(np.arange(len(arity)), arity)
    whole = np.bincount(polygon, ~kept[indices], len(arity)) == 0
    starts = np.concatenate([[0], np.cumsum(arity[whole])]).astype(np.int32)
    return indices[whole[polygon]], starts
