"""FAPs 31-38: the eyebrows, which slide over the forehead while the rims of the lids stay."""

from __future__ import annotations

from collections.abc import Mapping

from authoring.bump_motion import BumpMotion
from authoring.bumps import Place
from authoring.construction import Construction
from authoring.curves import brow_places, rim_places
from cloning.prepare import PreparedFace

BORDERS = (-900, -300, 300, 900)

REACH = 2.4
"""In eye widths: from the brow to the top of the forehead, which gives way to a brow that is raised."""

_EYES = (("3.7", "3.11"), ("3.8", "3.12"))
_MIDDLES = ("4.3", "4.4")


def _brow(face: PreparedFace, values: Mapping[str, float]) -> list[Place]:
    return [*rim_places(face), *brow_places(face, values)]


_MOTIONS = (
    *(BumpMotion(k, BORDERS, _EYES[(k + 1) % 2], REACH, slides=True, carries=True, shape=_brow) for k in range(31, 37)),
    *(
        BumpMotion(k, BORDERS, _EYES[(k + 1) % 2], REACH, pins=_MIDDLES, slides=True, carries=True, shape=_brow)
        for k in (37, 38)
    ),
)

CONSTRUCTIONS: Mapping[int, Construction] = {m.fap_id: m.construction for m in _MOTIONS}
