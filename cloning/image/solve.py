"""The least-squares system of a picture: one unknown a pixel, everything outside the domain anchored."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from cloning.image.color import Planes
from cloning.image.grid import SIDES
from cloning.image.multigrid import Multigrid, factored
from fba.arrays import Bools
from fba.errors import CloningError

EDGE_WEIGHT = 0.05
"""Weight of the single differences. The two equations of a tent on flat skin see only every second pixel, so that a
checkerboard is free; this binds neighbours, and lets iterations converge."""

DIRECT = 150_000
"""Unknowns up to which the matrix is factored, in about two seconds; more are solved by a multigrid. The factor holds
4-byte floats: errors of 2e-5 of the largest change, in two thirds of the time."""

STEPS = 100

TOLERANCE = 1e-3
"""Iterations stop when the next step would change no unknown by more than this part of the largest one."""


class _Solver(Protocol):
    def solve(self, right: Any) -> Any: ...


class PixelSystem:
    """Least squares for one unknown a pixel, prepared once for any number of right-hand sides.

    The rows are, for each tent that touches the domain, its two equations, and for each pair of neighbours their
    difference with a small weight.

    Parameters
    ----------
    domain : (h, w) the unknown pixels; the two outermost rows and columns must be known, as is everything else.
    coefficients : (2, 4, h - 2, w - 2) of the differences in the rings, two equations for each inner pixel.
    """

    def __init__(self, domain: Bools, coefficients: Planes) -> None:
        from scipy import sparse

        self.domain = domain
        self.count = int(domain.sum())
        number = np.full(domain.shape, -1, np.int32)
        number[domain] = np.arange(self.count, dtype=np.int32)
        h, w = domain.shape
        inner, around = number[1:-1, 1:-1], [number[1 + r : h - 1 + r, 1 + c : w - 1 + c] for r, c in SIDES]
        five = np.stack([inner, *around], axis=-1)
        self._touched = (five >= 0).any(axis=-1)
        self._coefficients = coefficients[:, :, self._touched]
        columns, values = [], []
        for row in self._coefficients:
            columns.append(five[self._touched])
            values.append(np.concatenate([-row.sum(axis=0, keepdims=True), row]).T)
        self._edges = []
        for k in (0, 2):
            pair = five[..., [0, k + 1]]
            self._edges.append((pair >= 0).any(axis=-1))
            columns.append(pair[self._edges[-1]])
            values.append(np.tile([-1.0, 1.0], (len(columns[-1]), 1)) * np.sqrt(EDGE_WEIGHT))
        known = np.concatenate([(c < 0).ravel() for c in columns])
        starts = np.concatenate([[0], np.cumsum(np.concatenate([(c >= 0).sum(axis=1) for c in columns]))])
        index, data = (np.concatenate([part.ravel() for part in parts])[~known] for parts in (columns, values))
        rows = sparse.csr_array((data.astype(np.float64), index, starts), shape=(len(starts) - 1, self.count))
        across = rows.T.tocsr()
        self._across, self._matrix = across.astype(np.float32), (across @ rows).tocsr()
        self.direct = self.count <= DIRECT
        self._near: _Solver = (
            factored(self._matrix.astype(np.float32)) if self.direct else Multigrid(self._matrix, domain)
        )

    def solve(self, wanted: Planes) -> tuple[Planes, int]:
        """Find the unknowns whose differences come nearest to those wanted; known pixels are zero.

        Parameters
        ----------
        wanted : (4, h - 2, w - 2) differences in the ring of each inner pixel.

        Returns
        -------
        (h, w) and the steps of iteration, 0 where the matrix is factored.

        Raises
        ------
        CloningError
            If the iteration does not converge.
        """
        ring = wanted[:, self._touched]
        parts = [np.einsum("ki,ki->i", row, ring) for row in self._coefficients]
        edges = zip((0, 2), self._edges, strict=True)
        bound = [np.sqrt(EDGE_WEIGHT) * wanted[k][kept] for k, kept in edges]
        right = self._across @ np.concatenate([*parts, *bound]).astype(np.float32)
        if self.direct:
            found, steps = self._near.solve(right), 0
        else:
            found, steps = _iterate(self._matrix, right.astype(np.float64), self._near)
        out = np.zeros(self.domain.shape, np.float32)
        out[self.domain] = found
        return out, steps


def _iterate(matrix: Any, right: Planes, near: _Solver) -> tuple[Planes, int]:
    """Conjugate gradients with a preconditioner."""
    x = np.zeros_like(right)
    left = right.copy()
    change = near.solve(left)
    direction, size = change.copy(), float(left @ change)
    for step in range(1, STEPS + 1):
        moved = matrix @ direction
        along = size / max(float(direction @ moved), 1e-300)
        x += along * direction
        left -= along * moved
        change = near.solve(left)
        if np.abs(change).max() <= TOLERANCE * np.abs(x).max():
            return x, step
        size, before = float(left @ change), size
        direction = change + (size / before) * direction
    raise CloningError(f"the luminances did not converge in {STEPS} steps; check the feature points")
