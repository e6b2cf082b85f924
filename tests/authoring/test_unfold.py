"""Folded spots are smoothed; what is not folded is left alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from authoring.unfold import unfold
from cloning.prepare import PreparedFace
from fat.quality import flips

Shipped = Callable[[str], PreparedFace]


def test_a_folded_spot_is_smoothed_and_feature_points_stay(shipped: Shipped) -> None:
    skin = shipped("quad_head").skin
    field = np.tile([0.0, -0.1, 0.0], (skin.vertex_count, 1))
    held = np.concatenate([vertices for vertices, _ in skin.points.values()])
    odd = int(np.setdiff1d(np.flatnonzero(skin.vertices[:, 2] > 0.5 * skin.vertices[:, 2].max()), held)[0])
    size = np.linalg.norm(skin.vertices[skin.edges[:, 0]] - skin.vertices[skin.edges[:, 1]], axis=1).max()
    field[odd, 0] += 2.0 * size
    before = field.copy()
    assert flips(skin.vertices, skin.triangles, field) > 0.0
    unfold(skin, field)
    assert flips(skin.vertices, skin.triangles, field) == 0.0
    np.testing.assert_array_equal(field[held], before[held])


def test_what_is_not_folded_is_left_alone(shipped: Shipped) -> None:
    skin = shipped("quad_head").skin
    field = 0.1 * skin.vertices
    before = field.copy()
    unfold(skin, field)
    np.testing.assert_array_equal(field, before)
