"""The lining of mouth, cheeks and nose: hidden skin close behind the skin in front of it, which must not come through.

Where it does, it shows as a dark spot, though no triangle turns over and no edge gets longer.
"""

from __future__ import annotations

import numpy as np

from cloning.labels import OPPOSITE
from cloning.surface import Surface
from fba.arrays import Bools, Floats, Ints

DEEP = 0.15
"""Hidden skin farther than this from what can be seen, along the skin, in eye separations, is lining; nearer to it are
the rims of lips, lids and nostrils, which show in many motions."""

THICK = 0.3
"""Lining lies nearer than this to the skin before it, in eye separations: a cheek is about 0.25 thick."""

BEFORE = 0.005
"""Lining at least this far before the skin shows, in eye separations (.3 mm)."""

STEEP = 0.5
"""Least cosine between the way from the skin to the lining and the skin's normal: beside the rim of a hole is not
before the skin."""


def lining(surface: Surface, seen: Bools, labels: Ints) -> Ints:
    """The vertices (m,) that line the inside.

    Parameters
    ----------
    seen : (n,) what can be seen at rest, see `cloning.visibility`.
    labels : (n,) see `cloning.labels`: the lining of a lip is not behind the other lip.
    """
    from scipy.sparse.csgraph import dijkstra

    outer = np.flatnonzero(seen).astype(np.int32)
    if not len(outer):
        return np.zeros(0, dtype=np.int32)
    inside = dijkstra(surface.graph, indices=outer, min_only=True)
    deep = np.flatnonzero(np.isfinite(inside) & (inside > DEEP)).astype(np.int32)
    away, height = _above(surface, surface.vertices, outer, deep, labels)
    found: Ints = deep[(away < THICK) & (height < 0.0)]
    return found


def coming_through(surface: Surface, seen: Bools, labels: Ints, inner: Ints, offsets: Floats) -> Ints:
    """The vertices of the lining that a motion brings before the skin.

    Parameters
    ----------
    seen, labels : as for `lining`.
    inner : (m,) of `lining`.
    offsets : (n, 3) in eye separations.
    """
    if not len(inner):
        return inner
    places = surface.vertices + offsets
    reach = places[inner].min(axis=0) - THICK, places[inner].max(axis=0) + THICK
    around = seen & np.all((places >= reach[0]) & (places <= reach[1]), axis=1)
    outer = np.flatnonzero(around).astype(np.int32)
    # Lining lies behind the skin at rest; both together must go as far as what shows, near it.
    way = np.linalg.norm(offsets, axis=1)
    if not len(outer) or way[inner].max(initial=0.0) + way[outer].max(initial=0.0) < BEFORE:
        return inner[:0]
    going = np.concatenate([inner, outer])
    going = going[way[going] > BEFORE / 4.0]
    both = np.concatenate([surface.vertices[going], places[going]])
    low, high = both.min(axis=0) - THICK, both.max(axis=0) + THICK
    inner = inner[np.all((places[inner] >= low) & (places[inner] <= high), axis=1)]
    away, height = _above(surface, places, outer, inner, labels)
    found: Ints = inner[(away < THICK) & (height > np.maximum(BEFORE, STEEP * away))]
    return found


def _above(surface: Surface, places: Floats, outer: Ints, inner: Ints, labels: Ints) -> tuple[Floats, Floats]:
    """Distance (m,) of the inner vertices from the nearest outer ones on their side, and their height (m,) there.

    What is farther away than THICK is infinitely far.
    """
    from scipy.spatial import cKDTree

    away, height = np.full(len(inner), np.inf), np.zeros(len(inner))
    normals = surface.normals_of(places)
    for side in np.unique(labels[inner]).tolist():
        mine, before = labels[inner] == side, outer[labels[outer] != OPPOSITE[side]]
        if not len(before):
            continue
        away[mine], near = cKDTree(places[before]).query(places[inner[mine]], distance_upper_bound=THICK)
        found = np.isfinite(away[mine])
        one, other = inner[mine][found], before[np.asarray(near)[found]]
        height[np.flatnonzero(mine)[found]] = ((places[one] - places[other]) * normals[other]).sum(axis=1)
    return away, height
