"""Which vertices of a skin can be seen from outside."""

from __future__ import annotations

import numpy as np

from cloning.surface import Surface
from fba.arrays import Bools, Floats, Ints

FINEST = 24
"""Parts that the sides of a triangle are divided into at most; sides longer than so many cells are drawn with gaps."""

ROUNDING = 1e-6
"""Cells that points of a triangle may lie outside its corners."""

BLOCK = 50_000
"""Points drawn at once: they fit the cache, and products so small are not given to several threads, which would wait
for each other."""


def visible(surface: Surface, directions: int = 14, cells: int = 384) -> Bools:
    """Vertices that can be seen from somewhere outside, (n,) bool.

    The surface is drawn into a depth buffer from directions all around (not from below); a vertex is visible
    where it lies at the front of one of them and faces it.
    """
    seen = np.zeros(surface.vertex_count, dtype=bool)
    normals, corners = surface.normals, np.ascontiguousarray(surface.triangles.T)
    views = _views(directions)
    # Opposite views first: what they have seen is not looked at again.
    for view in views[np.argsort(views[:, 2] ** 2 < 0.5, kind="stable")]:
        unseen = np.flatnonzero(~seen & (normals @ view > 0.05)).astype(np.int32)
        if len(unseen):
            side = np.cross([0.0, 1.0, 0.0], view)
            side /= np.linalg.norm(side)
            up = np.cross(view, side)
            flat = surface.vertices @ np.stack([side, up], axis=1)
            depth = surface.vertices @ view
            seen[unseen] = depth[unseen] > _front(flat, depth, corners, unseen, cells)
    return seen


def _views(count: int) -> Floats:
    """Directions spread evenly over the sphere above a shallow angle, symmetric to the left and right."""
    rows = [(0.0, 0.0), (0.0, -0.35), (0.0, 0.6)]
    for angle in (0.5, 1.0, 1.6, 2.4):
        rows += [(s * angle, e) for s in (1.0, -1.0) for e in (0.1, -0.3)]
    rows += [(np.pi, 0.2), (0.0, 1.3)]
    turned = np.array(rows[: max(count, 1)])
    a, e = turned[:, 0], turned[:, 1]
    found: Floats = np.stack([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)], axis=1)
    return found


def _covering(boxes: tuple[Floats, Floats, Floats, Floats], some: Ints, side: int) -> Bools:
    """Which triangles, with (t,) left, right, bottom and top, have one of some cells in their box."""
    left, right, bottom, top = boxes
    wide = side + 1
    # Sums over all cells before each, so that four of them count the cells in a box.
    sums = np.zeros((wide, wide), np.int32)
    sums[1:, 1:] = np.bincount(some, minlength=side * side).reshape(side, side)
    before = sums.cumsum(axis=0).cumsum(axis=1).ravel()
    begin_x, begin_y = (np.maximum(v - ROUNDING, 0.0).astype(np.intp) * k for v, k in ((left, wide), (bottom, 1)))
    end_x, end_y = ((v + (1.0 + ROUNDING)).astype(np.intp) * k for v, k in ((right, wide), (top, 1)))
    more, less = before[end_x + end_y] + before[begin_x + begin_y], before[begin_x + end_y] + before[end_x + begin_y]
    found: Bools = more > less
    return found


def _front(flat: Floats, depth: Floats, corners: Ints, some: Ints, cells: int) -> Floats:
    """Depth just behind the foremost surface at some vertices: a depth buffer of sample points of the triangles."""
    low = flat.min(axis=0)
    size = float((flat.max(axis=0) - low).max()) / cells
    side = cells + 2
    x, y = ((flat[:, axis] - low[axis]) / size for axis in range(2))
    cell = x[some].astype(np.intp) * side + y[some].astype(np.intp)
    # Corner by corner, since short axes are slow to reduce.
    left, right, bottom, top = (
        outer(outer(places[corners[0]], places[corners[1]]), places[corners[2]])
        for places in (x, y)
        for outer in (np.minimum, np.maximum)
    )
    near = np.flatnonzero(_covering((left, right, bottom, top), cell, side))
    steps = np.clip(np.ceil(np.hypot((right - left)[near], (top - bottom)[near])), 1, FINEST).astype(np.int8)
    order = near[np.argsort(steps, kind="stable")]
    ends = np.cumsum(np.bincount(steps, minlength=FINEST + 1))
    buffer = np.full(side * side, -np.inf)
    for n in range(1, FINEST + 1):
        grid = np.array([(i / n, j / n, 1.0 - (i + j) / n) for i in range(n + 1) for j in range(n + 1 - i)])
        block = max(BLOCK // len(grid), 1)
        for start in range(ends[n - 1], ends[n], block):
            drawn = corners[:, order[start : min(start + block, ends[n])]]
            column, row, height = (grid @ axis[drawn] for axis in (x, y, depth))
            np.maximum.at(buffer, (column.astype(np.intp) * side + row.astype(np.intp)).ravel(), height.ravel())
    found: Floats = buffer[cell] - 3.0 * size
    return found
