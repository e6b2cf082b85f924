"""The adaptive arithmetic coder of FBA bitstreams.

It is built like the syntax-based arithmetic coder of H.263 (ITU-T H.263, annex E): 16-bit registers, cumulative
frequencies that run downward, and a 1 after 22 zeros in a row so that no start code can appear.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from formats.fba_bitstream.bits import BitReader, BitWriter

_QUARTER, _HALF, _THREE_QUARTERS, _TOP = 1 << 14, 1 << 15, 3 << 14, (1 << 16) - 1
_REGISTER_BITS = 16
_END_BITS = 2
"""Bits that end a run: what lies between the quarters is told by two."""

LONGEST_ZEROS = 22
"""After so many zeros in a row the coder puts a 1 in."""

FULL = 16383
"""Total of the frequencies at which they are halved."""


class Model(Protocol):
    """Frequencies of the symbols 0 .. n - 1."""

    total: int

    def bounds(self, symbol: int) -> tuple[int, int]:
        """Sum of the frequencies of all larger symbols, and the same with the symbol's own."""
        ...

    def find(self, target: int) -> int:
        """The symbol whose bounds hold ``low <= target < high``."""
        ...

    def update(self, symbol: int) -> None:
        """Learn that this symbol came."""
        ...


class UniformModel:
    """All symbols alike, for what is coded once only."""

    def __init__(self, count: int) -> None:
        self.total = count

    def bounds(self, symbol: int) -> tuple[int, int]:
        return self.total - 1 - symbol, self.total - symbol

    def find(self, target: int) -> int:
        return self.total - 1 - target

    def update(self, symbol: int) -> None:
        """Nothing is learned."""


class AdaptiveModel:
    """Frequencies that begin at 1 and grow with every symbol."""

    def __init__(self, count: int) -> None:
        self.total = self._count = count
        self._below = np.arange(count + 1, dtype=np.int64)
        """Entry k: sum of the frequencies of the k largest symbols."""

    def bounds(self, symbol: int) -> tuple[int, int]:
        behind = self._count - symbol
        return self._below.item(behind - 1), self._below.item(behind)

    def find(self, target: int) -> int:
        return self._count - int(self._below.searchsorted(target, "right"))

    def update(self, symbol: int) -> None:
        if self.total == FULL:
            self._below[1:] = np.cumsum((np.diff(self._below) + 1) // 2)
            self.total = self._below.item(self._count)
        self._below[self._count - symbol :] += 1
        self.total += 1


class RunEncoder:
    """One run of the arithmetic coder; `finish` ends it."""

    def __init__(self, out: BitWriter) -> None:
        self._out = out
        self._low, self._high = 0, _TOP
        self._opposite = 0
        self._zeros = 0

    def put(self, symbol: int, model: Model) -> None:
        """Code one symbol and let the model learn it."""
        length = self._high - self._low + 1
        below, above = model.bounds(symbol)
        self._high = self._low - 1 + length * above // model.total
        self._low += length * below // model.total
        model.update(symbol)
        while True:
            if self._high < _HALF:
                self._emit(0)
            elif self._low >= _HALF:
                self._emit(1)
                self._low -= _HALF
                self._high -= _HALF
            elif self._low >= _QUARTER and self._high < _THREE_QUARTERS:
                self._opposite += 1
                self._low -= _QUARTER
                self._high -= _QUARTER
            else:
                return
            self._low *= 2
            self._high = 2 * self._high + 1

    def finish(self) -> None:
        """Write what tells the last interval."""
        self._opposite += 1
        self._emit(0 if self._low < _QUARTER else 1)

    def _emit(self, bit: int) -> None:
        self._put(bit)
        for _ in range(self._opposite):
            self._put(1 - bit)
        self._opposite = 0

    def _put(self, bit: int) -> None:
        self._out.bit(bit)
        self._zeros = 0 if bit else self._zeros + 1
        if self._zeros == LONGEST_ZEROS:
            self._out.bit(1)
            self._zeros = 0


class RunDecoder:
    """One run of the arithmetic coder, from the reader's place on; `finish` puts the reader behind it.

    The coder looks 16 bits ahead, past the end of the run. What it sees there does not matter, so a missing 1 after
    22 zeros is an error only where it lies inside the run.
    """

    def __init__(self, reader: BitReader) -> None:
        self._reader = reader
        self._at = reader.position
        self._zeros = 0
        self._ends: list[int] = []
        """Place behind each of the last 16 bits that were read, stuffing passed."""
        self._unstuffed: int | None = None
        self._low, self._high, self._code = 0, _TOP, 0
        for _ in range(_REGISTER_BITS):
            self._code = self._code << 1 | self._next()

    def get(self, model: Model) -> int:
        """Decode one symbol and let the model learn it."""
        length = self._high - self._low + 1
        target = ((self._code - self._low + 1) * model.total - 1) // length
        symbol = model.find(target)
        below, above = model.bounds(symbol)
        self._high = self._low - 1 + length * above // model.total
        self._low += length * below // model.total
        model.update(symbol)
        while True:
            if self._high < _HALF:
                offset = 0
            elif self._low >= _HALF:
                offset = _HALF
            elif self._low >= _QUARTER and self._high < _THREE_QUARTERS:
                offset = _QUARTER
            else:
                return symbol
            self._low = 2 * (self._low - offset)
            self._high = 2 * (self._high - offset) + 1
            self._code = 2 * (self._code - offset) | self._next()

    def finish(self) -> None:
        """Put the reader behind the last bit of the run.

        Raises
        ------
        FapStreamError
            If the data ends before, or holds 23 zeros in a row.
        """
        end = self._ends[_END_BITS - 1 - _REGISTER_BITS]
        reader = self._reader
        if end > reader.size:
            reader.position = reader.size
            raise reader.error("the file ends here, in the middle of a frame; it is cut or damaged")
        if self._unstuffed is not None and self._unstuffed < end:
            reader.position = self._unstuffed
            raise reader.error(f"more than {LONGEST_ZEROS} zeros in a row; the data is damaged")
        reader.position = end

    def _next(self) -> int:
        bit = self._reader.bit_at(self._at)
        self._at += 1
        self._zeros = 0 if bit else self._zeros + 1
        if self._zeros == LONGEST_ZEROS:
            if not self._reader.bit_at(self._at) and self._unstuffed is None:
                self._unstuffed = self._at
            self._at += 1
            self._zeros = 0
        self._ends.append(self._at)
        if len(self._ends) > _REGISTER_BITS:
            del self._ends[0]
        return bit
