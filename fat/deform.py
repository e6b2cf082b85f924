"""Sums of weighted vertex displacements for many frames at once."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from fba.arrays import Bools, Floats, Ints

SHORTEST = 16
"""Vertices in the shortest stretch. A stretch multiplies the columns that move any vertex in it: short ones multiply
fewer zeros, long ones multiply faster. From 8 to 32 a cloned face in full motion is as fast within 10 %."""

LONGEST = 1024
"""Vertices in the longest stretch; a power of two times the shortest."""

LONG_BATCH = 128
"""Frames for which the tiles are chosen."""

PRODUCT_COST = 200_000
"""What one more product costs by itself, in multiplications: about 5 microseconds."""

COPY_COST = 20
"""What it costs to copy one number, in multiplications."""

Number = TypeVar("Number", np.float64, np.float32)


@dataclass(frozen=True, slots=True)
class Column:
    """Where one unit of weight moves vertices: index (k,), slopes (k, 3)."""

    index: Ints
    slopes: Floats


class Deformer(Generic[Number]):
    """Neutral vertices plus weighted columns, by one matrix product for each stretch of vertices.

    Tiles are the stretches that are best where all columns have weights; their rows are multiplied as they lie in
    memory. Where few have, the stretches are longer, and the rows of the columns in use are copied first.

    Parameters
    ----------
    neutral : (n, 3).
    columns : K columns over these vertices; an index that occurs twice in a column counts twice.
    number : type of the numbers that are multiplied and returned.
    """

    def __init__(self, neutral: Floats, columns: Sequence[Column], number: type[Number]) -> None:
        self.number: type[Number] = number
        self._count: int = len(neutral)
        first = _first_equal(columns)
        self._order: NDArray[np.intp] = np.argsort(first, kind="stable")
        distinct: Ints = np.unique(first)
        self._starts: NDArray[np.intp] = np.searchsorted(first[self._order], distinct)
        # Column 0 is the neutral face, whose weight is 1. Row 0 holds zeros, for tiles that a column does not move.
        parts = [Column(np.arange(len(neutral), dtype=np.int32), neutral), *(columns[k] for k in distinct)]
        member = np.zeros((-(-len(neutral) // LONGEST) * (LONGEST // SHORTEST), len(parts)), dtype=bool)
        member[:, 0] = True
        for k, part in enumerate(parts):
            member[part.index // SHORTEST, k] = True
        self._tile, self._member = _stretches(SHORTEST, member, LONG_BATCH, 0)
        ids = np.cumsum(self._member, dtype=np.int32).reshape(self._member.shape)
        self._row: Ints = np.where(self._member, ids, 0).astype(np.int32)
        self._sizes = np.count_nonzero(self._member, axis=1)
        self._rows: NDArray[Number] = np.zeros((1 + int(self._sizes.sum()), 3 * self._tile), dtype=number)
        flat = self._rows.reshape(-1)
        for k, part in enumerate(parts):
            places = 3 * (self._tile * self._row[part.index // self._tile, k] + part.index % self._tile)
            np.add.at(flat, (places[:, None] + np.arange(3)).ravel(), part.slopes.astype(number).ravel())
        self._columns = [np.flatnonzero(m).astype(np.int32) for m in self._member]
        self._tiles: list[NDArray[Number]] = np.split(self._rows[1:], np.cumsum(self._sizes)[:-1])

    def __call__(self, weights: Floats) -> NDArray[Number]:
        """Return the vertices (f, n, 3) at weights (f, K).

        A vertex whose columns have no weight keeps its neutral value exactly: the product only adds zeros.
        """
        factors: NDArray[Number] = np.ones((self._member.shape[1], len(weights)), dtype=self.number)
        factors[1:] = np.add.reduceat(weights.T[self._order], self._starts, axis=0)
        out: NDArray[Number] = np.empty((len(weights), 3 * self._count), dtype=self.number)
        start = 0
        for columns, rows in self._products(factors):
            target = out[:, start : start + rows.shape[1]]
            start += rows.shape[1]
            if columns.size == 1:
                target[:] = rows[0, : target.shape[1]]
            else:
                np.matmul(factors.take(columns, axis=0).T, rows[:, : target.shape[1]], out=target)
        return out.reshape(len(weights), self._count, 3)

    def _products(self, factors: NDArray[Number]) -> Iterator[tuple[Ints, NDArray[Number]]]:
        """Columns (k,) and their rows (k, numbers) of each stretch of vertices; the last stretches may be empty."""
        active: Ints = np.flatnonzero(factors.any(axis=1)).astype(np.int32)
        frames = factors.shape[1]
        length, used = _stretches(self._tile, self._member[:, active], frames, COPY_COST)
        width = length // self._tile
        as_they_lie = np.zeros(len(used), dtype=bool)
        if width == 1:
            # No copy, but rows without weights are multiplied, too.
            as_they_lie = self._sizes * frames <= np.count_nonzero(used, axis=1) * (frames + COPY_COST)
        for number, whole in enumerate(as_they_lie.tolist()):
            if whole:
                yield self._columns[number], self._tiles[number]
            else:
                columns = active[used[number]]
                row = self._row[width * number : width * (number + 1)].take(columns, axis=1)
                yield columns, self._rows.take(row.T, axis=0).reshape(columns.size, -1)


def _stretches(tile: int, used: Bools, frames: int, copy_cost: int) -> tuple[int, Bools]:
    """Vertices in the stretches that cost least, and which columns each stretch uses.

    Parameters
    ----------
    tile : vertices in a tile.
    used : (tiles, columns), which columns each tile uses.
    copy_cost : what it costs to copy one number into a stretch that is longer than a tile.
    """
    least, length, best = float(np.inf), tile, (tile, used)
    while True:
        numbers = 3 * length * np.count_nonzero(used)
        cost = float(len(used) * PRODUCT_COST + numbers * (frames + (copy_cost if length > tile else 0)))
        if cost < least:
            least, best = cost, (length, used)
        if length == LONGEST:
            return best
        length, used = 2 * length, used[0::2] | used[1::2]


def _first_equal(columns: Sequence[Column]) -> Ints:
    """For each column the number (K,) of the first that equals it: faces often give two FAPs the same motion."""
    numbers: dict[bytes, int] = {}
    return np.array([numbers.setdefault(_digest(column), k) for k, column in enumerate(columns)], dtype=np.int32)


def _digest(column: Column) -> bytes:
    return hashlib.blake2b(column.index.tobytes() + column.slopes.tobytes()).digest()
