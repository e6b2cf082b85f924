"""Is an eye open? What lies between its lids, looked at from the front."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cloning.surface import Surface
from fba.arrays import Bools, Floats

EYES = ((3, "3.1", "3.3", "3.7", "3.11"), (5, "3.2", "3.4", "3.8", "3.12"))
"""First label, upper and lower lid, corners."""

SHALLOW = 0.08
"""Skin that lies at most this far behind the line from lid to lid covers the eye, in eye separations. Measured: open
eyes 0.14 and more, painted and closed ones 0.05 and less."""

DIRECT = 0.7
"""An eye is filled where the way from lid to lid along the skin is shorter than this share of its width; where it is
longer, the lids meet in a crease. Measured: filled eyes 0.48 to 0.54, closed ones 1.04, open ones 0.78 to 1.04."""

PROBES = np.array([0.2, 0.35, 0.5, 0.65, 0.8])
THICK = 0.3
"""Skin within this of the eye's plane is between the lids, in eye separations."""


@dataclass(frozen=True, eq=False)
class Covered:
    """The eyes that skin covers, by their first labels.

    Attributes
    ----------
    filled : the lids are drawn on one smooth skin.
    closed : the lids meet in a crease.
    """

    filled: tuple[int, ...]
    closed: tuple[int, ...]


def covered_eyes(surface: Surface) -> Covered:
    """Which eyes show skin between their lids."""
    ways: dict[int, float] = {}
    for number, upper, lower, *corners in EYES:
        at = surface.positions
        if any(key not in surface.points for key in (upper, lower, *corners)):
            continue
        line = at[upper] + PROBES[:, None] * (at[lower] - at[upper])
        behind = line[:, 2] - front(surface, line)
        if float(np.median(behind)) < SHALLOW:
            width = float(np.linalg.norm(at[corners[0]] - at[corners[1]]))
            rows = surface.point_matrix([lower])
            way = surface.distances([upper], 3.0 * width)[0][rows.indices[rows.data > 1e-6]].min()
            ways[number] = float(way) / width
    # On coarse meshes the way depends on where a point lies in its triangle: the shorter one counts for both.
    smooth = min(ways.values(), default=np.inf) < DIRECT
    return Covered(tuple(ways) if smooth else (), () if smooth else tuple(ways))


def between_lids(surface: Surface, number: int) -> Bools:
    """(n,) the vertices between the lids of an eye: below an arc through the upper one, above one through the lower."""
    _, upper, lower, *corners = next(row for row in EYES if row[0] == number)
    at = surface.positions
    ends = sorted((at[key] for key in corners), key=lambda place: float(place[0]))
    share = (surface.vertices[:, 0] - ends[0][0]) / max(float(ends[1][0] - ends[0][0]), 1e-12)
    base = ends[0] + np.clip(share, 0.0, 1.0)[:, None] * (ends[1] - ends[0])
    arc = 4.0 * share * (1.0 - share)
    middle = 0.5 * (ends[0] + ends[1])
    high, low = ((at[key] - middle)[1] for key in (upper, lower))
    height = surface.vertices[:, 1] - base[:, 1]
    inside = (share > 0.0) & (share < 1.0) & (height < arc * high) & (height > arc * low)
    found: Bools = inside & (np.abs(surface.vertices[:, 2] - base[:, 2]) < THICK)
    return found


def front(surface: Surface, places: Floats) -> Floats:
    """(k,) z of the foremost skin at the x and y of each place; -inf where there is none."""
    corners = surface.vertices[surface.triangles]
    flat = corners[:, :, :2]
    near = np.all((flat.max(axis=1) >= places[:, :2].min(axis=0)) & (flat.min(axis=1) <= places[:, :2].max(axis=0)), 1)
    a, b, c = (corners[near, k][None] for k in range(3))
    p = places[:, None]

    def cross(u: Floats, v: Floats) -> Floats:
        return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]

    area = cross(b - a, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        second, third = cross(p - a, c - a) / area, cross(b - a, p - a) / area
        depth = a[..., 2] + second * (b - a)[..., 2] + third * (c - a)[..., 2]
        hit = (second >= 0.0) & (third >= 0.0) & (second + third <= 1.0)
    found: Floats = np.where(hit, depth, -np.inf).max(axis=1, initial=-np.inf)
    return found
