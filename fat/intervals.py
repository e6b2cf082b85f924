"""The piecewise linear rule of FaceDefMesh: how far each interval is used at a FAP value."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fba.arrays import Floats, Ints


@dataclass(frozen=True, slots=True)
class IntervalRule:
    """The intervals of one FaceDefMesh: ``weight = sign * (clip(value, low, high) - origin)``, each (b-1,)."""

    low: Floats
    high: Floats
    origin: Floats
    sign: Floats


def interval_rule(borders: Ints) -> IntervalRule:
    """Return the rule of these borders; see `interval_weights`."""
    edges = np.asarray(borders, dtype=np.float64)
    low, high = edges[:-1].copy(), edges[1:].copy()
    low[0], high[-1] = -np.inf, np.inf
    if edges.size == 2:
        return IntervalRule(low, high, np.zeros(1), np.ones(1))
    below = edges[1:] <= 0.0
    return IntervalRule(low, high, np.where(below, edges[1:], edges[:-1]), np.where(below, -1.0, 1.0))


def interval_weights(borders: Ints, values: ArrayLike) -> Floats:
    """Return the factor of each interval's slope at FAP values.

    The displacement of a vertex is ``FAPU * sum_i weight_i * D_i``.

    Parameters
    ----------
    borders : (b,) increasing FAP values with 0 among them.
    values : (...) FAP values.

    Returns
    -------
    (..., b-1) float64, in FAP units. Intervals below zero count positive: their slopes point to where the
    vertex goes as the value falls.

    Notes
    -----
    ISO/IEC 14496-1, FaceDefMesh. Beyond the first or last border the line of the first or last interval goes
    on; also through zero when all borders lie on one side of it. A single interval is strictly linear, whatever
    its sign: ``FAPU * FAP * D``.

    >>> interval_weights(np.array([-1000, 0, 500, 1000]), 600).tolist()
    [0.0, 500.0, 100.0]
    """
    rule = interval_rule(borders)
    value = np.asarray(values, dtype=np.float64)[..., None]
    weights: Floats = rule.sign * (np.clip(value, rule.low, rule.high) - rule.origin) + 0.0  # no negative zeros
    return weights
