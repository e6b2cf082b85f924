"""Low-level FAPs from the units of a face: chosen, shared out, scaled, freed of cross-talk, exact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from authoring.construction import Offsets
from authoring.fitting import Fitting, PointAxis
from authoring.recipes import Border, Mix, Recipe
from authoring.units import Units, added
from fba.arrays import Floats
from fba.faps import Fap, fap

LEAST = 60.0
"""FAP units by which a unit must move the FAP's own point: one that hardly moves it shows something else."""

SIDEWAYS = 0.85
"""Largest share of the own point's motion across the FAP's axis."""

FARTHEST = 4.0
"""Largest factor of a unit; beyond it modelled detail becomes caricature. All three limits are measured on the
MakeHuman and ICT-FaceKit units (shrugLower folds, cheekPuff goes forward)."""


@dataclass(frozen=True, eq=False)
class UnitMotion:
    """One border of a FAP made of units.

    parts : unit -> factor.
    error : what the own feature point misses, in FAP units.
    """

    value: int
    offsets: Offsets
    parts: dict[str, float]
    error: float


@dataclass(frozen=True, eq=False)
class UnitMaker:
    """Makes FAPs of one face out of its units."""

    fitting: Fitting
    units: Units
    _shares: dict[tuple[str, ...], Floats] = field(default_factory=dict)

    def mix(self, mix: Mix) -> tuple[Offsets, dict[str, float]] | None:
        """Weighted sum of units; None where the first one is missing, others may be.

        Returns
        -------
        offsets, and unit -> weight of those that are there.
        """
        total: Offsets = {}
        used: dict[str, float] = {}
        for k, (name, weight) in enumerate(mix.items()):
            unit = self.units.get(name)
            if unit is None and k == 0:
                return None
            if unit is not None:
                total = added(total, unit, weight) if total else {s: weight * part for s, part in unit.items()}
                used[name] = weight
        return total, used

    def border(self, recipe: Recipe, border: Border) -> UnitMotion | str:
        """One border of one FAP, or why units do not make it."""
        entry = fap(recipe.fap_id)
        own = entry.feature_points[0]
        for key in (own, recipe.judged or own):
            if key not in self.fitting.face.skin.points:
                return f"the feature point {key} is not given"
        reasons = []
        for mix in border.mixes:
            found = self.mix(mix)
            if found is None:
                reasons.append(f"there is no {next(iter(mix))}")
                continue
            raw = self._part(found[0], border, entry)
            if raw is None:
                reasons.append(f"feature points of {', '.join(border.rivals)} are not given")
                continue
            factor, reason = self._factor(raw, entry, border.value, recipe.judged or own)
            if reason:
                reasons.append(f"{'+'.join(found[1])} {reason}")
                continue
            return self._fitted(recipe, border, raw, factor, found[1])
        return "; ".join(reasons)

    def _fitted(self, recipe: Recipe, border: Border, raw: Offsets, factor: float, used: Mix) -> UnitMotion:
        entry, face = fap(recipe.fap_id), self.fitting.face
        raw = {name: factor * part for name, part in raw.items()}
        if not recipe.whole:
            others = {s.name for s in face.scene.shapes} - set(face.skin.shapes)
            roles = {name: face.scene.shape(name).role for name in others}
            raw = {name: part for name, part in raw.items() if name not in roles or roles[name].value == "other"}
        direction = np.asarray(entry.direction)
        own, axis = entry.feature_points[0], int(np.argmax(np.abs(direction)))
        amount = border.value * face.fapu.unit(entry.unit) * float(direction[axis])
        wanted: dict[PointAxis, float] = {(key, axis): amount for key in (own, *recipe.tied) if key in self.fitting.ids}
        free = {(key, a) for key in recipe.carried for a in range(3)} - wanted.keys()
        skin = self.fitting.corrected(face.skin.join(raw), wanted, free)
        offsets = self.fitting.finished(raw, skin)
        reached = float(self.fitting.at(own, face.skin.join(offsets)) @ direction) / face.fapu.unit(entry.unit)
        return UnitMotion(
            border.value, offsets, {name: factor * w for name, w in used.items()}, abs(reached - border.value)
        )

    def _factor(self, raw: Offsets, entry: Fap, value: int, point: str) -> tuple[float, str]:
        """How far the shape must go, and why it cannot serve ("" if it can)."""
        face = self.fitting.face
        moved = self.fitting.at(point, face.skin.join(raw)) / face.fapu.unit(entry.unit)
        along = float(moved @ np.asarray(entry.direction)) * float(np.sign(value))
        length = max(float(np.linalg.norm(moved)), 1e-12)
        sideways = float(np.sqrt(max(1.0 - (along / length) ** 2, 0.0)))
        if along < LEAST:
            return 0.0, f"moves its point by {along:.0f} only"
        if sideways >= SIDEWAYS:
            return 0.0, f"moves its point across the axis ({100 * sideways:.0f} %)"
        if abs(value) / along > FARTHEST:
            return 0.0, f"would have to be {abs(value) / along:.1f} times as large"
        return abs(value) / along, ""

    def _part(self, raw: Offsets, border: Border, entry: Fap) -> Offsets | None:
        """The part of a mix that belongs to one FAP."""
        face = self.fitting.face
        if border.side:
            half = ("left", "right").index(border.side)
            raw = {name: self.units.halves[name][half] * part for name, part in raw.items()}
        if border.axes:
            kept = [float(axis in border.axes) for axis in "xyz"]
            raw = {name: part * kept for name, part in raw.items()}
        if not border.rivals:
            return raw
        own = entry.feature_points[0]
        if not any(key in face.skin.points for key in border.rivals if key != own):
            return None
        skin = self.share(own, border.rivals)[:, None] * face.skin.join(raw)
        return {name: part for name, part in face.skin.split(skin).items() if part.any()}

    def share(self, own: str, rivals: Sequence[str]) -> Floats:
        """(n,) share of a feature point in the skin: 1 at it, 0 at its rivals, level there.

        Weights fall with the squared distance along the surface; all rivals' shares add up to 1.
        """
        face = self.fitting.face
        keys = tuple(k for k in rivals if k in face.skin.points)
        if keys not in self._shares:
            away = np.maximum(face.skin.distances(keys), 1e-6)
            near = np.where(np.isfinite(away), 1.0 / away**2, 0.0)
            total = np.maximum(near.sum(axis=0), 1e-300)
            self._shares[keys] = near / total
        share: Floats = self._shares[keys][keys.index(own)]
        return share
