"""Collect every measure of a face, beside its source's, and judge it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields

from fat.conformance import FapConformance
from fat.face import AnimatableFace
from fat.fap_quality import FapQuality
from fat.held_out import misplaced, uneven
from fba.errors import LandmarkError
from fba.faps import faps
from fba.fapu import FAPU_POINTS, Fapu
from fba.scene import Role
from studio.checked_skin import CheckedSkin
from studio.fap_measuring import FapMeasurer, eye_depths
from studio.fidelity import Fidelity
from studio.measures import BY_CODE
from studio.motion_measuring import MotionMeasurer, MotionMeasures
from studio.posing import Poses
from studio.verdicts import Place, Reading, Verdict, judge, judge_motions

VAGUE = ("2.13", "2.14")
PLACED = ("2.", "3.", "4.", "5.", "8.", "9.")
"""Groups of feature points with a definite place; ears, hair, tongue and skull have none that every face shares, nor
have the corners of the jaw (VAGUE)."""
PUPILS = ("3.5", "3.6")


@dataclass(frozen=True, eq=False)
class Measured:
    """All rows of a face.

    Attributes
    ----------
    neutral : largest offset of a vertex with all FAPs 0, in eye separations.
    own : conformance of each FAP.
    rows : quality of each FAP, viseme and expression in each direction.
    motions : what is judged beside the source.
    """

    face: AnimatableFace
    neutral: float
    own: tuple[FapConformance, ...]
    rows: tuple[FapQuality, ...]
    motions: tuple[MotionMeasures, ...]


def measure(
    face: AnimatableFace,
    neutral: float,
    own: Sequence[FapConformance],
    skin: CheckedSkin | None,
    points: Collection[str] | None = None,
) -> Measured:
    """Measure a face whose tables can be played.

    Parameters
    ----------
    skin : None for a face without any.
    points : feature points on its skin by whose places it is compared with another face; None: all of them.
    """
    poses = Poses(face)
    eyes = eye_depths(skin, poses)
    by_fap = FapMeasurer(poses, skin, eyes)
    by_motion = None
    if skin is not None:
        by_motion = MotionMeasurer(poses, skin, skin.surface.points if points is None else points, eyes)
    rows: list[FapQuality] = []
    motions: list[MotionMeasures] = []
    for table in face.tables:  # Table by table, so that both read the same poses.
        rows += by_fap.rows(table)
        motions += [] if by_motion is None else by_motion.motions(table)
    return Measured(face, neutral, tuple(own), tuple(rows), tuple(motions))


def verdicts(mine: Measured, theirs: Measured | None, beside: Fidelity | None) -> tuple[Verdict, ...]:
    """Every measure that this face allows, in the order of `studio.measures`."""
    found = [judge("neutral", [Reading(mine.neutral, None if theirs is None else theirs.neutral)])]
    found += [judge("fapu", _fapu(mine.face)), judge("own-fp", _own(mine, theirs))]
    if theirs is not None:
        found.append(judge("points", _points(mine.face, theirs.face)))
    found.append(judge("point-sides", _point_sides(mine.face)))
    found += [judge(code, _rows(mine, theirs, read)) for code, read in _ROWS.items()]
    found += [] if beside is None else _fidelity(beside)
    found += judge_motions(mine.motions, None if theirs is None else theirs.motions)
    order = {code: n for n, code in enumerate(BY_CODE)}
    return tuple(sorted((v for v in found if v is not None), key=lambda v: order[v.code]))


_ROWS: dict[str, Callable[[FapQuality], float | None]] = {
    "cross-talk": lambda row: None if row.cross_talk is None else 100.0 * row.cross_talk,
    "in-eyes": lambda row: row.penetration,
    "flips-worst": lambda row: row.flips,
    "fold": lambda row: row.fold,
    "symmetry": lambda row: None if row.high_level else row.asymmetry,
    "seams": lambda row: row.parted,
    "lining": lambda row: row.through,
    "hidden-stretch": lambda row: row.stretch,
}


def _rows(mine: Measured, theirs: Measured | None, read: Callable[[FapQuality], float | None]) -> Iterator[Reading]:
    beside = {} if theirs is None else {row.key: row for row in theirs.rows}
    for row in mine.rows:
        value, other = read(row), beside.get(row.key)
        if value is None or (theirs is not None and other is None):
            continue
        point = None if read is not _ROWS["cross-talk"] or row.cross_fap is None else _own_point(row.cross_fap)
        place = Place((row.fap_id, row.select, row.value), None, point)
        yield Reading(value, None if other is None else read(other), row.where, place)


def _own_point(fap_id: int) -> str:
    return faps()[fap_id - 1].feature_points[0]


def _own(mine: Measured, theirs: Measured | None) -> Iterator[Reading]:
    beside = {} if theirs is None else {f.fap_id: f for f in theirs.own}
    for found in mine.own:
        other = beside.get(found.fap_id)
        where = f"{found.name} at {found.value:+d}"
        value, theirs_value = (None if f is None else _own_percent(f) for f in (found, other))
        yield Reading(value or 0.0, theirs_value, where, Place((found.fap_id, 1, found.value), None, found.point))


def _own_percent(found: FapConformance) -> float:
    """The error in percent; what is within one unit and a table's rounding is no error."""
    within = BY_CODE["own-fp"].good
    percent = 100.0 * found.relative_error
    return min(percent, within) if found.error_units <= 1.0 else percent


def _fapu(face: AnimatableFace) -> Iterator[Reading]:
    places = face.feature_points.positions(face.scene)
    try:
        measured = Fapu.from_feature_points({k: places[k] for k in FAPU_POINTS if k in places})
    except LandmarkError:
        return
    for unit in fields(Fapu):
        used, found = getattr(face.fapu, unit.name), getattr(measured, unit.name)
        yield Reading(100.0 * abs(used / found - 1.0), None, unit.name.upper())


def _points(face: AnimatableFace, source: AnimatableFace) -> Iterator[Reading]:
    off = misplaced(source.feature_points.positions(source.scene), face.feature_points.positions(face.scene))
    for key in _placed(face, off):
        yield Reading(off[key], 0.0, "", Place(None, None, key))


def _point_sides(face: AnimatableFace) -> Iterator[Reading]:
    off = uneven(face.feature_points.positions(face.scene))
    for key in _placed(face, off):
        yield Reading(off[key], None, "", Place(None, None, key))


def _placed(face: AnimatableFace, keys: Iterable[str]) -> Iterator[str]:
    """The points with a definite place: on a surface, and pupils only where there are eyeballs."""
    eyeballs = face.scene.with_role(Role.EYE_LEFT) and face.scene.with_role(Role.EYE_RIGHT)
    known = (k for k in keys if k.startswith(PLACED) and k not in VAGUE and face.feature_points[k].shape is not None)
    return (k for k in known if eyeballs or k not in PUPILS)


def _fidelity(beside: Fidelity) -> list[Verdict | None]:
    worst, lips = Place(beside.fp_error_worst_key), Place(beside.lip_gap_key, None, "2.2")
    blink = Place((19, 1, 1024), None, beside.lid_gap_point)
    readings = {
        "fp-error": Reading(beside.fp_error_mean, 0.0),
        "fp-error-worst": Reading(beside.fp_error_worst, 0.0, beside.fp_error_worst_motion, worst),
        "held-out": Reading(beside.held_out, 0.0, "", Place(None, None, beside.held_out_point)),
        "unasked": Reading(float(len(beside.unasked)), 0.0, ", ".join(beside.unasked[:3])),
        "lip-gap": Reading(beside.lip_gap, 0.0, beside.lip_gap_motion, lips),
        "flips": Reading(beside.flips_mean, beside.source_flips_mean),
    }
    if beside.lid_gap is not None:
        readings["lid-gap"] = Reading(beside.lid_gap, 0.0, "", blink)
    return [judge(code, [reading]) for code, reading in readings.items()]
