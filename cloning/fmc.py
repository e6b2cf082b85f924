"""Facial Motion Cloning: align by feature points, interpolate the source's motion, scale it by FAPUs.

The default mode keeps the method's idea and repairs what breaks on faces with lids and a mouth cavity: motion (not
position) is normalized, by a smooth field of FAPU ratios; alignment happens in space instead of on a cylinder, which
sees the skin around the eyes edge-on; labels keep upper and lower lip apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cloning.align import anchor_ids
from cloning.backends import SkinTransfer
from cloning.normalize import blend, ratios
from cloning.prepare import PreparedFace
from cloning.published import build_published
from cloning.skin import FARTHEST, LEAST_FACING, SkinMap, build_skin_map
from fba.arrays import Floats


@dataclass(frozen=True, eq=False)
class AlignedTransfer:
    """The default mode's transfer."""

    skin_map: SkinMap
    measures: Mapping[str, float]
    parameters: Mapping[str, float | str | bool]

    def apply(self, motions: Floats) -> Floats:
        return self.skin_map.apply(motions)


def build_transfer(source: PreparedFace, target: PreparedFace, as_published: bool) -> SkinTransfer:
    """Prepare Facial Motion Cloning between two faces."""
    if as_published:
        return build_published(source, target)
    ids = anchor_ids(source.skin, target.skin)
    anchors = np.array([target.skin.positions[i] for i in ids])
    scale = blend(target.skin.vertices, anchors, ratios(source.fapu, target.fapu, ids))
    skin_map = build_skin_map(source.skin, source.labels, target.skin, target.labels, scale)
    found = ~skin_map.unmatched
    return AlignedTransfer(
        skin_map,
        {
            "unmatched_share": float(skin_map.unmatched.mean()),
            "mean_distance_es": float(skin_map.distances[found].mean()) if found.any() else 0.0,
            "rest_without_partner": float(skin_map.fill.unreached.sum()),
        },
        {"farthest_es": FARTHEST, "least_facing": LEAST_FACING, "refinements": len(skin_map.refinements)},
    )
