"""The values of XMT-A's attributes: lists and single values, by the type of their field."""

from __future__ import annotations

import re

import numpy as np

from fba.arrays import Floats
from fba.errors import InputFileError
from formats.vrml97.numbers import read_decimals
from formats.vrml97.tree import Booleans, Empty, Nodes, Numbers, Strings, Value
from formats.xml_tree import MAX_ITEMS, Element

_CHUNK = 1 << 21
"""Characters of numbers that are converted at once: bounds the memory."""

_OPENING = re.compile(r"""[\s,]*(["'])""")
_MARKS = {mark: re.compile(rf"\\.|{mark}(?=\s|\Z)", re.DOTALL) for mark in "\"'"}
"""Escapes and ends of a quoted string. The end is a mark before white space: some writers leave marks inside as they
are."""

_ESCAPE = re.compile(r"\\(.)", re.DOTALL)
_NUMBER = re.compile(r"[+-]?(?:0[xX][0-9a-fA-F]+|[0-9.]+(?:[eE][+-]?[0-9]+)?|I)")


class ValueReader:
    """Turn attributes into values; errors name the file and the line."""

    def __init__(self, source: str) -> None:
        self.source = source

    def fail(self, element: Element, message: str) -> InputFileError:
        return InputFileError(f"{self.source}: line {element.line}: {message}")

    def value(self, text: str, kind: str | None, element: Element) -> Value:
        """The value of an attribute; a field of unknown type is taken for what its text looks like."""
        many = kind is not None and kind.startswith("M")
        base = _guessed(text) if kind is None else kind[2:]
        if many and not text.strip():
            return Empty()
        if base == "String":
            if many or (kind is None and text.lstrip()[:1] == '"'):
                return Strings(_strings(text), True)
            return Strings((text,))
        if base == "Bool":
            words = text[:MAX_ITEMS].lower().split()
            if not words or any(w not in ("true", "false", "1", "0") for w in words):
                raise self.fail(element, f"expected true or false, found {text[:40]!r}")
            return Booleans(tuple(w in ("true", "1") for w in words), many)
        if base == "Node":
            return Nodes((), True) if many else Nodes((None,))
        values = self.numbers(text, element)
        return Numbers(values, many or (kind is None and values.size > 4))

    def numbers(self, text: str, element: Element, count: int | None = None) -> Floats:
        parts: list[Floats] = []
        at = 0
        while at < len(text):
            stop = len(text) if len(text) - at <= _CHUNK else text.rfind(" ", at, at + _CHUNK) + 1
            if stop <= at:
                raise self.fail(element, "expected a number, found a very long word")
            piece = text[at:stop]
            values = read_decimals(piece)
            parts.append(np.array([self.number(w, element) for w in _words(piece)]) if values is None else values)
            at = stop
        found = np.concatenate(parts) if parts else np.zeros(0)
        if not found.size or (count is not None and found.size != count):
            raise self.fail(element, f"expected {'a number' if count else 'numbers'}, found {text[:40]!r}")
        return found

    def number(self, word: str, element: Element) -> float:
        try:
            if not _NUMBER.fullmatch(word):
                raise ValueError
            if word.endswith("I"):
                return float("-inf") if word[0] == "-" else float("inf")
            return float(int(word, 16)) if "x" in word.lower() else float(word)
        except (ValueError, OverflowError):
            raise self.fail(element, f"expected a number, found {word[:40]!r}") from None


def _words(text: str) -> list[str]:
    return text.replace(",", " ").split()


def _strings(text: str) -> tuple[str, ...]:
    """The quoted strings of a list; a text without quotation marks is one string. What is not closed is left out."""
    if text.lstrip()[:1] not in ("'", '"'):
        return (text,)
    found: list[str] = []
    at = 0
    while opening := _OPENING.match(text, at):
        marks = _MARKS[opening.group(1)].finditer(text, opening.end())
        end = next((m.start() for m in marks if not m.group().startswith("\\")), None)
        if end is None or len(found) == MAX_ITEMS:
            break
        found.append(_ESCAPE.sub(r"\1", text[opening.end() : end]))
        at = end + 1
    return tuple(found)


def _guessed(text: str) -> str:
    if text.strip().lower() in ("true", "false"):
        return "Bool"
    some = _words(text[:200])[:20]
    whole = some if len(text) <= 200 else some[:-1]
    return "Float" if whole and all(_NUMBER.fullmatch(w) for w in whole) else "String"
