"""Smooth weights over the skin that split a face unit between the feature points it moves together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fba.arrays import Floats
from fba.feature_points import FeaturePoint
from samples.build.contact import LOWER_LIP, UPPER_LIP
from samples.build.geodesic import distances, smoothstep
from samples.build.head import Head

HALF_WIDTH = 0.12
"""Width (ES0) of the blend between the halves of the forehead and the mouth."""

LINING = (0.4, 1.6)
"""Behind the contact line (in lip thicknesses) the lining of the mouth goes along up to the first, not beyond the
second."""

CONTOURS = {
    "upper": (("2.7", "2.2", "2.6"), ("8.6", "8.1", "8.5")),
    "lower": (("2.9", "2.3", "2.8"), ("8.8", "8.2", "8.7")),
}
"""Lip -> inner and outer contour points (right, middle, left)."""
CURVES = {
    "upper": (("2.5", "2.7", "2.2", "2.6", "2.4"), ("8.4", "8.6", "8.9", "8.1", "8.10", "8.5", "8.3")),
    "lower": (("2.5", "2.9", "2.3", "2.8", "2.4"), ("8.4", "8.8", "8.2", "8.7", "8.3")),
}
"""Lip -> all points along its inner and its outer contour, corners included."""
BROWS = {"left": ("4.1", "4.3", "4.5"), "right": ("4.2", "4.4", "4.6")}


@dataclass(frozen=True)
class Masks:
    """Weights (n,) in 0..1 by name.

    ``left`` ``right``: halves. ``beside_left`` ``beside_right``: the same from the inner end of the brow outwards.
    ``mouth``: between the corners. ``upper`` ``lower``: lips.
    ``corner_left`` ``corner_right``: beyond the quarter point of the mouth.
    ``2.8`` ...: the share of one contour point in its lip; all shares and the corners add up to 1 on the lip.
    ``4.3`` ...: the share of one eyebrow point in the forehead between the lid's fold and the hair line.
    """

    head: Head

    def __getitem__(self, name: str) -> Floats:
        if name in self._halves:
            return self._halves[name]
        if name in self._lips:
            return self._lips[name]
        if name.startswith("corner_"):
            return self._corner(name.removeprefix("corner_"))
        if name.startswith("beside_"):
            return self._beside(name.removeprefix("beside_"))
        if name == "mouth":
            return self._mouth()
        if name.startswith("4."):
            return self._brow(name)
        return self._contour(name)

    @cached_property
    def _skin(self) -> Floats:
        return self.head.parts["skin"]

    @cached_property
    def _halves(self) -> dict[str, Floats]:
        left = 0.5 * (1.0 + np.tanh(self._skin[:, 0] / (HALF_WIDTH * self.head.fapu.es0)))
        return {"left": left, "right": 1.0 - left}

    @cached_property
    def _lips(self) -> dict[str, Floats]:
        up = self._distance(UPPER_LIP)
        low = self._distance(LOWER_LIP)
        upper = smoothstep(0.5 + (low - up) / (low + up))
        return {"upper": upper, "lower": 1.0 - upper}

    def _distance(self, keys: Sequence[str]) -> Floats:
        mesh = self.head.scene.shape("skin").mesh
        nearest: Floats = distances(mesh, [self.head.points[k] for k in keys]).min(axis=0)
        return nearest

    def _corner(self, side: str) -> Floats:
        p = self.head.positions
        sign = 1.0 if side == "left" else -1.0
        quarter, corner = abs(p["2.6"][0]), abs(p["2.4"][0])
        return smoothstep((sign * self._skin[:, 0] - quarter) / (corner - quarter))

    def _beside(self, side: str) -> Floats:
        brow = self.head.positions["4.1" if side == "left" else "4.2"][0]
        return smoothstep(self._skin[:, 0] / brow)

    def _contour(self, key: str) -> Floats:
        lip, row, place = next(
            (lip, r, row.index(key)) for lip, rows in CONTOURS.items() for r, row in enumerate(rows) if key in row
        )
        p = self.head.positions
        ends = (("2.5", "2.4"), ("8.4", "8.3"))[row]
        knots = [p[k][0] for k in (ends[0], *CONTOURS[lip][row], ends[1])]
        along = _hat(self._skin[:, 0], knots, place + 1)
        inner = self._inner_share(lip)
        across = inner if row == 0 else (1.0 - inner) * self._toward_face(lip) * self._in_front(lip)
        share: Floats = along * across * self._lips[lip]
        return share

    def _in_front(self, lip: str) -> Floats:
        """1 outside the mouth, 0 behind the contact line."""
        inner, outer, thick = self.lip_distances(lip)
        return 1.0 - smoothstep((outer - inner) / thick)

    def _toward_face(self, lip: str) -> Floats:
        """1 on the outer contour, 0 at the height of the chin's boss (lower lip) or of the nose (upper lip)."""
        p = self.head.positions
        end = p["2.10" if lip == "lower" else "9.15"][1]
        x = [p[k][0] for k in CONTOURS[lip][1]]
        start = np.interp(self._skin[:, 0], x, [p[k][1] for k in CONTOURS[lip][1]])
        return smoothstep((self._skin[:, 1] - end) / (start - end))

    def _mouth(self) -> Floats:
        width = 0.6 * abs(self.head.positions["2.4"][0])
        return 1.0 - smoothstep((np.abs(self._skin[:, 0]) - width) / width)

    def _inner_share(self, lip: str) -> Floats:
        """1 on the inner contour and just behind it, 0 deep in the mouth, on the outer contour and beyond."""
        inner, outer, thick = self.lip_distances(lip)
        behind = np.where(outer > thick, inner / thick, 0.0)
        deep = smoothstep((behind - LINING[0]) / (LINING[1] - LINING[0]))
        share: Floats = smoothstep(0.5 + 0.5 * (outer - inner) / thick) * (1.0 - deep)
        return share

    def lip_distances(self, lip: str) -> tuple[Floats, Floats, Floats]:
        """Distance (n,) of the skin to a lip's inner and outer contour, and the lip's thickness at its x."""
        rows = CONTOURS[lip]
        inner, outer = (self._contour_distance(lip, keys) for keys in CURVES[lip])
        p = self.head.positions
        width = [float(np.linalg.norm(p[a] - p[b])) for a, b in zip(*rows, strict=True)]
        x = [p["8.4"][0], *(p[k][0] for k in rows[0]), p["8.3"][0]]
        thick: Floats = np.interp(self._skin[:, 0], x, [0.3 * width[0], *width, 0.3 * width[2]])
        return inner, outer, thick

    def _contour_distance(self, lip: str, keys: Sequence[str]) -> Floats:
        """Geodesic distance to the vertices next to the curve through contour points."""
        p = self.head.positions
        curve = np.array([p[k] for k in keys])
        x = np.linspace(curve[0, 0], curve[-1, 0], 41)
        line = np.column_stack([x, *(_through(x, curve[:, 0], curve[:, k]) for k in (1, 2))])
        ids = np.flatnonzero(self._lips[lip] > 0.5)
        away = np.linalg.norm(self._skin[ids][None] - line[:, None], axis=2)
        seeds = [FeaturePoint("skin", (int(ids[k]),), (1.0,)) for k in np.unique(np.argmin(away, axis=1))]
        nearest: Floats = distances(self.head.scene.shape("skin").mesh, seeds).min(axis=0)
        return nearest

    def _brow(self, key: str) -> Floats:
        side = next(s for s, keys in BROWS.items() if key in keys)
        sign = 1.0 if side == "left" else -1.0
        p = self.head.positions
        keys = BROWS[side]
        x = sign * self._skin[:, 0]
        knots = [sign * p[k][0] for k in keys]
        first, last = -knots[0], knots[-1] + 1.6 * (knots[-1] - knots[-2])
        along = _hat(x, [first, *knots, last], keys.index(key) + 1)
        fold = p["3.13" if side == "left" else "3.14"][1]
        brow = np.interp(x, knots, [p[k][1] for k in keys])
        hair = np.interp(x, [0.0, p["11.3"][0]], [p["11.1"][1], p["11.3"][1]])
        y = self._skin[:, 1]
        rise = smoothstep((y - fold) / (brow - fold))
        fade = smoothstep(((y - brow) / (hair - brow) - BROW_HEIGHT) / (1.0 - BROW_HEIGHT))
        share: Floats = along * rise * (1.0 - fade)
        return share


BROW_HEIGHT = 0.3
"""Up to this share of the way from the points of the brow to the hair line, the brow moves as a whole."""
ENDS = (("2.5", "2.4"), ("8.4", "8.3"))


def _hat(x: Floats, knots: Sequence[float], k: int) -> Floats:
    """Smooth hat: 1 at knots[k], 0 at the neighbours; neighbouring hats add up to 1."""
    rise = smoothstep((x - knots[k - 1]) / (knots[k] - knots[k - 1]))
    fall = smoothstep((knots[k + 1] - x) / (knots[k + 1] - knots[k]))
    return np.minimum(rise, fall)


def _through(x: Floats, knots: Floats, values: Floats) -> Floats:
    """Smooth curve through knots."""
    from scipy.interpolate import PchipInterpolator

    curve: Floats = PchipInterpolator(knots, values)(x)
    return curve
