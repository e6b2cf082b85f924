"""Piecewise affine warps between pictures, over one triangulation of their feature points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cloning.image.parts import parts
from cloning.image.points import EYES, MOUTH, Places, eye_separation, rim_names, to_array
from fba.arrays import Bools, Floats, Ints

Indices = NDArray[np.integer[Any]]

RING = 1.35
"""How far beyond the face's convex hull, in its own size, the warp ends: neck and hair give way, the rest stays."""

RING_POINTS = 24

APART = 0.03
"""Rims of lips and lids are held so far apart, in eye separations, while the triangles are chosen: shut lips would
otherwise be tied to each other by chance."""

EDGE = 1e-9
"""Pixels; a pixel this near to a triangle's edge belongs to it."""


@dataclass(frozen=True, eq=False)
class WarpMesh:
    """Triangles over the moved points of the target.

    Attributes
    ----------
    names : of the points; those of the ring come last and have none.
    places : (n, 2) in the target's warped picture.
    triangles : (t, 3).
    ring : (k, 2) the points that stay.
    """

    names: list[str]
    places: Floats
    triangles: Ints
    ring: Floats

    def of_names(self, names: set[str]) -> Ints:
        """The triangles with all corners among these points."""
        has = np.array([n in names for n in self.names] + [False] * len(self.ring))
        return np.flatnonzero(has[self.triangles].all(axis=1)).astype(np.int32)

    def affine(self, goals: Floats) -> Floats:
        """(t, 2, 3) maps from the warped picture to the places (n, 2) of the same points in another one."""
        here, there = self.places[self.triangles], goals[self.triangles]
        edges, other = here[:, 1:] - here[:, :1], there[:, 1:] - there[:, :1]
        det = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
        det = np.where(np.abs(det) < 1e-12, np.inf, det)
        inverse = np.stack([edges[:, 1, 1], -edges[:, 0, 1], -edges[:, 1, 0], edges[:, 0, 0]], axis=1) / det[:, None]
        linear = np.einsum("tij,tjk->tki", inverse.reshape(-1, 2, 2), other)
        shift = there[:, 0] - np.einsum("tij,tj->ti", linear, here[:, 0])
        return np.concatenate([linear, shift[:, :, None]], axis=2)


def ring_around(points: Floats, size: tuple[int, int]) -> Floats:
    """(k, 2) points around a face, within a picture of `size` = (width, height)."""
    from scipy.spatial import ConvexHull

    corners = points[ConvexHull(points).vertices]
    middle = corners.mean(axis=0)
    out = middle + RING * (corners - middle)
    closed = np.concatenate([out, out[:1]])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    wanted = np.linspace(0.0, along[-1], RING_POINTS, endpoint=False)
    ring = np.stack([np.interp(wanted, along, closed[:, i]) for i in (0, 1)], axis=1)
    inside: Floats = np.clip(ring, 0.0, np.array(size, np.float64) - 1.0)
    return inside


def triangulate(moved: Places, target: Places, size: tuple[int, int]) -> WarpMesh:
    """Triangulate the target's moved points and a ring around both states (Delaunay, lips and lids held apart)."""
    from scipy.spatial import Delaunay

    names = list(moved)
    places = to_array(moved, names)
    ring = ring_around(np.concatenate([places, to_array(target, names)]), size)
    apart = places.copy()
    index = {name: i for i, name in enumerate(names)}
    push = APART * eye_separation(target) / 2.0
    for slit in MOUTH + EYES:
        for rim, sign in zip(slit, (-1.0, 1.0), strict=True):
            rows = [index[n] for n in rim_names(rim, moved)]
            apart[rows, 1] += sign * push * np.sin(np.linspace(0.0, np.pi, len(rows)))
    triangles = Delaunay(np.concatenate([apart, ring])).simplices.astype(np.int32)
    return WarpMesh(names, np.concatenate([places, ring]), triangles, ring)


def label_pixels(mesh: WarpMesh, box: tuple[slice, slice]) -> Ints:
    """Which triangle covers each pixel of a box (rows, columns), -1 for none; of several the last."""
    rows, columns = box
    labels = np.full((rows.stop - rows.start, columns.stop - columns.start), -1, np.int32)
    triangles, lines, starts, counts = _spans(mesh.places[mesh.triangles] - [columns.start, rows.start], labels.shape)
    before = np.cumsum(counts) - counts
    at = np.repeat(lines * labels.shape[1] + starts - before, counts)
    at += np.arange(len(at))
    labels.ravel()[at] = np.repeat(triangles.astype(np.int32), counts)
    return labels


def _spans(corners: Floats, shape: tuple[int, ...]) -> tuple[Indices, Indices, Indices, Indices]:
    """Runs of pixels within triangles (t, 3, 2): triangle, row, first column and length of each, triangles in order."""
    edges, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    real = np.flatnonzero(np.abs(edges[:, 0] * other[:, 1] - edges[:, 1] * other[:, 0]) >= 1e-12)
    low = np.maximum(np.ceil(corners[..., 1].min(axis=1) - EDGE).astype(int), 0)
    high = np.minimum(np.floor(corners[..., 1].max(axis=1) + EDGE).astype(int) + 1, shape[0])
    tall = np.maximum(high - low, 0)[real]
    triangles = np.repeat(real, tall)
    lines = low[triangles] + np.arange(len(triangles)) - np.repeat(np.cumsum(tall) - tall, tall)
    left, right = np.full(len(lines), np.inf), np.full(len(lines), -np.inf)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        (ax, ay), (bx, by) = corners[triangles, a].T, corners[triangles, b].T
        steep = np.abs(by - ay) > EDGE
        share = np.clip((lines - ay) / np.where(steep, by - ay, 1.0), 0.0, 1.0)
        met = (lines >= np.minimum(ay, by) - EDGE) & (lines <= np.maximum(ay, by) + EDGE)
        for x in (ax + share * (bx - ax), np.where(steep, ax + share * (bx - ax), bx)):
            left = np.where(met, np.minimum(left, x), left)
            right = np.where(met, np.maximum(right, x), right)
    starts = np.maximum(np.ceil(left - EDGE), 0).astype(int)
    counts = np.minimum(np.floor(right + EDGE), shape[1] - 1).astype(int) + 1 - starts
    kept = counts > 0
    return triangles[kept], lines[kept], starts[kept], counts[kept]


@dataclass(frozen=True, eq=False)
class Covered:
    """Pixels of a box that lie in some triangle.

    Attributes
    ----------
    at : (p,) in the box, counted row by row.
    label : (p,) the triangle of each.
    x, y : (p,) in the picture.
    """

    at: Indices
    label: Indices
    x: Floats
    y: Floats


def covered(labels: Ints, where: Bools, box: tuple[slice, slice]) -> Covered:
    """Those of some pixels of a box that lie in a triangle, row by row."""
    at = np.flatnonzero(where & (labels >= 0))
    rows = at // labels.shape[1]
    x, y = (at - labels.shape[1] * rows + box[1].start).astype(np.float64), (rows + box[0].start).astype(np.float64)
    return Covered(at, labels.ravel().take(at).astype(np.intp), x, y)


def mapped(affine: Floats, pixels: Covered) -> Floats:
    """(2, p) places (x, y) of pixels in another picture."""
    out = np.empty((2, len(pixels.label)))
    by_x, by_y, shift = np.ascontiguousarray(np.moveaxis(affine, 0, -1)).swapaxes(0, 1)
    for part in parts(len(pixels.label)):
        label, x, y = pixels.label[part], pixels.x[part], pixels.y[part]
        for k, goal in enumerate(out[:, part]):
            np.multiply(by_x[k].take(label), x, out=goal)
            goal += by_y[k].take(label) * y
            goal += shift[k].take(label)
    return out
