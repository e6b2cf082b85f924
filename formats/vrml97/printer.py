"""Write a syntax tree as VRML97 or MPEG-4 BT text: the same tree gives the same text, and reads back equal."""

from __future__ import annotations

import numpy as np

from fba.arrays import Floats, Floats32
from formats.vrml97.decimals import decimals
from formats.vrml97.tree import (
    BodyItem,
    Booleans,
    Empty,
    ExternProto,
    Field,
    Interface,
    Is,
    Nodes,
    Numbers,
    Proto,
    Route,
    Statement,
    Strings,
    Use,
    Value,
    VrmlNode,
)

HEADER = "#VRML V2.0 utf8\n"
_PER_LINE = 12
"""Numbers in one line: four points, six texture coordinates."""

_EXACT_POWER = 22
"""10**22 is the largest power of ten that float64 holds exactly."""

_MOST_DIGITS = 9
"""Decimal digits that always tell two float32 apart."""

_FEW = 10**6
"""Decimals of up to six digits are as many different float32, so that none of them has a shorter text."""


def print_tree(statements: tuple[Statement, ...], *, bt: bool = False) -> str:
    """Write statements as text, without a header.

    Infinities, which only BT can say, are ``+I`` there and the overflowing ``1e999`` in VRML97.

    >>> print_tree((Use("head"),))
    'USE head\\n'
    """
    out: list[str] = []
    for statement in statements:
        _statement(statement, 0, out, bt)
        out.append("\n")
    return "".join(out)


def _statement(item: Statement | BodyItem, depth: int, out: list[str], bt: bool) -> None:
    if isinstance(item, (VrmlNode, Use)):
        _node(item, depth, out, bt)
    elif isinstance(item, Field):
        out.append(f"{item.name} ")
        _value(item.value, depth, out, bt)
    elif isinstance(item, Interface):
        _interface(item, depth, out, bt)
    elif isinstance(item, Route):
        out.append(f"ROUTE {item.source}.{item.event_out} TO {item.target}.{item.event_in}")
    elif isinstance(item, Proto):
        out.append(f"PROTO {item.name} [")
        _block(item.interface, depth, out, bt)
        out.append("] {")
        _block(item.body, depth, out, bt)
        out.append("}")
    elif isinstance(item, ExternProto):
        out.append(f"EXTERNPROTO {item.name} [")
        _block(item.interface, depth, out, bt)
        out.append("] ")
        _value(item.urls, depth, out, bt)
    else:
        out.append(item.text)


def _block(items: tuple[Statement, ...] | tuple[BodyItem, ...], depth: int, out: list[str], bt: bool) -> None:
    if not items:
        out.append(" ")
        return
    indent = "\n" + " " * (depth + 1)
    for item in items:
        out.append(indent)
        _statement(item, depth + 1, out, bt)
    out.append("\n" + " " * depth)


def _interface(item: Interface, depth: int, out: list[str], bt: bool) -> None:
    out.append(f"{item.access} {item.type} {item.name}")
    if item.value is not None:
        out.append(" ")
        _value(item.value, depth, out, bt)


def _node(item: VrmlNode | Use, depth: int, out: list[str], bt: bool) -> None:
    if isinstance(item, Use):
        out.append(f"USE {item.name}")
        return
    if item.def_name is not None:
        out.append(f"DEF {item.def_name} ")
    out.append(f"{item.type} {{")
    _block(item.body, depth, out, bt)
    out.append("}")


def _value(value: Value, depth: int, out: list[str], bt: bool) -> None:
    if isinstance(value, Numbers):
        _numbers(value, depth, out, bt)
    elif isinstance(value, Nodes):
        _nodes(value, depth, out, bt)
    elif isinstance(value, Strings):
        _row([_quoted(s) for s in value.values], value.many, depth, out)
    elif isinstance(value, Booleans):
        _row(["TRUE" if b else "FALSE" for b in value.values], value.many, depth, out)
    elif isinstance(value, Is):
        out.append(f"IS {value.name}")
    elif isinstance(value, Empty):
        out.append("[ ]")
    else:
        out.append(value.text)


def _row(words: list[str], many: bool, depth: int, out: list[str]) -> None:
    if many:
        out.append("[ " + f"\n{' ' * (depth + 1)}".join(words) + " ]")
    else:
        out.append(" ".join(words))


def _nodes(value: Nodes, depth: int, out: list[str], bt: bool) -> None:
    if value.many:
        out.append("[")
    for item in value.items:
        if value.many:
            out.append("\n" + " " * (depth + 1))
        if item is None:
            out.append("NULL")
        else:
            _node(item, depth + 1 if value.many else depth, out, bt)
    if value.many:
        out.append("\n" + " " * depth + "]" if value.items else " ]")


def _numbers(value: Numbers, depth: int, out: list[str], bt: bool) -> None:
    if not value.many or value.values.size <= _PER_LINE:
        words = " ".join(number_words(value.values, bt=bt))
        out.append(words if not value.many else f"[ {words} ]" if words else "[ ]")
        return
    lines = decimals(value.values, _PER_LINE)
    if lines is None:
        words_of_all = number_words(value.values, bt=bt)
        rows = range(0, len(words_of_all), _PER_LINE)
        lines = "\n".join(" ".join(words_of_all[start : start + _PER_LINE]) for start in rows)
    indent = "\n" + " " * (depth + 1)
    out.append("[" + indent + lines.replace("\n", indent) + "\n" + " " * depth + "]")


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def number_words(values: Floats, *, bt: bool = False) -> list[str]:
    """The shortest text of each number that reads back as the same float64; integers without a point."""
    whole = np.all((values == np.rint(values)) & (np.abs(values) < 2**53) & ~((values == 0) & np.signbit(values)))
    if whole:
        return list(map(str, values.astype(np.int64).tolist()))
    # One call for the whole list is several times faster than one for each number.
    words = (repr(values.tolist())[1:-1] + ",").replace(".0,", ",")[:-1].split(", ")
    if not np.all(np.isfinite(values)):
        infinity = {"inf": "+I", "-inf": "-I"} if bt else {"inf": "1e999", "-inf": "-1e999"}
        words = [infinity.get(w, w) for w in words]
    return words


def shortest_float32(values: Floats32) -> Floats:
    """Float64 numbers whose shortest text is the shortest decimal that reads back as the given float32.

    >>> float(shortest_float32(np.float32([0.1]))[0])
    0.1
    """
    flat = np.asarray(values, dtype=np.float32).reshape(-1)
    out = flat.astype(np.float64)
    rounded = _rounded_decimals(out, flat)
    out = np.where(np.isnan(rounded), out, rounded)
    todo = np.flatnonzero(np.isfinite(out) & (out != 0) & np.isnan(rounded))
    exponent = np.floor(np.log10(np.abs(out[todo]))).astype(np.int64)
    direct = (exponent <= _EXACT_POWER) & (exponent >= _MOST_DIGITS - _EXACT_POWER)
    rest = todo[~direct]
    todo, exponent = todo[direct], exponent[direct]
    for digits in range(1, _MOST_DIGITS + 1):
        shift = digits - 1 - exponent
        power = 10.0 ** np.abs(shift)
        x = flat[todo].astype(np.float64)
        short = np.where(shift >= 0, np.rint(x * power) / power, np.rint(x / power) * power)
        fits = short.astype(np.float32) == flat[todo]
        out[todo[fits]] = short[fits]
        todo, exponent = todo[~fits], exponent[~fits]
    for k in (*rest, *todo):
        out[k] = float(str(flat[k]))
    return out


def _rounded_decimals(values: Floats, flat: Floats32) -> Floats:
    """The decimals behind float32 that were rounded to a few places, all at once; NaN where a number was not."""
    some = slice(None, None, max(1, len(flat) // 64))
    for places in range(_MOST_DIGITS + 1):
        power = 10.0**places
        with np.errstate(over="ignore", invalid="ignore"):
            if not np.array_equal((np.rint(values[some] * power) / power).astype(np.float32), flat[some]):
                continue
            whole = np.rint(values * power)
            short = whole / power
            found = (short.astype(np.float32) == flat) & (np.abs(whole) < _FEW)
            return np.where(found, short, np.nan)
    return np.full(len(values), np.nan)
