"""Skin slides over what lies below it: a motion across the view follows the round of the head in depth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cloning.surface import Surface
from fba.arrays import Floats

SEEN = 0.3
"""Least forward part of a vertex's normal: skin that faces sideways or is hidden says nothing about the round."""

LEAST = 0.05
"""Skin with less than this share of the motion says nothing about the round either."""

FEWEST = 12
"""A paraboloid through fewer vertices than this, twice its unknowns, would follow their noise."""


@dataclass(frozen=True, eq=False)
class Round:
    """The round of a part of a head, a paraboloid ``z = f(x, y)``.

    Attributes
    ----------
    middle : (3,) its origin.
    terms : (6,) factors of 1, x, y, x^2, xy, y^2.
    """

    middle: Floats
    terms: Floats

    def slide(self, places: Floats, shift: Floats) -> Floats:
        """A shift (n, 3) across the view, completed in depth: each place (n, 3) keeps its height above the round."""
        local = places - self.middle
        depth = (_powers(local + shift) - _powers(local)) @ self.terms
        done: Floats = shift + depth[:, None] * [0.0, 0.0, 1.0]
        return done


def fit_round(surface: Surface, weight: Floats) -> Round:
    """The round below the skin that moves: least squares through what faces forwards, by weight (n,)."""
    heavy = np.abs(weight)
    seen = (surface.normals[:, 2] > SEEN) & (heavy > LEAST * heavy.max(initial=0.0))
    if seen.sum() < FEWEST:
        return Round(np.zeros(3), np.zeros(6))
    middle = surface.vertices[seen].mean(axis=0)
    local, heavy = surface.vertices[seen] - middle, heavy[seen]
    terms = np.linalg.lstsq(heavy[:, None] * _powers(local), heavy * local[:, 2], rcond=1e-9)[0]
    return Round(middle, terms)


def _powers(places: Floats) -> Floats:
    x, y = places[:, 0], places[:, 1]
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
