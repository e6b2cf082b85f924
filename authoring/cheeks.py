"""FAPs 39-42: cheeks puffed and sucked in together with their lining, and lifted under the eyes."""

from __future__ import annotations

from collections.abc import Mapping

from authoring.bump_motion import BumpMotion
from authoring.bumps import Place
from authoring.construction import Construction
from authoring.curves import rim_places
from cloning.prepare import PreparedFace

PUFF_BORDERS = (-900, -600, -300, 300, 600, 900)
LIFT_BORDERS = (300, 600)

PUFF, LIFT = 1.9, 2.2
"""Reach in eye widths: a puffed cheek from the cheekbone to the jaw, a lifted one from the lower lid to the mouth."""

_EYES = (("3.7", "3.11"), ("3.8", "3.12"))


def _lids(face: PreparedFace, _: Mapping[str, float]) -> list[Place]:
    return rim_places(face)


_MOTIONS = (
    *(BumpMotion(k, PUFF_BORDERS, _EYES[(k + 1) % 2], PUFF, bulges=True, carries=True) for k in (39, 40)),
    *(BumpMotion(k, LIFT_BORDERS, _EYES[(k + 1) % 2], LIFT, slides=True, carries=True, shape=_lids) for k in (41, 42)),
)

CONSTRUCTIONS: Mapping[int, Construction] = {m.fap_id: m.construction for m in _MOTIONS}
