"""The low-level FAPs of one face: given by a shape, made of units, or constructed, border by border."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from authoring import jaw, lids
from authoring.construct import construct
from authoring.construction import Offsets
from authoring.ends import unfolded
from authoring.from_units import UnitMaker, UnitMotion
from authoring.names import SIDES
from authoring.recipes import RECIPES, UNITS_FIRST
from authoring.report import Step
from authoring.units import PUPIL, FaceShapes, Given
from cloning.prepare import PreparedFace
from fat.conformance import Probe
from fat.face import AnimatableFace
from fat.motion import FaceMotion
from fat.tables import FaceDefTables
from fba.arrays import Floats
from fba.faps import Fap, fap
from fba.findings import Finding

JAW = 3
PUPIL_FAPS = (29, 30)

ARCS: Mapping[int, Sequence[int]] = {
    JAW: jaw.OPEN_BORDERS,
    **{number: made.borders for number, made in lids.CONSTRUCTIONS.items()},
}
"""FAPs that go along an arc, whatever shows them -> the borders that keep to it. One unit shows both directions."""

MOST_SCALED = 4.0
"""A given shape that would have to be scaled more than this (or its inverse) to show its value is left as it is."""


@dataclass(frozen=True, eq=False)
class Made:
    """One FAP: motions at its borders, how each was made, and why others were not."""

    motions: tuple[FaceMotion, ...]
    steps: tuple[Step, ...]
    why: tuple[str, ...]
    findings: tuple[Finding, ...] = ()


@dataclass(frozen=True, eq=False)
class LowLevel:
    """Makes the low-level FAPs of one face.

    constructing : False leaves out what no shape shows.
    """

    face: PreparedFace
    shapes: FaceShapes
    maker: UnitMaker
    constructing: bool
    _made: dict[int, tuple[list[FaceMotion], list[Finding]]] = field(default_factory=dict)

    def make(self, fap_id: int) -> Made:
        """One FAP, each side from the best that there is; no motions if there is nothing."""
        entry = fap(fap_id)
        found: dict[int, tuple[Offsets, Step]] = {}
        why: list[str] = []
        findings: list[Finding] = []
        self._given(entry, found, why, findings)
        made: dict[int, tuple[Offsets, Step]] = {}
        for sign in (-1, 1) if entry.bidirectional else (1,):
            if not any(value * sign > 0 for value in found):
                self._side(entry, sign, made, why)
        found.update(self._unfolded(fap_id, made, why))
        rows = sorted(found.items())
        still = self.shapes.without_resting
        motions = tuple(FaceMotion(entry.name, fap_id, 1, value, still(offsets)) for value, (offsets, _) in rows)
        return Made(motions, tuple(step for _, (_, step) in rows), tuple(dict.fromkeys(why)), tuple(findings))

    def _side(self, entry: Fap, sign: int, found: dict[int, tuple[Offsets, Step]], why: list[str]) -> None:
        ways = [self._constructed, self._from_units]
        if entry.id in UNITS_FIRST:
            ways.reverse()
        for way in ways:
            made = way(entry, sign)
            if isinstance(made, str):
                why.append(made)
            else:
                found.update(made)
                return

    def _unfolded(
        self, fap_id: int, made: dict[int, tuple[Offsets, Step]], why: list[str]
    ) -> dict[int, tuple[Offsets, Step]]:
        """What was made, up to where the skin folds."""
        kept = unfolded(self.face, fap_id, {value: offsets for value, (offsets, _) in made.items()})
        out = {}
        for value, offsets in kept.items():
            beyond = min((v for v in made if v * value > 0 and abs(v) >= abs(value)), key=abs)
            step = made[beyond][1]
            if beyond != value:
                parts = {name: value / beyond * factor for name, factor in step.parts.items()}
                step = Step(value, step.how, parts)
                why.append(f"the table ends at {value}, beyond which the skin folds")
            out[value] = (offsets, step)
        return out

    def _given(
        self, entry: Fap, found: dict[int, tuple[Offsets, Step]], why: list[str], findings: list[Finding]
    ) -> None:
        for given in self.shapes.given.get((entry.id, 1), ()):
            value, factor, wrong = self._calibrated(entry, given)
            if wrong:
                findings.append(Finding("warning", "given-shape", f"'{given.shape}': {wrong}", f"FAP {entry.id}"))
            if value in found:
                why.append(f"'{given.shape}' shows the value {value} once more; the first shape is kept")
            elif value:
                offsets = {name: factor * part for name, part in given.offsets.items()}
                found[value] = (offsets, Step(value, "given", {given.shape: factor}))

    def _calibrated(self, entry: Fap, given: Given) -> tuple[int, float, str]:
        """The value that a given shape shows, the factor that makes it exact, and what is wrong."""
        shown = self._shown(entry, given.offsets)
        if shown is None:
            if given.value is None:
                return 0, 0.0, f"nothing measures the value at which it shows {entry.name}; a map (--map) must say it"
            return given.value, 1.0, ""
        value = given.value if given.value is not None else round(shown)
        if value == 0:
            text = (
                f"it does not move the feature point {entry.feature_points[0]} as {entry.name} does; a map (--map) can "
                "say which value it shows"
            )
            return 0, 0.0, text
        factor = value / shown if shown else 0.0
        if not 1.0 / MOST_SCALED <= factor <= MOST_SCALED:
            return value, 1.0, f"it moves its feature point by {shown:.0f} FAP units, not {value}; it is used as it is"
        return value, factor, ""

    def _shown(self, entry: Fap, offsets: Offsets) -> float | None:
        """The FAP value that a motion shows; None where the face has nothing to measure it at."""
        moved = {name: rest + offsets.get(name, 0.0) for name, rest in self._rest.items()}
        found = self._probe.measure(entry, 1, moved)
        return None if found is None else found.found

    @cached_property
    def _rest(self) -> dict[str, Floats]:
        return {s.name: self.face.scene.world_vertices(s.name) for s in self.face.scene.shapes}

    @cached_property
    def _probe(self) -> Probe:
        bare = AnimatableFace(self.face.scene, self.face.points, FaceDefTables(()), self.face.fapu)
        return Probe(bare, self._rest)

    def _dilated(self, entry: Fap) -> dict[int, tuple[Offsets, Step]] | str:
        """A pupil that a unit widens; it narrows along the same line."""
        name = f"{PUPIL}{SIDES[PUPIL_FAPS.index(entry.id)]}"
        unit = self.maker.units.get(name)
        shown = None if unit is None else self._shown(entry, unit)
        if unit is None or shown is None or not shown > 0.0:
            return f"there is no {name}" if unit is None else f"{name} does not widen the pupil"
        factor = round(shown) / shown
        offsets = {shape: factor * part for shape, part in unit.items()}
        return {round(shown): (offsets, Step(round(shown), "units", self._named({name: 1.0}, factor)))}

    def _from_units(self, entry: Fap, sign: int) -> dict[int, tuple[Offsets, Step]] | str:
        if entry.id in PUPIL_FAPS:
            pupil = self._dilated(entry)
            return pupil if sign > 0 or isinstance(pupil, str) else "a pupil narrows along the line on which it widens"
        recipe = RECIPES.get(entry.id)
        if recipe is None:
            return "no unit shows it"
        out: dict[int, tuple[Offsets, Step]] = {}
        for border in recipe.borders:
            bends = entry.id in ARCS and border.value > 0
            if border.value * sign < 0 and not bends:
                continue
            made = self.maker.border(recipe, border)
            if isinstance(made, str):
                return made
            out = (self._bent(entry.id, sign, made) if bends else {}) or out
            if not out and border.value * sign > 0:
                out = {made.value: (made.offsets, Step(made.value, "units", self._named(made.parts, 1.0)))}
        return out or f"no unit shows it {'below' if sign < 0 else 'above'} zero"

    def _bent(self, fap_id: int, sign: int, made: UnitMotion) -> dict[int, tuple[Offsets, Step]]:
        """The borders of a unit's motion on its arc: jaws turn and lids slide; none where the face has no such arc."""
        values = [b for b in ARCS[fap_id] if b * sign > 0]
        unit = self.maker.units.get(next(iter(made.parts)))
        rows = (
            jaw.open_jaw(self.face, values, unit) if fap_id == JAW else lids.close_lid(self.face, fap_id, values, unit)
        )
        return {v: (o, Step(v, "units", self._named(made.parts, v / made.value))) for v, o in rows.items()}

    def _named(self, parts: Mapping[str, float], share: float) -> dict[str, float]:
        """Factors by the shapes' own names."""
        return {name: share * factor for unit, factor in parts.items() for name in self.maker.units.sources(unit)}

    def _constructed(self, entry: Fap, sign: int) -> dict[int, tuple[Offsets, Step]] | str:
        if not self.constructing:
            return "constructions were not asked for"
        if entry.id not in self._made:
            self._made[entry.id] = construct(self.face, entry.id)
        motions, findings = self._made[entry.id]
        rows = {
            m.value: (self.maker.fitting.seamless(dict(m.offsets)), Step(m.value, "constructed", {}))
            for m in motions
            if m.value * sign > 0
        }
        if rows:
            return rows
        reasons = [f.message.removeprefix(f"{entry.name} is ") for f in findings]
        return "; ".join(reasons) or f"the construction has no {'negative' if sign < 0 else 'positive'} side"
