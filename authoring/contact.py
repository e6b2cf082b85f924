"""The line along which the lips meet: in a pose they neither run through each other nor, where asked, stay apart."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cloning.prepare import PreparedFace
from fba.arrays import Bools, Floats, Ints

GAP = -2.0 / 1024.0
"""Gap between touching lips, in MNS0: they overlap by a hair, so that no light falls through between two meshes."""

REACH = 0.17
"""How far from the line of contact a lip gives way, in eye separations."""

NEAR = 0.12
"""How far from the line through its feature points the edge of a lip may lie, in eye separations."""

ODD, ODD_AT_LEAST = 3.0, 0.01
"""A slice in which the lips at rest are this many times as far apart as in the middle one, and by this more (eye
separations), was measured elsewhere: near the corners of the mouth the lips are one skin."""

SLICES = 80
PASSES = 6

GUIDES = (("2.5", "2.7", "2.2", "2.6", "2.4"), ("2.5", "2.9", "2.3", "2.8", "2.4"))
"""Feature points along the edge of the upper and of the lower lip, by rising x."""


@dataclass(frozen=True, eq=False)
class Lips:
    """The lips of one face, in eye separations."""

    face: PreparedFace

    @property
    def apart(self) -> bool:
        """True if the mouth is a slit between two lips whose feature points are given."""
        labels = self.face.labels
        known = all(k in self.face.skin.points for row in GUIDES for k in row)
        return known and 1 not in labels.sealed and all(np.any(labels.values == k) for k in (1, 2))

    @property
    def edges_at_rest(self) -> tuple[Floats, Floats]:
        """The edges of the upper and of the lower lip, (s, 3) each, slice by slice."""
        return self._lines(np.zeros_like(self.face.skin.vertices))[1]

    def in_contact(self, skin: Floats, gaps: bool) -> Floats:
        """Skin offsets (n, 3), mesh units, with lips that do not run through each other more than at rest.

        Parameters
        ----------
        gaps : bring the lips together too where they are apart.
        """
        if not self.apart:
            return skin
        es0 = self.face.fapu.es0
        offsets = skin / es0
        touching = GAP * self.face.fapu.mns0 / es0
        least = np.minimum(self._gap_at_rest, touching)
        for _ in range(PASSES):
            span, lines = self._lines(offsets)
            gap = lines[0][:, 1] - lines[1][:, 1]
            wrong = self._between(least - gap)
            half = 0.5 * (wrong if gaps else np.maximum(wrong, 0.0))
            if not np.abs(half).max() > 1e-6:
                break
            offsets = offsets + self._shift(0, offsets, span, lines[0], half)
            offsets = offsets + self._shift(1, offsets, span, lines[1], -half)
        done: Floats = offsets * es0
        return done

    def _between(self, values: Floats) -> Floats:
        """Values (s,) of the slices, with those that were not measured between the lips' edges taken from beside."""
        rest = self._gap_at_rest
        used = rest < ODD * max(float(np.median(rest)), 0.0) + ODD_AT_LEAST
        row = np.arange(len(values))
        filled: Floats = np.interp(row, row[used], values[used]) if used.any() else np.zeros(len(values))
        return filled

    def _shift(self, lip: int, offsets: Floats, span: Floats, line: Floats, lift: Floats) -> Floats:
        """Offsets along y that lift a lip's edge slice by slice and fade away from it."""
        side = self._side(lip)
        moved = self.face.skin.vertices[side] + offsets[side]
        place = np.column_stack([np.interp(moved[:, 0], span, line[:, k]) for k in (1, 2)])
        away = np.clip(np.linalg.norm(moved[:, 1:] - place, axis=1) / REACH, 0.0, 1.0)
        out = np.zeros_like(offsets)
        out[side, 1] = np.interp(moved[:, 0], span, lift, 0.0, 0.0) * (1.0 - away * away * (3.0 - 2.0 * away))
        return out

    def _lines(self, offsets: Floats) -> tuple[Floats, tuple[Floats, Floats]]:
        """x of the slices, and the edges of both lips there, (s, 3); slices without an edge take their neighbours'."""
        right, left = (float(self._moved(k, offsets)[0]) for k in ("2.5", "2.4"))
        span = np.linspace(right, left, SLICES + 2)[1:-1]
        upper, lower = (self._edge(lip, offsets, span) for lip in (0, 1))
        return span, (upper, lower)

    def _edge(self, lip: int, offsets: Floats, span: Floats) -> Floats:
        places = self.face.skin.vertices + offsets
        guide = np.array([self._moved(k, offsets) for k in GUIDES[lip]])
        near = np.column_stack([np.interp(span, guide[:, 0], guide[:, k]) for k in (1, 2)])
        a, b = self._edges(lip).T
        width = np.where(places[a, 0] == places[b, 0], 1.0, places[b, 0] - places[a, 0])
        share = (span[:, None] - places[a, 0]) / width
        cut = [places[a, k] + share * (places[b, k] - places[a, k]) for k in (1, 2)]
        crossed = (share >= 0.0) & (share <= 1.0) & (places[a, 0] != places[b, 0])
        crossed &= np.hypot(cut[0] - near[:, :1], cut[1] - near[:, 1:]) < NEAR
        sign = 1.0 if lip == 0 else -1.0
        best = np.argmin(np.where(crossed, sign * cut[0], np.inf), axis=1)
        row = np.arange(len(span))
        found = crossed[row, best]
        if not found.any():
            return np.column_stack([span, near])
        line = np.column_stack([span, cut[0][row, best], cut[1][row, best]])
        for k in (1, 2):
            line[:, k] = np.interp(span, span[found], line[found, k])
        return line

    def _moved(self, key: str, offsets: Floats) -> Floats:
        vertices, weights = self.face.skin.points[key]
        place: Floats = weights @ (self.face.skin.vertices[vertices] + offsets[vertices])
        return place

    @cached_property
    def _gap_at_rest(self) -> Floats:
        upper, lower = self.edges_at_rest
        gap: Floats = upper[:, 1] - lower[:, 1]
        return gap

    @cached_property
    def _both_edges(self) -> tuple[Ints, Ints]:
        edges = self.face.skin.edges
        return edges[self._side(0)[edges].all(axis=1)], edges[self._side(1)[edges].all(axis=1)]

    def _edges(self, lip: int) -> Ints:
        return self._both_edges[lip]

    def _side(self, lip: int) -> Bools:
        side: Bools = self.face.labels.values == lip + 1
        return side
