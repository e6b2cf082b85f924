"""Sphere fitting."""

from __future__ import annotations

import numpy as np

from fba.arrays import Floats


def fit_sphere(vertices: Floats) -> tuple[Floats, float, float]:
    """Least-squares sphere through points.

    Parameters
    ----------
    vertices : (n, 3).

    Returns
    -------
    center : (3,).
    radius : > 0.
    error : root mean square distance of the points from the sphere.
    """
    middle = vertices.mean(axis=0)
    local = vertices - middle
    system = np.concatenate([2.0 * local, np.ones((len(local), 1))], axis=1)
    right = np.einsum("ij,ij->i", local, local)
    solution = np.linalg.lstsq(system, right, rcond=None)[0]
    center = solution[:3]
    radius = float(np.sqrt(max(float(solution[3] + center @ center), 1e-300)))
    away = np.linalg.norm(local - center, axis=1)
    return center + middle, radius, float(np.sqrt(np.mean((away - radius) ** 2)))
