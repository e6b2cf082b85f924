"""The timed commands of a BT file: what of them updates nodes, and how updates are written."""

from __future__ import annotations

import re
from collections.abc import Iterator

from fba.errors import FapStreamError
from formats.bifs.changes import TICKS
from formats.bifs.playing import Update, plain_value
from formats.bifs.scene import BifsScene
from formats.vrml97.parser import parse
from formats.vrml97.tree import Nodes, Raw, Statement, VrmlNode

_TOKEN = re.compile(r'#[^\n]*+|"[^"\\]*+(?:\\.[^"\\]*+)*+"|[{}\[\]]|[^\s,{}\[\]"#]++', re.DOTALL)
_RESOLUTION = re.compile(r"timeStampResolution\s++([0-9]{1,9})\b")
_TIME = re.compile(r"D?[0-9]{1,10}")


def write_commands(scene: BifsScene) -> str:
    """``AT ticks { REPLACE FAPS.open_jaw BY 600 }`` for every frame that changes something."""
    out: list[str] = []
    for frame in scene.frames:
        out.append(f"AT {frame.number * scene.timing.step} {{\n")
        for change in frame.changes:
            said = str(change.value).upper()
            out.append(f" REPLACE {change.node}.{change.field} BY {said}\n")
        out.append("}\n")
    return "".join(out)


def read_commands(statements: tuple[Statement, ...], source: str) -> list[Update]:
    """All field updates of a file, in its order; other commands are passed over.

    Raises
    ------
    FapStreamError
        If a time is no number.
    VrmlSyntaxError
        If a node in a command breaks the grammar.
    """
    found: list[Update] = []
    resolution, ticks = float(TICKS), 0
    for statement in statements:
        if not isinstance(statement, Raw):
            continue
        if (told := _RESOLUTION.search(statement.text)) and int(told.group(1)):
            resolution = float(told.group(1))
        words = _Words(statement.text)
        if words.take("RAP") | words.take("AT"):
            time = words.next()
            if not _TIME.fullmatch(time):
                raise FapStreamError(f"{source}: expected a time after AT, found {time[:40]!r}")
            ticks = ticks + int(time[1:]) if time[0] == "D" else int(time)
            found.extend(_updates(words, ticks / resolution))
    return found


class _Words:
    """The words of a text, one by one; comments are left out."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.found = [m for m in _TOKEN.finditer(text) if not m.group().startswith("#")]
        self.at = 0

    def peek(self) -> str:
        return self.found[self.at].group() if self.at < len(self.found) else ""

    def next(self) -> str:
        self.at += 1
        return self.found[self.at - 1].group() if self.at <= len(self.found) else ""

    def take(self, word: str) -> bool:
        """Go behind a word if it is the next one."""
        self.at += (hit := self.peek() == word)
        return hit

    def block(self) -> str:
        """The text from here to the brace or bracket that closes the next one; the rest if none does."""
        start = self.found[self.at].start() if self.at < len(self.found) else len(self.text)
        depth = 0
        while word := self.next():
            depth += (word in "{[") - (word in "}]")
            if depth <= 0 and word in "}]":
                return self.text[start : self.found[self.at - 1].end()]
        return self.text[start:]


def _updates(words: _Words, seconds: float) -> Iterator[Update]:
    while word := words.next():
        if word == "REPLACE":
            target, _, field = words.next().partition(".")
            if field and words.take("BY"):
                yield from _update(words, seconds, target, field)
        elif word == "MULTIPLEREPLACE":
            target = words.next()
            if words.take("{"):
                while (field := words.next()) not in ("}", ""):
                    yield from _update(words, seconds, target, field)


def _update(words: _Words, seconds: float, target: str, field: str) -> Iterator[Update]:
    """The update, if its value is one that a FAP node can have; goes behind the value."""
    word = words.peek()
    if word in "{}[]":
        if word in "{[":
            words.block()
        return
    following = words.found[words.at + 1].group() if words.at + 1 < len(words.found) else ""
    if word == "DEF" or following == "{":
        items = tuple(s for s in parse(words.block(), bt=True) if isinstance(s, VrmlNode))
        value = plain_value(Nodes(items))
    else:
        words.next()
        if word == "USE":
            words.next()
            return
        value = None if word == "NULL" else _number(word)
        if value is None and word != "NULL":
            return
    yield Update(seconds, target, field, value)


def _number(word: str) -> float | None:
    words = {"+I": float("inf"), "-I": float("-inf"), "TRUE": 1.0, "FALSE": 0.0}
    try:
        return words[word.upper()] if word.upper() in words else float(word)
    except ValueError:
        return None
