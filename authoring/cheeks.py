"""FAPs 39-42: cheeks puffed and sucked in together with their lining, and lifted under the eyes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from authoring.bump_motion import BumpMotion
from authoring.bumps import Place
from authoring.construction import Construction, Offsets
from authoring.curves import dome_places, rim_places, shut_lip_places
from cloning.prepare import PreparedFace

SUCK_BORDERS, PUFF_BORDERS = (-900, -300), (300, 900)
LIFT_BORDERS = (75, 150, 300, 600)
"""Close steps: the lower lid is pushed round the eyeball."""

PUFF, LIFT = 1.6, 2.2
"""Reach in eye widths: a puffed cheek from the cheekbone to the jaw, a lifted one from the lower lid to the mouth."""

_EYES = (("3.7", "3.11"), ("3.8", "3.12"))


def _dome(face: PreparedFace, values: Mapping[str, float]) -> list[Place]:
    return [*dome_places(face, values), *shut_lip_places(face, values)]


def _rims(face: PreparedFace, values: Mapping[str, float]) -> list[Place]:
    return [*rim_places(face), *shut_lip_places(face, values)]


@dataclass(frozen=True)
class Puff:
    """A cheek that is blown up round along its normal, and sucked in sideways between the teeth.

    Attributes
    ----------
    puffed, sucked : the motions above and below 0.
    """

    puffed: BumpMotion
    sucked: BumpMotion

    @property
    def construction(self) -> Construction:
        """The construction of the FAP."""
        return replace(self.puffed.construction, borders=(*SUCK_BORDERS, *PUFF_BORDERS), make=self.make)

    def make(self, face: PreparedFace, value: int) -> Offsets:
        """Offsets at a border."""
        return (self.puffed if value > 0 else self.sucked).make(face, value)


def _puff(fap_id: int) -> Puff:
    eye = _EYES[(fap_id + 1) % 2]
    return Puff(
        BumpMotion(fap_id, PUFF_BORDERS, eye, PUFF, bulges=True, carries=True, shape=_dome),
        BumpMotion(fap_id, SUCK_BORDERS, eye, PUFF, carries=True, shape=_dome),
    )


_LIFTS = tuple(
    BumpMotion(k, LIFT_BORDERS, _EYES[(k + 1) % 2], LIFT, slides=True, carries=True, shape=_rims) for k in (41, 42)
)

CONSTRUCTIONS: Mapping[int, Construction] = {
    **{k: _puff(k).construction for k in (39, 40)},
    **{m.fap_id: m.construction for m in _LIFTS},
}
