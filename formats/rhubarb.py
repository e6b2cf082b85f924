"""Mouth cues of Rhubarb Lip Sync (.json, .tsv) as visemes.

Cues switch from one of nine mouth shapes to the next. A shape becomes a viseme by the table formats/data/rhubarb.csv,
and a switch a short cross-fade between the two visemes that FAP 1 can blend.
"""

from __future__ import annotations

import csv
import json
import math
from functools import cache
from importlib.resources import files
from itertools import pairwise
from pathlib import Path

import numpy as np

from fba.arrays import Floats, Ints
from fba.errors import FapStreamError, TextSyntaxError
from fba.findings import Finding
from fba.high_level import BLEND_MAX
from fba.stream import VISEME_FIELDS, FapStream
from formats.files import read_bytes

RATE = 50.0
"""Frames a second, if nothing else is wanted: the cues' hundredths of a second are halves of frames."""

FADE = 0.1
"""Seconds of a cross-fade. Lips need about that long from one sound to the next; cues that are shorter fade in and out
within their own time and are shown in full at their middle."""

LARGEST_FILE = 64 << 20
LARGEST_FRAMES = 200_000
"""More frames than that are refused before any memory is taken: an hour at 50 a second."""

Cue = tuple[float, int]
"""Start in seconds and viseme."""


@cache
def mouth_visemes() -> dict[str, int]:
    """Rhubarb's mouth shape -> number of the viseme.

    >>> mouth_visemes()["A"], mouth_visemes()["X"]
    (1, 0)
    """
    text = (files("formats") / "data" / "rhubarb.csv").read_text("utf-8")
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    return {row["mouth"]: int(row["viseme"]) for row in rows}


def read_rhubarb(path: str | Path, rate: float | None = None) -> tuple[FapStream, list[Finding]]:
    """Read mouth cues.

    Parameters
    ----------
    path : a JSON document or lines of tab-separated values, whatever the name says.
    rate : frames a second; None: 50.

    Returns
    -------
    stream : FAP 1 alone is masked; as long as the recording.
    findings : gaps or overlaps between cues.

    Raises
    ------
    InputFileError
        If the file cannot be read.
    FapStreamError, TextSyntaxError
        If it holds no mouth cues; the message names the line or cue.
    """
    return parse_rhubarb(read_bytes(path, LARGEST_FILE), str(path), rate, Path(path).stem)


def parse_rhubarb(
    data: bytes, source: str = "cues", rate: float | None = None, name: str = "cues"
) -> tuple[FapStream, list[Finding]]:
    """Read the bytes of such a file; see `read_rhubarb`."""
    rate = RATE if rate is None else rate
    if not (math.isfinite(rate) and rate > 0.0):
        raise FapStreamError(f"the frame rate must be a positive number, not {rate}")
    text = data.decode("utf-8-sig", "replace")
    read = _read_json if text.lstrip()[:1] in ("{", "[") else _read_tsv
    cues, end, findings = read(text, source)
    if not end * rate < LARGEST_FRAMES:
        raise FapStreamError(
            f"{source}: {end:g} seconds at {rate:g} frames a second are more than {LARGEST_FRAMES} frames; "
            "cut the recording or take a lower --rate"
        )
    count = max(math.ceil(round(end * rate, 6)), 1)
    visemes = _fields(cues, end, np.arange(count) / rate)
    return FapStream.build(rate, count, visemes=visemes, name=name), findings


def _fields(cues: list[Cue], end: float, times: Floats) -> Ints:
    """Fields of FAP 1 at these times: a cue's viseme alone, or two around a switch."""
    starts = np.array([start for start, _ in cues])
    shown = np.array([viseme for _, viseme in cues])
    lengths = np.diff(np.append(starts, end))
    # Half a fade lies on either side of a switch, and no two fades overlap.
    halves = np.minimum(np.minimum(lengths[:-1], lengths[1:]) / 2.0, FADE / 2.0)
    at = np.maximum(np.searchsorted(starts, times, "right") - 1, 0)
    fields = np.zeros((len(times), len(VISEME_FIELDS)), dtype=np.int32)
    fields[:, 0] = shown[at]
    fields[:, 2] = BLEND_MAX
    for offset in (0, 1):
        switch = at + offset - 1  # between the cues `switch` and `switch` + 1
        there = (switch >= 0) & (switch < len(halves))
        near = np.flatnonzero(there)[np.abs(times[there] - starts[switch[there] + 1]) < halves[switch[there]]]
        k = switch[near]
        way = (times[near] - starts[k + 1]) / halves[k] / 2.0 + 0.5
        blend = np.rint(BLEND_MAX * (1.0 - way * way * (3.0 - 2.0 * way)))
        fields[near, 0], fields[near, 1], fields[near, 2] = shown[k], shown[k + 1], blend
    return fields


def _read_tsv(text: str, source: str) -> tuple[list[Cue], float, list[Finding]]:
    """Lines of a time and a shape; the last one tells the end."""
    marks: list[Cue] = []
    for line, content in enumerate(text.splitlines(), start=1):
        words = content.split()
        if not words:
            continue
        if len(words) != 2:
            message = f"a time and a mouth shape such as '0.05<tab>D' are wanted, not '{content.strip()[:40]}'"
            raise TextSyntaxError(message, line, 1, source)
        start = _time(words[0])
        if start is None:
            raise TextSyntaxError(f"'{words[0][:20]}' is not a time in seconds", line, 1, source)
        viseme = mouth_visemes().get(words[1])
        if viseme is None:
            raise TextSyntaxError(_unknown(words[1]), line, 1, source)
        if marks and start < marks[-1][0]:
            raise TextSyntaxError(f"the time {start:g} is before {marks[-1][0]:g} of the cue above", line, 1, source)
        marks.append((start, viseme))
    if len(marks) < 2:
        raise FapStreamError(f"{source}: {len(marks)} mouth cues; a cue and the end of the recording are wanted")
    end = marks[-1][0]
    return _merged(marks[:-1], end, source), end, []


def _read_json(text: str, source: str) -> tuple[list[Cue], float, list[Finding]]:
    """An object whose ``mouthCues`` have start, end and value."""
    try:
        document = json.loads(text, parse_int=float)
    except json.JSONDecodeError as error:
        raise TextSyntaxError(f"no valid JSON: {error.msg}", error.lineno, error.colno, source) from None
    except (RecursionError, ValueError):
        raise FapStreamError(f"{source}: the JSON is nested too deeply or holds unreadable numbers") from None
    listed = document.get("mouthCues") if isinstance(document, dict) else None
    if not isinstance(listed, list) or not listed:
        raise FapStreamError(f"{source}: there is no list 'mouthCues'; the JSON output of Rhubarb Lip Sync is wanted")
    cues: list[Cue] = []
    gaps: list[int] = []
    end = 0.0
    for number, entry in enumerate(listed, start=1):
        start, stop, viseme = _json_cue(entry, number, source)
        if cues and start < cues[-1][0]:
            raise FapStreamError(f"{source}, cue {number}: it starts at {start:g}, before the cue above")
        if cues and abs(start - end) > 0.005:
            gaps.append(number)
            if start > end:
                cues.append((end, mouth_visemes()["X"]))
        cues.append((start, viseme))
        end = max(end, stop)
    findings = []
    if gaps:
        text = f"{len(gaps)} cues do not start where the one before ends; gaps are idle, overlaps are cut"
        findings.append(Finding("warning", "cue-gaps", text, f"cue {gaps[0]}"))
    return _merged(cues, end, source), end, findings


def _json_cue(entry: object, number: int, source: str) -> tuple[float, float, int]:
    if not isinstance(entry, dict):
        raise FapStreamError(f"{source}, cue {number}: an object with start, end and value is wanted")
    start, stop = _time(entry.get("start")), _time(entry.get("end"))
    if start is None or stop is None or stop < start:
        raise FapStreamError(f"{source}, cue {number}: start and end must be times in seconds, one after the other")
    value = entry.get("value")
    viseme = mouth_visemes().get(value) if isinstance(value, str) else None
    if viseme is None:
        raise FapStreamError(f"{source}, cue {number}: {_unknown(value)}")
    return start, stop, viseme


def _time(value: object) -> float | None:
    """A finite number from 0 on, or None."""
    if not isinstance(value, str | float) or (isinstance(value, str) and "_" in value):
        return None
    try:
        seconds = float(value)
    except ValueError:
        return None
    return seconds if math.isfinite(seconds) and seconds >= 0.0 else None


def _unknown(value: object) -> str:
    return f"'{str(value)[:20]}' is no mouth shape; Rhubarb's are {', '.join(mouth_visemes())}"


def _merged(cues: list[Cue], end: float, source: str) -> list[Cue]:
    """Cues that last, from time 0 on, neighbours of one viseme as one."""
    lasting = [a for a, b in pairwise([(0.0, mouth_visemes()["X"]), *cues, (end, 0)]) if b[0] > a[0]]
    if not lasting:
        raise FapStreamError(f"{source}: no mouth cue lasts any time")
    return [lasting[0], *(b for a, b in pairwise(lasting) if a[1] != b[1])]
