"""The sphere through points: centre and radius of an eyeball from its mesh."""

from __future__ import annotations

import numpy as np

from fba.arrays import Floats


def fit_sphere(points: Floats) -> tuple[Floats, float, float]:
    """Return the least-squares sphere through points (n, 3): centre (3,), radius, root mean square error.

    Notes
    -----
    Linear in the unknowns: ``|p|^2 = 2 p.c + (r^2 - |c|^2)``. Any part of the sphere will do; points that define none
    (fewer than four, or all in a plane) give the smallest solution, whose error or size shows it.

    >>> round(fit_sphere(np.array([[3.0, 0, 0], [1, 0, 0], [2, 1, 0], [2, 0, 1]]))[1], 6)
    1.0
    """
    middle = points.mean(axis=0)
    local = points - middle
    size = max(float(np.abs(local).max()), 1e-300)
    unit = local / size
    matrix = np.concatenate([2.0 * unit, np.ones((len(unit), 1))], axis=1)
    solution = np.linalg.lstsq(matrix, np.einsum("ij,ij->i", unit, unit), rcond=1e-9)[0]
    radius = float(np.sqrt(max(float(solution[3] + solution[:3] @ solution[:3]), 0.0)))
    error = np.sqrt(np.mean((np.linalg.norm(unit - solution[:3], axis=1) - radius) ** 2))
    center: Floats = middle + size * solution[:3]
    return center, size * radius, size * float(error)
