"""Lips: heights of the inner and outer contours, depths, and the corners.

Each contour moves between its own feature points while the other contour stays. Inner and outer corner lie so close
together that they move as one (FAPs 6 and 53, 7 and 54, 12 and 59, 13 and 60).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from authoring.bump_motion import BumpMotion
from authoring.construction import Construction
from authoring.curves import lip_places

MOUTH = ("8.3", "8.4")
HEIGHTS = (-600, -300, 300, 600)
DEPTHS = (-1080, -540, 540, 1080)
"""The whole range of the standard, but for the lower lip's heights: 600 MNS/1024 is twice the height of a lip."""

INNER, OUTER = 0.6, 0.55
"""Reach of a lip, in mouth widths: from the contact line to the nose, and some lining behind it."""

PUSH = 0.6
"""A lip is pushed as a whole; its corners hardly go along."""

STRETCH, RAISE = 1.6, 0.9
"""A stretched corner pushes the whole cheek before it; a raised one only the skin between nose and jaw."""

_OUTER = {6: "8.3", 7: "8.4", 12: "8.3", 13: "8.4"}
_TIED = {53: 6, 54: 7, 59: 12, 60: 13}
"""The outer corner's FAP -> the inner one's, whose motion is the same."""

_MOTIONS = (
    *(BumpMotion(k, HEIGHTS, MOUTH, INNER, shape=lip_places) for k in (4, 5, 8, 9, 10, 11)),
    *(BumpMotion(k, HEIGHTS, MOUTH, OUTER, shape=lip_places) for k in (51, 52, 55, 56, 57, 58)),
    *(BumpMotion(k, DEPTHS, MOUTH, PUSH) for k in (16, 17)),
    *(BumpMotion(k, HEIGHTS, MOUTH, STRETCH, (_OUTER[k],), slides=True, carries=True) for k in (6, 7)),
    *(BumpMotion(k, HEIGHTS, MOUTH, RAISE, (_OUTER[k],), slides=True, shape=lip_places) for k in (12, 13)),
)

_OWN = {m.fap_id: m.construction for m in _MOTIONS}

CONSTRUCTIONS: Mapping[int, Construction] = {
    **_OWN,
    **{outer: replace(_OWN[inner], fap_id=outer) for outer, inner in _TIED.items()},
}
