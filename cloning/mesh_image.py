"""Mesh image: the picture of a surface in a plane whose colour is the place in space.

Song et al., section V-A.2, draw the target's cylindrical mesh with the graphics card. Here it is drawn on the CPU, one
sample at the centre of each pixel, the surface nearest to the outside winning. Columns go once around the cylinder, so
triangles across the seam at the back are drawn whole and samples wrap. Drawing is not antialiased: a mean of skin and
background, or of two sheets one behind the other, would be a place where nothing is. Sampling is bilinear among pixels
of one sheet.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Bools, Floats, Ints

AROUND = 1024
"""Columns around the whole cylinder: pixels of a third of a degree."""

SHEET = 0.08
"""Neighbouring pixels belong to two sheets where their depths differ by more than this, in eye separations: about a
lip's thickness."""

_PAIRS = 2_000_000
"""Triangle-pixel pairs that are looked at in one go."""


@dataclass(frozen=True, eq=False)
class MeshImage:
    """A drawn surface.

    Attributes
    ----------
    places : (rows, columns, 3) place in space at each pixel's centre; 0 where nothing is.
    depth : (rows, columns) from outside; inf where nothing is.
    low : lower end of the plane's second coordinate.
    pixel : (2,) width and height of a pixel; the columns make a whole turn.
    """

    places: Floats
    depth: Floats
    low: float
    pixel: Floats

    def sample(self, plane: Floats) -> tuple[Floats, Bools]:
        """Places at points (m, 2) of the plane.

        Returns
        -------
        places : (m, 3), 0 where there is nothing.
        found : (m,) False where the nearest pixel is empty.
        """
        rows, columns = self.depth.shape
        at = np.stack([(plane[:, 0] + np.pi) / self.pixel[0], (plane[:, 1] - self.low) / self.pixel[1]], axis=1) - 0.5
        first = np.floor(at).astype(int)
        share = at - first
        column, row = np.rint(at).astype(int).T
        inside = np.abs(at[:, 1] - 0.5 * (rows - 1)) <= 0.5 * rows + 1e-9
        nearest = np.where(inside, self.depth[np.clip(row, 0, rows - 1), column % columns], np.inf)
        total, places = np.zeros(len(plane)), np.zeros((len(plane), 3))
        for i in (0, 1):
            for j in (0, 1):
                c, r = (first[:, 0] + i) % columns, np.clip(first[:, 1] + j, 0, rows - 1)
                weight = np.abs(1 - i - share[:, 0]) * np.abs(1 - j - share[:, 1])
                with np.errstate(invalid="ignore"):
                    weight = np.where(np.abs(self.depth[r, c] - nearest) <= SHEET, weight, 0.0)
                total += weight
                places += weight[:, None] * self.places[r, c]
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
    buffer = np.full(rows * columns, np.inf)
    drawn = np.zeros((rows * columns, 3))
    for triangle, pixels, weights in _covered(corners, rows, columns):
        away = np.einsum("pk,pk->p", weights, depth[triangles[triangle]])
        order = np.lexsort((away, pixels))
        first = np.ones(len(order), bool)
        first[1:] = pixels[order][1:] != pixels[order][:-1]
        order = order[first]
        order = order[away[order] < buffer[pixels[order]]]
        buffer[pixels[order]] = away[order]
        drawn[pixels[order]] = np.einsum("pk,pkd->pd", weights[order], places[triangles[triangle[order]]])
    return MeshImage(drawn.reshape(rows, columns, 3), buffer.reshape(rows, columns), low, pixel)


def _covered(corners: Floats, rows: int, columns: int) -> list[tuple[Ints, Ints, Floats]]:
    """Pixels whose centres each triangle covers: (triangles, flat pixels, barycentric coordinates), in chunks."""
    ab, ac = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    det = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    low, high = np.ceil(corners.min(axis=1) - 0.5).astype(int), np.floor(corners.max(axis=1) - 0.5).astype(int)
    low[:, 1], high[:, 1] = np.maximum(low[:, 1], 0), np.minimum(high[:, 1], rows - 1)
    span = np.maximum(high - low + 1, 0)
    count = np.where(np.abs(det) > 1e-12, span[:, 0] * span[:, 1], 0)
    stops = np.cumsum(count)
    out: list[tuple[Ints, Ints, Floats]] = []
    start = 0
    while start < len(corners):
        base = stops[start - 1] if start else 0
        end = max(start + 1, int(np.searchsorted(stops, base + _PAIRS, side="right")))
        some = np.arange(start, min(end, len(corners)))
        owner = np.repeat(some, count[some])
        step = np.arange(len(owner)) - np.repeat(np.cumsum(count[some]) - count[some], count[some])
        column = low[owner, 0] + step % span[owner, 0]
        row = low[owner, 1] + step // span[owner, 0]
        x, y = column + 0.5 - corners[owner, 0, 0], row + 0.5 - corners[owner, 0, 1]
        second = (x * ac[owner, 1] - y * ac[owner, 0]) / det[owner]
        third = (y * ab[owner, 0] - x * ab[owner, 1]) / det[owner]
        hit = (second >= -1e-12) & (third >= -1e-12) & (second + third <= 1.0 + 1e-12)
        weights = np.stack([1.0 - second - third, second, third], axis=1)[hit]
        out.append((owner[hit], (row * columns + column % columns)[hit], weights))
        start = end
    return out
