"""Which vertices of a skin can be seen from outside."""

from __future__ import annotations

import numpy as np

from cloning.surface import Surface
from fba.arrays import Bools, Floats, Ints


def visible(surface: Surface, directions: int = 14, cells: int = 384) -> Bools:
    """Vertices that can be seen from somewhere outside, (n,) bool.

    The surface is drawn into a depth buffer from directions all around (not from below); a vertex is visible
    where it lies at the front of one of them and faces it.
    """
    seen = np.zeros(surface.vertex_count, dtype=bool)
    normals = surface.normals
    for view in _views(directions):
        side = np.cross([0.0, 1.0, 0.0], view)
        side /= np.linalg.norm(side)
        up = np.cross(view, side)
        flat = surface.vertices @ np.stack([side, up], axis=1)
        depth = surface.vertices @ view
        front = _front(flat, depth, surface.triangles, cells)
        seen |= (depth > front) & (normals @ view > 0.05)
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


def _front(flat: Floats, depth: Floats, triangles: Ints, cells: int) -> Floats:
    """Depth just behind the foremost surface at each vertex: a depth buffer of sample points of the triangles."""
    low = flat.min(axis=0)
    size = float((flat.max(axis=0) - low).max()) / cells
    side = cells + 2
    buffer = np.full(side * side, -np.inf)
    placed = np.concatenate([(flat - low) / size, depth[:, None]], axis=1)
    # The longer side of a triangle's box, and the other: corner by corner, since short axes are slow to reduce.
    sides = [placed[:, axis][triangles].T for axis in range(2)]
    wide, high = (np.maximum(np.maximum(a, b), c) - np.minimum(np.minimum(a, b), c) for a, b, c in sides)
    spread = np.sqrt(wide * wide + high * high)
    steps = np.clip(np.ceil(spread).astype(int), 1, 24)
    for n in np.unique(steps):
        grid = np.array([(i / n, j / n, 1.0 - (i + j) / n) for i in range(n + 1) for j in range(n + 1 - i)])
        corners = triangles[steps == n].T
        column, row, height = (grid @ placed[:, axis][corners] for axis in range(3))
        np.maximum.at(buffer, (column.astype(int) * side + row.astype(int)).ravel(), height.ravel())
    cell = placed[:, :2].astype(int)
    found: Floats = buffer[cell[:, 0] * side + cell[:, 1]] - 3.0 * size
    return found
