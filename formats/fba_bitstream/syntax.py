"""What coder and decoder share: start codes, groups of FAPs, steps, ranges of symbols, models."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache

from fba.errors import FapStreamError
from fba.faps import FAP_COUNT, LOW_LEVEL_FAPS, faps
from fba.high_level import BLEND_MAX, EXPRESSIONS, VISEMES
from fba.stream import EXPRESSION_FIELDS, VISEME_FIELDS
from formats.fba_bitstream.arithmetic import AdaptiveModel, Model, UniformModel

OBJECT_START, PLANE_START, SEQUENCE_END = 0x1BA, 0x1BB, 0x1B1
OBJECT_STARTS = (OBJECT_START, 0x101)
"""The second is of old drafts; so is the second below."""
PLANE_STARTS = (PLANE_START, 0x103)

FACE = 1
"""Value of the two bits that say whether a plane is of a face (1), a body (2) or both (3)."""

NONE, HELD, INTERPOLATED, ALL = range(4)
"""Types of a group's mask: nothing is sent; some is, the rest keeps its value; ... is interpolated; all is sent."""

GROUP_STARTS = (1, 3, 19, 31, 39, 43, 48, 51, 61, 65)
GROUPS = tuple(
    range(first, behind) for first, behind in zip(GROUP_STARTS, (*GROUP_STARTS[1:], FAP_COUNT + 1), strict=True)
)

QUANTIZER_BITS = 5
RANGE_UNIT = 60
"""A range is sent in 5 bits, in these units of a FAP's own step."""
LARGEST_RANGE = 31 * RANGE_UNIT

HIGH_LEVEL: dict[int, tuple[int, ...]] = {
    1: (len(VISEMES), len(VISEMES), BLEND_MAX),
    2: (len(EXPRESSIONS), BLEND_MAX, len(EXPRESSIONS), BLEND_MAX),
}
"""FAP 1, 2 -> largest value of each coded field; BLEND_MAX marks those that are quantized."""
PLAIN_BITS = {1: 1, 2: 2}
"""FAP 1, 2 -> number of flags behind the coded fields: viseme_def; init_face and expression_def."""

_ROLL_RANGES = (1080, 420)
"""Ranges of FAP 47 that the only published decoder takes; the table of the overview says 300 and 60."""

FieldKey = tuple[int, int]
"""A FAP and the number of its field (0 for low-level FAPs)."""

COLUMNS = {1: FAP_COUNT, 2: FAP_COUNT + len(VISEME_FIELDS)}
"""Where the fields of FAP 1 and 2 begin in a frame's row of values, behind one column for each FAP."""
ROW = FAP_COUNT + len(VISEME_FIELDS) + len(EXPRESSION_FIELDS)


def column(fap_id: int, number: int) -> int:
    """Where a field stands in a frame's row of values."""
    return COLUMNS[fap_id] + number if fap_id in COLUMNS else fap_id - 1


@cache
def steps(quantizer: int) -> tuple[int, ...]:
    """Step of FAP 1 .. 68 at a scale of 0..31; the scale 0 sends values as they are."""
    return tuple(f.quantizer * quantizer if quantizer else 1 for f in faps())


def field_step(limit: int, quantizer: int) -> int:
    """Step of a high-level field: selections are never quantized."""
    return quantizer if limit == BLEND_MAX and quantizer else 1


@dataclass
class Ranges:
    """Lowest and highest level of FAP 3 .. 68, in units of the FAP's step at scale 1."""

    low: dict[int, int]
    high: dict[int, int]

    @classmethod
    def default(cls, kind: int) -> Ranges:
        """What holds before a stream says otherwise; kind 0: intra planes, 1: predicted ones."""
        high = {}
        for definition in faps()[2:]:
            limits = (definition.i_range, definition.p_range)[kind]
            widest = max(map(abs, limits)) // definition.quantizer
            if definition.name == "tongue_roll":
                widest = _ROLL_RANGES[kind]
            high[definition.id] = -(-widest // RANGE_UNIT) * RANGE_UNIT
        return cls({k: -v for k, v in high.items()}, high)

    def levels(self, fap_id: int, quantizer: int) -> tuple[int, int]:
        """Lowest and highest level at a scale; both are cut toward zero."""
        scale = quantizer or 1
        return -(-self.low[fap_id] // scale), self.high[fap_id] // scale


@dataclass
class Segment:
    """What holds from one intra plane to the next.

    quantizer : scale 0..31.
    mask : FAP numbers that are sent, ascending.
    ranges : of intra planes and of predicted ones.
    """

    quantizer: int
    mask: tuple[int, ...]
    ranges: tuple[Ranges, Ranges]
    _models: dict[FieldKey, tuple[int, Model]] = field(default_factory=dict)

    def field_range(self, fap_id: int, number: int, intra: bool) -> tuple[int, int]:
        """Lowest and highest level of a field; low-level FAPs have one."""
        if fap_id not in HIGH_LEVEL:
            return self.ranges[0 if intra else 1].levels(fap_id, self.quantizer)
        limit = HIGH_LEVEL[fap_id][number]
        if limit == BLEND_MAX and self.quantizer:
            limit = (limit + self.quantizer // 2) // self.quantizer
        return (0 if intra else -limit), limit

    def model(self, fap_id: int, number: int, intra: bool) -> tuple[int, Model]:
        """Lowest level and the model of the levels from there on; one for each field, new at every intra plane."""
        found = None if intra else self._models.get((fap_id, number))
        if found is not None:
            return found
        low, high = self.field_range(fap_id, number, intra)
        if intra or low == high:
            # A symbol that cannot be another one changes nothing in the coder, so there is nothing to learn either.
            return low, UniformModel(high - low + 1)
        return self._models.setdefault((fap_id, number), (low, AdaptiveModel(high - low + 1)))

    def runs(self) -> Iterator[tuple[int, list[FieldKey]]]:
        """The runs of one plane: FAP 1, FAP 2 (where they are masked), then all others in one, even if none is."""
        for fap_id, fields in HIGH_LEVEL.items():
            if fap_id in self.mask:
                yield fap_id, [(fap_id, k) for k in range(len(fields))]
        yield 0, [(fap_id, 0) for fap_id in self.mask if fap_id in LOW_LEVEL_FAPS]

    def step(self, fap_id: int, number: int) -> int:
        """Units of the FAP (the field) in one level."""
        if fap_id in HIGH_LEVEL:
            return field_step(HIGH_LEVEL[fap_id][number], self.quantizer)
        return steps(self.quantizer)[fap_id - 1]


def range_fields(mask: tuple[int, ...], marker: Callable[[], None]) -> Iterator[int]:
    """FAPs whose range is sent, in order; `marker` is called where a marker bit stands.

    A marker stands before the first of every four FAPs of a group, masked or not.
    """
    for group in GROUPS[1:]:
        for place, fap_id in enumerate(group):
            if place % 4 == 0:
                marker()
            if fap_id in mask:
                yield fap_id


def rounded(value: int, step: int) -> int:
    """Level nearest to a value; halves go toward zero."""
    level = (2 * abs(value) + step - 1) // (2 * step)
    return level if value >= 0 else -level


def require_number(frame: int) -> int:
    """A frame number that a stream can hold."""
    if frame >= 2**31:
        raise FapStreamError(f"the frame number {frame} is too large")
    return frame
