"""Visemes and expressions of one face: given by a shape, or posed from units and from the face's own FAPs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from authoring.construction import Offsets
from authoring.contact import Lips
from authoring.fitting import Fitting
from authoring.poses import CLOSED, EXPRESSION_POSES, VISEME_POSES, stand_in
from authoring.report import Step
from authoring.units import FaceShapes, added
from fat.evaluate import Player
from fat.motion import FaceMotion
from fat.tables import table_name
from fba.faps import EXPRESSION_FAP, VISEME_FAP, fap
from fba.high_level import BLEND_MAX, EXPRESSIONS, VISEMES


@dataclass(frozen=True, eq=False)
class HighLevel:
    """Makes visemes and expressions.

    player : plays the low-level FAPs that the face has so far.
    """

    fitting: Fitting
    shapes: FaceShapes
    player: Player

    def make(self, fap_id: int, select: int) -> tuple[FaceMotion | None, Step | None, str]:
        """The motion at full intensity, how it was made, and why it is missing or lacks a part."""
        name = table_name(fap_id, select)
        for given in self.shapes.given.get((fap_id, select), ()):
            motion = FaceMotion(name, fap_id, select, BLEND_MAX, given.offsets)
            return motion, Step(BLEND_MAX, "given", {given.shape: 1.0}), ""
        entry = VISEMES[select - 1].name if fap_id == VISEME_FAP else EXPRESSIONS[select - 1].name
        pose = (VISEME_POSES if fap_id == VISEME_FAP else EXPRESSION_POSES)[entry]
        offsets, parts, absent = self._posed(pose)
        why = f"without {', '.join(absent)}, which this face cannot show" if absent else ""
        if not offsets:
            return None, None, why
        face = self.fitting.face
        skin = Lips(face).in_contact(face.skin.join(offsets), gaps=entry in CLOSED)
        done = self.shapes.without_resting(self.fitting.finished(offsets, skin))
        step = Step(BLEND_MAX, "posed", parts)
        return FaceMotion(name, fap_id, select, BLEND_MAX, done), step, why

    def _posed(self, pose: Mapping[str, float]) -> tuple[Offsets, dict[str, float], list[str]]:
        """Sum of a pose's units; FAPs stand in for units that are not there.

        Returns
        -------
        offsets; shape -> factor and FAP name -> value; names of what is missing.
        """
        total: Offsets = {}
        parts: dict[str, float] = {}
        faps: dict[int, float] = {}
        absent: list[str] = []
        for name, weight in pose.items():
            unit = self.shapes.units.get(name)
            if unit is not None:
                total = added(total, unit, weight)
                for shape in self.shapes.units.sources(name):
                    parts[shape] = max(weight, parts.get(shape, 0.0))
                continue
            known = {k: weight * v for k, v in stand_in(name).items() if self.player.face.tables.get(k) is not None}
            if not known:
                absent.append(name)
            for number, value in known.items():
                faps[number] = faps.get(number, 0.0) + value
        if faps:
            total = added(total, self._played(faps))
            parts.update({fap(number).name: value for number, value in sorted(faps.items())})
        return {name: part for name, part in total.items() if part.any()}, parts, absent

    def _played(self, faps: Mapping[int, float]) -> Offsets:
        rest = self.player.pose().world_shapes()
        moved = self.player.pose(faps).world_shapes()
        return {name: moved[name] - rest[name] for name in rest if not np.array_equal(moved[name], rest[name])}


def high_level_keys() -> list[tuple[int, int]]:
    """(FAP, number) of the 14 visemes and 6 expressions."""
    return [(VISEME_FAP, v.id) for v in VISEMES] + [(EXPRESSION_FAP, e.id) for e in EXPRESSIONS]
