"""Sums of weighted vertex displacements for many frames at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fba.arrays import Bools, Floats, Ints

BLOCK_VERTICES = 512
"""Vertices in one block. The columns of a block are those that move any vertex in it: small blocks skip more
zeros, large ones multiply faster. Between 256 and 1,024 the speed is the same within 10 %."""

GATHER_BELOW = 0.6
"""Columns that no frame of a batch uses are left out when fewer than this share of them is used; copying the
others costs about as much as it saves above that."""


@dataclass(frozen=True, slots=True)
class Column:
    """Where one unit of weight moves vertices: index (k,), slopes (k, 3)."""

    index: Ints
    slopes: Floats


@dataclass(frozen=True, slots=True)
class _Block:
    start: int
    stop: int
    columns: Ints
    rows: Floats
    """(1 + columns, 3 * vertices): the neutral vertices, then each column's slopes."""


class Deformer:
    """Neutral vertices plus weighted columns, by one matrix product for each block of vertices.

    Parameters
    ----------
    neutral : (n, 3).
    columns : K columns over these vertices; an index that occurs twice in a column counts twice.
    """

    def __init__(self, neutral: Floats, columns: Sequence[Column]) -> None:
        self._count = len(neutral)
        inside = [np.unique(c.index // BLOCK_VERTICES) for c in columns]
        members: list[list[int]] = [[] for _ in range(0, self._count, BLOCK_VERTICES)]
        for number, blocks in enumerate(inside):
            for block in blocks.tolist():
                members[block].append(number)
        self._blocks = []
        for block, numbers in enumerate(members):
            start = block * BLOCK_VERTICES
            stop = min(start + BLOCK_VERTICES, self._count)
            rows = np.zeros((1 + len(numbers), stop - start, 3))
            rows[0] = neutral[start:stop]
            for row, number in enumerate(numbers, start=1):
                column = columns[number]
                here = (column.index >= start) & (column.index < stop)
                np.add.at(rows[row], column.index[here] - start, column.slopes[here])
            self._blocks.append(_Block(start, stop, np.array(numbers, np.int32), rows.reshape(len(rows), -1)))

    def __call__(self, weights: Floats) -> Floats:
        """Return the vertices (f, n, 3) at weights (f, K).

        A vertex whose columns have no weight keeps its neutral value exactly: the product only adds zeros.
        """
        frames = len(weights)
        out = np.empty((frames, self._count * 3))
        active: Bools = np.asarray(weights.any(axis=0))
        for block in self._blocks:
            target = out[:, 3 * block.start : 3 * block.stop]
            columns, rows = block.columns, block.rows
            used = active[columns]
            count = int(used.sum())
            if count == 0:
                target[:] = rows[0]
                continue
            if count < GATHER_BELOW * used.size:
                columns, rows = columns[used], rows[np.concatenate([[0], 1 + np.flatnonzero(used)])]
            factors = np.ones((frames, 1 + columns.size))
            factors[:, 1:] = weights[:, columns]
            np.matmul(factors, rows, out=target)
        return out.reshape(frames, self._count, 3)
