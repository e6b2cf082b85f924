"""A multigrid preconditioner for symmetric systems whose unknowns are pixels: for pictures too large to factor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fba.arrays import Bools, Floats

if TYPE_CHECKING:
    from scipy import sparse

COARSEST = 8000
"""Unknowns that are factored directly."""

SWEEPS = 2


def factored(matrix: Any) -> Any:
    """Factor a symmetric positive definite matrix; the result has ``solve(right)``.

    Not `cloning.factors`: on a grid of pixels SuperLU's joined columns hold no zeros, and save a fifth of the time.
    """
    from scipy.sparse.linalg import splu

    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})


@dataclass(frozen=True, eq=False)
class _Level:
    matrix: sparse.csr_array
    weights: Floats
    up: sparse.csr_array
    down: sparse.csr_array


class Multigrid:
    """One V-cycle, symmetric: damped Jacobi before and after, bilinear steps, Galerkin matrices.

    Parameters
    ----------
    matrix : (n, n) symmetric positive definite.
    domain : (h, w) the pixels that are unknowns, n of them, numbered row by row.
    """

    def __init__(self, matrix: sparse.csr_array, domain: Bools) -> None:
        self._levels: list[_Level] = []
        while matrix.shape[0] > COARSEST:
            up, coarse = _interpolation(domain)
            down = up.T.tocsr()
            self._levels.append(_Level(matrix, _damping(matrix), up, down))
            matrix, domain = (down @ (matrix @ up)).tocsr(), coarse
        self._coarsest = factored(matrix)

    def solve(self, right: Floats) -> Floats:
        """An approximate solution for a right-hand side (n,)."""
        return self._cycle(0, right)

    def _cycle(self, depth: int, right: Floats) -> Floats:
        if depth == len(self._levels):
            exact: Floats = self._coarsest.solve(right)
            return exact
        level = self._levels[depth]
        x = level.weights * right
        for _ in range(SWEEPS - 1):
            x += level.weights * (right - level.matrix @ x)
        x += level.up @ self._cycle(depth + 1, level.down @ (right - level.matrix @ x))
        for _ in range(SWEEPS):
            x += level.weights * (right - level.matrix @ x)
        return x


def _damping(matrix: Any) -> Floats:
    """Jacobi weights: 4/3 over the largest eigenvalue (a bound by row sums), over the diagonal."""
    diagonal = matrix.diagonal()
    bound = float((abs(matrix).sum(axis=1) / diagonal).max())
    return np.asarray((4.0 / 3.0) / bound / diagonal)


def _interpolation(domain: Bools) -> tuple[sparse.csr_array, Bools]:
    """Bilinear interpolation from every second pixel of every second row, zero outside the domain."""
    from scipy import sparse

    coarse = np.ascontiguousarray(domain[::2, ::2])
    numbers = np.full((coarse.shape[0] + 1, coarse.shape[1] + 1), -1, np.int64)
    numbers[:-1, :-1][coarse] = np.arange(int(coarse.sum()))
    rows, columns = np.nonzero(domain)
    n = len(rows)
    entries: list[tuple[Any, Any, Any]] = []
    for r in (0, 1):
        for c in (0, 1):
            other = numbers[rows // 2 + r, columns // 2 + c]
            share = np.where(rows % 2, 0.5, 1.0 - r) * np.where(columns % 2, 0.5, 1.0 - c)
            good = (other >= 0) & (share > 0)
            entries.append((share[good], np.flatnonzero(good), other[good]))
    values, at, to = (np.concatenate(part) for part in zip(*entries, strict=True))
    matrix = sparse.coo_array((values, (at, to)), shape=(n, int(coarse.sum())))
    return matrix.tocsr(), coarse
