"""FAPUs measured on points with known distances."""

from __future__ import annotations

import numpy as np
import pytest

from fba import Fapu, Unit
from fba.errors import LandmarkError

POINTS = {
    "3.1": (1.0, 4.1, 0.0),
    "3.3": (1.0, 3.9, 0.0),
    "3.2": (-1.0, 4.15, 0.0),
    "3.4": (-1.0, 3.85, 0.0),
    "3.5": (1.5, 4.0, 0.0),
    "3.6": (-1.5, 4.2, 0.0),
    "9.15": (0.0, 2.0, 1.0),
    "2.2": (0.0, 1.0, 1.0),
    "8.3": (1.2, 0.9, 0.5),
    "8.4": (-1.0, 0.9, 0.5),
}


def points() -> dict[str, np.ndarray]:
    return {key: np.array(value) for key, value in POINTS.items()}


def test_distances() -> None:
    fapu = Fapu.from_feature_points(points())
    assert fapu.irisd0 == pytest.approx((0.2 + 0.3) / 2)
    assert fapu.es0 == pytest.approx(3.0)
    assert fapu.ens0 == pytest.approx(4.1 - 2.0)
    assert fapu.mns0 == pytest.approx(1.0)
    assert fapu.mw0 == pytest.approx(2.2)
    assert fapu.unit(Unit.MNS) == pytest.approx(1.0 / 1024)
    assert fapu.unit(Unit.AU) == 1e-5
    assert fapu.unit(Unit.NONE) == 1.0


@pytest.mark.parametrize(
    ("swap", "named"), [(("3.5", "3.6"), "ES0"), (("8.3", "8.4"), "MW0"), (("2.2", "9.15"), "MNS0")]
)
def test_swapped_points_are_refused_by_name(swap: tuple[str, str], named: str) -> None:
    swapped = points()
    swapped[swap[0]], swapped[swap[1]] = swapped[swap[1]], swapped[swap[0]]
    with pytest.raises(LandmarkError, match=named):
        Fapu.from_feature_points(swapped)


def test_missing_points_are_all_named() -> None:
    few = points()
    del few["3.1"], few["8.4"]
    with pytest.raises(LandmarkError, match=r"3\.1.*8\.4"):
        Fapu.from_feature_points(few)
