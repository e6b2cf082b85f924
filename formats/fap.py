"""FAP streams as text: the ``.fap`` files that came with the MPEG reference encoder.

The layout is de facto, not part of ISO/IEC 14496: a header line ``version name fps frames``, then two lines for
each frame, a mask of 68 zeros and ones, and the frame number with one value for each masked FAP (four for FAP 1, six
for FAP 2). Lines that start with ``#`` are comments. The reader takes what real files hold; see `read_fap`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fba.errors import FapStreamError
from fba.faps import EXPRESSION_FAP, FAP_COUNT, VISEME_FAP, faps
from fba.findings import Finding, Severity
from fba.high_level import BLEND_MAX, EXPRESSIONS, VISEMES
from fba.stream import EXPRESSION_FIELDS, VISEME_FIELDS, FapStream
from formats.files import read_bytes, write_bytes

_LINE_END = re.compile(r"\r\n|\r|\n")
_BLANKS = re.compile(r"[ \t\f\v]+")
_WORD = re.compile(r"[^ \t\f\v]+")
_NUMBERS = re.compile(r"[0-9eE.+\- \t\f\v]*")
_INT32 = 2**31

_Line = tuple[int, str]


def read_fap(path: str | Path) -> tuple[FapStream, list[Finding]]:
    """Read a .fap file.

    Returns
    -------
    stream : values that a mask does not announce are zero and unmasked.
    findings : what is unusual: a wrong number of frames in the header, 69 mask columns, missing frames, values
        outside the standard's ranges, single values for FAP 1 or 2.

    Raises
    ------
    InputFileError
        If the file cannot be read.
    FapStreamError
        If it is damaged; the message names the line and the frame.

    Notes
    -----
    Accepted as found in public files: any line ends, tabs, bytes that are not UTF-8, names with blanks, versions
    other than 2.1, 69 mask columns (the last is dropped), numbers with a decimal point (rounded), any first frame
    number.
    """
    return parse_fap(read_bytes(path), str(path))


def parse_fap(data: bytes, source: str = "stream") -> tuple[FapStream, list[Finding]]:
    """Read the bytes of a .fap file; `source` names them in messages. See `read_fap`."""
    return _Reader(source).read(data)


def write_fap(stream: FapStream, path: str | Path) -> None:
    """Write a .fap file atomically; `read_fap` gives back the same stream.

    Raises
    ------
    FapStreamError
        If the stream has no frames.
    OutputFileError
        If the file cannot be written.

    Notes
    -----
    The frame rate is written as an integer where it is one, as most readers expect it. Line ends in the name
    become blanks.
    """
    if not len(stream):
        raise FapStreamError(f"the stream '{stream.name}' has no frames; a .fap file needs at least one")
    write_bytes(path, "".join(_lines(stream)).encode("utf-8"))


def _lines(stream: FapStream) -> Iterator[str]:
    name = re.sub(r"[\r\n]+", " ", stream.name).strip(" \t\f\v") or "stream"
    rate = f"{stream.frame_rate:.0f}" if float(stream.frame_rate).is_integer() else repr(float(stream.frame_rate))
    yield f"{stream.version} {name} {rate} {len(stream)}\n"
    for k in range(len(stream)):
        mask = stream.mask[k]
        values = [int(stream.frame_numbers[k])]
        if mask[0]:
            values += stream.visemes[k].tolist()
        if mask[1]:
            values += stream.expressions[k].tolist()
        values += stream.values[k, 2:][mask[2:]].tolist()
        yield " ".join("1" if m else "0" for m in mask.tolist()) + "\n"
        yield " ".join(map(str, values)) + "\n"


@dataclass
class _Reader:
    """State of one reading: findings that are told once, and the frames so far."""

    source: str
    findings: list[Finding] = field(default_factory=list)
    told: set[str] = field(default_factory=set)

    def read(self, data: bytes) -> tuple[FapStream, list[Finding]]:
        lines = self._content(data)
        version, name, rate, announced = self._header(next(lines, (0, "")))
        numbers: list[int] = []
        masks: list[list[bool]] = []
        rows: list[list[int]] = []
        last_line = 0
        for mask_line in lines:
            frame = len(masks)
            mask, spare = self._mask(mask_line, frame)
            values_line = next(lines, None)
            if values_line is None:
                raise self._error(mask_line[0], frame, "the file ends after the mask; its values are missing")
            number, row = self._values(values_line, frame, mask, spare)
            if numbers and number <= numbers[-1]:
                message = f"frame number {number} follows {numbers[-1]}; frame numbers must increase"
                raise self._error(values_line[0], frame, message)
            if numbers and number > numbers[-1] + 1:
                message = f"{number - numbers[-1] - 1} frames are missing between {numbers[-1]} and {number}"
                self._tell("info", "missing-frames", message, values_line[0])
            numbers.append(number)
            masks.append(mask)
            rows.append(row)
            last_line = values_line[0]
        if not rows:
            raise FapStreamError(f"{self.source}: the file holds a header but no frames")
        if announced != len(rows):
            message = f"the header announces {announced} frames, the file holds {len(rows)}; it may be cut"
            self._tell("warning", "frame-count", message, last_line)
        table = np.array(rows, dtype=np.int32)
        low = table[:, :FAP_COUNT]
        visemes = table[:, FAP_COUNT : FAP_COUNT + len(VISEME_FIELDS)]
        expressions = table[:, FAP_COUNT + len(VISEME_FIELDS) :]
        stream = FapStream(rate, low, np.array(masks), visemes, expressions, np.array(numbers), name, version)
        return stream, [*self.findings, *range_findings(stream)]

    @staticmethod
    def _content(data: bytes) -> Iterator[_Line]:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
        for number, line in enumerate(_LINE_END.split(text), start=1):
            stripped = line.strip(" \t\f\v")
            if stripped and not stripped.startswith("#"):
                yield number, stripped

    def _header(self, line: _Line) -> tuple[str, str, float, int]:
        words = [w.span() for w in _WORD.finditer(line[1])]
        try:
            if len(words) < 3:
                raise ValueError
            version = line[1][slice(*words[0])]
            name = line[1][words[0][1] : words[-2][0]].strip(" \t\f\v") or "stream"
            _number(version)
            rate, count = (_number(line[1][slice(*words[k])]) for k in (-2, -1))
        except ValueError:
            where = f"{self.source}, line {line[0]}" if line[0] else self.source
            raise FapStreamError(
                f"{where}: a .fap file starts with a line 'version name frames-per-second frames', "
                f"such as '2.1 smile 25 100', not '{line[1][:60]}'"
            ) from None
        if not rate > 0:
            raise FapStreamError(f"{self.source}, line {line[0]}: the frame rate must be positive, not {rate:g}")
        return version, name, rate, round(count)

    def _mask(self, line: _Line, frame: int) -> tuple[list[bool], bool]:
        """The mask, and whether a spurious 69th column is set."""
        tokens = _BLANKS.split(line[1])
        if len(tokens) not in (FAP_COUNT, FAP_COUNT + 1):
            cut = "; the file may be cut here" if len(tokens) < FAP_COUNT else ""
            raise self._error(line[0], frame, f"the mask has {len(tokens)} entries; it must have {FAP_COUNT}{cut}")
        bad = next((t for t in tokens if t not in ("0", "1")), None)
        if bad is not None:
            raise self._error(line[0], frame, f"the mask holds '{bad[:20]}'; only 0 and 1 are allowed")
        if len(tokens) > FAP_COUNT:
            message = f"the mask has {FAP_COUNT + 1} entries; the last one is ignored"
            self._tell("warning", "mask-columns", message, line[0])
        return [t == "1" for t in tokens[:FAP_COUNT]], len(tokens) > FAP_COUNT and tokens[-1] == "1"

    def _values(self, line: _Line, frame: int, mask: list[bool], spare: bool) -> tuple[int, list[int]]:
        """Frame number, and one row: 68 FAPs, the fields of FAP 1, those of FAP 2."""
        found = self._integers(line, frame)
        number, found = found[0], found[1:]
        widths = {VISEME_FAP: len(VISEME_FIELDS), EXPRESSION_FAP: len(EXPRESSION_FIELDS)}
        fields = {k: widths.get(k, 1) for k, masked in enumerate(mask, start=1) if masked}
        wanted = sum(fields.values())
        if spare and len(found) == wanted + 1:
            found.pop()
        short = wanted - len(found)
        single = next((s for s in ((1,), (2,), (1, 2)) if self._short_by(fields, s) == short), ()) if short > 0 else ()
        if short and not single:
            message = f"the mask announces {wanted} values, but the line has {len(found)} after the frame number"
            raise self._error(line[0], frame, message + ("; the file may be cut here" if short > 0 else ""))
        for key in single:
            fields[key] = 1
            message = f"FAP {key} has a single value where {widths[key]} belong; it is left out"
            self._tell("warning", f"single-value-fap{key}", message, line[0])
        row = [0] * (FAP_COUNT + len(VISEME_FIELDS) + len(EXPRESSION_FIELDS))
        starts = {VISEME_FAP: FAP_COUNT, EXPRESSION_FAP: FAP_COUNT + len(VISEME_FIELDS)}
        at = 0
        for key, width in fields.items():
            if key in single:
                mask[key - 1] = False
            else:
                start = starts.get(key, key - 1)
                row[start : start + width] = found[at : at + width]
            at += width
        return number, row

    @staticmethod
    def _short_by(fields: dict[int, int], single: tuple[int, ...]) -> int:
        """How many values are too few if these FAPs have one value only; -1 if one of them is not masked."""
        return sum(fields[k] - 1 for k in single) if all(k in fields for k in single) else -1

    def _integers(self, line: _Line, frame: int) -> list[int]:
        out = []
        for token in _BLANKS.split(line[1]):
            try:
                value = round(_number(token))
            except ValueError:
                raise self._error(line[0], frame, f"'{token[:20]}' is not a finite number") from None
            if not -_INT32 <= value < _INT32:
                raise self._error(line[0], frame, f"{token[:20]} is too large for a FAP value")
            out.append(value)
        return out

    def _error(self, line: int, frame: int, message: str) -> FapStreamError:
        return FapStreamError(f"{self.source}, line {line}, frame {frame + 1} of the file: {message}")

    def _tell(self, severity: Severity, code: str, message: str, line: int) -> None:
        """Report the first of each kind, with its line."""
        if code not in self.told:
            self.told.add(code)
            self.findings.append(Finding(severity, code, message, f"line {line}"))


def _number(token: str) -> float:
    """A finite number in plain ASCII notation; ValueError for anything else."""
    if not _NUMBERS.fullmatch(token):
        raise ValueError(token)
    value = float(token)
    if not np.isfinite(value):
        raise ValueError(token)
    return value


def range_findings(stream: FapStream) -> list[Finding]:
    """Return a warning for each FAP whose values leave the range of the standard's intra frames."""
    findings = []
    for definition in faps()[2:]:
        column = stream.values[:, definition.id - 1]
        low, high = definition.i_range
        outside = int(np.count_nonzero((column < low) | (column > high)))
        if outside:
            findings.append(
                Finding(
                    "warning",
                    "fap-range",
                    f"FAP {definition.id} ({definition.name}) runs from {column.min()} to {column.max()}, outside "
                    f"{low}..{high} in {outside} of {len(stream)} frames; it is played as it is",
                    f"FAP {definition.id}",
                )
            )
    selects = ((stream.visemes, VISEME_FAP, (len(VISEMES), len(VISEMES), BLEND_MAX)),)
    pairs = (len(EXPRESSIONS), BLEND_MAX) * 2
    for fields, number, limits in (*selects, (stream.expressions, EXPRESSION_FAP, pairs)):
        names = VISEME_FIELDS if number == VISEME_FAP else EXPRESSION_FIELDS
        for column, name, limit in zip(fields.T, names, limits, strict=False):
            if np.any((column < 0) | (column > limit)):
                message = f"{name} runs from {column.min()} to {column.max()}, outside 0..{limit}"
                findings.append(Finding("warning", "high-level-range", message, f"FAP {number}"))
    return findings
