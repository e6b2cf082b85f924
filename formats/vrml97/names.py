"""Node names as DEF names: VRML97 and BT identifiers, reversibly."""

from __future__ import annotations

import re
from collections.abc import Iterable

_ESCAPED = re.compile(r"_x([0-9a-f]{2,6})_")
_PLAIN = re.compile(r"[A-Za-z0-9_]")
_RESERVED = frozenset(
    {"DEF", "USE", "PROTO", "EXTERNPROTO", "ROUTE", "TO", "IS", "TRUE", "FALSE", "NULL", "AT", "BY"}
    | {"eventIn", "eventOut", "exposedField", "field"}
)


def escape(name: str) -> str:
    """A DEF name for any name: letters, digits and _ stay, the rest is its code point.

    >>> escape("left eye"), escape("9")
    ('left_x20_eye', '_x39_')
    """
    if name in _RESERVED or not name:
        return "".join(f"_x{ord(c):02x}_" for c in name) or "_x00_"
    out: list[str] = []
    for position, character in enumerate(name):
        ambiguous = character == "_" and _ESCAPED.match(name, position)
        digit_first = position == 0 and character.isdigit()
        plain = _PLAIN.match(character) and not ambiguous and not digit_first
        out.append(character if plain else f"_x{ord(character):02x}_")
    return "".join(out)


def unescape(name: str) -> str:
    """The name behind a DEF name.

    >>> unescape(escape("a.b c_x20_"))
    'a.b c_x20_'
    """

    def character(match: re.Match[str]) -> str:
        code = int(match.group(1), 16)
        return match.group() if code > 0x10FFFF or 0xD800 <= code < 0xE000 else chr(code) if code else ""

    return _ESCAPED.sub(character, name)


class Names:
    """Gives every name once.

    >>> names = Names(["eye"])
    >>> names.give("eye"), names.give("eye"), names.give("ear")
    ('eye_2', 'eye_3', 'ear')
    """

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._taken = set(taken)
        self._next: dict[str, int] = {}

    def give(self, name: str) -> str:
        """The name itself, or with the first free number behind it."""
        given = name
        while given in self._taken:
            number = self._next.get(name, 2)
            self._next[name] = number + 1
            given = f"{name}_{number}"
        self._taken.add(given)
        return given
