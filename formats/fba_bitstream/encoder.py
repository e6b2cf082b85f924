"""From FAP stream to FBA bitstream."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fba.errors import FapStreamError
from fba.faps import LOW_LEVEL_FAPS
from fba.stream import FapStream
from formats.fba_bitstream.arithmetic import RunEncoder
from formats.fba_bitstream.bits import BitWriter
from formats.fba_bitstream.rates import coded_rate
from formats.fba_bitstream.syntax import (
    ALL,
    FACE,
    GROUPS,
    HELD,
    HIGH_LEVEL,
    LARGEST_RANGE,
    NONE,
    OBJECT_START,
    PLAIN_BITS,
    PLANE_START,
    QUANTIZER_BITS,
    RANGE_UNIT,
    SEQUENCE_END,
    FieldKey,
    Ranges,
    Segment,
    column,
    range_fields,
    rounded,
)

LARGEST_GAP = 100_000
"""Most frames that may be missing in one place."""


@dataclass
class _Levels:
    """One plane: is it intra, the level of every field, and what the decoder then lacks of its value."""

    intra: bool
    levels: dict[FieldKey, int]
    missing: dict[FieldKey, int]


@dataclass
class _Part:
    """Planes from one intra plane to the next."""

    mask: tuple[int, ...]
    planes: list[_Levels]


class Encoder:
    """Turns a stream into levels at one scale, and these into bits.

    Attributes
    ----------
    clipped : FAP -> largest amount by which a value was cut, in FAP units.
    rounded : FAP -> largest amount by which a value was rounded.
    """

    def __init__(self, stream: FapStream, quantizer: int) -> None:
        self.clipped: dict[int, int] = {}
        self.rounded: dict[int, int] = {}
        self._stream = stream
        self._quantizer = quantizer
        self._parts = list(self._split())

    @property
    def exact(self) -> bool:
        """The decoder gets every value as it is."""
        return not (self.clipped or self.rounded)

    def corrections(self) -> Iterator[dict[int, int]]:
        """For each frame: column of a value -> what the decoder lacks of it."""
        for part in self._parts:
            for plane in part.planes:
                yield {column(*key): amount for key, amount in plane.missing.items()}

    def _split(self) -> Iterator[_Part]:
        """Levels of all planes: intra where the mask changes, and where a change is too large but the value is not."""
        part: _Part | None = None
        last: dict[FieldKey, int] = {}
        for frame in range(len(self._stream)):
            mask = tuple((np.flatnonzero(self._stream.mask[frame]) + 1).tolist())
            wanted = self._values(frame, mask)
            intra = part is None or part.mask != mask or not self._fits(mask, wanted, last)
            if intra or part is None:
                if part is not None:
                    yield part
                part = _Part(mask, [])
                last = dict.fromkeys(wanted, 0)
            levels = self._quantize(mask, wanted, last, intra)
            missing = {key: value - last[key] for key, value in wanted.items() if value != last[key]}
            part.planes.append(_Levels(intra, levels, missing | self._flags_beyond_a_bit(frame, mask)))
        if part is not None:
            yield part

    def _values(self, frame: int, mask: tuple[int, ...]) -> dict[FieldKey, int]:
        fields = {1: self._stream.visemes[frame], 2: self._stream.expressions[frame]}
        wanted: dict[FieldKey, int] = {}
        for fap_id in mask:
            if fap_id in HIGH_LEVEL:
                wanted |= {(fap_id, k): int(fields[fap_id][k]) for k in range(len(HIGH_LEVEL[fap_id]))}
            else:
                wanted[fap_id, 0] = int(self._stream.values[frame, fap_id - 1])
        return wanted

    def _flags_beyond_a_bit(self, frame: int, mask: tuple[int, ...]) -> dict[FieldKey, int]:
        """What is lost of flags that are neither 0 nor 1."""
        fields = {1: self._stream.visemes[frame], 2: self._stream.expressions[frame]}
        lost: dict[FieldKey, int] = {}
        for fap_id in fields.keys() & set(mask):
            for number in range(len(HIGH_LEVEL[fap_id]), len(fields[fap_id])):
                flag = int(fields[fap_id][number])
                if flag not in (0, 1):
                    lost[fap_id, number] = flag - (flag & 1)
                    self.clipped[fap_id] = max(self.clipped.get(fap_id, 0), abs(lost[fap_id, number]))
        return lost

    def _widest(self, mask: tuple[int, ...]) -> Segment:
        widest = dict.fromkeys(LOW_LEVEL_FAPS, LARGEST_RANGE)
        ranges = Ranges({k: -v for k, v in widest.items()}, widest)
        return Segment(self._quantizer, mask, (ranges, ranges))

    def _fits(self, mask: tuple[int, ...], wanted: dict[FieldKey, int], last: dict[FieldKey, int]) -> bool:
        """Whether a predicted plane can tell these values, or an intra plane could not either."""
        widest = self._widest(mask)
        predicted = intra = True
        for (fap_id, number), value in wanted.items():
            step = widest.step(fap_id, number)
            for kind, origin in ((False, last[fap_id, number]), (True, 0)):
                low, high = widest.field_range(fap_id, number, kind)
                inside = low <= rounded(value - origin, step) <= high
                if kind:
                    intra &= inside
                else:
                    predicted &= inside
        return predicted or not intra

    def _quantize(
        self, mask: tuple[int, ...], wanted: dict[FieldKey, int], last: dict[FieldKey, int], intra: bool
    ) -> dict[FieldKey, int]:
        """Levels of one plane; `last` becomes what the decoder has after it."""
        widest = self._widest(mask)
        levels: dict[FieldKey, int] = {}
        for (fap_id, number), value in wanted.items():
            step = widest.step(fap_id, number)
            low, high = widest.field_range(fap_id, number, intra)
            level = rounded(value - last[fap_id, number], step)
            levels[fap_id, number] = kept = min(max(level, low), high)
            last[fap_id, number] += kept * step
            error = abs(value - last[fap_id, number])
            if error:
                told = self.rounded if kept == level else self.clipped
                told[fap_id] = max(told.get(fap_id, 0), error)
        return levels

    def encode(self) -> bytes:
        """The whole bitstream."""
        out = BitWriter()
        out.start_code(OBJECT_START)
        frame, number = 0, -1
        first = int(min(self._stream.frame_numbers[0], 0))
        for part in self._parts:
            segment = Segment(self._quantizer, part.mask, _ranges(part, self._quantizer))
            for plane in part.planes:
                if plane.intra and frame:
                    out.start_code(PLANE_START)
                following = int(self._stream.frame_numbers[frame]) - first
                self._header(out, plane.intra, following - number - 1)
                if plane.intra:
                    _intra_header(out, segment)
                self._runs(out, segment, plane, frame)
                number = following
                frame += 1
        out.start_code(SEQUENCE_END)
        return out.bytes()

    def _header(self, out: BitWriter, intra: bool, skipped: int) -> None:
        out.bit(intra)
        out.bits(FACE, 2)
        if intra:
            sixteenths, ntsc = coded_rate(self._stream.frame_rate)
            out.bit(1)
            out.bits(sixteenths >> 4, 8)
            out.bits(sixteenths & 15, 4)
            out.bit(ntsc)
            out.bit(0)
        if skipped > LARGEST_GAP:
            raise FapStreamError(f"{skipped} frames are missing in one place; at most {LARGEST_GAP} can be written")
        out.bit(skipped > 0)
        if skipped:
            for _ in range(skipped // 15):
                out.bits(15, 4)
            out.bits(skipped % 15, 4)

    def _runs(self, out: BitWriter, segment: Segment, plane: _Levels, frame: int) -> None:
        flags = {1: self._stream.visemes[frame, 3:], 2: self._stream.expressions[frame, 4:]}
        for fap_id, fields in segment.runs():
            run = RunEncoder(out)
            for key in fields:
                low, model = segment.model(*key, plane.intra)
                run.put(plane.levels[key] - low, model)
            run.finish()
            if fap_id:
                for flag in flags[fap_id][: PLAIN_BITS[fap_id]]:
                    out.bit(int(flag))


def _intra_header(out: BitWriter, segment: Segment) -> None:
    out.bits(segment.quantizer, QUANTIZER_BITS)
    for group in GROUPS:
        sent = [fap_id in segment.mask for fap_id in group]
        kind = ALL if all(sent) else HELD if any(sent) else NONE
        out.bit(1)
        out.bits(kind, 2)
        if kind == HELD:
            for flag in sent:
                out.bit(flag)
    out.bit(0)
    out.bit(0)
    out.bits(0b1111, 4)
    for ranges in segment.ranges:
        for table in (ranges.high, ranges.low):
            for fap_id in range_fields(segment.mask, lambda: out.bit(1)):
                out.bits(abs(table[fap_id]) // RANGE_UNIT, 5)


def _ranges(part: _Part, quantizer: int) -> tuple[Ranges, Ranges]:
    """The narrowest ranges that hold all levels of a part: of its intra plane, and of the others."""
    made = []
    for intra in (True, False):
        low = dict.fromkeys(LOW_LEVEL_FAPS, 0)
        high = dict.fromkeys(LOW_LEVEL_FAPS, 0)
        for plane in part.planes:
            if plane.intra == intra:
                for (fap_id, _), level in plane.levels.items():
                    if fap_id in low:
                        low[fap_id] = min(low[fap_id], level)
                        high[fap_id] = max(high[fap_id], level)
        scale = (quantizer or 1) / RANGE_UNIT
        made.append(
            Ranges(
                {k: RANGE_UNIT * int(np.floor(v * scale)) for k, v in low.items()},
                {k: RANGE_UNIT * int(np.ceil(v * scale)) for k, v in high.items()},
            )
        )
    return made[0], made[1]
