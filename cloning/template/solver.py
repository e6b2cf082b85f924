"""Solutions of a template's equations, step by step with one pattern."""

from __future__ import annotations

from typing import Any

import numpy as np

from fba.arrays import Floats, Ints


class Solver:
    """Solves symmetric positive definite systems of one pattern: the order of elimination is found once."""

    def __init__(self) -> None:
        self._order: Ints | None = None

    def solve(self, system: Any, right: Floats) -> Floats:
        """(n, 3) solutions for a sparse (n, n) system and (n, 3) right sides."""
        from scipy.sparse.linalg import splu

        order = self._order
        rules: dict[str, Any] = {"diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
        solved: Floats
        if order is None:
            factor = splu(system.tocsc(), permc_spec="MMD_AT_PLUS_A", **rules)
            self._order = np.argsort(factor.perm_c).astype(np.int32)
            solved = factor.solve(np.asfortranarray(right))
            return solved
        # A symmetric matrix by rows is the same by columns.
        ordered = system.tocsr()[order][:, order].T
        solved = np.empty_like(right)
        solved[order] = splu(ordered, permc_spec="NATURAL", **rules).solve(np.asfortranarray(right[order]))
        return solved
