"""A z-buffer in numpy alone: the renderer that works everywhere.

Triangles are cut into rows of pixels, the rows into pixels, all triangles at once; the nearest triangle of each
pixel is found by one unbuffered minimum over 64-bit keys that hold depth and triangle. Edges follow the usual
rule (a pixel belongs to the triangle that holds its centre, left and upper edges included), so that neighbours
neither overlap nor leave gaps.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fba.arrays import Floats, Floats32, Ints
from studio.render.camera import Camera
from studio.render.drawable import Drawable, corner_attributes
from studio.render.protocol import depth_range, project
from studio.render.shading import SAMPLES, UInt8, encode, paint_iris, resolve, shade, sieve, tint_by_decal

EMPTY = np.iinfo(np.int64).max
FORESHORTENED = 0.01
"""Relative difference of distance between a triangle's corners from which perspective is followed inside it."""
FAR = 1e6
"""Pixels; corners farther outside the picture are moved here where only whole pixels are wanted."""
MIN_W = 1e-3
"""Triangles with a corner nearer to the lens than this fraction of its distance are left out."""


class SoftwareRenderer:
    """See `studio.render.protocol.Renderer`."""

    def __init__(self, name: str = "software") -> None:
        self.name = name

    def render(self, drawables: Sequence[Drawable], camera: Camera, width: int, height: int) -> UInt8:
        wide, high = width * SAMPLES, height * SAMPLES
        samples = np.zeros(high * wide, dtype=np.uint32)
        drawables = [d for d in drawables if len(d.triangles)]
        if drawables:
            matrix = camera.clip_matrix(width, height, *depth_range(drawables, camera))
            placed = [_screen(d, matrix, wide, high) for d in drawables]
            corners, w = (np.concatenate([p[k] for p in placed]) for k in range(2))
            quarters = np.concatenate([np.full(len(d.triangles), round(4 * d.opacity)) for d in drawables])
            hit, triangle = nearest_triangles(corners, wide, high, quarters)
            colors = np.full((len(hit), 4), 255, dtype=np.uint8)
            colors[:, :3] = _colors(drawables, camera, corners, w, hit, triangle, wide).T
            samples[hit] = colors.view(np.uint32)[:, 0]
        return resolve(samples.view(np.uint8).reshape(high, wide, 4))


def _screen(drawable: Drawable, matrix: Floats, width: int, height: int) -> tuple[Floats, Floats]:
    """Corners (t, 3, 3): pixel x, pixel y (downwards), depth -1..1, NaN for triangles behind the lens; and w (t, 3)."""
    ndc, w = project(drawable.vertices, matrix)
    place = np.empty_like(ndc)
    place[:, 0] = (ndc[:, 0] + 1.0) * (0.5 * width)
    place[:, 1] = (1.0 - ndc[:, 1]) * (0.5 * height)
    place[:, 2] = ndc[:, 2]
    place[w < MIN_W] = np.nan
    return place[drawable.triangles], w[drawable.triangles]


def nearest_triangles(
    corners: Floats, width: int, height: int, quarters: NDArray[np.int64] | None = None
) -> tuple[NDArray[np.int64], Ints]:
    """Find which triangle each pixel sees.

    Parameters
    ----------
    corners : (t, 3, 3) pixel x, pixel y, depth (smaller is nearer, -1..1).
    quarters : (t,) opacity of each triangle in quarters; None for 4.

    Returns
    -------
    hit : (p,) int64, the covered pixels (row * width + column), ascending.
    triangle : (p,) int32, the nearest triangle there; of equals the one with the lower number.
    """
    keys = depth_keys(corners, width, height, quarters)
    hit = np.flatnonzero(keys != EMPTY)
    return hit, (keys[hit] & 0xFFFFFFFF).astype(np.int32)


def depth_keys(
    corners: Floats, width: int, height: int, quarters: NDArray[np.int64] | None = None
) -> NDArray[np.int64]:
    """(height * width,) int64: depth in the high half, triangle in the low half; `EMPTY` where nothing is."""
    keys = np.full(width * height, EMPTY, dtype=np.int64)
    span_triangle, span_row, start, stop = _spans(corners, width, height)
    slope_x, slope_y, level = _depth_planes(corners)
    first = level[span_triangle] + slope_y[span_triangle] * (span_row + 0.5) + slope_x[span_triangle] * (start + 0.5)
    lengths = stop - start
    total = int(lengths.sum())
    if total == 0:
        return keys
    before = np.cumsum(lengths) - lengths
    span = np.repeat(np.arange(len(lengths), dtype=np.int32), lengths)
    step = np.arange(total, dtype=np.int32) - before.astype(np.int32)[span]
    pixel = (span_row * width + start).astype(np.int64)[span] + step
    depth = first.astype(np.float32)[span]
    depth += slope_x[span_triangle].astype(np.float32)[span] * step.astype(np.float32)
    # Depths between 1 and 3 are positive floats, whose bits sort like the numbers.
    packed = np.empty((total, 2), dtype=np.int32)
    packed[:, _LOW] = span_triangle.astype(np.int32)[span]
    packed[:, 1 - _LOW] = np.clip(depth + np.float32(2), np.float32(1), np.float32(3)).view(np.int32)
    key = packed.reshape(-1).view(np.int64)
    if quarters is not None and quarters.min(initial=4) < 4:
        solid = quarters[span_triangle]
        thin = np.flatnonzero(np.repeat(solid < 4, lengths))
        kept = sieve(pixel[thin] % width, pixel[thin] // width, solid[span[thin]])
        key[thin[~kept]] = EMPTY
    np.minimum.at(keys, pixel, key)
    return keys


_LOW = 0 if np.little_endian else 1


def _spans(
    corners: Floats, width: int, height: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Rows of pixels of all triangles: triangle, row, first column, column after the last."""
    usable = np.flatnonzero(np.isfinite(corners).all(axis=(1, 2)))
    x, y = corners[usable, :, 0], corners[usable, :, 1]
    order = np.lexsort((x, y), axis=1)
    x, y = np.take_along_axis(x, order, axis=1), np.take_along_axis(y, order, axis=1)
    top = np.clip(np.ceil(y[:, 0] - 0.5), 0, height).astype(np.int64)
    bottom = np.clip(np.ceil(y[:, 2] - 0.5), 0, height).astype(np.int64)
    seen = (bottom > top) & (x.min(axis=1) < width) & (x.max(axis=1) > 0)
    x, y, top, bottom, usable = x[seen], y[seen], top[seen], bottom[seen], usable[seen]
    rows = bottom - top
    owner = np.repeat(np.arange(len(rows)), rows)
    row = np.arange(len(owner)) - np.repeat(np.cumsum(rows) - rows, rows) + top[owner]
    center = row + 0.5
    # Edges are always walked from their upper end, so that both triangles at an edge find the same crossing.
    slope, base = _crossings(x, y)
    long = base[0][owner] + slope[0][owner] * center
    edge = owner + len(rows) * np.where(center < y[:, 1][owner], 1, 2)
    short = base.ravel()[edge] + slope.ravel()[edge] * center
    start = np.clip(np.ceil(np.minimum(long, short) - 0.5), 0, width).astype(np.int64)
    stop = np.clip(np.ceil(np.maximum(long, short) - 0.5), 0, width).astype(np.int64)
    full = stop > start
    return usable[owner[full]], row[full], start[full], stop[full]


def _crossings(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Slope and base (3, t) of ``x = base + slope * y`` along the long, the upper and the lower edge."""
    first, last = [0, 0, 1], [2, 1, 2]
    rise = (y[:, last] - y[:, first]).T
    slope = np.divide((x[:, last] - x[:, first]).T, rise, out=np.zeros_like(rise), where=rise > 0)
    return np.ascontiguousarray(slope), x[:, first].T - y[:, first].T * slope


def _depth_planes(corners: Floats) -> tuple[Floats, Floats, Floats]:
    """Depth of each triangle as ``slope_x * x + slope_y * y + level``; flat where it is seen edge-on."""
    gradient = _gradients(corners)
    dz1, dz2 = corners[:, 1, 2] - corners[:, 0, 2], corners[:, 2, 2] - corners[:, 0, 2]
    slope_x = gradient[:, 0] * dz1 + gradient[:, 2] * dz2
    slope_y = gradient[:, 1] * dz1 + gradient[:, 3] * dz2
    level = corners[:, 0, 2] - slope_x * corners[:, 0, 0] - slope_y * corners[:, 0, 1]
    return slope_x, slope_y, level


def _gradients(corners: Floats) -> Floats:
    """(t, 4) change of the barycentric coordinates of corners 1 and 2: d1/dx, d1/dy, d2/dx, d2/dy."""
    a, b = corners[:, 1, :2] - corners[:, 0, :2], corners[:, 2, :2] - corners[:, 0, :2]
    area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    inverse = np.divide(1.0, area, out=np.zeros_like(area), where=np.abs(area) > 1e-12)
    gradient: Floats = np.stack([b[:, 1], -b[:, 0], -a[:, 1], a[:, 0]], axis=1) * inverse[:, None]
    return gradient


def _colors(
    drawables: Sequence[Drawable],
    camera: Camera,
    corners: Floats,
    w: Floats,
    hit: NDArray[np.int64],
    triangle: Ints,
    width: int,
) -> UInt8:
    """(3, p) uint8 colours of the pixels that were hit."""
    directions = camera.rotation()
    table = np.concatenate([corner_attributes(d, directions) for d in drawables])
    first, second = _weights(corners, hit, triangle, width)
    _foreshorten(first, second, triangle, w)
    mixed = _mix(table, triangle, first, second)
    area = _signed_area(corners)
    facing = np.where(area < 0, np.float32(1), np.float32(-1))[triangle]
    start = 0
    for drawable in drawables:
        stop = start + len(drawable.triangles)
        if drawable.iris is not None or drawable.decal is not None:
            mine = np.flatnonzero((triangle >= start) & (triangle < stop))
            _paint(drawable, mixed, mine, triangle[mine] - start, first[mine], second[mine])
        start = stop
    return encode(shade(mixed, facing))


def _paint(
    drawable: Drawable, mixed: Floats32, mine: NDArray[np.int64], triangle: Ints, first: Floats32, second: Floats32
) -> None:
    """Change the albedo of one drawable's pixels by its iris and its decal."""
    if drawable.iris is not None:
        rest = drawable.iris.directions.astype(np.float32)[drawable.triangles]
        turned = _mix(rest, triangle, first, second)
        mixed[3:6, mine] = paint_iris(mixed[3:6, mine], turned, drawable.iris.angle, drawable.iris.color)
    if drawable.decal is not None:
        uv = drawable.decal.uv.astype(np.float32)
        some = np.flatnonzero(drawable.decal.touched[triangle])
        u, v = _mix(uv, triangle[some], first[some], second[some])
        albedo = mixed[3:6, mine[some]]
        tint_by_decal(albedo, u, v, drawable.decal.image)
        mixed[3:6, mine[some]] = albedo


def _signed_area(corners: Floats) -> Floats:
    a, b = corners[:, 1, :2] - corners[:, 0, :2], corners[:, 2, :2] - corners[:, 0, :2]
    area: Floats = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return area


def _weights(corners: Floats, hit: NDArray[np.int64], triangle: Ints, width: int) -> tuple[Floats32, Floats32]:
    """Barycentric coordinates of corners 1 and 2 at the centres of the pixels."""
    place = hit.astype(np.int32)
    row = place // np.int32(width)
    column = place - row * np.int32(width)
    # Places relative to a whole pixel beside the corner keep single precision exact enough.
    gradient = _gradients(corners)
    finite = np.nan_to_num(corners[:, 0, :2])
    origin = np.floor(np.clip(finite, -FAR, FAR))
    offset = origin + 0.5 - finite
    near_x, near_y = np.ascontiguousarray(origin.T).astype(np.int32)
    dx, dy = (column - near_x[triangle]).astype(np.float32), (row - near_y[triangle]).astype(np.float32)
    weights = []
    for k in (0, 2):
        level = gradient[:, k] * offset[:, 0] + gradient[:, k + 1] * offset[:, 1]
        planes = [np.nan_to_num(p).astype(np.float32) for p in (gradient[:, k], gradient[:, k + 1], level)]
        weight = planes[2][triangle]
        weight += planes[0][triangle] * dx
        weight += planes[1][triangle] * dy
        weights.append(np.clip(weight, 0, 1, out=weight))
    first, second = weights
    return first, second


def _foreshorten(first: Floats32, second: Floats32, triangle: Ints, w: Floats) -> None:
    """Turn weights in the picture into weights on the surface, in place, for triangles that reach far into depth."""
    ratios = (w[:, :1] / w[:, 1:]).astype(np.float32)
    deep = np.abs(ratios - np.float32(1)).max(axis=1, initial=0) > FORESHORTENED
    if not deep.any():
        return
    some = np.flatnonzero(deep[triangle])
    a = first[some] * ratios[triangle[some], 0]
    b = second[some] * ratios[triangle[some], 1]
    total = np.float32(1) - first[some] - second[some] + a + b
    first[some], second[some] = a / total, b / total


def _mix(table: Floats32, triangle: Ints, first: Floats32, second: Floats32) -> Floats32:
    """Interpolate (t, 3, c) corner values at pixels: (c, p)."""
    count = table.shape[2]
    out = np.empty((count, len(triangle)), dtype=np.float32)
    for k in range(count):
        base = np.ascontiguousarray(table[:, 0, k])
        out[k] = base[triangle]
        out[k] += (table[:, 1, k] - base)[triangle] * first
        out[k] += (table[:, 2, k] - base)[triangle] * second
    return out
