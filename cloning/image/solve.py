"""The least-squares system of a picture: one unknown a pixel, everything outside the domain anchored."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from cloning.image.color import Planes
from cloning.image.grid import SIDES
from cloning.image.multigrid import Multigrid, factored
from cloning.image.parts import parts
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


def around(domain: Bools) -> NDArray[np.intp]:
    """(n,) places of the pixels whose tents touch a domain (h, w), counted row by row."""
    touched = domain.copy()
    for down, across in SIDES:
        touched |= np.roll(domain, (down, across), (0, 1))
    return np.flatnonzero(touched)


class PixelSystem:
    """Least squares for one unknown a pixel, prepared once for any number of right-hand sides.

    The rows are, for each tent that touches the domain, its two equations, and for each pair of neighbours their
    difference with a small weight.

    Parameters
    ----------
    domain : (h, w) the unknown pixels; the two outermost rows and columns must be known, as is everything else.
    coefficients : (2, 4, n) of the differences in the rings, two equations for each of the pixels `around` the domain.
    """

    def __init__(self, domain: Bools, coefficients: Planes) -> None:
        self._shape, self._unknown = domain.shape, np.flatnonzero(domain)
        self.count, at = len(self._unknown), around(domain)
        self._coefficients = coefficients
        number = np.full(domain.size, -1, np.int32)
        number[self._unknown] = np.arange(self.count, dtype=np.int32)
        steps = [down * domain.shape[1] + across for down, across in SIDES]
        self._matrix = _normal_matrix(np.stack([number[at + step] for step in (0, *steps)], axis=1), coefficients)
        tent = np.full(domain.size, -1, np.intp)
        tent[at] = np.arange(len(at))
        self._own = tent[self._unknown]
        self._reaching = [tent[self._unknown - step] for step in steps]
        self.direct = self.count <= DIRECT
        self._near: _Solver = (
            factored(self._matrix.astype(np.float32)) if self.direct else Multigrid(self._matrix, domain)
        )

    def solve(self, wanted: Planes) -> tuple[Planes, int]:
        """Find the unknowns whose differences come nearest to those wanted; known pixels are zero.

        Parameters
        ----------
        wanted : (4, n) differences in the rings of the pixels `around` the domain.

        Returns
        -------
        (h, w) and the steps of iteration, 0 where the matrix is factored.

        Raises
        ------
        CloningError
            If the iteration does not converge.
        """
        right = self._right(wanted.astype(np.float32, copy=False))
        if self.direct:
            found, steps = self._near.solve(right), 0
        else:
            found, steps = _iterate(self._matrix, right.astype(np.float64), self._near)
        out = np.zeros(self._shape, np.float32)
        out.ravel()[self._unknown] = found
        return out, steps

    def _right(self, wanted: Planes) -> Planes:
        """(count,) the transposed rows times what they shall be: what every difference pulls at its two pixels."""
        pull = np.empty_like(wanted)
        for part in parts(wanted.shape[1]):
            here, asked = pull[:, part], wanted[:, part]
            here[:] = 0.0
            for row in self._coefficients[:, :, part]:
                here += row * (row * asked).sum(axis=0)
            here[::2] += np.float32(EDGE_WEIGHT) * asked[::2]
        right: Planes = -pull.sum(axis=0).take(self._own)
        for side, tent in zip(pull, self._reaching, strict=True):
            right += side.take(tent)
        return right


def _normal_matrix(five: NDArray[np.int32], coefficients: Planes) -> Any:
    """The matrix of the least squares.

    Parameters
    ----------
    five : (n, 5) numbers of the unknowns of each tent: its pixel and the ring; -1 where known.
    """
    from scipy import sparse

    columns, values = [], []
    for row in coefficients:
        columns.append(five)
        values.append(np.concatenate([-row.sum(axis=0, keepdims=True), row]).T)
    for k in (1, 3):
        columns.append(five[:, [0, k]])
        values.append(np.tile([-1.0, 1.0], (len(five), 1)) * np.sqrt(EDGE_WEIGHT))
    known = np.concatenate([(c < 0).ravel() for c in columns])
    starts = np.concatenate([[0], np.cumsum(np.concatenate([(c >= 0).sum(axis=1) for c in columns]))])
    index, data = (np.concatenate([a.ravel() for a in arrays])[~known] for arrays in (columns, values))
    rows = sparse.csr_array((data.astype(np.float64), index, starts), shape=(len(starts) - 1, int(five.max()) + 1))
    return (rows.T.tocsr() @ rows).tocsr()


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
