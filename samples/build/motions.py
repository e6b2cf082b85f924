"""Turn recipes of ARKit units into calibrated motions on one head."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fat.motion import FaceMotion
from fat.tables import table_name
from fba.arrays import Floats
from fba.faps import fap
from samples.build.correction import Correction, PointAxis
from samples.build.geodesic import distances, smoothstep
from samples.build.head import Head
from samples.build.low_level import Border, Recipe
from samples.build.neutral import LOWER_LIP, UPPER_LIP

Offsets = dict[str, Floats]


@dataclass(frozen=True)
class MotionBuilder:
    """Makes motions of one head out of its ARKit units."""

    head: Head

    @cached_property
    def correction(self) -> Correction:
        return Correction(self.head)

    def pose(self, units: Mapping[str, float]) -> Offsets:
        """Weighted sum of units: shape -> (n, 3)."""
        total: Offsets = {}
        for name, weight in units.items():
            for shape, offsets in self.head.unit(name).items():
                total[shape] = total.get(shape, 0.0) + weight * offsets
        return total

    def fap_motion(self, recipe: Recipe, border: Border) -> FaceMotion:
        """One border of one FAP: scaled, cleared of cross-talk, exact at its own feature point."""
        entry = fap(recipe.fap)
        direction = np.asarray(entry.direction)
        own = entry.feature_points[0]
        wanted = border.value * self.head.fapu.unit(entry.unit) * direction
        raw = self._part(self.pose(border.units), border.part)
        moves = float(self.correction.at(own, raw["skin"]) @ direction)
        scale = min(float(wanted @ direction) / moves, border.most)
        raw = {name: scale * offsets for name, offsets in raw.items()}
        axis = int(np.argmax(np.abs(direction)))
        goals: dict[PointAxis, float] = {(key, axis): float(wanted[axis]) for key in (own, *recipe.tied)}
        free = {(key, a) for key in recipe.carried for a in range(3)} - goals.keys()
        skin = self.correction.correct(raw["skin"], goals, free)
        return FaceMotion(table_name(recipe.fap), recipe.fap, 1, border.value, self._with_skin(raw, skin))

    def _with_skin(self, raw: Offsets, skin: Floats) -> Offsets:
        """The offsets with a corrected skin; the lashes follow the correction of the lid below them."""
        out = {**raw, "skin": skin}
        for name, nearest in self._lash_roots.items():
            out[name] = raw[name] + (skin - raw["skin"])[nearest]
        return {name: offsets for name, offsets in out.items() if np.any(offsets)}

    @cached_property
    def _lash_roots(self) -> dict[str, Floats]:
        from scipy.spatial import cKDTree

        tree = cKDTree(self.head.parts["skin"])
        return {name: tree.query(self.head.parts[name])[1] for name in ("lashes_left", "lashes_right")}

    def _part(self, offsets: Offsets, part: str) -> Offsets:
        if not part:
            return offsets
        out = {name: np.zeros_like(values) for name, values in offsets.items()}
        share = self._halves[part] if part in self._halves else self._lips[part]
        out["skin"] = share[:, None] * offsets["skin"]
        return out

    @cached_property
    def _halves(self) -> dict[str, Floats]:
        """Weights of the skin that split a symmetric unit smoothly into a left and a right one."""
        x = self.head.parts["skin"][:, 0] / (HALF_WIDTH * self.head.fapu.es0)
        left = 0.5 * (1.0 + np.tanh(x))
        return {"left": left, "right": 1.0 - left}

    @cached_property
    def _lips(self) -> dict[str, Floats]:
        """Weights that split a unit of the mouth into upper and lower lip, blended around the corners."""
        mesh = self.head.scene.shape("skin").mesh
        up, low = (distances(mesh, [self.head.points[k] for k in keys]).min(axis=0) for keys in (UPPER_LIP, LOWER_LIP))
        upper = smoothstep(0.5 + (low - up) / (2.0 * LIP_BLEND * self.head.fapu.es0))
        return {"upper": upper, "lower": 1.0 - upper}


HALF_WIDTH = 0.12
"""Width (ES0) of the blend between the halves of the forehead and the mouth."""
LIP_BLEND = 0.2
"""Difference of distances (ES0) over which a point stops to belong to one lip."""
