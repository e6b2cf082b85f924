"""Where a picture may change: the face's region, a mask of what is relit in it, and one of what opens in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cloning.image.color import Planes
from cloning.image.points import Places, Slits, eye_separation, from_eyes, rim_names, to_array
from cloning.image.warp import WarpMesh
from fba.arrays import Bools, Floats, Ints

INSET = 0.97
"""The mask's outline lies inside the points of the face's contour, by this factor towards its middle: neither the
source's background nor its hair is copied onto the face."""

FEATHER = 0.15
"""Width of the mask's soft border, in eye separations: about a third of an eye. As it blends what is asked, not the
solution, it may be narrow without showing."""

REACH = 0.05
"""So far around the face's contour the picture is still wholly that of the warp, in eye separations: points lie on a
contour up to that, and the edge of a chin that has risen must not stay where it was."""

BORDER = 0.15
"""Width of the soft border around that, in eye separations: 1 cm. Beyond it every pixel is the target's own."""

TEMPLE = 0.25
"""The temples lie so far beyond the outer ends of the brows, in eye separations: no feature point marks them, and
without them the mask's border would run through the brows."""

RIM_FEATHER = 0.02
"""Softness of the border between lips and mouth, or lids and eye, in eye separations."""


UNMARKED = (
    (("2.13", "10.7", "10.9", "outline left"), ((1.09, 0.4), (0.83, 1.1))),
    (("2.14", "10.8", "10.10", "outline right"), ((-1.09, 0.4), (-0.83, 1.1))),
    (("11.1", "11.2", "11.3"), ((0.83, -0.6), (-0.83, -0.6))),
)
"""Points of the contour, and what stands in for a part of which there is none: half the width of cheek bones, jaw and
forehead of the mean face (137, 105 and 105 mm, pupils 63 mm apart), to the subject's left and down, from between the
eyes, in eye separations."""


ROUND = 3
"""Straight pieces into which a contour is cut between two of its points."""


def outline(places: Places) -> Floats:
    """(k, 2) corners of the convex hull of a face's points and its temples."""
    points = to_array(places, list(places))
    if "4.5" in places and "4.6" in places:
        ends = to_array(places, ["4.5", "4.6"])
        across = (ends[0] - ends[1]) / max(float(np.linalg.norm(ends[0] - ends[1])), 1e-12)
        points = np.concatenate([points, ends + TEMPLE * eye_separation(places) * np.stack([across, -across])])
    return _hull(points)


def contour(places: Places) -> Floats:
    """(k, 2) corners of a face's rounded contour; parts that no point marks are added as the mean face has them."""
    from scipy.interpolate import CubicHermiteSpline

    missing = [from_eyes(places, parts) for names, parts in UNMARKED if not any(n in places for n in names)]
    corners = _hull(np.concatenate([outline(places), *missing]))
    tangents = np.roll(corners, -1, axis=0) - np.roll(corners, 1, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    corners, tangents = (np.concatenate([part, part[:1]]) for part in (corners, tangents))
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    at = np.interp(np.arange(ROUND * (len(along) - 1)) / ROUND, np.arange(len(along)), along)
    return _hull(CubicHermiteSpline(along, corners, tangents)(at))


def _hull(points: Floats) -> Floats:
    from scipy.spatial import ConvexHull

    corners: Floats = points[ConvexHull(points).vertices]
    return corners


@dataclass(frozen=True, eq=False)
class _Sides:
    """The sides of a convex polygon: the depth behind one at (x, y) is `up` (y - y0) - `left` (x - x0), in pixels."""

    up: Planes
    left: Planes
    x0: Planes
    y0: Planes

    @classmethod
    def of(cls, corners: Floats) -> _Sides:
        """Of (k, 2) corners."""
        middle = corners.mean(axis=0)
        along = np.roll(corners, -1, axis=0) - corners
        along /= np.maximum(np.linalg.norm(along, axis=1), 1e-12)[:, None]
        inside = np.sign(along[:, 0] * (middle[1] - corners[:, 1]) - along[:, 1] * (middle[0] - corners[:, 0]))
        return cls(*(part.astype(np.float32) for part in (*(inside[:, None] * along).T, *corners.T)))

    def depth(self, x: Planes, y: Planes) -> Planes:
        """The depth of places whose x and y are given, or can be spread to the same shape."""
        depth: Planes = np.full(np.broadcast_shapes(x.shape, y.shape), np.inf, np.float32)
        behind = np.empty_like(depth)
        for up, left, x0, y0 in zip(self.up, self.left, self.x0, self.y0, strict=True):
            np.subtract(up * (y - y0), left * (x - x0), out=behind)
            np.minimum(depth, behind, out=depth)
        return depth

    def span(self, y: Planes, depth: float) -> tuple[Planes, Planes]:
        """(n, 1) first and last x in rows (n,) that are so deep; the last before the first where there is none."""
        room = self.up * (y[:, None] - self.y0) + self.left * self.x0 - np.float32(depth)
        steep = np.where(np.abs(self.left) < 1e-6, np.float32(1e-6), self.left)
        ends = room / steep
        first = np.where(steep < 0, ends, -np.inf).max(axis=1, keepdims=True)
        last = np.where(steep > 0, ends, np.inf).min(axis=1, keepdims=True)
        return first, last


def depth_within(corners: Floats, box: tuple[slice, slice]) -> Planes:
    """How deep each pixel of a box lies in a convex polygon, in pixels; less than 0 outside."""
    y, x = _rows_and_columns(box)
    return _Sides.of(corners).depth(x[None, :], y[:, None])


def soft_within(corners: Floats, box: tuple[slice, slice], reach: float, width: float) -> Planes:
    """How much of each pixel of a box is a convex polygon's, 0..1.

    Parameters
    ----------
    corners : (k, 2).
    reach : how far around it, in pixels, the border ends.
    width : of the border, in pixels.
    """
    sides, (y, x) = _Sides.of(corners), _rows_and_columns(box)
    outer, inner = sides.span(y, -reach - 1.0), sides.span(y, width - reach + 1.0)
    share = ((x >= inner[0]) & (x <= inner[1])).astype(np.float32)
    border = np.flatnonzero((x >= outer[0]) & (x <= outer[1]) & (share == 0))
    rows, columns = np.divmod(border, len(x))
    depth = sides.depth(x[columns], y[rows])
    share.ravel()[border] = smooth((depth + np.float32(reach)) / np.float32(width))
    return share


def _rows_and_columns(box: tuple[slice, slice]) -> tuple[Planes, Planes]:
    y, x = (np.arange(part.start, part.stop, dtype=np.float32) for part in box)
    return y, x


def face_mask(moved: Places, box: tuple[slice, slice]) -> Planes:
    """How much each pixel of a box is relit, 0..1: 0 outside the face's convex hull, 1 well inside."""
    corners = outline(moved)
    middle = corners.mean(axis=0)
    return soft_within(middle + INSET * (corners - middle), box, 0.0, FEATHER * eye_separation(moved))


def region_share(places: Places, unit: float, box: tuple[slice, slice]) -> Planes:
    """How much of each pixel of a box is the warped face's, 0..1; the rest is the target's as it was.

    Parameters
    ----------
    places : of the face's points.
    unit : the target's eye separation in pixels.
    """
    return soft_within(contour(places), box, (REACH + BORDER) * unit, BORDER * unit)


def bounds(domain: Bools, more: int = 2) -> tuple[slice, slice]:
    """Rows and columns of a domain, and so many more on each side as there are."""
    found = []
    for axis in (1, 0):
        at = np.flatnonzero(domain.any(axis=axis))
        found.append(slice(max(int(at[0]) - more, 0), int(at[-1]) + more + 1))
    return found[0], found[1]


def widened(domain: Bools) -> Bools:
    """A domain and its neighbours."""
    wide = domain.copy()
    wide[1:] |= domain[:-1]
    wide[:-1] |= domain[1:]
    wide[:, 1:] |= domain[:, :-1]
    wide[:, :-1] |= domain[:, 1:]
    return wide


def slit_mask(mesh: WarpMesh, labels: Ints, moved: Places, slits: Slits) -> Planes:
    """Values 0..1 for the pixels between these upper and lower rims: between lips, between lids."""
    from scipy import ndimage

    within = np.zeros(len(mesh.triangles) + 1, bool)
    for upper, lower in slits:
        within[mesh.of_names({*rim_names(upper, moved), *rim_names(lower, moved)})] = True
    inside: Bools = within[labels]
    out = np.zeros(labels.shape, np.float32)
    if inside.any():
        soft = max(RIM_FEATHER * eye_separation(moved), 0.5)
        around = bounds(inside, 1 + int(np.ceil(4.0 * soft)))
        blurred: Planes = ndimage.gaussian_filter(inside[around].astype(np.float32), soft, truncate=4.0)
        out[around] = smooth(2.0 * blurred - 0.5)
    return out


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
