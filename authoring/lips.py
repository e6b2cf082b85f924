"""Lips: heights of the inner and outer contours, depths, and the corners.

Each contour moves between its own feature points while the other contour stays. Inner and outer corner lie so close
together that they move as one (FAPs 6 and 53, 7 and 54, 12 and 59, 13 and 60).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from authoring.bump_motion import BumpMotion
from authoring.bumps import Place
from authoring.construction import Construction
from authoring.curves import contact_places, corner_places, lip_places, shut_lip_places
from cloning.prepare import PreparedFace

MOUTH = ("8.3", "8.4")
HEIGHTS = (-600, -300, 300, 600)
DEPTHS = (-1080, -540, 540, 1080)
"""The whole range of the standard, but for the lower lip's heights: 600 MNS/1024 is twice the height of a lip."""

INNER, OUTER = 0.6, 0.55
"""Reach of a lip, in mouth widths: from the contact line to the nose, and some lining behind it."""

PUSH = 0.6
"""A lip is pushed as a whole; its corners hardly go along."""

STRETCH, RAISE = 1.6, 1.2
"""A stretched corner pushes the whole cheek before it; a raised one only the skin between nose and jaw."""

_OUTER = {6: "8.3", 7: "8.4", 12: "8.3", 13: "8.4"}
_TIED = {53: 6, 54: 7, 59: 12, 60: 13}
"""The outer corner's FAP -> the inner one's, whose motion is the same."""


def _stretched(face: PreparedFace, values: Mapping[str, float]) -> list[Place]:
    return [*contact_places(face), *corner_places(face, values)]


def _raised(face: PreparedFace, values: Mapping[str, float]) -> list[Place]:
    return [*shut_lip_places(face, values), *corner_places(face, values)]


_INNER = BumpMotion(4, HEIGHTS, MOUTH, INNER, carries=True, shape=lip_places)
_OUTER_LIP = BumpMotion(51, HEIGHTS, MOUTH, OUTER, carries=True, shape=shut_lip_places)
_STRETCH = BumpMotion(6, HEIGHTS, MOUTH, STRETCH, slides=True, carries=True, shape=_stretched)
_RAISE = BumpMotion(12, HEIGHTS, MOUTH, RAISE, slides=True, carries=True, shape=_raised)

_MOTIONS = (
    *(replace(_INNER, fap_id=k) for k in (4, 5, 8, 9, 10, 11)),
    *(replace(_OUTER_LIP, fap_id=k) for k in (51, 52, 55, 56, 57, 58)),
    *(BumpMotion(k, DEPTHS, MOUTH, PUSH, carries=True) for k in (16, 17)),
    *(replace(_STRETCH, fap_id=k, tied=(_OUTER[k],)) for k in (6, 7)),
    *(replace(_RAISE, fap_id=k, tied=(_OUTER[k],)) for k in (12, 13)),
)

_OWN = {m.fap_id: m.construction for m in _MOTIONS}

CONSTRUCTIONS: Mapping[int, Construction] = {
    **_OWN,
    **{outer: replace(_OWN[inner], fap_id=outer) for outer, inner in _TIED.items()},
}
