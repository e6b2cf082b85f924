"""Which side of the mouth and of the eyes a vertex belongs to, measured along the surface.

Upper and lower lip nearly touch in space but are far apart along the skin, so a label by geodesic distance tells
them apart also where they curl over the contact line and inside the mouth. Motion is never sampled, filtered or
warped across two opposite labels.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cloning.openings import between_lids, covered_eyes
from cloning.surface import Surface, symmetric_graph
from fba.arrays import Bools, Floats, Ints

NONE = 0
SIDES: tuple[tuple[int, tuple[str, ...]], ...] = (
    (1, ("2.2", "2.6", "2.7", "8.1", "8.5", "8.6", "8.9", "8.10")),
    (2, ("2.3", "2.8", "2.9", "8.2", "8.7", "8.8")),
    (3, ("3.1", "3.13")),
    (4, ("3.3", "3.9")),
    (5, ("3.2", "3.14")),
    (6, ("3.4", "3.10")),
)
"""Label number and its feature points; 1/2 upper/lower lip, 3/4 left lids, 5/6 right lids."""

OPPOSITE = np.array([-1, 2, 1, 4, 3, 6, 5])
"""The label that a label must never mix with; -1 for none."""

REACH = {1: ("8.3", "8.4", 0.75), 3: ("3.7", "3.11", 0.75), 5: ("3.8", "3.12", 0.75)}
"""How far a pair of labels reaches: corner, corner, and the share of their distance (0.75 MW for the lips)."""

SURE = 0.8
"""A vertex is labelled where the nearer side's distance is at most this share of the other's."""

SEAM_BAND = 0.12
"""Half width of the band (in MW) over which a sealed mouth's skin stretches from the upper to the lower lip."""

SEALED = 0.35
"""The mouth counts as sealed where the way from upper to lower lip is shorter than this share of MW."""


@dataclass(frozen=True, eq=False)
class Labels:
    """Labels of a surface.

    Attributes
    ----------
    values : (n,) int, 0 = belongs to no lip or lid.
    sealed : first label of each pair whose two sides are grown together (1 mouth, 3 left eye, 5 right eye).
    closed : likewise of each eye whose lids meet in a crease.
    between : (n,) bool, skin between two sides that are grown together: it stretches.
    """

    values: Ints
    sealed: tuple[int, ...]
    closed: tuple[int, ...]
    between: Bools


def label(surface: Surface) -> Labels:
    """Label the lips and lids of a skin."""
    values = np.zeros(surface.vertex_count, dtype=np.int32)
    covered = covered_eyes(surface)
    between = np.zeros(surface.vertex_count, dtype=bool)
    for eye in covered.filled:
        between |= between_lids(surface, eye)
    sealed = list(covered.filled)
    for (upper, upper_points), (lower, lower_points) in zip(SIDES[::2], SIDES[1::2], strict=True):
        here = [i for i in upper_points if i in surface.points], [i for i in lower_points if i in surface.points]
        left, right, share = REACH[upper]
        if not here[0] or not here[1] or left not in surface.positions or right not in surface.positions:
            continue
        width = float(np.linalg.norm(surface.positions[left] - surface.positions[right]))
        reach = share * width
        if upper in sealed:
            continue
        above, below = (surface.distances(ids, 3.0 * width).min(axis=0) for ids in here)
        if upper == 1 and _grown_together(surface, here[0][0], here[1][0], width):
            sealed.insert(0, upper)
            without, seam = _cut(surface, width)
            between |= seam < SEAM_BAND * width
            above, below = (surface.distances(ids, 3.0 * width, without).min(axis=0) for ids in here)
        near, far = np.minimum(above, below), np.maximum(above, below)
        sure = (near < reach) & (near <= SURE * far)
        values[sure & (above < below)] = upper
        values[sure & (below < above)] = lower
    return Labels(values, tuple(sealed), covered.closed, between)


def _grown_together(surface: Surface, upper: str, lower: str, width: float) -> bool:
    """True if skin joins the middles of the two sides directly, not round the corners."""
    rows = surface.point_matrix([lower])
    d = surface.distances([upper], width)[0]
    used = rows.indices[rows.data > 1e-6]
    return bool(np.min(d[used]) < SEALED * width)


def _cut(surface: Surface, width: float) -> tuple[Bools, Floats]:
    """Vertices along the shortest path 2.4 - 2.2 - 2.5, and everybody's distance from it."""
    from scipy.sparse.csgraph import dijkstra

    ids = [i for i in ("2.4", "2.2", "2.5") if i in surface.points]
    stops = [int(surface.points[i][0][np.argmax(surface.points[i][1])]) for i in ids]
    on_path = np.zeros(surface.vertex_count, dtype=bool)
    edges = surface.edges
    lengths = np.linalg.norm(surface.vertices[edges[:, 0]] - surface.vertices[edges[:, 1]], axis=1)
    graph = symmetric_graph(edges, lengths, surface.vertex_count)
    for start, end in pairwise(stops):
        before = dijkstra(graph, indices=np.array([start]), return_predecessors=True)[1][0]
        step = end
        while step >= 0:
            on_path[step] = True
            step = int(before[step])
    away = dijkstra(surface.graph, indices=np.flatnonzero(on_path), min_only=True, limit=width)
    return on_path, away
