"""Rotation, scale and translation in the plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Floats


@dataclass(frozen=True)
class Similarity2D:
    """p -> factor * p + shift, points read as complex numbers x + iy.

    Attributes
    ----------
    factor : scale and rotation.
    shift : translation.
    """

    factor: complex
    shift: complex

    @property
    def scale(self) -> float:
        """How much longer distances become."""
        return abs(self.factor)

    def apply(self, places: Floats) -> Floats:
        """Move (n, 2) places."""
        moved = self.factor * (places[:, 0] + 1j * places[:, 1]) + self.shift
        return np.stack([moved.real, moved.imag], axis=1)

    def turn(self, motions: Floats) -> Floats:
        """Rotate and scale (n, 2) motions."""
        return Similarity2D(self.factor, 0j).apply(motions)

    def inverse(self) -> Similarity2D:
        """The way back."""
        return Similarity2D(1.0 / self.factor, -self.shift / self.factor)


def fit_similarity_2d(places: Floats, goals: Floats) -> Similarity2D:
    """Least squares rotation, scale and translation from (k, 2) places to goals, k >= 2, never a reflection.

    >>> s = fit_similarity_2d(np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([[1.0, 1.0], [1.0, 3.0]]))
    >>> s.apply(np.array([[0.0, 1.0]])).round(9).tolist()
    [[-1.0, 1.0]]
    """
    p, q = places[:, 0] + 1j * places[:, 1], goals[:, 0] + 1j * goals[:, 1]
    middle, goal = p.mean(), q.mean()
    factor = complex(np.vdot(p - middle, q - goal) / max(float(np.vdot(p - middle, p - middle).real), 1e-300))
    return Similarity2D(factor, complex(goal - factor * middle))
