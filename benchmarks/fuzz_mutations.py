"""Damaged files out of good ones: byte by byte, word by word, or value by value of a JSON document."""

from __future__ import annotations

import base64
import json
import random
import re
from typing import Any

_ODD_BYTES = (b"0", b"-1", b"1e999", b"nan", b"9" * 20, b"\0", b"\xff" * 4, b"[" * 50, b'"', b",", b"\n", b"\0\0\1\xbb")
_ODD_NUMBERS = (
    b"0",
    b"-1",
    b"1",
    b"2",
    b"3",
    b"255",
    b"65536",
    b"2147483647",
    b"4294967296",
    b"-2147483649",
    b"9" * 30,
)
_ODD_REALS = (b"1e308", b"1e999", b"-1e-320", b"nan", b"inf", b".5", b"0x7f", b"1.5")
_ODD_VALUES: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 2, 3, 4, 5, 1000, 2**26, 2**31, 2**53, 2**70, 0.5, -1e308, 1e-320, "", "a", "../x.bin",
    "data:;base64,AAAA", "SCALAR", "VEC3", [], [0], [0, 0, 0, 0], [1e308] * 3, {}, {"a": 1}, 5120, 5121, 5123, 5126,
)  # fmt: skip

_WORD = re.compile(rb"[A-Za-z_][\w:]*|[-+]?[0-9.][\w.+-]*|\s+|.", re.DOTALL)


def mutated(kind: str, data: bytes, source: random.Random, others: list[bytes]) -> bytes:
    """A file with a few random changes, of a sort that suits its kind as often as not."""
    if kind in ("glb", "gltf") and source.random() < 0.8:
        return _json_mutated(data, source)
    if kind not in ("fba", "glb", "stl") and source.random() < 0.5:
        return _words_mutated(data, source)
    return _bytes_mutated(data, source, others)


def _bytes_mutated(data: bytes, source: random.Random, others: list[bytes]) -> bytes:
    """Bits, bytes, cuts, repeats, pieces of other files, odd numbers."""
    out = bytearray(data)
    for _ in range(source.choice((1, 1, 2, 4, 16))):
        at = source.randrange(len(out) + 1)
        length = min(source.choice((1, 1, 4, 32, 256)), len(out) - at)
        kind = source.randrange(6)
        if kind == 0 and length:
            out[at] ^= 1 << source.randrange(8)
        elif kind == 1:
            out[at : at + length] = source.randbytes(length)
        elif kind == 2:
            del out[at : at + length]
        elif kind == 3:
            out[at:at] = out[at : at + length] * source.choice((1, 2, 50))
        elif kind == 4:
            other = source.choice(others)
            start = source.randrange(len(other))
            out[at : at + length] = other[start : start + length]
        else:
            out[at : at + length] = source.choice(_ODD_BYTES)
    return bytes(out)


def _words_mutated(data: bytes, source: random.Random) -> bytes:
    """Words dropped, doubled, moved, exchanged; numbers of all sizes."""
    words = _WORD.findall(data)
    for _ in range(source.choice((1, 1, 2, 4, 8))):
        if not words:
            break
        at = source.randrange(len(words))
        length = source.choice((1, 1, 2, 8, 40))
        kind = source.randrange(6)
        if kind == 0:
            del words[at : at + length]
        elif kind == 1:
            words[at:at] = words[at : at + length] * source.choice((1, 1, 3, 30))
        elif kind == 2:
            to = source.randrange(len(words))
            words[to:to] = words[at : at + length]
        elif kind == 3:
            words[at] = source.choice(words)
        else:
            numbers = [k for k in range(at, min(at + 200, len(words))) if words[k][:1] in b"-+.0123456789"]
            if numbers:
                words[numbers[0]] = source.choice(_ODD_NUMBERS if source.random() < 0.7 else _ODD_REALS)
    return b"".join(words)


def _json_mutated(data: bytes, source: random.Random) -> bytes:
    """A .gltf or .glb some of whose values are others; the container stays whole."""
    packed = data.startswith(b"glTF")
    length = int.from_bytes(data[12:16], "little") if packed else len(data)
    try:
        document = json.loads(data[20 : 20 + length] if packed else data)
    except (ValueError, RecursionError):
        return _bytes_mutated(data, source, [data])
    for _ in range(source.choice((1, 1, 1, 2, 4))):
        places = list(_places(document))
        if places:
            _change(*source.choice(places), source, places)
    text = json.dumps(document).encode()
    if not packed:
        return text
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    head = b"glTF" + (2).to_bytes(4, "little") + (20 + len(text) + len(rest)).to_bytes(4, "little")
    return head + len(text).to_bytes(4, "little") + b"JSON" + text + rest


_Place = tuple[Any, Any]
"""An object or list, and a key of it."""


def _places(value: object) -> list[_Place]:
    out: list[_Place] = []
    waiting = [value]
    while waiting:
        found = waiting.pop()
        keys = list(found) if isinstance(found, dict) else range(len(found)) if isinstance(found, list) else ()
        for key in keys:
            out.append((found, key))
            waiting.append(found[key])  # type: ignore[index]
    return out


def _change(owner: Any, key: Any, source: random.Random, places: list[_Place]) -> None:
    kind = source.randrange(6)
    value = owner[key]
    if kind == 0:
        del owner[key]
    elif kind == 1:
        other, place = source.choice(places)
        if place in other if isinstance(other, dict) else place < len(other):
            owner[key] = _copy(other[place])
    elif kind == 2 and isinstance(value, int):
        owner[key] = value + source.choice((-2, -1, 1, 2, 100))
    elif kind == 3 and isinstance(value, str) and value.startswith("data:"):
        head, _, text = value.partition(",")
        raw = bytearray(_decoded(text))
        for _ in range(source.choice((1, 4, 30))):
            if raw:
                at = 4 * source.randrange(-(-len(raw) // 4))
                raw[at : at + 4] = source.choice((b"\0\0\0\0", b"\xff\xff\xff\xff", b"\0\0\x80\x7f", b"\1\0\0\0"))
        owner[key] = head + "," + base64.b64encode(bytes(raw)).decode()
    elif kind == 4 and isinstance(value, list):
        owner[key] = _copy(value * source.choice((0, 2, 3))) if len(value) < 1000 else []
    else:
        owner[key] = _copy(source.choice(_ODD_VALUES))


def _copy(value: Any) -> Any:
    """The same, sharing nothing: a document that holds itself has no end."""
    return json.loads(json.dumps(value))


def _decoded(text: str) -> bytes:
    try:
        return base64.b64decode(text)
    except ValueError:
        return b"\0" * 64
