"""A FAP stream as values of a FAP node over time."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fba.arrays import Ints
from fba.errors import UnsupportedFeatureError
from fba.faps import LOW_LEVEL_FAPS
from fba.stream import EXPRESSION_FIELDS, VISEME_FIELDS, FapStream
from formats.vrml97.face_nodes import fap_field
from formats.vrml97.tree import Booleans, Nodes, Value, VrmlNode, node, number
from formats.vrml97.writer import NOT_INITIALIZED

TICKS = 1000
"""Ticks a second of a stream that does not say otherwise."""

STREAM_KEY = "stream"
"""Key of the string of the toolkit's WorldInfo that tells what the updates of a FAP node cannot."""

HIGH_LEVEL = (("viseme", "Viseme", VISEME_FIELDS), ("expression", "Expression", EXPRESSION_FIELDS))
"""Field of the FAP node, node in it, fields of that node, in the order of FAP 1 and 2."""

FLAGS = frozenset({"viseme_def", "init_face", "expression_def"})
"""Fields of these nodes that are SFBool."""

FAP_NAMES = ("FAPS", "VISEME", "EXPRESSION")
"""DEF names of the FAP node that a stream changes and the two nodes in it, unless the scene has them already."""


@dataclass(frozen=True, slots=True)
class Change:
    """A new value of a field. node : DEF name of its node."""

    node: str
    field: str
    value: int | bool


@dataclass(frozen=True, slots=True)
class Timing:
    """Ticks a second, and ticks from frame to frame."""

    resolution: int = TICKS
    step: int = 1


@dataclass(frozen=True, slots=True)
class Frame:
    """What a frame changes. number : frames since the first one."""

    number: int
    changes: tuple[Change, ...]


def timing_of(stream: FapStream) -> Timing:
    """Milliseconds where every frame falls on one, else the coarsest ticks that tell the frame rate.

    Raises
    ------
    UnsupportedFeatureError
        If a tick counter of 32 bits cannot tell it.

    >>> timing_of(FapStream.build(25, 1)), timing_of(FapStream.build(30000 / 1001, 1))
    (Timing(resolution=1000, step=40), Timing(resolution=30000, step=1001))
    """
    rate = Fraction(stream.frame_rate).limit_denominator(1001)
    if not rate or abs(float(rate) - stream.frame_rate) > 1e-6 * stream.frame_rate:
        raise UnsupportedFeatureError(f"{stream.frame_rate:g} frames a second are no ratio of small integers")
    milliseconds = TICKS / rate
    timing = Timing(rate.numerator, rate.denominator)
    if milliseconds.denominator == 1:
        timing = Timing(TICKS, int(milliseconds))
    last = int(stream.frame_numbers[-1]) - int(stream.frame_numbers[0])
    if max(last * timing.step, timing.resolution) >= 2**32:
        raise UnsupportedFeatureError(f"the stream '{stream.name}' is too long for a clock of 32 bits; split it")
    return timing


def fap_node(stream: FapStream, names: Sequence[str]) -> VrmlNode:
    """The FAP node of the first frame; FAPs that it does not speak of are left out, which means "not initialised".

    names : DEF names as in FAP_NAMES.
    """
    fields: dict[str, Value] = {}
    for k, (field, kind, inside) in enumerate(HIGH_LEVEL):
        if stream.mask[:, k].any():
            row = zip(inside, _rows(stream, k)[0].tolist(), strict=True)
            said = {name: Booleans((True,)) if name in FLAGS else number(value) for name, value in row if value}
            fields[field] = Nodes((node(kind, names[k + 1], **said),))
    for fap in LOW_LEVEL_FAPS:
        if stream.mask[0, fap - 1]:
            fields[fap_field(fap)] = number(int(stream.values[0, fap - 1]))
    return node("FAP", names[0], **fields)


def changes(stream: FapStream, names: Sequence[str]) -> Iterator[Frame]:
    """What every frame but the first changes; frames that change nothing are left out.

    A viseme or expression that is not spoken of has zeros in all fields, which shows nothing. It does not become NULL
    or an empty node: MP4Box crashes on updates of XMT-A that set NULL, and cannot decode an update that ends in an
    empty node. The note tells the difference.
    """
    low = np.where(stream.mask, stream.values, NOT_INITIALIZED)[:, 2:]
    columns = [(names[k + 1], name) for k, (_, _, inside) in enumerate(HIGH_LEVEL) for name in inside]
    columns += [(names[0], fap_field(fap)) for fap in LOW_LEVEL_FAPS]
    table = np.concatenate([_rows(stream, 0), _rows(stream, 1), low], axis=1)
    differs = table[1:] != table[:-1]
    for frame in (np.flatnonzero(differs.any(axis=1)) + 1).tolist():
        found: list[Change] = []
        for column in np.flatnonzero(differs[frame - 1]).tolist():
            owner, field = columns[column]
            value = int(table[frame, column])
            found.append(Change(owner, field, bool(value) if field in FLAGS else value))
        yield Frame(int(stream.frame_numbers[frame]) - int(stream.frame_numbers[0]), tuple(found))


def _rows(stream: FapStream, k: int) -> Ints:
    """Fields of the visemes or expressions, zero in frames that do not speak of them."""
    return np.where(stream.mask[:, k : k + 1], (stream.visemes, stream.expressions)[k], 0)


def stream_note(stream: FapStream) -> str:
    """What the updates do not tell: name, version, exact rate, which frames there are, which show no viseme."""
    row: dict[str, Any] = {
        "name": stream.name,
        "version": stream.version,
        "frame_rate": stream.frame_rate,
        "frames": _runs(stream.frame_numbers),
    }
    for k, (field, _, _) in enumerate(HIGH_LEVEL):
        if stream.mask[:, k].any() and not stream.mask[:, k].all():
            row[f"no_{field}"] = _runs(np.flatnonzero(~stream.mask[:, k]))
    return f"{STREAM_KEY}: {json.dumps(row, separators=(',', ':'), ensure_ascii=False)}"


def _runs(numbers: NDArray[np.integer[Any]]) -> list[list[int]]:
    """Consecutive numbers as [first, count]."""
    starts = np.flatnonzero(np.concatenate([[True], np.diff(numbers) != 1]))
    counts = np.diff(np.append(starts, numbers.size))
    return [[int(numbers[s]), int(c)] for s, c in zip(starts, counts, strict=True)]
