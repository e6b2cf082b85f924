"""Motion for vertices that found no partner: the smoothest continuation of their neighbours' motion."""

from __future__ import annotations

from typing import Any

import numpy as np

from cloning.factors import factored
from fba.arrays import Bools, Floats, Ints


class HarmonicFill:
    """Solves for unknown vertices so that each is the weighted mean of its neighbours.

    Parts of the mesh without any known vertex rest.
    """

    def __init__(self, vertices: Floats, edges: Ints, unknown: Bools) -> None:
        """Factor the system.

        Parameters
        ----------
        vertices : (n, 3).
        edges : (e, 2); weights are inverse lengths, so positive: the fill stays between the known values.
        unknown : (n,) bool.
        """
        from scipy.sparse import coo_array, diags_array

        n = len(vertices)
        length = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
        weight = 1.0 / np.maximum(length, 1e-6)
        a, b = edges[:, 0], edges[:, 1]
        full = coo_array(
            (np.concatenate([weight, weight]), (np.concatenate([a, b]), np.concatenate([b, a]))), shape=(n, n)
        ).tocsr()
        reached = _reached(full, unknown)
        self.unreached: Bools = unknown & ~reached
        self.rows = np.flatnonzero(unknown & reached)
        known = np.flatnonzero(~unknown)
        near = np.unique(full[self.rows][:, known].indices)
        self.known = known[near]
        self._pull: Any = full[self.rows][:, self.known]
        self._solve: Any = None
        if len(self.rows):
            inner = full[self.rows][:, self.rows]
            total = np.asarray(full[self.rows].sum(axis=1)).ravel()
            self._solve = factored(diags_array(total) - inner)

    def apply(self, values: Floats) -> None:
        """Overwrite the unknown rows of (n, m) values in place."""
        values[self.unreached] = 0.0
        if self._solve is None:
            return
        right = self._pull @ values[self.known]
        moving = np.flatnonzero(np.any(right != 0.0, axis=0))
        values[self.rows] = 0.0
        for start in range(0, len(moving), 16):
            columns = moving[start : start + 16]
            values[np.ix_(self.rows, columns)] = self._solve.solve(np.asfortranarray(right[:, columns]))


def _reached(graph: Any, unknown: Bools) -> Bools:
    """Vertices whose connected component holds a known vertex."""
    from scipy.sparse.csgraph import connected_components

    count, component = connected_components(graph, directed=False)
    held = np.zeros(count, dtype=bool)
    held[component[~unknown]] = True
    found: Bools = held[component]
    return found
