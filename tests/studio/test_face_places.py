"""Motions read place by place."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np

from studio.checked_skin import CheckedSkin
from studio.face_places import FEWEST, MOVING, Places, place_names


def skin(count: int) -> CheckedSkin:
    """A row of vertices along x from 0 to 1; the last tenth is the upper lip, the feature points are at .2 and .8."""
    x = np.linspace(0.0, 1.0, count)
    vertices = np.stack([x, 0 * x, 0 * x], axis=1)
    labels = np.where(x > 0.9, 1, 0)
    points = {"4.1": np.array([0.2, 0, 0]), "5.1": np.array([0.8, 0, 0])}
    surface = SimpleNamespace(vertices=vertices, vertex_count=count, positions=points)
    return cast(CheckedSkin, SimpleNamespace(surface=surface, labels=labels))


def edges(count: int) -> np.ndarray:
    return np.stack([np.arange(count - 1), np.arange(1, count)], axis=1).astype(np.int32)


def test_a_flaw_is_read_at_its_place_and_the_rest_is_still() -> None:
    places = Places(skin(601), ("4.1", "5.1"), edges(601))
    x = places.members[:, 0] / 600.0
    moving = x < 0.3
    found = {name: (value, at) for name, value, at in places.quantiles(0.5, moving, 1.0 + x[moving])}
    assert set(found) == {"4.1", "5.1", "upper lip", MOVING}
    assert found["5.1"][0] == found["upper lip"][0] == 0.0
    assert abs(found["4.1"][0] - 1.05) < 0.01, "six tenths of its edges move, the median among them"
    assert abs(found[MOVING][0] - 1.15) < 0.01
    worst = np.flatnonzero(moving)[-1]
    assert found["4.1"][1] == found[MOVING][1] == worst


def test_what_reaches_from_one_place_into_another_and_small_places_are_left_out() -> None:
    row = edges(301)
    places = Places(skin(301), ("4.1", "5.1"), row)
    assert len(places.members) == len(row) - 2
    everything = np.ones(len(places.members), dtype=bool)
    names = [name for name, *_ in places.quantiles(0.9, everything, np.ones(len(everything)))]
    assert FEWEST > 301 * 0.1
    assert names == ["4.1", "5.1", MOVING]
    assert place_names(("5.1", "4.1"))[:3] == ("4.1", "5.1", "upper lip")
    none = np.zeros(len(places.members), dtype=bool)
    assert MOVING not in {name for name, *_ in places.quantiles(0.9, none, np.zeros(0))}
