"""Triangles that cross, and lips that sink into each other."""

from __future__ import annotations

import numpy as np
import pytest

from fat.intersections import crossing
from fat.lip_contact import lip_depth

FLAT = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])


@pytest.mark.parametrize(
    ("other", "crosses"),
    [
        ([[0.2, 0.2, -1], [0.2, 0.2, 1], [5, 5, 1]], True),
        ([[0.2, 0.2, -1], [0.3, 0.2, -1], [0.2, 0.3, 1]], True),
        ([[0.9, 0.9, -1], [0.9, 0.9, 1], [5, 5, 1]], False),
        ([[0.2, 0.2, 0.1], [0.2, 0.2, 1], [0.5, 0.2, 1]], False),
        ([[0.2, 0.2, 0], [0.4, 0.2, 0], [0.2, 0.4, 0]], False),
        ([[-1.0, 0.4, -0.5], [3, 0.4, -0.5], [0.5, 0.4, 2]], True),
    ],
)
def test_two_triangles(other: list[list[float]], crosses: bool) -> None:
    second = np.array([other], float)
    assert (len(crossing(FLAT, second)) == 1) is crosses
    assert (len(crossing(second, FLAT)) == 1) is crosses


def test_the_same_triangles_as_by_trying_every_pair() -> None:
    rng = np.random.default_rng(3)
    soup = [rng.normal(size=(n, 1, 3)) + 0.4 * rng.normal(size=(n, 3, 3)) for n in (60, 80)]
    pairs = [k for k in range(60) if any(len(crossing(soup[0][[k]], soup[1][[j]])) for j in range(80))]
    assert 5 < len(pairs) < 55
    assert crossing(*soup).tolist() == pairs
    assert crossing(soup[0], soup[1] + 100.0).tolist() == []
    assert crossing(soup[0][:0], soup[1]).tolist() == []


def test_lips_are_as_deep_in_each_other_as_they_overlap() -> None:
    x = np.linspace(-0.5, 0.5, 41)
    lower = np.stack([x, 0 * x, 0 * x], axis=1)
    for gap, deep in ((0.05, 0.0), (-0.03, 0.1)):
        places = np.concatenate([lower, lower + np.array([0.0, gap, 0.0])])
        normals = np.repeat([[0.0, 1, 0], [0.0, -1, 0]], 41, axis=0)
        upper = np.arange(41, 82, dtype=np.int32)
        depth, whose = lip_depth(places, normals, upper, np.arange(41, dtype=np.int32), 0.3)
        assert depth == pytest.approx(np.full(82, deep))
        assert whose.tolist() == [*range(41, 82), *range(41)]
    assert lip_depth(places, normals, upper[:0], upper, 0.3)[0].tolist() == []
