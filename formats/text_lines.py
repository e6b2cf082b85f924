"""Line-oriented text as arrays: where lines and words begin, so that big meshes are parsed without loops."""

from __future__ import annotations

from bisect import bisect_right
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fba.arrays import Bools, Floats
from fba.errors import InputFileError, TextSyntaxError

_BLANK = 32
_LINE_FEED = 10


class TextLines:
    """A text file's bytes and the places of its lines and words.

    Attributes
    ----------
    data : the bytes; a backslash at the end of a line has joined it to the next one, byte offsets kept.
    """

    def __init__(self, data: bytes, source: Path, *, continuations: bool = False) -> None:
        if b"\0" in data:
            raise InputFileError(f"{source} holds binary data, not text; check that the extension is right")
        self.source = source
        self._original = data
        if continuations and b"\\" in data:
            for end in (b"\\\r\n", b"\\\n"):
                data = data.replace(end, b" " * len(end))
        if b"\n" not in data and b"\r" in data:
            data = data.replace(b"\r", b"\n")
            self._original = data
        self.data = data if data.endswith(b"\n") else data + b"\n"
        self.bytes = np.frombuffer(self.data, dtype=np.uint8)
        ends = np.flatnonzero(self.bytes == _LINE_FEED)
        self.starts = np.concatenate([[0], ends[:-1] + 1])
        self.ends = ends

    def replace(self, data: bytes) -> None:
        """Put other bytes of the same length and the same line ends in place; before any word is asked for."""
        self.data = data
        self.bytes = np.frombuffer(data, dtype=np.uint8)

    @cached_property
    def words(self) -> NDArray[np.intp]:
        """Byte offset of every word."""
        filled = self.bytes > _BLANK
        first = filled.copy()
        first[1:] &= ~filled[:-1]
        return np.flatnonzero(first)

    @cached_property
    def first_word(self) -> NDArray[np.intp]:
        """Number of the first word that begins in each line or later."""
        return np.searchsorted(self.words, self.starts)

    @cached_property
    def word_counts(self) -> NDArray[np.intp]:
        """Number of words in each line."""
        return np.diff(np.append(self.first_word, self.words.size))

    def keyword_is(self, keyword: bytes) -> Bools:
        """Which lines have exactly this first word."""
        found = self.word_counts > 0
        at = self.words[np.minimum(self.first_word, max(self.words.size - 1, 0))] if self.words.size else self.starts
        for k, letter in enumerate(keyword):
            place = np.minimum(at + k, self.bytes.size - 1)
            found &= self.bytes[place] == letter
        found &= self.bytes[np.minimum(at + len(keyword), self.bytes.size - 1)] <= _BLANK
        return found

    def text_of(self, lines: Bools, skip: int) -> bytes:
        """Bytes of these lines without their first `skip` bytes (a keyword), everything else dropped."""
        if not lines.any():
            return b""
        keep = np.repeat(lines, self.ends + 1 - self.starts)
        if skip:
            at = self.words[self.first_word[lines]]
            keep[(at[:, None] + np.arange(skip)).ravel()] = False
        return self.bytes[keep].tobytes()

    def numbers(self, lines: Bools, skip: int) -> Floats:
        """All numbers of these lines in reading order, exact.

        Raises
        ------
        TextSyntaxError
            At the first word that is not a number.
        """
        text = self.text_of(lines, skip)
        if b"_" not in text:
            try:
                return np.array(list(map(float, text.split())), dtype=np.float64)
            except ValueError:
                pass
        raise self._bad_number(lines, skip)

    def _bad_number(self, lines: Bools, skip: int) -> TextSyntaxError:
        for line in np.flatnonzero(lines):
            for word in self.line(int(line)).split()[1 if skip else 0 :]:
                try:
                    good = "_" not in word and bool([float(word)])
                except ValueError:
                    good = False
                if not good:
                    return self.error(int(line), f"'{word[:40]}' is not a number", word)
        return self.error(0, "a number cannot be read")

    def line(self, number: int) -> str:
        """Text of one line (counted from 0, joined lines as one)."""
        return self.data[self.starts[number] : self.ends[number]].decode("utf-8", "replace").strip()

    def error(self, number: int, message: str, word: str = "") -> TextSyntaxError:
        """A syntax error that names the line of the file as an editor counts it."""
        start = int(self.starts[number])
        column = max(self.data[start : int(self.ends[number])].find(word.encode()), 0) if word else 0
        offset = start + column
        breaks = self._breaks
        row = bisect_right(breaks, offset - 1)
        begin = breaks[row - 1] + 1 if row else 0
        return TextSyntaxError(message, row + 1, offset - begin + 1, str(self.source))

    @cached_property
    def _breaks(self) -> list[int]:
        original = np.frombuffer(self._original, dtype=np.uint8)
        places: list[int] = np.flatnonzero(original == _LINE_FEED).tolist()
        return places
