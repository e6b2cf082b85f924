"""Mesh image: the picture of a surface in a plane whose colour is the place in space.

Song et al., section V-A.2, draw the target's cylindrical mesh with the graphics card. Here it is drawn on the CPU, one
sample at the centre of each pixel. The surface nearest to the outside wins; what faces inwards is not seen: a throat
behind the axis is no nape. Columns go once around the cylinder, so triangles across the seam at the back are drawn in
one piece and samples wrap. Each pixel also keeps the triangle it was drawn from, and those too fine to cover a pixel's
centre: a sample is read inside the triangle that covers it, so it is as exact as the surface, whatever the resolution.
Nothing is blurred: a mean of skin and background, or of two sheets one behind the other, would be a place where nothing
is. Only where no triangle covers a sample, at the very edge, it is bilinear among pixels of one sheet.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fba.arrays import Bools, Floats, Ints

AROUND = 1024
"""Columns around the whole cylinder: pixels of a third of a degree."""

SHEET = 0.08
"""Neighbouring pixels belong to two sheets where their depths differ by more than this, in eye separations: about a
lip's thickness."""

AROUND_SAMPLE = range(-1, 3)
"""Rows and columns of pixels around a sample whose triangles are tried: two to each side."""

EDGE = 1e-9
"""A triangle covers a sample whose barycentric coordinates are not below this, negative."""

FLAT = 1e-12
"""Triangles of less than half this many pixels have no inside; those that face inwards have a negative one."""

_PAIRS = 250_000
"""Triangle-pixel pairs that are looked at in one go."""


@dataclass(frozen=True, eq=False)
class MeshImage:
    """A drawn surface.

    Attributes
    ----------
    depth : (rows, columns) from outside; inf where nothing is.
    owners : (rows, columns) the triangle that was drawn there; -1 where nothing is.
    low : lower end of the plane's second coordinate.
    pixel : (2,) width and height of a pixel; the columns make a whole turn.
    corners : (t, 3, 6) the triangles' corners: column and row (in one piece across the seam), depth, place in space.
    inverse : (t, 2, 2) from columns and rows, counted from the first corner, to the shares of the other two.
    fine : (2, f) flat pixels, sorted, and the triangles too fine to be drawn that touch them.
    """

    depth: Floats
    owners: Ints
    low: float
    pixel: Floats
    corners: Floats
    inverse: Floats
    fine: Ints

    @property
    def places(self) -> Floats:
        """(rows, columns, 3) the picture: the place in space at each pixel's centre; 0 where nothing is."""
        rows, columns = np.indices(self.depth.shape, dtype=np.int32)
        return self._pictured(rows.ravel(), columns.ravel()).reshape(*self.depth.shape, 3)

    def _pictured(self, rows: Ints, columns: Ints) -> Floats:
        """(m, 3) what the picture shows at these pixels."""
        owner = self.owners[rows, columns]
        found = self._inside(owner, np.stack([columns, rows], axis=1).astype(np.float64) + 0.5)[1]
        return np.where(owner[:, None] >= 0, found[:, 1:], 0.0)

    def _inside(self, owner: Ints, at: Floats) -> tuple[Floats, Floats]:
        """Coordinates (3, m) of points, in pixels, in a triangle each, and (m, 4) depth and place there."""
        corners = self.corners[owner]
        away = at - corners[:, 0, :2]
        away[:, 0] -= self.depth.shape[1] * np.rint(away[:, 0] / self.depth.shape[1])
        weights = _barycentric(self.inverse[owner], away)
        return weights, np.einsum("km,mkd->md", weights, corners[:, :, 2:])

    def sample(self, plane: Floats) -> tuple[Floats, Bools]:
        """Places at points (m, 2) of the plane.

        Returns
        -------
        places : (m, 3), 0 where there is nothing.
        found : (m,) False where no triangle covers the point and the nearest pixel is empty.
        """
        at = np.stack([(plane[:, 0] + np.pi) / self.pixel[0], (plane[:, 1] - self.low) / self.pixel[1]], axis=1)
        places, found = self._exact(at)
        missed = np.flatnonzero(~found)
        places[missed], found[missed] = self._bilinear(at[missed] - 0.5)
        return places, found

    def _exact(self, at: Floats) -> tuple[Floats, Bools]:
        """Places inside the triangles of the pixels around points (m, 2) in pixels; the outermost wins."""
        nearest, places = np.full(len(at), np.inf), np.zeros((len(at), 3))
        for owner in self._candidates(at):
            weights, found = self._inside(owner, at)
            better = (owner >= 0) & (weights.min(axis=0) >= -EDGE) & (found[:, 0] < nearest)
            nearest[better], places[better] = found[better, 0], found[better, 1:]
        return places, np.isfinite(nearest)

    def _candidates(self, at: Floats) -> Iterator[Ints]:
        """Triangles, one (m,) after the other, that may cover points (m, 2) in pixels; -1 for none."""
        rows, columns = self.depth.shape
        column, row = np.floor(at - 0.5).astype(int).T
        for i in AROUND_SAMPLE:
            for j in AROUND_SAMPLE:
                yield self.owners[np.clip(row + j, 0, rows - 1), (column + i) % columns]
        own = np.floor(at).astype(int)
        pixel = np.clip(own[:, 1], 0, rows - 1) * columns + own[:, 0] % columns
        first, last = (np.searchsorted(self.fine[0], pixel, side=side) for side in ("left", "right"))
        for step in range(int((last - first).max(initial=0))):
            which = np.minimum(first + step, self.fine.shape[1] - 1)
            yield np.where(first + step < last, self.fine[1, which], -1)

    def _bilinear(self, at: Floats) -> tuple[Floats, Bools]:
        """Places at points (m, 2), in pixels from the first one's centre, among pixels of one sheet."""
        rows, columns = self.depth.shape
        first = np.floor(at).astype(int)
        share = at - first
        column, row = np.rint(at).astype(int).T
        inside = np.abs(at[:, 1] - 0.5 * (rows - 1)) <= 0.5 * rows + 1e-9
        nearest = np.where(inside, self.depth[np.clip(row, 0, rows - 1), column % columns], np.inf)
        total, places = np.zeros(len(at)), np.zeros((len(at), 3))
        for i in (0, 1):
            for j in (0, 1):
                c, r = (first[:, 0] + i) % columns, np.clip(first[:, 1] + j, 0, rows - 1)
                weight = np.abs(1 - i - share[:, 0]) * np.abs(1 - j - share[:, 1])
                with np.errstate(invalid="ignore"):
                    weight = np.where(np.abs(self.depth[r, c] - nearest) <= SHEET, weight, 0.0)
                total += weight
                places += weight[:, None] * self._pictured(r, c)
        found = np.isfinite(nearest) & (total > 0.0)
        places = np.where(found[:, None], places / np.maximum(total, 1e-300)[:, None], 0.0)
        return places, found


def draw_mesh(plane: Floats, depth: Floats, triangles: Ints, places: Floats, columns: int = AROUND) -> MeshImage:
    """Draw a surface.

    Parameters
    ----------
    plane : (n, 2) angle from -pi to pi, and height, of each vertex.
    depth : (n,) from outside; the smallest wins.
    triangles : (t, 3).
    places : (n, 3) what is drawn.
    columns : pixels around; they are about square at the surface's mean radius.
    """
    radius = float(np.abs(depth).mean())
    low, high = float(plane[:, 1].min()), float(plane[:, 1].max())
    turn = 2.0 * np.pi / columns
    rows = max(int(np.ceil((high - low) / (turn * radius))), 1)
    pixel = np.array([turn, max(high - low, 1e-12) / rows])
    corners = np.stack([(plane[:, 0] + np.pi) / pixel[0], (plane[:, 1] - low) / pixel[1]], axis=1)[triangles]
    across = np.ptp(corners[:, :, 0], axis=1) > 0.5 * columns
    corners[:, :, 0] += np.where(across[:, None] & (corners[:, :, 0] < 0.5 * columns), columns, 0.0)
    corners = np.concatenate([corners, depth[triangles][:, :, None], places[triangles]], axis=2)
    inverse = _inverse(corners[:, :, :2])
    buffer, owners = np.full(rows * columns, np.inf), np.full(rows * columns, -1, np.int32)
    skipped = np.isnan(inverse[:, 0, 0])
    for triangle, pixels, weights in _covered(corners[:, :, :2], inverse, rows, columns):
        away = np.einsum("kp,pk->p", weights, corners[triangle, :, 2])
        np.minimum.at(buffer, pixels, away)
        nearest = away == buffer[pixels]
        owners[pixels[nearest]] = triangle[nearest]
        skipped[triangle[~nearest]] = True
    skipped[owners[owners >= 0]] = True
    shape, fine = (rows, columns), _touched(corners[:, :, :2], ~skipped, rows, columns)
    return MeshImage(buffer.reshape(shape), owners.reshape(shape), low, pixel, corners, inverse, fine)


def _touched(corners: Floats, which: Bools, rows: int, columns: int) -> Ints:
    """(2, f) flat pixels, sorted, and the triangles among some whose boxes touch them."""
    some = np.flatnonzero(which)
    low, high = (np.floor(end(corners[some], axis=1)).astype(int) for end in (np.min, np.max))
    low[:, 1], high[:, 1] = np.maximum(low[:, 1], 0), np.minimum(high[:, 1], rows - 1)
    owner, column, row = _boxes(low, high)
    pixel = row * columns + column % columns
    order = np.argsort(pixel, kind="stable")
    found: Ints = np.stack([pixel[order], some[owner[order]]])
    return found


def _boxes(low: Ints, high: Ints) -> tuple[Ints, Ints, Ints]:
    """Every pixel of some boxes: the box's number, column, row."""
    span = np.maximum(high - low + 1, 0)
    count = span[:, 0] * span[:, 1]
    owner = np.repeat(np.arange(len(low), dtype=np.int32), count)
    step = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    return owner, low[owner, 0] + step % span[owner, 0], low[owner, 1] + step // span[owner, 0]


def _inverse(corners: Floats) -> Floats:
    """(t, 2, 2) from the plane, counted from the first corner, to shares of the others; nan where nothing is drawn."""
    ab, ac = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    det = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    rows = np.stack([ac[:, 1], -ac[:, 0], -ab[:, 1], ab[:, 0]], axis=1)
    found: Floats = (rows / np.where(det > FLAT, det, np.nan)[:, None]).reshape(-1, 2, 2)
    return found


def _barycentric(inverse: Floats, away: Floats) -> Floats:
    """(3, m) coordinates of points (m, 2), counted from the first corner of their triangles."""
    second = inverse[:, 0, 0] * away[:, 0] + inverse[:, 0, 1] * away[:, 1]
    third = inverse[:, 1, 0] * away[:, 0] + inverse[:, 1, 1] * away[:, 1]
    return np.stack([1.0 - second - third, second, third])


def _covered(corners: Floats, inverse: Floats, rows: int, columns: int) -> list[tuple[Ints, Ints, Floats]]:
    """Pixels whose centres each triangle covers: (triangles, flat pixels, barycentric coordinates), in chunks."""
    low, high = np.ceil(corners.min(axis=1) - 0.5).astype(int), np.floor(corners.max(axis=1) - 0.5).astype(int)
    low[:, 1], high[:, 1] = np.maximum(low[:, 1], 0), np.minimum(high[:, 1], rows - 1)
    high[np.isnan(inverse[:, 0, 0])] = -1
    stops = np.cumsum(np.prod(np.maximum(high - low + 1, 0), axis=1))
    out: list[tuple[Ints, Ints, Floats]] = []
    start = 0
    while start < len(corners):
        base = stops[start - 1] if start else 0
        end = max(start + 1, int(np.searchsorted(stops, base + _PAIRS, side="right")))
        owner, column, row = _boxes(low[start:end], high[start:end])
        owner += start
        away = np.stack([column, row], axis=1) + 0.5 - corners[owner, 0]
        weights = _barycentric(inverse[owner], away)
        hit = weights.min(axis=0) >= -1e-12
        out.append((owner[hit], (row * columns + column % columns)[hit], weights[:, hit]))
        start = end
    return out
