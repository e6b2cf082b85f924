"""The updates of a FAP node over time as a FAP stream."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fba.arrays import Floats, Ints
from fba.errors import FapStreamError
from fba.faps import FAP_COUNT, LOW_LEVEL_FAPS
from fba.findings import Finding
from fba.stream import FapStream
from formats.bifs.changes import HIGH_LEVEL, STREAM_KEY
from formats.vrml97.document import split
from formats.vrml97.face_nodes import fap_field
from formats.vrml97.tree import Booleans, Field, Nodes, Numbers, Statement, Use, Value, VrmlNode, definitions, walk
from formats.vrml97.writer import NOT_INITIALIZED

MAX_FRAMES = 500_000
"""Frames of a stream at most: five and a half hours at 25 a second."""

_LATEST = 1e9
"""Seconds: later times count as this, which is beyond every last frame."""

_RATES = (25.0, 30.0, 24.0, 50.0, 60.0, 30000 / 1001, 24000 / 1001, 100.0, 120.0)
"""Frame rates that are tried, the first that fits all times counts."""

_LAST_RATE = 100.0
"""Frames a second where no rate fits."""

_TICK = 0.001
"""Seconds by which a time may miss its frame: players count milliseconds."""

_FAP_OF_FIELD = {fap_field(k): k for k in LOW_LEVEL_FAPS}


@dataclass(frozen=True, slots=True)
class Update:
    """``REPLACE node.field BY value`` at a time; a value None is NULL."""

    seconds: float
    node: str
    field: str
    value: float | VrmlNode | None


def played(
    statements: tuple[Statement, ...], updates: Sequence[Update], source: str, name: str
) -> tuple[FapStream, list[Finding]]:
    """The stream that moves the FAP node of the first Face of a scene.

    Parameters
    ----------
    source : file name for messages. name : of the stream, where the file tells none.

    Returns
    -------
    stream : the scene's own FAP values are its first frame. FAPs that are not initialised are unmasked.
    findings : how times without a frame rate were understood.

    Raises
    ------
    FapStreamError
        If nothing in the file moves a Face, or the times make no stream.
    """
    fap = _fap_of(statements)
    if fap is None:
        raise FapStreamError(f"{source} has no Face with a FAP node, so that no stream can be read from it")
    state = _State(fap)
    ours = {state.name, *state.names, *(u.value.def_name for u in updates if isinstance(u.value, VrmlNode))} - {None}
    known = sorted((u for u in updates if u.node in ours), key=lambda u: u.seconds)
    note = _note(split(statements).metadata)
    if not known and note is None:
        raise FapStreamError(f"{source} holds a face, but no timed updates of its FAP node; nothing moves it")
    if known and not (np.isfinite(known[-1].seconds) and known[0].seconds >= 0.0):
        raise FapStreamError(f"{source}: updates at {known[0].seconds:g} to {known[-1].seconds:g} s make no stream")
    findings: list[Finding] = []
    if note is None:
        note = {"frame_rate": _rate([u.seconds for u in known], findings), "frames": None, "name": name}
    rate = note["frame_rate"]
    at = np.rint(np.minimum([u.seconds for u in known], _LATEST) * rate)
    count = float(at.max(initial=0.0)) + 1.0
    if count > MAX_FRAMES:
        raise FapStreamError(f"{source}: the last update would be frame {count:.0f}; {MAX_FRAMES} are read at most")
    numbers = np.arange(int(count), dtype=np.int32) if note["frames"] is None else note["frames"]
    return _sampled(state, known, at, numbers, note), findings


def _sampled(state: _State, updates: Sequence[Update], at: Floats, numbers: Ints, note: dict[str, Any]) -> FapStream:
    """The state at every frame."""
    values = np.zeros((len(numbers), FAP_COUNT), np.int32)
    mask = np.zeros((len(numbers), FAP_COUNT), np.bool_)
    high = [np.zeros((len(numbers), len(names)), np.int32) for _, _, names in HIGH_LEVEL]
    ends = np.searchsorted(at, numbers - numbers[0], side="right").tolist()
    done = 0
    for row, end in enumerate(ends):
        for update in updates[done:end]:
            state.apply(update.node, update.field, update.value)
        done = max(done, end)
        values[row], mask[row] = np.where(state.mask, state.values, 0), state.mask
        for k, rows in enumerate(high):
            rows[row] = state.high[k] if state.mask[k] else 0
    for k, rows in enumerate(note.get("absent", ())):
        mask[rows, k] = False
        high[k][rows] = 0
    version = note.get("version", "2.1")
    return FapStream(note["frame_rate"], values, mask, high[0], high[1], numbers, note["name"], version)


def _fap_of(statements: tuple[Statement, ...]) -> VrmlNode | None:
    """The FAP node of the first Face, else the first of the file."""
    defs = definitions(statements)
    nodes = [n for n in walk(statements) if isinstance(n, VrmlNode)]
    for face in nodes:
        for item in face.nodes("fap") if face.type == "Face" else ():
            found = defs.get(item.name) if isinstance(item, Use) else item
            if found is not None and found.type == "FAP":
                return found
    return next((n for n in nodes if n.type == "FAP"), None)


class _State:
    """Values of a FAP node, and of the Viseme and Expression node in it."""

    def __init__(self, fap: VrmlNode) -> None:
        self.values = np.zeros(FAP_COUNT, np.int32)
        self.mask = np.zeros(FAP_COUNT, np.bool_)
        self.high = [np.zeros(len(names), np.int32) for _, _, names in HIGH_LEVEL]
        self.name = fap.def_name
        self.names: list[str | None] = [None, None]
        for part in fap.body:
            if isinstance(part, Field):
                self.set(part.name, plain_value(part.value))

    def apply(self, name: str, field: str, value: Any) -> None:
        """Do an update; what is none of this FAP node's is passed over."""
        if name == self.name:
            self.set(field, value)
        elif name in self.names:
            self.set_high(self.names.index(name), field, value)

    def set(self, field: str, value: Any) -> None:
        for k, (owner, kind, _) in enumerate(HIGH_LEVEL):
            if field == owner:
                shown = value if isinstance(value, VrmlNode) and value.type == kind else VrmlNode("")
                self.mask[k] = shown.type == kind
                self.names[k] = shown.def_name
                self.high[k][:] = 0
                for part in shown.body:
                    if isinstance(part, Field):
                        self.set_high(k, part.name, plain_value(part.value))
        number = _FAP_OF_FIELD.get(field)
        if number is not None and isinstance(value, (int, float)):
            given = abs(value) < NOT_INITIALIZED
            self.mask[number - 1] = given
            self.values[number - 1] = round(value) if given else 0

    def set_high(self, k: int, field: str, value: Any) -> None:
        names = HIGH_LEVEL[k][2]
        if field in names and isinstance(value, (int, float)) and abs(value) < NOT_INITIALIZED:
            self.high[k][names.index(field)] = round(value)


def remark(updates: int) -> list[Finding]:
    """What the reader of a face says about updates of the file."""
    message = f"{updates} timed updates move this face; read as a stream (fba convert FILE OUT.fap), not with the face"
    return [Finding("info", "stream", message)] if updates else []


def plain_value(value: Value) -> float | VrmlNode | None:
    """A field's value as an update has it; None where it is none that FAP nodes have."""
    if isinstance(value, Numbers) and value.values.size == 1:
        return float(value.values[0])
    if isinstance(value, Booleans) and len(value.values) == 1:
        return float(value.values[0])
    item = value.items[0] if isinstance(value, Nodes) and len(value.items) == 1 else None
    return item if isinstance(item, VrmlNode) else None


def _note(strings: tuple[str, ...]) -> dict[str, Any] | None:
    """What the toolkit's WorldInfo notes about the stream; None if it says nothing, or nothing that can be right."""
    for text in strings:
        key, _, body = text.partition(": ")
        if key != STREAM_KEY:
            continue
        try:
            row = json.loads(body)
            name, version, rate = str(row["name"]), str(row["version"]), float(row["frame_rate"])
            numbers = _unrun(row["frames"])
            absent = [_unrun(row.get(f"no_{field}", [])) for field, _, _ in HIGH_LEVEL]
            fits = all(a.size == 0 or 0 <= a[0] <= a[-1] < numbers.size for a in absent)
            if not (numbers.size and fits and 1e-6 < rate < 1e6):
                return None
            return {"name": name, "version": version, "frame_rate": rate, "frames": numbers, "absent": absent}
        except (ValueError, TypeError, KeyError, OverflowError, RecursionError):
            return None
    return None


def _unrun(runs: Any) -> Ints:
    """Increasing numbers from [first, count] pairs; ValueError if they are none."""
    pairs = [(int(a), int(b)) for a, b in runs]
    if any(b < 1 or not -(2**31) <= a < 2**31 - b for a, b in pairs) or sum(b for _, b in pairs) > MAX_FRAMES:
        raise ValueError("no runs of numbers")
    found = np.concatenate([np.arange(a, a + b, dtype=np.int32) for a, b in pairs] or [np.zeros(0, np.int32)])
    if np.any(found[1:] <= found[:-1]):
        raise ValueError("not increasing")
    return found


def _rate(seconds: list[float], findings: list[Finding]) -> float:
    """The frame rate on whose frames all times fall."""
    times = np.array(seconds)
    for rate in _RATES:
        if np.all(np.abs(times - np.rint(times * rate) / rate) <= _TICK):
            message = f"the file does not tell its frame rate; its updates fall on frames of {rate:.5g} a second"
            findings.append(Finding("info", "frame-rate", message))
            return rate
    message = f"the updates fall on the frames of no usual rate; they are put on the nearest of {_LAST_RATE:g} a second"
    findings.append(Finding("warning", "frame-rate", message))
    return _LAST_RATE
