"""The rotation, uniform scale and translation that bring points nearest to others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Floats


@dataclass(frozen=True, eq=False)
class Similarity:
    """x -> scale * (rotation @ x) + shift.

    Attributes
    ----------
    scale : > 0.
    rotation : (3, 3), determinant 1.
    shift : (3,)
    """

    scale: float
    rotation: Floats
    shift: Floats

    def apply(self, places: Floats) -> Floats:
        """Move (n, 3) places."""
        moved: Floats = self.scale * (places @ self.rotation.T) + self.shift
        return moved


def fit_similarity(places: Floats, goals: Floats, weights: Floats | None = None) -> Similarity:
    """Least squares similarity (Umeyama 1991).

    Parameters
    ----------
    places, goals : (k, 3), k >= 3, not all on one line.
    weights : (k,) how much each pair counts; None = all the same.
    """
    w = np.ones(len(places)) if weights is None else np.asarray(weights, np.float64)
    w = w / w.sum()
    middle, goal = w @ places, w @ goals
    local, wanted = places - middle, goals - goal
    u, d, vt = np.linalg.svd((wanted * w[:, None]).T @ local)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation = (u * sign) @ vt
    scale = float((d * sign).sum() / max(float(w @ np.sum(local**2, axis=1)), 1e-300))
    return Similarity(scale, rotation, goal - scale * (rotation @ middle))
