"""Turn recipes of ARKit units into calibrated motions on one head."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fat.motion import FaceMotion
from fat.tables import table_name
from fba.arrays import Floats
from fba.faps import fap
from samples.build.correction import Correction, PointAxis
from samples.build.geodesic import smoothstep
from samples.build.head import Head
from samples.build.lids import Lid
from samples.build.low_level import Border, Recipe
from samples.build.masks import Masks
from samples.build.neutral import PASSES, close_lips, lash_roots

Offsets = dict[str, Floats]


@dataclass(frozen=True)
class MotionBuilder:
    """Makes motions of one head out of its ARKit units."""

    head: Head

    @cached_property
    def correction(self) -> Correction:
        return Correction(self.head)

    def pose(self, units: Mapping[str, float]) -> Offsets:
        """Weighted sum of units: shape -> (n, 3). The upper teeth stay (mouthFunnel bends a few of them)."""
        total: Offsets = {}
        for name, weight in units.items():
            unit = self._tongue_up if name == TONGUE_UP else self.head.unit(name)
            for shape, offsets in unit.items():
                if shape == "upper_teeth":
                    continue
                total[shape] = total.get(shape, 0.0) + weight * offsets
        return total

    def fap_motions(self, recipe: Recipe) -> list[FaceMotion]:
        """All borders of one FAP."""
        motions = [self._border(recipe, border) for border in recipe.borders]
        if recipe.lid is None:
            return [replace(m, offsets=self.over_eyeballs(dict(m.offsets))) for m in motions]
        lid = Lid(self.head, *recipe.lid)
        return [step for motion in motions for step in self._lid_steps(lid, motion)]

    def _lid_steps(self, lid: Lid, motion: FaceMotion) -> list[FaceMotion]:
        """A lid's motion: opening as it is; closing in steps, because the lid slides over a ball."""
        full = dict(motion.offsets)
        if motion.value < 0:
            return [motion]
        own = fap(motion.fap_id or 0).feature_points[0]
        steps = []
        for value in range(LID_STEP, motion.value + 1, LID_STEP):
            part = {name: value / motion.value * offsets for name, offsets in full.items()}
            skin = lid.closing(part["skin"], value)
            skin *= self.correction.at(own, part["skin"])[1] / self.correction.at(own, skin)[1]
            steps.append(replace(motion, value=value, offsets=self._with_skin(part, lid.over_eyeball(skin))))
        return steps

    def _border(self, recipe: Recipe, border: Border) -> FaceMotion:
        """One border of one FAP: scaled, cleared of cross-talk, exact at its own feature point."""
        entry = fap(recipe.fap)
        direction = np.asarray(entry.direction)
        own = entry.feature_points[0]
        wanted = border.value * self.head.fapu.unit(entry.unit) * direction
        raw = self._masked(self.pose(border.units), border.masks)
        if border.axes:
            raw["skin"] = raw["skin"] * [float(axis in border.axes) for axis in "xyz"]
        moves = float(self.correction.at(own, raw["skin"]) @ direction)
        scale = min(float(wanted @ direction) / moves, border.most)
        raw = {name: scale * offsets for name, offsets in raw.items()}
        missing = float(wanted @ direction) - scale * moves
        if scale == border.most and border.masks:
            raw["skin"] = raw["skin"] + missing * self._sliding(direction, border.masks, own)
        axis = int(np.argmax(np.abs(direction)))
        goals: dict[PointAxis, float] = {(key, axis): float(wanted[axis]) for key in (own, *recipe.tied)}
        free = {(key, a) for key in recipe.carried for a in range(3)} - goals.keys()
        skin = self.correction.correct(raw["skin"], goals, free)
        return FaceMotion(table_name(recipe.fap), recipe.fap, 1, border.value, self._with_skin(raw, skin))

    def _with_skin(self, raw: Offsets, skin: Floats) -> Offsets:
        """The offsets with a corrected skin; the lashes follow the correction of the lid below them."""
        out = {**raw, "skin": skin}
        for name, nearest in self._lash_roots.items():
            out[name] = raw[name] + (skin - raw["skin"])[nearest] if name in raw else skin[nearest]
        return _without_noise(out, NOISE * self.head.fapu.es0)

    @cached_property
    def _lash_roots(self) -> dict[str, NDArray[np.int64]]:
        """The skin vertex next to the root of each vertex of the lashes."""
        from scipy.spatial import cKDTree

        tree = cKDTree(self.head.parts["skin"])
        roots = lash_roots(self.head)
        return {name: np.asarray(tree.query(self.head.parts[name][rows])[1]) for name, rows in roots.items()}

    def over_eyeballs(self, offsets: Offsets) -> Offsets:
        """The offsets with the lids kept off the eyeballs."""
        skin = offsets["skin"]
        for side in ("left", "right"):
            skin = Lid(self.head, side, "upper").over_eyeball(skin)
        return self._with_skin(offsets, skin)

    def with_lips_in_contact(self, offsets: Offsets, gaps: bool) -> Offsets:
        """The offsets with lips that do not run through each other, nor leave a gap if `gaps` are to be closed."""
        skin = offsets["skin"]
        for _ in range(PASSES):
            skin = skin + close_lips(self.head, skin, gaps)
        return self._with_skin(offsets, skin)

    @cached_property
    def _tongue_up(self) -> Offsets:
        """The front of the tongue bends up and back until its tip is behind the upper teeth; no face unit does it."""
        p = self.head.positions
        tongue = self.head.parts["tongue"]
        middle, tip = p["6.2"][2], p["6.1"][2]
        share = smoothstep((tongue[:, 2] - middle) / (tip - middle)) ** 2
        lift = np.array([0.0, TIP_LIFT, -0.5 * TIP_LIFT]) * self.head.fapu.es0
        return {"tongue": share[:, None] * lift}

    def _sliding(self, direction: Floats, names: Sequence[str], own: str) -> Floats:
        """The masked skin sliding along its own surface: as far as 1 along a direction at the own point."""
        normals = self.head.scene.shape("skin").mesh.vertex_normals()
        across = normals @ direction
        tangent = direction - across[:, None] * normals
        tangent /= np.maximum(1.0 - across**2, STEEPEST)[:, None]
        slide = np.prod([self.masks[name] for name in names], axis=0)[:, None] * tangent
        even: Floats = slide / float(self.correction.at(own, slide) @ direction)
        return even

    def _masked(self, offsets: Offsets, names: Sequence[str]) -> Offsets:
        """Only the skin's share under the product of these masks; everything, if there are none."""
        if not names:
            return offsets
        share = np.prod([self.masks[name] for name in names], axis=0)
        return {"skin": share[:, None] * offsets["skin"]}

    @cached_property
    def masks(self) -> Masks:
        return Masks(self.head)


TONGUE_UP = "tongueUp"
"""Name of a pose's own unit beside MakeHuman's."""
TIP_LIFT = 0.2
"""Height of the tongue's tip in that unit, in ES0."""
LID_STEP = 256
"""Between the borders of a closing lid: the chord of each step stays within 0.4 % of the eyeball's radius."""
STEEPEST = 0.4
"""Squared cosine between a direction and the surface below which skin no longer slides the whole way."""
NOISE = 3e-4
"""Offsets below this length (ES0) are what is left of a local correction far away; they become 0."""


def _without_noise(offsets: Offsets, least: float) -> Offsets:
    out = {}
    for name, values in offsets.items():
        moves = np.linalg.norm(values, axis=1) >= least
        if moves.any():
            out[name] = np.where(moves[:, None], values, 0.0)
    return out
