"""Vectors of many places in many motions: x, y and z are arrays of their own, (n, K) each, worked on row by row."""

from __future__ import annotations

import numpy as np

from fba.arrays import Floats, Ints

ROWS = 1024
"""Places worked on in one go: with a dozen motions, what is made of them stays in the processor's cache."""


def edges(places: list[Floats], start: Ints, end: Ints) -> list[Floats]:
    """From the places `start` to the places `end`, (r,) each."""
    found = [p.take(end, axis=0) for p in places]
    for vector, p in zip(found, places, strict=True):
        vector -= p.take(start, axis=0)
    return found


def cross(e: list[Floats], f: list[Floats]) -> list[Floats]:
    """Cross products of two vectors each."""
    found = [e[k - 2] * f[k - 1] for k in range(3)]
    for k, part in enumerate(found):
        part -= e[k - 1] * f[k - 2]
    return found


def length(vectors: list[Floats]) -> Floats:
    """(n, K) lengths."""
    squared = vectors[0] ** 2
    for part in vectors[1:]:
        squared += part**2
    found: Floats = np.sqrt(squared, out=squared)
    return found
