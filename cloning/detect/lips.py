"""Inner lip points on their own lip: lips that touch are at one place in space, but far apart along the skin."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cloning.surface import Surface
from cloning.template.closest import TriangleSearch
from fba.arrays import Floats, Ints

LIPS = (("8.1", ("2.2", "2.6", "2.7")), ("8.2", ("2.3", "2.8", "2.9")))
"""Outer middle of each lip, and the points of its inner edge."""


def on_own_lip(skin: Surface, whole: TriangleSearch, places: Mapping[str, Floats]) -> dict[str, tuple[Ints, Floats]]:
    """Place the inner lip points on skin that is nearer, along itself, to their own lip's outer middle.

    Parameters
    ----------
    whole : finds places on the skin.
    places : where the points shall be.

    Returns
    -------
    Vertices (3,) of a triangle and weights (3,) of each point; none without both outer middles.
    """
    from scipy.sparse.csgraph import dijkstra

    outer = [key for key, _ in LIPS]
    if any(key not in places for key in outer):
        return {}
    starts = whole.closest(np.array([places[key] for key in outer]))
    corners = skin.triangles[starts.triangles]
    seeds = corners[np.arange(len(outer)), np.argmax(starts.weights, axis=1)]
    away = dijkstra(skin.graph, indices=seeds)
    found: dict[str, tuple[Ints, Floats]] = {}
    for lip, (_, inner) in enumerate(LIPS):
        own = (away[lip] < away[1 - lip])[skin.triangles].all(axis=1)
        ids = [key for key in inner if key in places]
        if not ids or not own.any():
            continue
        search = TriangleSearch(skin.vertices, skin.triangles, usable=own)
        near = search.closest(np.array([places[key] for key in ids]))
        found |= {key: (skin.triangles[near.triangles[k]], near.weights[k]) for k, key in enumerate(ids)}
    return found
