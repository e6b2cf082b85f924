"""The edges of lids and lips between their feature points: more anchors where faces must be aligned best.

MPEG-4 has three points on the edge of a lid. Between them the edge is followed along the surface, on the side that
looks outwards, and divided evenly, in the same way on both faces.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from cloning.surface import Surface, symmetric_graph
from fba.arrays import Floats, Ints


@dataclass(frozen=True, slots=True)
class Contour:
    """One edge: its label (see `cloning.labels`), its feature points in order, and anchors between two of them."""

    label: int
    points: tuple[str, ...]
    anchors: int


CONTOURS = (
    Contour(1, ("2.4", "2.6", "2.2", "2.7", "2.5"), 1),
    Contour(2, ("2.4", "2.8", "2.3", "2.9", "2.5"), 1),
    Contour(3, ("3.11", "3.1", "3.7"), 5),
    Contour(4, ("3.11", "3.3", "3.7"), 5),
    Contour(5, ("3.8", "3.2", "3.12"), 5),
    Contour(6, ("3.8", "3.4", "3.12"), 5),
)

INWARD_COST = 4.0
"""How much longer a way counts where the surface turns away from the outside."""

DEPTH = 0.5
"""The centre that "outside" is seen from lies this share of the edge's width behind its corners."""

FACE = ("3.11", "3.8", "8.3", "8.4")
"""Inner corners of the left and the right eye, and corners of the mouth: they span the plane of a face."""

LEAN = 0.12
"""That plane leans back on an upright face, by this much of its height: the mouth lies before the eyes' inner corners.
0.02 to 0.24 on five heads."""

DETOUR = 1.6
"""A way longer than this times the straight line does not follow an edge and gives no anchors."""


_ANCHORS: WeakKeyDictionary[Surface, Mapping[str, tuple[int, Floats]]] = WeakKeyDictionary()


def contour_anchors(surface: Surface) -> Mapping[str, tuple[int, Floats]]:
    """Anchors on the edges of lips and lids; sought once for each surface.

    Returns
    -------
    name -> (label of its edge, (3,) position); names are the same on every face.
    """
    if surface not in _ANCHORS:
        _ANCHORS[surface] = _sought(surface)
    return _ANCHORS[surface]


def _sought(surface: Surface) -> Mapping[str, tuple[int, Floats]]:
    found: dict[str, tuple[int, Floats]] = {}
    for contour in CONTOURS:
        if any(i not in surface.points for i in contour.points):
            continue
        graph, places = _outer_graph(surface, contour)
        for a, b in pairwise(contour.points):
            line = _path(graph, places, surface, a, b)
            for k, position in enumerate(_divide(line, surface.positions, a, b, contour.anchors)):
                found[f"{a}-{b}/{k + 1}"] = (contour.label, position)
    return found


def _outer_graph(surface: Surface, contour: Contour) -> tuple[object, Ints]:
    """Graph of the skin around an edge in which the inner side is far, and the vertices that it is about."""
    first, last = surface.positions[contour.points[0]], surface.positions[contour.points[-1]]
    width = float(np.linalg.norm(first - last))
    center = 0.5 * (first + last) - DEPTH * width * _forward(surface.positions)
    near = np.linalg.norm(surface.vertices - 0.5 * (first + last), axis=1) < 0.9 * width
    places = np.flatnonzero(near)
    new = np.full(surface.vertex_count, -1)
    new[places] = np.arange(len(places))
    outward = surface.vertices[places] - center
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-12)
    facing = np.einsum("ij,ij->i", outward, surface.normals[places])
    cost = 1.0 + INWARD_COST * np.clip(0.4 - facing, 0.0, 1.4)
    full = surface.graph.tocoo()
    rows, columns = full.coords
    kept = near[rows] & near[columns] & (rows < columns)
    pairs = np.stack([new[rows[kept]], new[columns[kept]]], axis=1)
    lengths = full.data[kept] * 0.5 * (cost[pairs[:, 0]] + cost[pairs[:, 1]])
    return symmetric_graph(pairs, lengths, len(places)), places.astype(np.int32)


def _forward(positions: Mapping[str, Floats]) -> Floats:
    """Where a face looks, (3,) unit, however the head is held."""
    if any(i not in positions for i in FACE):
        return np.array([0.0, 0.0, 1.0])
    left, right, *mouth = (positions[i] for i in FACE)
    up = 0.5 * (left + right) - 0.5 * (mouth[0] + mouth[1])
    ahead = np.cross(left - right, up)
    sizes = [max(float(np.linalg.norm(way)), 1e-300) for way in (ahead, up)]
    forward = ahead / sizes[0] - LEAN * up / sizes[1]
    return forward / max(float(np.linalg.norm(forward)), 1e-300)


def _path(graph: object, places: Ints, surface: Surface, a: str, b: str) -> Floats | None:
    """(k, 3) positions along the cheapest way between two feature points; None where there is none."""
    way = _way(graph, places, surface, a, b)
    if way is None:
        return None
    line: Floats = surface.vertices[way].copy()
    line[0], line[-1] = surface.positions[a], surface.positions[b]
    return line


def _way(graph: object, places: Ints, surface: Surface, a: str, b: str) -> Ints | None:
    """Vertices along the cheapest way between two feature points; None where there is none."""
    from scipy.sparse.csgraph import dijkstra

    ends = [int(v[np.argmax(w)]) for v, w in (surface.points[a], surface.points[b])]
    start, stop = (int(k) for k in np.searchsorted(places, ends))
    if max(start, stop) == len(places) or [int(places[start]), int(places[stop])] != ends:
        return None
    before = dijkstra(graph, indices=np.array([start]), return_predecessors=True)[1][0]  # type: ignore[call-overload]
    way = [stop]
    while way[-1] != start:
        if before[way[-1]] < 0:
            return None
        way.append(int(before[way[-1]]))
    found: Ints = places[np.array(way[::-1])]
    return found


def _divide(line: Floats | None, positions: Mapping[str, Floats], a: str, b: str, count: int) -> list[Floats]:
    if line is None or len(line) < 2:
        return []
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    if along[-1] > DETOUR * float(np.linalg.norm(positions[a] - positions[b])):
        return []
    at = along[-1] * np.arange(1, count + 1) / (count + 1)
    return [np.array([np.interp(t, along, line[:, axis]) for axis in range(3)]) for t in at]


def contour_places(surface: Surface, contour: Contour) -> Any:
    """(k, n) sparse matrix that evaluates a vertex field at the anchors of one edge, in order.

    Anchors lie between two vertices of the way along the edge. Feature points are not among them.
    """
    from scipy.sparse import csr_array

    graph, places = _outer_graph(surface, contour)
    rows, columns, weights = [], [], []
    row = 0
    for a, b in pairwise(contour.points):
        way = _way(graph, places, surface, a, b)
        if way is None or len(way) < 2:
            continue
        steps = np.linalg.norm(np.diff(surface.vertices[way], axis=0), axis=1)
        along = np.concatenate([[0.0], np.cumsum(steps)])
        for t in along[-1] * np.arange(1, contour.anchors + 1) / (contour.anchors + 1):
            k = int(np.clip(np.searchsorted(along, t, side="right") - 1, 0, len(steps) - 1))
            share = (t - along[k]) / max(float(steps[k]), 1e-12)
            rows += [row, row]
            columns += [int(way[k]), int(way[k + 1])]
            weights += [1.0 - share, share]
            row += 1
    return csr_array((weights, (rows, columns)), shape=(row, surface.vertex_count))


def lid_profile(anchors: Mapping[str, tuple[int, Floats]]) -> dict[str, float]:
    """How far the eye is open along its lids, relative to its middle.

    Parameters
    ----------
    anchors : as from `contour_anchors`.

    Returns
    -------
    name of a lid's anchor -> opening there divided by the opening in the middle; only where the lids are apart.
    """
    found: dict[str, float] = {}
    for upper, lower in ((CONTOURS[2], CONTOURS[3]), (CONTOURS[4], CONTOURS[5])):
        names = list(zip(_names(upper), _names(lower), strict=True))
        if any(a not in anchors or b not in anchors for a, b in names):
            continue
        openings = [float(anchors[a][1][1] - anchors[b][1][1]) for a, b in names]
        middle = 0.5 * (openings[upper.anchors - 1] + openings[upper.anchors])
        for (a, b), opening in zip(names, openings, strict=True):
            if opening > 0.0 and middle > 0.0:
                found[a] = found[b] = opening / middle
    return found


def _names(contour: Contour) -> list[str]:
    return [f"{a}-{b}/{k}" for a, b in pairwise(contour.points) for k in range(1, contour.anchors + 1)]


def line_along(surface: Surface, contour: Contour, a: str, b: str) -> tuple[Ints, Floats]:
    """Vertices along an edge from one of its feature points to the next.

    Returns
    -------
    vertices : (k,), empty where there is no way.
    shares : (k,) of the way's length, from 0 to 1.
    """
    if a not in surface.points or b not in surface.points:
        return np.zeros(0, np.int32), np.zeros(0)
    way = _way(*_outer_graph(surface, contour), surface, a, b)
    if way is None or len(way) < 2:
        return np.zeros(0, np.int32), np.zeros(0)
    steps = np.linalg.norm(np.diff(surface.vertices[way], axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    return way, along / max(float(along[-1]), 1e-12)
