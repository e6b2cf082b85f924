"""A FAP stream as values of a FAP node over time."""

from __future__ import annotations

import json
from collections.abc import Iterator
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
from formats.vrml97.tree import Booleans, Nodes, Numbers, Value, VrmlNode, node, number
from formats.vrml97.writer import NOT_INITIALIZED

TICKS = 1000
"""Ticks a second of a stream that does not say otherwise."""

STREAM_KEY = "stream"
"""Key of the string of the toolkit's WorldInfo that tells what the updates of a FAP node cannot."""

HIGH_LEVEL = (("viseme", "Viseme", VISEME_FIELDS), ("expression", "Expression", EXPRESSION_FIELDS))
"""Field of the FAP node, node in it, fields of that node, in the order of FAP 1 and 2."""

FLAGS = frozenset({"viseme_def", "init_face", "expression_def"})
"""Fields of these nodes that are SFBool."""

Change = tuple[str, int | VrmlNode]
"""Field of the FAP node and its new value."""


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


def fap_node(stream: FapStream, name: str) -> VrmlNode:
    """The FAP node of the first frame; FAPs that it does not speak of are left out, which means "not initialised"."""
    fields: dict[str, Value] = {}
    for k, (field, _, _) in enumerate(HIGH_LEVEL):
        if stream.mask[:, k].any():
            fields[field] = Nodes((_high_level(k, _rows(stream, k)[0]),))
    for fap in LOW_LEVEL_FAPS:
        if stream.mask[0, fap - 1]:
            fields[fap_field(fap)] = number(int(stream.values[0, fap - 1]))
    return node("FAP", name, **fields)


def changes(stream: FapStream) -> Iterator[Frame]:
    """What every frame but the first changes in the FAP node; frames that change nothing are left out.

    A viseme or expression that is not spoken of becomes an empty node, which shows nothing, and not NULL: MP4Box
    crashes on updates of XMT-A that set NULL. The note tells the difference.
    """
    low = np.where(stream.mask, stream.values, NOT_INITIALIZED)
    high = [_rows(stream, k) for k in range(len(HIGH_LEVEL))]
    differs = low[1:] != low[:-1]
    for k, rows in enumerate(high):
        differs[:, k] = np.any(rows[1:] != rows[:-1], axis=1)
    for frame in (np.flatnonzero(differs.any(axis=1)) + 1).tolist():
        found: list[Change] = []
        for column in np.flatnonzero(differs[frame - 1]).tolist():
            if column < len(HIGH_LEVEL):
                found.append((HIGH_LEVEL[column][0], _high_level(column, high[column][frame])))
            else:
                found.append((fap_field(column + 1), int(low[frame, column])))
        yield Frame(int(stream.frame_numbers[frame]) - int(stream.frame_numbers[0]), tuple(found))


def _rows(stream: FapStream, k: int) -> Ints:
    """Fields of the visemes or expressions, zero in frames that do not speak of them."""
    return np.where(stream.mask[:, k : k + 1], (stream.visemes, stream.expressions)[k], 0)


def _high_level(k: int, row: Ints) -> VrmlNode:
    _, kind, names = HIGH_LEVEL[k]
    fields: dict[str, Numbers | Booleans] = {
        name: Booleans((True,)) if name in FLAGS else number(value)
        for name, value in zip(names, row.tolist(), strict=True)
        if value
    }
    return node(kind, **fields)


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
