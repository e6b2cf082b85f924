"""Vertex tents as a backend: a copy of the source on the target, one-ring by one-ring, then the target's own vertices.

After Song et al. The default mode finds the correspondence with the elastic template; published mode has the paper's
own mesh image (see `cloning.vtc_image`, which is also a backend of its own, and `cloning.recast`).
"""

from __future__ import annotations

from typing import Any

from cloning.backends import SkinTransfer
from cloning.local_transfer import goal_transfer, template_copy
from cloning.prepare import PreparedFace
from cloning.shape_solver import ShapeTransfer
from cloning.tents import tent_transfer
from cloning.vtc_image import build_published
from fba.arrays import Floats


def build_transfer(source: PreparedFace, target: PreparedFace, as_published: bool) -> SkinTransfer:
    """Prepare vertex tents between two faces."""
    if as_published:
        return build_published(source, target)
    copy, skin_map = template_copy(source, target)
    skin = source.skin

    def factor(held: Floats, rows: Any) -> ShapeTransfer:
        return tent_transfer(skin.vertices, copy, skin.polygons, held, rows, links=skin.links)

    return goal_transfer(source, target, skin_map, factor, {})
