"""FAPs 65-68: the ears as a whole, raised and pulled; their skin blends into the head around the attachment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from authoring.bumps import bumps
from authoring.construction import Construction, Offsets
from authoring.riders import skin_offsets
from cloning.prepare import PreparedFace
from fba.arrays import Floats
from fba.faps import fap

REACH = 0.85
"""How far the moving skin reaches from the rim, as a share of the ear's height: well over its attachment,
so that the skin around gives way smoothly."""

WIDEST = 0.9
"""Largest turn of an ear about its attachment, in radians; the rest of a pull stretches it."""

BORDERS = (-900, -300, 300, 900)


@dataclass(frozen=True)
class Ear:
    """Feature points of an ear: top, back and bottom of the pinna, lower and upper end of its attachment."""

    top: str
    back: str
    bottom: str
    lower: str
    upper: str

    def weight(self, face: PreparedFace) -> Floats:
        """(n,) 1 on the pinna, 0 on the head."""
        made = _WEIGHTS.setdefault(face, {})
        if self not in made:
            maker = bumps(face)
            at = face.skin.positions
            rim = tuple(k for k in (self.top, self.back, self.bottom) if k in face.skin.points)
            free = maker.within(rim, REACH * float(np.linalg.norm(at[self.top] - at[self.lower])))
            goals = maker.goals(dict.fromkeys(rim, 1.0))
            made[self] = maker.patch(free).weights(goals, face.skin.vertices)[:, 0]
        return made[self]

    def raised(self, face: PreparedFace, length: float) -> Floats:
        """The ear higher by a length; (n, 3) in eye separations."""
        field: Floats = length * self.weight(face)[:, None] * [0.0, 1.0, 0.0]
        return field

    def pulled(self, face: PreparedFace, length: float) -> Floats:
        """The ear turned about its attachment until its back lies a length (along +x) farther to the side.

        The axis is vertical, through the middle of the attachment, so that no height changes.
        """
        at = face.skin.positions
        axis, middle = np.array([0.0, 1.0, 0.0]), 0.5 * (at[self.upper] + at[self.lower])
        arm = (at[self.back] - middle) * [1.0, 0.0, 1.0]
        angle = _angle(arm, axis, length)
        weight = self.weight(face)
        local = face.skin.vertices - middle
        turned = _turn(local, axis, weight * angle) - local
        missing = length - float(_turn(arm[None], axis, np.array([angle]))[0, 0] - arm[0])
        away = np.clip(local @ arm / float(arm @ arm), 0.0, 1.0)
        field: Floats = turned + missing * (weight * away)[:, None] * [1.0, 0.0, 0.0]
        return field


_WEIGHTS: WeakKeyDictionary[PreparedFace, dict[Ear, Floats]] = WeakKeyDictionary()


def _turn(local: Floats, axis: Floats, angles: Floats) -> Floats:
    """Places (n, 3) turned about an axis through 0, each by its own angle (n,)."""
    c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
    turned: Floats = c * local + s * np.cross(axis, local) + (1.0 - c) * np.outer(local @ axis, axis)
    return turned


def _angle(arm: Floats, axis: Floats, length: float) -> float:
    """The turn, at most WIDEST, after which an arm (3,) across the axis comes nearest to being longer in x by this."""
    across = np.cross(axis, arm)
    radius, start = float(np.hypot(arm[0], across[0])), float(np.arctan2(across[0], arm[0]))
    goal = np.clip((arm[0] + length) / max(radius, 1e-12), -1.0, 1.0)
    # x = radius cos(start - angle); of its two solutions the smaller turn.
    both = np.array([start - np.arccos(goal), start + np.arccos(goal)])
    both = (both + np.pi) % (2.0 * np.pi) - np.pi
    return float(np.clip(both[np.argmin(np.abs(both))], -WIDEST, WIDEST))


@dataclass(frozen=True)
class EarMotion:
    """One FAP of an ear."""

    fap_id: int
    ear: Ear

    @property
    def construction(self) -> Construction:
        """The construction of the FAP."""
        e = self.ear
        return Construction(self.fap_id, BORDERS, (e.top, e.back, e.lower, e.upper), self.make)

    def make(self, face: PreparedFace, value: int) -> Offsets:
        """Offsets at a border."""
        entry = fap(self.fap_id)
        direction = np.asarray(entry.direction)
        length = value * face.fapu.unit(entry.unit) / face.fapu.es0
        if direction[0]:
            field = self.ear.pulled(face, length * float(direction[0]))
        else:
            field = self.ear.raised(face, length)
        own = entry.feature_points[0]
        at = face.skin.point_matrix([own]) @ field @ direction
        missing = length - float(at[0])
        field = field + missing * self.ear.weight(face)[:, None] * direction
        return skin_offsets(face, field)


_LEFT = Ear("10.1", "10.3", "10.5", "10.7", "10.9")
_RIGHT = Ear("10.2", "10.4", "10.6", "10.8", "10.10")

CONSTRUCTIONS: Mapping[int, Construction] = {
    m.fap_id: m.construction
    for m in (EarMotion(65, _LEFT), EarMotion(66, _RIGHT), EarMotion(67, _LEFT), EarMotion(68, _RIGHT))
}
