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
from cloning.contours import contour_anchors, lid_profile
from cloning.normalize import blend, ratios
from cloning.prepare import PreparedFace
from cloning.published import build_published
from cloning.skin import FARTHEST, LEAST_FACING, SkinMap, build_skin_map
from fba.arrays import Floats

WIDEST = 2.0
"""The local opening of the lids changes their FAPU ratio by at most this factor."""


@dataclass(frozen=True, eq=False)
class AlignedTransfer:
    """The default mode's transfer."""

    skin_map: SkinMap
    measures: Mapping[str, float]
    parameters: Mapping[str, float | str | bool]

    def apply(self, motions: Floats) -> Floats:
        return self.skin_map.apply(motions)

    def carry(self, values: Floats) -> Floats:
        return self.skin_map.carry(values)


def build_transfer(source: PreparedFace, target: PreparedFace, as_published: bool) -> SkinTransfer:
    """Prepare Facial Motion Cloning between two faces."""
    if as_published:
        return build_published(source, target)
    scale = scale_field(source, target)
    skin_map = build_skin_map(source.skin, source.labels, target.skin, target.labels, scale)
    return AlignedTransfer(
        skin_map,
        skin_map.health(),
        {"farthest_es": FARTHEST, "least_facing": LEAST_FACING, "refinements": len(skin_map.refinements)},
    )


def scale_field(source: PreparedFace, target: PreparedFace) -> Floats:
    """FAPU ratios of every target vertex and axis, (n, 3), mesh units.

    IRISD is the opening in the middle of the eye. Along the lids the vertical ratio follows the shape of both
    openings, so that lids that meet in the middle meet everywhere.
    """
    ids = anchor_ids(source.skin, target.skin)
    places = [target.skin.positions[i] for i in ids]
    values = list(ratios(source.fapu, target.fapu, ids))
    anchors = contour_anchors(target.skin)
    mine, yours = lid_profile(contour_anchors(source.skin)), lid_profile(anchors)
    lids = ratios(source.fapu, target.fapu, ["3.1"])[0]
    for name, opening in yours.items():
        if name in mine:
            local = float(np.clip(opening / mine[name], 1.0 / WIDEST, WIDEST))
            places.append(anchors[name][1])
            values.append(lids * np.array([1.0, local, 1.0]))
    return blend(target.skin.vertices, np.array(places), np.array(values))
