"""FAP 18: the boss of the chin, pushed up and down over the jaw."""

from __future__ import annotations

from collections.abc import Mapping

from authoring.bump_motion import BumpMotion
from authoring.construction import Construction
from authoring.curves import shut_lip_places

REACH = 0.7
"""In mouth widths: to the jaw's edge on both sides."""

CONSTRUCTIONS: Mapping[int, Construction] = {
    18: BumpMotion(18, (-420, 420), ("8.3", "8.4"), REACH, slides=True, shape=shut_lip_places).construction
}
