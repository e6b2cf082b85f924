"""Eyelids that close on a line and slide over the eyeball."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fba.arrays import Bools, Floats
from fba.fapu import FAPU_DIVISOR
from samples.build.contact import LIDS, edge_line, side_mask
from samples.build.geodesic import smoothstep
from samples.build.head import Head

LID_REACH = 0.1
"""How far from its rim a lid follows the correction of the closing line, in ES0."""
CORNER = 0.25
"""Share of the opening's width over which the correction fades towards each corner."""
CLEARANCE = 1.01
"""Skin that lies on the eyeball stays this far from its centre (radii), or as far as it is in the neutral face."""
OUTSIDE = 0.99
"""Skin nearer to the centre than this (radii) in the neutral face is the inside of the socket."""
PASSES = 5


@dataclass(frozen=True)
class Lid:
    """One eyelid of a head: side "left" or "right", part "upper" or "lower"."""

    head: Head
    side: str
    part: str

    def closing(self, skin: Floats, value: float) -> Floats:
        """Correct a lid's motion so that its whole rim goes the same share of the way to the other rim.

        Parameters
        ----------
        skin : (n, 3) offsets at `value`.
        value : of the FAP; 1024 brings the rims together, so does any pair of upper and lower values of that sum.
        """
        edge = LIDS[self.side, self.part]
        own, other = self._rest(self.part), self._rest("lower" if self.part == "upper" else "upper")
        goal = own[:, 1] + value / FAPU_DIVISOR * (other[:, 1] - own[:, 1])
        x = self.head.parts["skin"][:, 0]
        rim = np.column_stack([np.interp(x, self._span, own[:, k]) for k in (1, 2)])
        away = np.linalg.norm(self.head.parts["skin"][:, 1:] - rim, axis=1) / (LID_REACH * self.head.fapu.es0)
        ends = np.minimum(x - self._span[0], self._span[-1] - x) / (CORNER * (self._span[-1] - self._span[0]))
        fall = (1.0 - smoothstep(away)) * smoothstep(ends) * self._mask
        out = skin.copy()
        for _ in range(PASSES):
            line = edge_line(self.head, edge, self._mask, self._span, out).points
            missing = goal - line[:, 1]
            out[:, 1] += fall * np.interp(x + out[:, 0], self._span, missing, left=0.0, right=0.0)
        return out

    def over_eyeball(self, skin: Floats) -> Floats:
        """Push skin that would enter the eyeball forward along the gaze; heights stay."""
        center, radius = self.head.eye_centers[f"eye_{self.side}"]
        rest = self.head.parts["skin"]
        away = np.linalg.norm(rest - center, axis=1)
        kept = np.minimum(away, CLEARANCE * radius)
        moved = rest + skin
        across = np.linalg.norm(moved[:, :2] - center[:2], axis=1)
        front = center[2] + np.sqrt(np.maximum(kept**2 - across**2, 0.0))
        covers = (away >= OUTSIDE * radius) & (rest[:, 2] > center[2]) & skin.any(axis=1)
        enters = covers & (across < kept) & (moved[:, 2] < front)
        out = skin.copy()
        out[enters, 2] += (front - moved[:, 2])[enters]
        return out

    @cached_property
    def _mask(self) -> Bools:
        return side_mask(self.head, LIDS[self.side, self.part])

    @cached_property
    def _span(self) -> Floats:
        """Slices from corner to corner; the corners themselves stay."""
        first, _, last = (self.head.positions[k][0] for k in LIDS[self.side, self.part].guide)
        margin = 0.04 * (last - first)
        span: Floats = np.linspace(first + margin, last - margin, 61)
        return span

    def _rest(self, part: str) -> Floats:
        edge = LIDS[self.side, part]
        return edge_line(self.head, edge, side_mask(self.head, edge), self._span).points
