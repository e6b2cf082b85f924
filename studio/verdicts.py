"""Judge a face by its measures, each at its worst place and beside the source's own value there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Literal

from fba.findings import Finding
from studio.measures import BY_CODE, MEASURES, Measure
from studio.motion_measuring import MotionMeasures

Word = Literal["good", "fair", "FAIL", "not judged"]

SLACK = 0.1
"""Parts by which a value may exceed the source's own that is beyond a limit already."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a measure is worst: a motion (FAP, select, value), and a vertex of the joined skin or a feature point."""

    motion: tuple[int, int, int] | None = None
    vertex: int | None = None
    point: str | None = None


@dataclass(frozen=True, slots=True)
class Reading:
    """A measure in one motion: value, the source's value there (None without), and how much coarser the mesh is."""

    value: float
    source: float | None
    where: str = ""
    place: Place = Place()
    coarser: float = 1.0


@dataclass(frozen=True, slots=True)
class Verdict:
    """One measure of a face, judged.

    Attributes
    ----------
    value, source : in the measure's unit, at the worst place; source is None without one.
    limit : the value beyond which it fails there; None where it is not judged.
    word : "good", "fair", "FAIL", or "not judged" for what means nothing without a source.
    where : the motion, in words.
    """

    code: str
    value: float
    source: float | None
    limit: float | None
    word: Word
    where: str
    place: Place

    @property
    def measure(self) -> Measure:
        """What was measured."""
        return BY_CODE[self.code]

    @property
    def failed(self) -> bool:
        return self.word == "FAIL"

    def finding(self) -> Finding:
        """The failure in plain words; an error if it is a must."""
        measure = self.measure
        beside = "" if not self.source else f" (the source's {self.source:.3g})"
        unit = "" if measure.unit == "times" else f" {measure.unit}"
        limit = "" if self.limit is None else f", at most {self.limit:.3g}"
        text = f"{measure.title}: {self.value:.3g}{unit}{beside}{limit}"
        where = " ".join(t for t in (self.where, f"at point {self.place.point}" if self.place.point else "") if t)
        return Finding("error" if measure.must else "warning", measure.code, text, where)

    def to_dict(self) -> dict[str, object]:
        """Everything as plain data."""
        return asdict(self) | {"title": self.measure.title, "unit": self.measure.unit, "must": self.measure.must}


def judge(code: str, readings: Iterable[Reading]) -> Verdict | None:
    """The verdict on the worst of some readings; None if there are none."""
    measure = BY_CODE[code]
    given = list(readings)
    if not given:
        return None
    worst = max(given, key=lambda r: (_excess(measure, r), r.value))
    judged = measure.rule == "limit" or worst.source is not None
    limits = [_allowed(measure, worst, step) for step in (measure.good, measure.fail)]
    word: Word = "not judged"
    if judged:
        word = "good" if worst.value <= limits[0] else "fair" if worst.value <= limits[1] else "FAIL"
    where, place = (worst.where, worst.place) if worst.value > 0.0 else ("", Place())
    return Verdict(code, worst.value, worst.source, limits[1] if judged else None, word, where, place)


def _allowed(measure: Measure, reading: Reading, step: float) -> float:
    """The value up to which a reading keeps a step of a measure."""
    theirs = reading.source or 0.0
    if measure.rule == "beyond":
        return theirs + step
    if measure.rule == "times":
        coarser: float = max(reading.coarser, 1.0) ** measure.finer
        return step * max(theirs * coarser, measure.floor)
    return step if theirs <= step else theirs * (1.0 + SLACK)


def _excess(measure: Measure, reading: Reading) -> float:
    """How bad a reading is in parts of what may be; where nothing may be, the value itself."""
    if measure.rule == "beyond":
        return reading.value - (reading.source or 0.0)
    allowed = _allowed(measure, reading, measure.fail)
    return reading.value / allowed if allowed else reading.value


def judge_motions(mine: Sequence[MotionMeasures], theirs: Sequence[MotionMeasures] | None) -> Iterator[Verdict]:
    """Verdicts on what is measured motion by motion, beside the source's motions (None: there is no source)."""
    beside = None if theirs is None else {m.key: m for m in theirs}
    for code in (m.code for m in MEASURES):
        found = judge(code, _readings(code, mine, beside))
        if found is not None:
            yield found


def _readings(
    code: str, mine: Sequence[MotionMeasures], beside: Mapping[tuple[int, int, int], MotionMeasures] | None
) -> Iterator[Reading]:
    for motion in mine:
        other = None if beside is None else beside.get(motion.key)
        if beside is not None and other is None:
            continue
        coarser = motion.grain / other.grain if other is not None and other.grain > 0.0 else 1.0
        spot = motion.spots.get(code)
        if spot is not None:
            theirs = None if other is None or code not in other.spots else other.spots[code].value
            yield Reading(spot.value, theirs, motion.where, Place(motion.key, spot.vertex, spot.point), coarser)
        there = None if other is None else other.places.get(code, {})
        for name, spot in motion.places.get(code, {}).items():
            if there is None or name in there:
                theirs = None if there is None else there[name].value
                where = f"{motion.where}, {_by(name)}"
                yield Reading(spot.value, theirs, where, Place(motion.key, spot.vertex, spot.point), coarser)


def _by(place: str) -> str:
    """A place in words: feature points are numbers."""
    return f"by point {place}" if place[0].isdigit() else place
