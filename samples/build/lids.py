"""Eyelids that close on a line and slide over the eyeball."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cloning.prepare import prepare
from cloning.rims import Eye, eyes
from fba.arrays import Floats
from fba.fapu import FAPU_DIVISOR
from samples.build.geodesic import smoothstep
from samples.build.head import Head

OVERLAP = 0.04
"""A rim goes this share of the eye's opening beyond the other one, but for its feature point, which goes exactly its
way."""
BESIDE = 0.2
"""Share of the way from the feature point to each corner over which the overlap grows."""
CLEARANCE = 1.01
"""Skin that lies on the eyeball stays this far from its centre (radii), or as far as it is in the neutral face."""
OUTSIDE = 0.99
"""Skin nearer to the centre than this (radii) in the neutral face is the inside of the socket."""


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
        eye, es0 = self._eye, self.head.fapu.es0
        part = ("upper", "lower").index(self.part)
        beside = smoothstep(np.abs(np.linspace(-1.0, 1.0, len(eye.open) + 2)[1:-1]) / BESIDE)
        beyond = OVERLAP * eye.opening.max() / np.where(eye.open, eye.opening, np.inf)
        travel = value / FAPU_DIVISOR * (1.0 + beside * beyond)
        out = skin.copy()
        out[eye.lids[part].vertices, 1] += es0 * eye.follow(part, skin / es0, travel, 0.0)
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
    def _eye(self) -> Eye:
        face = prepare(self.head.scene, self.head.points, "source")
        found = eyes(face)[("left", "right").index(self.side)]
        assert found is not None, self.head.name
        return found
