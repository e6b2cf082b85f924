"""Facial Motion Cloning exactly as its paper describes it.

Positions are divided by the FAPUs of the nearest feature point, projected to a cylinder, aligned by interpolation
over the triangulated feature points; motion is interpolated from the source's triangles, the outermost one winning,
averaged over a support of 0.02, with lip regions by polygons. Choices where the paper is silent: the feature points
are triangulated by Delaunay (the published triangulation is a picture), and triangles across the seam at the back
are repeated on both of its sides.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cloning.align import anchor_ids
from cloning.antialias import SUPPORT, circle_samples
from cloning.cylinder import MOUTH_HALF_ANGLE, cylinder, round_the_back
from cloning.interpolate import TriangleMesh2D, interpolate
from cloning.normalize import factors, nearest
from cloning.prepare import OPTIONAL, PreparedFace
from fba.arrays import Bools, Floats, Ints

UPPER_LIP = ("2.5", "2.7", "2.2", "2.6", "2.4", "9.1", "9.2")
LOWER_LIP = ("2.5", "2.9", "2.3", "2.8", "2.4", "2.11", "2.12")
EAR_RIMS = ("10.1", "10.2", "10.3", "10.4", "10.5", "10.6")


@dataclass(frozen=True, eq=False)
class Projected:
    """A face in the projected plane.

    Attributes
    ----------
    scale : (n, 3) FAPUs of each vertex's region, mesh units.
    plane : (n, 2) angle and height.
    depth : (n,)
    points : (k, 2) the feature points.
    lips : (n,) 1 upper, 2 lower, 0 out of the lip region.
    """

    scale: Floats
    plane: Floats
    depth: Floats
    points: Floats
    lips: Ints


@dataclass(frozen=True, eq=False)
class PublishedTransfer:
    """The paper's transfer as one sparse matrix between normalized motions."""

    matrix: Any
    source_scale: Floats
    target_scale: Floats
    measures: Mapping[str, float]
    parameters: Mapping[str, float | str | bool]

    def apply(self, motions: Floats) -> Floats:
        normalized = motions / self.source_scale[:, None, :]
        carried = self.matrix @ normalized.reshape(len(motions), -1)
        result: Floats = carried.reshape(-1, motions.shape[1], 3) * self.target_scale[:, None, :]
        return result

    def carry(self, values: Floats) -> Floats:
        carried: Floats = self.matrix @ values
        return carried


def build_published(source: PreparedFace, target: PreparedFace, support: float = SUPPORT) -> PublishedTransfer:
    """Prepare the published method between two faces.

    support : radius of the filter in the projected plane; 0 takes one sample, without a filter.
    """
    ids = [i for i in anchor_ids(source.skin, target.skin) if i not in OPTIONAL and i not in EAR_RIMS]
    mine, yours = project(source, ids), project(target, ids)
    plane = align_plane(yours.plane, yours.points, mine.points)
    matrix, outside = _motion_matrix(mine, source.skin.triangles, plane, yours.lips, support)
    return PublishedTransfer(
        matrix,
        mine.scale,
        yours.scale,
        {"outside_share": outside},
        {"support": support, "mouth_half_angle": MOUTH_HALF_ANGLE, "feature_points": len(ids)},
    )


def project(face: PreparedFace, ids: list[str]) -> Projected:
    """Normalize a face by the nearest feature point's FAPUs and project it."""
    vertices = face.skin.vertices * face.fapu.es0
    places = np.array([face.place(i) for i in ids])
    units = factors(face.fapu, ids)
    center = np.mean([face.place(i) for i in ("3.5", "3.6", "2.2")], axis=0)
    scale = units[nearest(vertices, places)]
    normal_points = (places - center) / units
    around = cylinder(dict(zip(ids, normal_points, strict=True)))
    plane, depth = around.project((vertices - center) / scale)
    points, _ = around.project(normal_points)
    lips = np.zeros(len(plane), dtype=np.int32)
    for number, corners in ((1, UPPER_LIP), (2, LOWER_LIP)):
        outline = np.array([points[ids.index(i)] for i in corners if i in ids])
        lips[inside_polygon(plane, outline) & (lips == 0)] = number
    return Projected(scale, plane, depth, points, lips)


def align_plane(plane: Floats, points: Floats, goals: Floats) -> Floats:
    """Move projected target vertices so that its feature points come to lie on the source's.

    Parameters
    ----------
    plane : (n, 2) target vertices.
    points, goals : (k, 2) feature points of target and source.
    """
    from scipy.spatial import Delaunay

    triangles = Delaunay(points).simplices
    return plane + interpolate(points, goals - points, triangles, plane)


def inside_polygon(places: Floats, outline: Floats) -> Bools:
    """(n,) bool, True for places (n, 2) inside a polygon (k, 2), by counting crossings."""
    inside = np.zeros(len(places), dtype=bool)
    x, y = places[:, 0], places[:, 1]
    for (ax, ay), (bx, by) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        crosses = (ay > y) != (by > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            at = (bx - ax) * (y - ay) / (by - ay) + ax
        inside ^= crosses & (x < at)
    return inside


def _motion_matrix(mine: Projected, triangles: Ints, plane: Floats, lips: Ints, support: float) -> tuple[Any, float]:
    """(n_t, n_s) matrix of mean sample weights, and the share of samples outside the source's triangles."""
    from scipy.sparse import csr_array

    samples = np.concatenate([plane[:, None], circle_samples(plane, support)], axis=1)
    count, n = samples.shape[1], len(mine.plane)
    points, tiles = round_the_back(mine.plane, triangles)
    depth = np.tile(mine.depth, 3)
    rows, columns, entries = [], [], []
    outside = 0
    for number in (0, 1, 2):
        here = np.flatnonzero(lips == number)
        opposite = {0: -1, 1: 2, 2: 1}[number]
        kept = tiles[~np.any(mine.lips[tiles % n] == opposite, axis=1)]
        if not len(here) or not len(kept):
            continue
        place = TriangleMesh2D(points, kept, depth).locate(samples[here].reshape(-1, 2))
        outside += int(np.sum(~place.inside))
        rows.append(np.repeat(here, 3 * count))
        columns.append(kept[place.triangles].ravel() % n)
        entries.append(place.weights.ravel() / count)
    matrix = csr_array(
        (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))),
        shape=(len(plane), n),
    )
    return matrix, outside / max(samples.shape[0] * count, 1)
