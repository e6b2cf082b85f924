"""The warp that lays a target over the source."""

from __future__ import annotations

import numpy as np

from cloning.align import radial_warp


def test_the_warp_does_not_know_where_the_origin_is() -> None:
    rng = np.random.default_rng(5)
    anchors, places = rng.normal(size=(40, 3)), rng.normal(size=(100, 3))
    goals = anchors + 0.1 * np.sin(3.0 * anchors)
    here = radial_warp(places, anchors, goals)
    away = np.array([3e3, -2e3, 1e4])
    np.testing.assert_allclose(radial_warp(places + away, anchors + away, goals), here, atol=1e-9)
    np.testing.assert_allclose(radial_warp(places, anchors, goals + away) - away, here, atol=1e-9)
