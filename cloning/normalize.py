"""Which FAPU scales the motion of which part of the face, and how the scales blend between feature points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fba.arrays import Floats, Ints
from fba.faps import Unit
from fba.fapu import Fapu

Units = tuple[Unit, Unit, Unit]

LIPS_AND_JAW: Units = (Unit.MW, Unit.MNS, Unit.MNS)
EYES: Units = (Unit.ES, Unit.IRISD, Unit.ES)
BROWS_AND_CHEEKS: Units = (Unit.ES, Unit.ENS, Unit.ES)
NOSE_AND_EARS: Units = (Unit.ENS, Unit.ENS, Unit.ENS)
TONGUE: Units = (Unit.MW, Unit.MNS, Unit.MW)

_GROUPS: Mapping[str, Units] = {
    "2": LIPS_AND_JAW,
    "3": EYES,
    "4": BROWS_AND_CHEEKS,
    "5": BROWS_AND_CHEEKS,
    "6": TONGUE,
    "7": BROWS_AND_CHEEKS,
    "8": LIPS_AND_JAW,
    "9": NOSE_AND_EARS,
    "10": NOSE_AND_EARS,
    "11": BROWS_AND_CHEEKS,
}
_TEETH = ("9.8", "9.9", "9.10", "9.11")


def units_of(feature_point: str) -> Units:
    """The FAPU of x, y and z in the region of a feature point: those that the FAPs there are measured in.

    Facial Motion Cloning prints the lips' only; where no FAP gives a unit for an axis, a neighbour's is taken.

    >>> [u.value for u in units_of("3.1")]
    ['ES', 'IRISD', 'ES']
    """
    if feature_point in _TEETH:
        return LIPS_AND_JAW
    return _GROUPS[feature_point.split(".", maxsplit=1)[0]]


def factors(fapu: Fapu, ids: Sequence[str]) -> Floats:
    """(k, 3) whole FAPU distances (IRISD0 ...) of each feature point's region, mesh units."""
    return np.array([[fapu.base(u) for u in units_of(i)] for i in ids]).reshape(-1, 3)


def ratios(source: Fapu, target: Fapu, ids: Sequence[str]) -> Floats:
    """(k, 3) factors that turn the source's motion into the target's at each feature point, mesh units."""
    return factors(target, ids) / factors(source, ids)


def blend(places: Floats, anchors: Floats, values: Floats, power: float = 3.0) -> Floats:
    """Blend values at anchors by inverse distance to the power of 3: exact at anchors, smooth between.

    Parameters
    ----------
    places : (n, 3).
    anchors : (k, 3).
    values : (k, m).
    """
    out = np.empty((len(places), values.shape[1]))
    for start in range(0, len(places), 4096):
        block = places[start : start + 4096]
        squared = sum((block[:, axis, None] - anchors[:, axis]) ** 2 for axis in range(3))
        weights = np.maximum(squared, 1e-16) ** (-0.5 * power)
        out[start : start + 4096] = weights @ values / weights.sum(axis=1, keepdims=True)
    return out


def nearest(places: Floats, anchors: Floats) -> Ints:
    """Index of the nearest anchor of each place, (n,)."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(anchors).query(places)[1], dtype=np.int32)
