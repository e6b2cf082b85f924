"""The rims of the lids as lines: where they end, where they lie, how far from them the skin is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cloning.rims import SLICES, Eye
from cloning.surface import Surface
from fba.arrays import Floats


def to_the_corners(eye: Eye | None) -> Eye | None:
    """The eye with all slices up to where it is narrowest towards each corner.

    Beyond that the lids are grown together, and what looks like a rim is a fold of the skin.
    """
    if eye is None:
        return None
    opening = eye.heights[0] - eye.heights[1]
    used = np.zeros(len(opening), dtype=bool)
    for side in (np.arange(SLICES - 1, -1, -1), np.arange(SLICES - 1, len(opening))):
        apart = np.append(opening[side] > 0.0, False)
        side = side[: int(np.argmin(apart))]
        used[side[: int(np.argmin(opening[side])) + 1]] = True
    return replace(eye, open=used)


def rim_line(eye: Eye, part: int) -> Floats:
    """Places (s, 3) along a rim by rising x."""
    lid = eye.lids[part]
    heights, edges, shares = lid.rim(lid.rest)
    used = eye.open & np.isfinite(heights)
    a, b = (lid.rest[edges[used, k]] for k in range(2))
    line: Floats = a + shares[used, None] * (b - a)
    return line


def from_rim(skin: Surface, eye: Eye, part: int, limit: float) -> Floats:
    """(n,) distance along the skin from the rim of a lid; inf beyond a limit, both in eye separations."""
    lid = eye.lids[part]
    heights, edges, shares = lid.rim(lid.rest)
    used = np.flatnonzero(eye.open & np.isfinite(heights))
    points = {str(k): (lid.vertices[edges[k]], np.array([1.0 - shares[k], shares[k]])) for k in used}
    places = {key: weights @ skin.vertices[vertices] for key, (vertices, weights) in points.items()}
    away: Floats = replace(skin, points=points, positions=places).distances(points, limit).min(axis=0)
    return away
