"""From FBA bitstream to FAP stream."""

from __future__ import annotations

import numpy as np

from fba.errors import FapStreamError, UnsupportedFeatureError
from fba.faps import FAP_COUNT, LOW_LEVEL_FAPS
from fba.findings import Finding, Severity
from fba.stream import FapStream
from formats.fba_bitstream.arithmetic import RunDecoder
from formats.fba_bitstream.bits import BitReader
from formats.fba_bitstream.corrections import unpacked
from formats.fba_bitstream.sequence import unwrapped
from formats.fba_bitstream.syntax import (
    ALL,
    COLUMNS,
    FACE,
    GROUPS,
    HELD,
    INTERPOLATED,
    PLAIN_BITS,
    PLANE_STARTS,
    QUANTIZER_BITS,
    RANGE_UNIT,
    ROW,
    SEQUENCE_END,
    FieldKey,
    Ranges,
    Segment,
    range_fields,
    require_number,
)

LARGEST_FRAMES = 100_000
"""More frames are not read: an hour at 25 a second. Six bits can be a frame, so that small files could take long."""

DEFAULT_RATE = 30.0
_INT32 = 2**31


class Decoder:
    """State of one reading."""

    def __init__(self, data: bytes, source: str) -> None:
        self._bits = BitReader(data, source)
        self._source = source
        self._start, self._user_data = unwrapped(data, source)
        self._findings: dict[str, Finding] = {}
        self._rate: float | None = None
        self._segment: Segment | None = None
        self._ranges = (Ranges.default(0), Ranges.default(1))
        self._signalled: set[tuple[int, int]] = set()
        """Kind of plane (0, 1) and FAP whose ranges the stream has told."""
        self._held: dict[FieldKey, int] = {}
        """Last value of every field."""
        self._flags: dict[int, tuple[int, ...]] = {}
        self._number = -1

    def decode(self, name: str) -> tuple[FapStream, list[Finding]]:
        """Read all planes."""
        self._bits.position = 8 * self._start + 32
        numbers: list[int] = []
        rows: list[np.ndarray] = []
        masks: list[np.ndarray] = []
        while self._plane_follows():
            if len(rows) == LARGEST_FRAMES:
                raise self._bits.error(f"more than {LARGEST_FRAMES} frames are not read; cut the stream")
            row, mask = self._plane()
            rows.append(row)
            masks.append(mask)
            numbers.append(self._number)
        if not rows:
            raise FapStreamError(f"{self._source}: the bitstream holds no frames")
        table = self._corrected(np.array(rows), np.array(masks))
        stream = FapStream(
            self._rate or DEFAULT_RATE,
            table[:, :FAP_COUNT],
            np.array(masks),
            table[:, COLUMNS[1] : COLUMNS[2]],
            table[:, COLUMNS[2] :],
            np.array(numbers),
            name,
        )
        return stream, list(self._findings.values())

    def _corrected(self, table: np.ndarray, masks: np.ndarray) -> np.ndarray:
        """Values with what user data says is missing."""
        sent = np.ones(table.shape, dtype=np.bool_)
        sent[:, :FAP_COUNT] = masks
        sent[:, COLUMNS[1] : COLUMNS[2]] = masks[:, :1]
        sent[:, COLUMNS[2] :] = masks[:, 1:2]
        for data in self._user_data:
            frames = unpacked(data, self._source)
            if frames is None:
                continue
            if len(frames) != len(table):
                text = f"the user data corrects {len(frames)} frames, but there are {len(table)}; the file may be cut"
                self._tell("warning", "corrections", text)
            for k, frame in enumerate(frames[: len(table)]):
                for place, amount in frame.items():
                    value = int(table[k, place]) + amount if place < ROW else _INT32
                    if not -_INT32 <= value < _INT32 or not sent[k, place]:
                        raise FapStreamError(f"{self._source}: the user data corrects what frame {k + 1} does not hold")
                    table[k, place] = value
        return table

    def _plane_follows(self) -> bool:
        """Pass stuffing and a plane start code, if any; False at the end."""
        bits = self._bits
        boundary = bits.position // 8 * 8 + 8
        stuffed = all(bits.bit_at(k) == (k > bits.position) for k in range(bits.position, boundary))
        aligned = boundary if stuffed else bits.position
        word = bits.word_at(aligned) if aligned % 8 == 0 else None
        if word == SEQUENCE_END:
            return False
        if word in PLANE_STARTS:
            bits.position = aligned + 32
            return True
        if bits.size - bits.position < 8 and not any(map(bits.bit_at, range(bits.position, bits.size))):
            text = "there is no end code; the file may be cut"
            self._tell("warning", "no-end-code", text)
            return False
        return True

    def _plane(self) -> tuple[np.ndarray, np.ndarray]:
        bits = self._bits
        start = bits.position
        intra = bool(bits.bit())
        kind = bits.bits(2)
        if kind != FACE:
            bits.position = start
            if kind == 0:
                raise bits.error("a plane of neither face nor body; the data is damaged")
            raise UnsupportedFeatureError(f"{bits.error('the stream animates a body')}; only faces are read")
        if intra:
            self._clock()
        elif self._segment is None:
            raise bits.error("the stream begins with a predicted plane; its beginning is missing")
        self._skip()
        segment = self._intra_header() if intra or self._segment is None else self._segment
        self._segment = segment
        for fap_id, fields in segment.runs():
            self._run(segment, fields, intra)
            if fap_id:
                self._flags[fap_id] = tuple(bits.bit() for _ in range(PLAIN_BITS[fap_id]))
        return self._row(segment)

    def _clock(self) -> None:
        """Frame rate and time code."""
        bits = self._bits
        if bits.bit():
            rate = bits.bits(8) + bits.bits(4) / 16
            rate *= 1000 / 1001 if bits.bit() else 1.0
            if rate == 0.0:
                raise bits.error("the frame rate is 0")
            if self._rate is not None and rate != self._rate:
                text = f"the frame rate changes from {self._rate:g} to {rate:g}; the first is kept"
                self._tell("warning", "frame-rate-changes", text)
            self._rate = self._rate or rate
        elif self._rate is None:
            self._tell("info", "no-frame-rate", f"the stream tells no frame rate; {DEFAULT_RATE:g} is taken")
        if bits.bit():
            bits.bits(11)
            bits.marker("of the time code")
            bits.bits(6)
            self._tell("info", "time-code", "the stream holds time codes; they are not kept")

    def _skip(self) -> None:
        skipped = 0
        if self._bits.bit():
            group = 15
            while group == 15:
                group = self._bits.bits(4)
                skipped += group
        if skipped and self._number >= 0:
            text = f"{skipped} frames are missing between {self._number} and {self._number + skipped + 1}"
            self._tell("info", "missing-frames", text)
        self._number = require_number(self._number + 1 + skipped)

    def _intra_header(self) -> Segment:
        bits = self._bits
        quantizer = bits.bits(QUANTIZER_BITS)
        mask: list[int] = []
        for group in GROUPS:
            bits.marker(f"of the mask of FAP {group[0]}")
            kind = bits.bits(2)
            if kind == INTERPOLATED:
                text = "the stream leaves FAPs to the decoder's interpolation; they are left out"
                self._tell("warning", "interpolated-faps", text)
            if kind in (HELD, INTERPOLATED):
                mask += [fap_id for fap_id in group if bits.bit()]
            elif kind == ALL:
                mask += group
        bits.bit()  # the suggested gender
        if bits.bit():
            raise UnsupportedFeatureError(
                f"{bits.error('the stream is coded in DCT mode')}, which no public source describes; "
                "only the predictive mode is read"
            )
        segment = Segment(quantizer, tuple(mask), self._ranges)
        self._read_ranges(segment)
        for fap_id in segment.mask:
            self._held |= dict.fromkeys([(fap_id, k) for k in range(4)], 0)
        return segment

    def _read_ranges(self, segment: Segment) -> None:
        """Ranges that this plane tells; they hold until others are told."""
        bits = self._bits
        flags = [bits.bit() for _ in range(4)]
        # In the order of the bitstream: highest and lowest of intra planes, then of predicted ones.
        tables = [(kind, sign) for kind in (0, 1) for sign in (1, -1)]
        for flag, (kind, sign) in zip(flags, tables, strict=True):
            if not flag:
                continue
            ranges = self._ranges[kind]
            for fap_id in range_fields(segment.mask, lambda: bits.marker("in a table of ranges")):
                (ranges.high if sign > 0 else ranges.low)[fap_id] = sign * RANGE_UNIT * bits.bits(5)
                self._signalled.add((kind, fap_id))
        low_level = [k for k in segment.mask if k in LOW_LEVEL_FAPS]
        if any((kind, k) not in self._signalled for kind in (0, 1) for k in low_level):
            text = "the stream relies on default ranges, on which sources differ; values may be wrong"
            self._tell("warning", "default-ranges", text)

    def _run(self, segment: Segment, fields: list[FieldKey], intra: bool) -> None:
        run = RunDecoder(self._bits)
        for fap_id, number in fields:
            low, model = segment.model(fap_id, number, intra)
            change = (low + run.get(model)) * segment.step(fap_id, number)
            value = change if intra else self._held[fap_id, number] + change
            if not -_INT32 <= value < _INT32:
                raise self._bits.error(f"the value of FAP {fap_id} runs out of all bounds; the data is damaged")
            self._held[fap_id, number] = value
        run.finish()

    def _row(self, segment: Segment) -> tuple[np.ndarray, np.ndarray]:
        row = np.zeros(ROW, dtype=np.int32)
        mask = np.zeros(FAP_COUNT, dtype=np.bool_)
        for fap_id in segment.mask:
            mask[fap_id - 1] = True
            if fap_id in LOW_LEVEL_FAPS:
                row[fap_id - 1] = self._held[fap_id, 0]
        for fap_id, fields in segment.runs():
            if fap_id:
                values = [self._held[key] for key in fields] + list(self._flags[fap_id])
                row[COLUMNS[fap_id] : COLUMNS[fap_id] + len(values)] = values
        return row, mask

    def _tell(self, severity: Severity, code: str, message: str) -> None:
        """Report the first of each kind, with its place."""
        where = f"byte {self._bits.position >> 3}"
        self._findings.setdefault(code, Finding(severity, code, message, where))
