"""ARKit's face curves as CSV, in the layout that the app Live Link Face records.

One row a frame: ``Timecode,BlendShapeCount``, the weights of ARKit's 52 shapes, nine angles of head and eyes. Shapes
become FAPs through the published table (`fat.profiles`) and come back through the same table; docs/formats/streams.md
tells what is lost.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from fat.profiles import ARKIT, profile_table
from fba.amplitudes import amplitudes
from fba.arrays import Floats
from fba.errors import FapStreamError, TextSyntaxError, UnsupportedFeatureError
from fba.faps import FAP_COUNT, LOW_LEVEL_FAPS, fap
from fba.findings import Finding
from fba.stream import FapStream
from formats.fap import range_findings
from formats.files import read_bytes, write_bytes
from formats.timecode import frame_numbers_of, timecode, timecode_seconds

ANGLES: tuple[tuple[str, int, float], ...] = (
    ("HeadYaw", 49, -1.0),
    ("HeadPitch", 48, 1.0),
    ("HeadRoll", 50, -1.0),
    ("LeftEyeYaw", 23, -1.0),
    ("LeftEyePitch", 25, 1.0),
    ("LeftEyeRoll", 0, 0.0),
    ("RightEyeYaw", 24, -1.0),
    ("RightEyePitch", 26, 1.0),
    ("RightEyeRoll", 0, 0.0),
)
"""Column, its FAP (0: none, eyeballs do not roll), sign of the FAP. Radians: yaw turns to the subject's right, pitch
down. Measured for the eyes on takes of the app against its gaze shapes; the head's follow from the same axes."""

GAZES: tuple[tuple[int, str, str], ...] = (
    (23, "eyeLookOutLeft", "eyeLookInLeft"),
    (24, "eyeLookInRight", "eyeLookOutRight"),
    (25, "eyeLookDownLeft", "eyeLookUpLeft"),
    (26, "eyeLookDownRight", "eyeLookUpRight"),
)
"""FAP of an eyeball, the shape that turns it the positive way, the one that turns it back."""

TURN = 0.6
"""Radians by which an eyeball has turned where its shape has the weight 1. Measured on three takes of the app, which
hold both: 0.58 to 0.62 sideways, 0.54 to 0.61 up and down. The shapes of the table's artist turn it by 0.17 to 0.26."""

SMALLNESS = 0.02
"""Weight of small weights against FAPs in normal amplitudes. Sums of shapes can be the FAPs of other shapes, and curves
would leap between them (by up to 0.5 on two takes, with this 0.25); at 0.1 FAPs are off by 3 % of an amplitude."""

RADIAN = 1e5
"""One radian in units of an angle FAP."""

_SWAPPED = {"jawLeft": "jawRight", "mouthLeft": "mouthRight"}
_FILE_ORDER = tuple(_SWAPPED.get(n) or next((left for left, right in _SWAPPED.items() if right == n), n) for n in ARKIT)
"""The app writes the right one of these two pairs first."""

COLUMNS = tuple(n[0].upper() + n[1:] for n in _FILE_ORDER) + tuple(name for name, _, _ in ANGLES)

LARGEST_FILE = 256 << 20
LARGEST_FRAMES = 1_000_000
LARGEST_WEIGHT = 10.0
"""A weight of 1 is the whole shape; trackers overshoot a little. Beyond this the column holds something else."""

_HIGHEST_USUAL = 1.5


def read_arkit_csv(
    path: str | Path, rate: float | None = None, *, strict_jaw: bool = False
) -> tuple[FapStream, list[Finding]]:
    """Read curves and turn them into FAPs.

    Parameters
    ----------
    rate : frames a second; None reads them off the time codes (60, the app's, where there are none).
    strict_jaw : for faces whose open_jaw leaves the lips (`fat.open_jaw`).

    Returns
    -------
    stream : the FAPs that the file's columns drive are masked. Rows that the recording dropped are missing numbers.
    findings : columns that are missing or unknown, weights outside 0..1, missing frames.

    Raises
    ------
    InputFileError
        If the file cannot be read.
    FapStreamError, TextSyntaxError
        If it is no such CSV; the message names the line.
    """
    return parse_arkit_csv(read_bytes(path, LARGEST_FILE), str(path), rate, strict_jaw=strict_jaw, name=Path(path).stem)


def parse_arkit_csv(
    data: bytes, source: str = "curves", rate: float | None = None, *, strict_jaw: bool = False, name: str = "curves"
) -> tuple[FapStream, list[Finding]]:
    """Read the bytes of such a file; see `read_arkit_csv`."""
    curves, findings = _parse(data, source)
    weights = {n: curves.values[:, k] for k, n in enumerate(curves.names)}
    numbers, found_rate, more = frame_numbers_of(curves.codes, len(curves.values), rate)
    faps = _faps_of(weights, strict_jaw)
    stream = FapStream.build(found_rate, len(numbers), {k: np.rint(v) for k, v in faps.items()}, name=name)
    stream = FapStream(found_rate, stream.values, stream.mask, stream.visemes, stream.expressions, numbers, name)
    return stream, [*findings, *more, *range_findings(stream)]


def write_arkit_csv(stream: FapStream, path: str | Path) -> list[Finding]:
    """Write the curves that show a stream best, atomically.

    Returns
    -------
    findings : FAPs that ARKit's shapes cannot show.

    Raises
    ------
    UnsupportedFeatureError
        If the stream holds visemes or expressions alone.
    FapStreamError
        If it has no frames.
    """
    text, findings = format_arkit_csv(stream)
    write_bytes(path, text.encode("ascii"))
    return findings


def format_arkit_csv(stream: FapStream) -> tuple[str, list[Finding]]:
    """The text of such a file; see `write_arkit_csv`."""
    if not len(stream):
        raise FapStreamError(f"the stream '{stream.name}' has no frames; a CSV needs at least one")
    if stream.mask[:, :2].any() and not (stream.mask & (stream.values != 0))[:, 2:].any():
        raise UnsupportedFeatureError(
            "the stream holds visemes or expressions alone, which ARKit's curves cannot carry; write it as .fap"
        )
    values = np.where(stream.mask, stream.values, 0)[:, 2:].astype(np.float64)
    weights, findings = _weights_of(values)
    if stream.mask[:, :2].any():
        text = "visemes and expressions (FAPs 1 and 2) are left out: ARKit has no curves for them"
        findings.append(Finding("warning", "high-level-lost", text, "FAP 1, 2"))
    angles = np.zeros((len(stream), len(ANGLES)))
    for k, (_, number, sign) in enumerate(ANGLES):
        if number:
            angles[:, k] = sign * values[:, number - 3] / RADIAN
    order = [ARKIT.index(n) for n in _FILE_ORDER]
    table = np.hstack([weights[:, order], angles]) + 0.0
    numbers = stream.frame_numbers - min(int(stream.frame_numbers[0]), 0)
    rows = [",".join(("Timecode", "BlendShapeCount", *COLUMNS))]
    for number, row in zip(numbers.tolist(), table.tolist(), strict=True):
        rows.append(f"{timecode(number / stream.frame_rate)},{len(COLUMNS)}," + ",".join(f"{v:.10f}" for v in row))
    return "\n".join(rows) + "\n", findings


@dataclass(frozen=True)
class _Curves:
    """names of the known columns, values (rows, names), time codes of every row or None."""

    names: tuple[str, ...]
    values: Floats
    codes: list[tuple[int, float]] | None


@cache
def _known() -> dict[str, str]:
    """Column name in small letters -> shape or angle."""
    return {n.lower(): n for n in (*ARKIT, *(name for name, _, _ in ANGLES))}


def _parse(data: bytes, source: str) -> tuple[_Curves, list[Finding]]:
    if b"\0" in data:
        raise FapStreamError(f"{source} holds binary data, not CSV; check that the extension is right")
    rows = _rows(data.decode("utf-8-sig", "replace"), source)
    line, header = next(rows, (1, []))
    titles = [t.strip().lower() for t in header]
    columns = {k: _known()[t] for k, t in enumerate(titles) if t in _known()}
    names = tuple(columns.values())
    if not columns or not set(names) & set(ARKIT):
        raise FapStreamError(
            f"{source}, line {line}: the first line names none of ARKit's shapes (EyeBlinkLeft, JawOpen, ...); "
            "the curves of Live Link Face are wanted"
        )
    if len(set(names)) < len(names):
        twice = next(n for n in names if names.count(n) > 1)
        raise TextSyntaxError(f"the column {twice} stands there twice", line, 1, source)
    times = titles.index("timecode") if "timecode" in titles else None
    found: list[Floats] = []
    codes: list[tuple[int, float]] | None = [] if times is not None else None
    for line, row in rows:
        if len(row) != len(header):
            cut = "; the file may be cut here" if len(row) < len(header) else ""
            raise TextSyntaxError(f"{len(row)} columns where the first line has {len(header)}{cut}", line, 1, source)
        if len(found) == LARGEST_FRAMES:
            raise TextSyntaxError(f"more than {LARGEST_FRAMES} frames are not read; cut the take", line, 1, source)
        found.append(np.array([_weight(row[k], name, line, k, source) for k, name in columns.items()]))
        if times is not None and codes is not None:
            code = timecode_seconds(row[times])
            if code is None:
                raise TextSyntaxError(
                    f"'{row[times].strip()[:30]}' is no time code such as 01:02:03:04.567", line, times + 1, source
                )
            codes.append(code)
    if not found:
        raise FapStreamError(f"{source}: the file holds a header but no frames")
    curves = _Curves(names, np.array(found), codes)
    return curves, _findings(curves, [t for t in titles if t not in _known()])


def _rows(text: str, source: str) -> Iterator[tuple[int, list[str]]]:
    """Line number and fields of every row that is not empty."""
    reader = csv.reader(io.StringIO(text, newline=""))
    while True:
        try:
            row = next(reader)
        except StopIteration:
            return
        except csv.Error as error:
            raise TextSyntaxError(f"{error}", max(reader.line_num, 1), 1, source) from None
        if any(map(str.strip, row)):
            yield reader.line_num, row


def _weight(text: str, name: str, line: int, column: int, source: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "_" in text:
        raise TextSyntaxError(f"'{text.strip()[:20]}' in the column {name} is not a number", line, column + 1, source)
    if abs(value) > LARGEST_WEIGHT:
        raise TextSyntaxError(
            f"{name} is {value:g}; weights run from 0 to 1 and angles are radians", line, column + 1, source
        )
    return value


def _findings(curves: _Curves, unknown: Sequence[str]) -> list[Finding]:
    findings = []
    missing = [n for n in ARKIT if n not in curves.names]
    if missing:
        text = f"{len(missing)} of ARKit's 52 shapes have no column, so they stay still: {', '.join(missing[:5])}"
        findings.append(Finding("warning", "missing-shapes", text + (", ..." if len(missing) > 5 else "")))
    strange = [t for t in unknown if t not in ("timecode", "blendshapecount")]
    if strange:
        text = f"{len(strange)} columns are not ARKit's and are left out: {', '.join(strange[:5])[:80]}"
        findings.append(Finding("warning", "unknown-columns", text))
    shapes = [k for k, n in enumerate(curves.names) if n in ARKIT]
    low, high = curves.values[:, shapes].min(), curves.values[:, shapes].max()
    if low < 0.0 or high > _HIGHEST_USUAL:
        text = f"weights run from {low:.3g} to {high:.3g}, usual is 0 to 1; they are taken as they are"
        findings.append(Finding("warning", "weight-range", text))
    return findings


@cache
def _table(strict_jaw: bool) -> Floats:
    """(52, 66): FAP 3 .. 68 of each shape at weight 1; the gaze's shapes turn the eyeballs by `TURN`."""
    table = np.zeros((len(ARKIT), FAP_COUNT - 2))
    for row, shape in enumerate(profile_table("arkit")):
        faps = shape.strict_faps if strict_jaw and shape.strict_faps else shape.faps
        for number, value in faps.items():
            table[row, number - 3] = value
    for number, forth, back in GAZES:
        table[:, number - 3] = 0.0
        table[ARKIT.index(forth), number - 3] = TURN * RADIAN
        table[ARKIT.index(back), number - 3] = -TURN * RADIAN
    return table


def _faps_of(weights: dict[str, Floats], strict_jaw: bool) -> dict[int, Floats]:
    """FAP -> values of every frame, for all that the columns drive.

    Angles of the eyes, where a take has them, are what the eyeballs do; the shapes of the gaze then move the lids only.
    """
    names = [n for n in ARKIT if n in weights]
    table = _table(strict_jaw)[[ARKIT.index(n) for n in names]]
    values = np.stack([weights[n] for n in names], axis=1) @ table
    driven = {number: values[:, number - 3] for number in LOW_LEVEL_FAPS if table[:, number - 3].any()}
    angles = {n: (k, sign) for n, k, sign in ANGLES if k and n in weights}
    eyes = {number for number, _, _ in GAZES}
    tracked = any(k in eyes and weights[n].any() for n, (k, _) in angles.items())
    for name, (number, sign) in angles.items():
        if number not in eyes or tracked:
            driven[number] = sign * RADIAN * weights[name]
    return driven


def _weights_of(values: Floats) -> tuple[Floats, list[Finding]]:
    """Weights (frames, 52), 0..1, that show FAPs (frames, 66) best by the table, and what they do not show.

    The gaze follows from the eyeballs. The rest is least squares with no negative weight, every FAP in its normal
    amplitude, a little in favour of small weights; what exceeds 1 is cut.
    """
    from scipy.optimize import nnls

    weights = np.zeros((len(values), len(ARKIT)))
    for number, forth, back in GAZES:
        turn = values[:, number - 3] / (TURN * RADIAN)
        weights[:, ARKIT.index(forth)], weights[:, ARKIT.index(back)] = np.maximum(turn, 0.0), np.maximum(-turn, 0.0)
    weights = np.minimum(weights, 1.0)
    carried = {number for _, number, _ in ANGLES}
    rows = [k - 3 for k in LOW_LEVEL_FAPS if k not in carried]
    scale = np.array([amplitudes()[k + 3].positive for k in rows], dtype=np.float64)
    table = (_table(False)[:, rows] / scale).T
    wanted = values[:, rows] / scale
    fitted = [k for k, n in enumerate(ARKIT) if not n.startswith("eyeLook")]
    matrix = np.vstack([table[:, fitted], SMALLNESS * np.eye(len(fitted))])
    for frame, row in enumerate(wanted - weights @ table.T):
        if row.any():
            weights[frame, fitted] = nnls(matrix, np.concatenate([row, np.zeros(len(fitted))]))[0]
    weights = np.minimum(weights, 1.0)
    lost = np.abs(weights @ table.T - wanted).sum(axis=0)
    there = np.abs(wanted).sum(axis=0)
    poor = [fap(rows[k] + 3).name for k in np.flatnonzero((there > 0.0) & (lost > 0.5 * there))]
    if not poor:
        return weights, []
    text = f"ARKit's shapes show less than half of {len(poor)} FAPs: {', '.join(poor[:5])}"
    return weights, [Finding("warning", "faps-lost", text + (", ..." if len(poor) > 5 else ""))]
