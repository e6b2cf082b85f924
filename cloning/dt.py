"""Deformation transfer as a backend: elastic template, triangle by triangle, then the target's own vertices.

After Xiang, Chen and Yang (2008). The source's skin is fitted onto the target; the fitted skin deforms as the source's
triangles do; each of the target's vertices follows its place on the fitted skin (see `cloning.local_transfer`).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cloning.backends import SkinTransfer
from cloning.deformation import deformation_transfer
from cloning.local_transfer import BareTransfer, GoalTransfer, carrying_map, goal_transfer, template_copy
from cloning.prepare import PreparedFace
from cloning.shape_solver import ShapeTransfer
from cloning.template.correspondence import correspond
from cloning.template.fitting import PUBLISHED, fit_template
from fba.arrays import Floats

LANDMARKS = (
    *("3.7", "3.8", "3.11", "3.12", "4.1", "4.2", "4.5", "4.6", "9.1", "9.2", "9.3", "9.15"),
    *("2.4", "2.5", "8.1", "8.2", "2.1", "2.10", "5.3", "5.4"),
)
"""Twenty of MPEG-4's feature points, for the published mode; which twenty the paper took is shown as a picture only."""


def build_transfer(source: PreparedFace, target: PreparedFace, as_published: bool) -> SkinTransfer:
    """Prepare deformation transfer between two faces."""
    return _build_published(source, target) if as_published else _build(source, target)


def _build(source: PreparedFace, target: PreparedFace) -> GoalTransfer:
    copy, skin_map = template_copy(source, target)
    skin = source.skin

    def factor(held: Floats, rows: Any) -> ShapeTransfer:
        return deformation_transfer(skin.vertices, copy, skin.triangles, held, rows, links=skin.links)

    return goal_transfer(source, target, skin_map, factor, {})


def _build_published(source: PreparedFace, target: PreparedFace) -> BareTransfer:
    """The paper's: every triangle counts the same, nothing is held but one resting vertex of each part."""
    skin = source.skin
    landmarks = [i for i in LANDMARKS if i in skin.points and i in target.skin.points]
    everything = np.ones(skin.vertex_count, bool)
    copy = fit_template(skin, target.skin, landmarks, schedule=PUBLISHED, visible=everything).vertices
    places = correspond(copy, skin.triangles, target.skin, farthest=np.inf, least_facing=-1.0)
    skin_map = carrying_map(target.skin, places)

    def factor(reach: Floats) -> ShapeTransfer:
        part = skin.components()
        held = np.zeros(skin.vertex_count)
        quietest = np.lexsort((reach, part))
        held[quietest[np.unique(part[quietest], return_index=True)[1]]] = 1.0
        return deformation_transfer(skin.vertices, copy, skin.triangles, held, links=skin.links, uniform=True)

    return BareTransfer(source, target, skin_map, factor, skin_map.health(), {"landmarks": len(landmarks)})
