"""Where a picture may change: a feathered mask of the face, and one of what opens in it."""

from __future__ import annotations

import numpy as np

from cloning.image.color import Planes
from cloning.image.points import Places, Slits, eye_separation, rim_names, to_array
from cloning.image.warp import WarpMesh
from fba.arrays import Bools, Ints

INSET = 0.97
"""The mask's outline lies inside the points of the face's contour, by this factor towards its middle: neither the
source's background nor its hair is copied onto the face."""

FEATHER = 0.15
"""Width of the mask's soft border, in eye separations: about a third of an eye. As it blends what is asked, not the
solution, it may be narrow without showing."""

TEMPLE = 0.25
"""The temples lie so far beyond the outer ends of the brows, in eye separations: no feature point marks them, and
without them the mask's border would run through the brows."""

RIM_FEATHER = 0.02
"""Softness of the border between lips and mouth, or lids and eye, in eye separations."""


def face_mask(moved: Places, box: tuple[slice, slice]) -> Planes:
    """Values 0..1 for the pixels of a box: 0 outside the face's convex hull, 1 well inside."""
    from scipy.spatial import ConvexHull

    points = to_array(moved, list(moved))
    if "4.5" in moved and "4.6" in moved:
        ends = to_array(moved, ["4.5", "4.6"])
        across = (ends[0] - ends[1]) / max(float(np.linalg.norm(ends[0] - ends[1])), 1e-12)
        points = np.concatenate([points, ends + TEMPLE * eye_separation(moved) * np.stack([across, -across])])
    corners = points[ConvexHull(points).vertices]
    middle = corners.mean(axis=0)
    corners = middle + INSET * (corners - middle)
    rows, columns = box
    y, x = (np.arange(part.start, part.stop, dtype=np.float32) for part in (rows, columns))
    depth = np.full((y.size, x.size), np.inf, np.float32)
    across = np.empty_like(depth)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = (b - a) / max(float(np.linalg.norm(b - a)), 1e-12)
        inside = np.sign(along[0] * (middle[1] - a[1]) - along[1] * (middle[0] - a[0]))
        up, left = np.float32(inside * along[0]), np.float32(inside * along[1])
        np.subtract((up * (y - np.float32(a[1])))[:, None], (left * (x - np.float32(a[0])))[None, :], out=across)
        np.minimum(depth, across, out=depth)
    return smooth(depth / np.float32(FEATHER * eye_separation(moved)))


def slit_mask(mesh: WarpMesh, labels: Ints, moved: Places, slits: Slits) -> Planes:
    """Values 0..1 for the pixels between these upper and lower rims: between lips, between lids."""
    from scipy import ndimage

    within = np.zeros(len(mesh.triangles) + 1, bool)
    for upper, lower in slits:
        within[mesh.of_names({*rim_names(upper, moved), *rim_names(lower, moved)})] = True
    inside: Bools = within[labels]
    soft = max(RIM_FEATHER * eye_separation(moved), 0.5)
    blurred: Planes = ndimage.gaussian_filter(inside.astype(np.float32), soft)
    return smooth(2.0 * blurred - 0.5)


def mouth_opening(places: Places) -> float:
    """Gap between the lips in widths of the mouth; 0 without points of the inner lips."""
    if "2.2" not in places or "2.3" not in places:
        return 0.0
    gap = np.asarray(places["2.3"]) - np.asarray(places["2.2"])
    across = np.asarray(places["8.3"]) - np.asarray(places["8.4"])
    width = float(np.linalg.norm(across))
    return max(float(across[0] * gap[1] - across[1] * gap[0]) / width**2, 0.0)


def smooth(t: Planes) -> Planes:
    """The smooth step from 0 to 1, flat beyond."""
    t = np.clip(t, 0.0, 1.0)
    out: Planes = t * t * (3.0 - 2.0 * t)
    return out
