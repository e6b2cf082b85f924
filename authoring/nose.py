"""FAPs 61-64: the wings of the nose with their creases and nostrils, and its tip."""

from __future__ import annotations

from collections.abc import Mapping

from authoring.bump_motion import BumpMotion
from authoring.construction import Construction
from authoring.curves import shut_lip_places

WING_BORDERS = (-540, -270, 270, 540)
RAISE_BORDERS = (-680, -340, 340, 680)
BEND_BORDERS = (-900, -450, 450, 900)
"""The whole ranges of the standard."""

NOSE = ("9.1", "9.2")
WING, TIP = 1.1, 1.6
"""Reach in widths of the nose: a wing with the skin beside it; the tip with the bridge up to the eyes."""

_MOTIONS = (
    *(BumpMotion(k, WING_BORDERS, NOSE, WING, carries=True, shape=shut_lip_places) for k in (61, 62)),
    BumpMotion(63, RAISE_BORDERS, NOSE, TIP, carries=True, shape=shut_lip_places),
    BumpMotion(64, BEND_BORDERS, NOSE, TIP, carries=True, shape=shut_lip_places),
)

CONSTRUCTIONS: Mapping[int, Construction] = {m.fap_id: m.construction for m in _MOTIONS}
