"""The usual mistakes of players of Facial Animation Tables, made on purpose: what each makes of a stream's frames."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fat.evaluate import Player
from fat.replay import Replay, cut, with_meshes, with_tables
from fat.tables import FaceDefMesh, FaceDefTable, FaceDefTables, FaceDefTransform
from fba.arrays import Floats, Ints
from fba.faps import Unit, fap, faps
from fba.fapu import ANGLE_UNIT, FAPU_DIVISOR
from fba.high_level import BLEND_MAX
from fba.scene import Node, Transform
from fba.stream import FapStream

Play = Callable[[Replay], Floats]


@dataclass(frozen=True, slots=True)
class Mistake:
    """What a player does, what is right, and the frames that come of the mistake."""

    what: str
    right: str
    play: Play


def _meshes(change: Callable[[FaceDefMesh], FaceDefMesh]) -> Play:
    """A mistake in reading FaceDefMesh."""
    return lambda case: case.play(with_meshes(case.playing, change))


def _turns(change: Callable[[FaceDefTransform], FaceDefTransform | None]) -> Play:
    """A mistake in reading FaceDefTransform; None: it is left out."""

    def made(case: Replay) -> Floats:
        def table(t: FaceDefTable) -> FaceDefTable:
            changed = (change(d) for d in t.transforms)
            return replace(t, transforms=tuple(d for d in changed if d is not None))

        return case.play(with_tables(case.playing, table))

    return made


def _angle(definition: FaceDefTransform, factor: float) -> FaceDefTransform:
    x, y, z, theta = definition.rotation_def
    return replace(definition, rotation_def=(x, y, z, factor * theta))


def _streams(change: Callable[[FapStream], FapStream]) -> Play:
    """A mistake in reading the stream."""
    return lambda case: case.play(stream=change(case.stream))


def _columns(stream: FapStream, part: str, columns: Mapping[int, Ints]) -> FapStream:
    fields = getattr(stream, part).copy()
    for column, values in columns.items():
        fields[:, column] = values
    return replace(stream, **{part: fields})


def _clamped(mesh: FaceDefMesh) -> FaceDefMesh:
    """Flat beyond both ends."""
    borders = mesh.interval_borders
    still = np.zeros_like(mesh.displacements[:, :1])
    return replace(
        mesh,
        interval_borders=np.concatenate([borders[:1] - 1, borders, borders[-1:] + 1]),
        displacements=np.concatenate([still, mesh.displacements, still], axis=1),
    )


def _below_turned(mesh: FaceDefMesh) -> FaceDefMesh:
    """Slopes of intervals below zero taken the other way round."""
    if mesh.interval_borders.size == 2:
        return mesh
    below = mesh.interval_borders[1:] <= 0
    return replace(mesh, displacements=np.where(below[:, None], -mesh.displacements, mesh.displacements))


def _by_interval(case: Replay) -> Floats:
    """The displacements of all vertices in the first interval, then those of the second, and so on."""

    def mesh(m: FaceDefMesh) -> FaceDefMesh:
        count, intervals = m.displacements.shape[:2]
        return replace(m, displacements=m.displacements.reshape(intervals, count, 3).transpose(1, 0, 2))

    keys = {t.key for t in case.playing.tables}
    tables = FaceDefTables(tuple(t for t in case.face.tables if t.key in keys))
    return case.play(case.reduced(with_meshes(replace(case.face, tables=tables), mesh)))


def _last_slope_alone(case: Replay) -> Floats:
    """The slope of the interval that holds the value, times the whole value."""
    values = Player(case.playing, rules=()).table_values(cut(case.stream, case.rows))
    borders = [
        max((m.interval_borders for m in t.meshes), key=len, default=np.array([0, 1])) for t in case.playing.tables
    ]
    steps = np.stack([_interval(b, v) for b, v in zip(borders, values.T, strict=True)]).max(axis=0)
    out = np.empty((len(case.rows), len(case.ids), 3))
    for step in np.unique(steps):
        rows = np.flatnonzero(steps == step)

        def mesh(m: FaceDefMesh, step: int = int(step)) -> FaceDefMesh:
            last, zero = m.interval_borders.size - 2, int(np.flatnonzero(m.interval_borders == 0)[0])
            if last == 0:
                return m
            pair = [max(zero - 1 - step, 0), min(zero + step, last)]
            return replace(m, interval_borders=np.array([-1, 0, 1]), displacements=m.displacements[:, pair])

        out[rows] = case.play(with_meshes(case.playing, mesh), rows=case.rows[rows])
    return out


def _interval(borders: Ints, values: Floats) -> Ints:
    """How many intervals away from zero the one is that holds a value."""
    above = np.searchsorted(borders[(borders > 0)][:-1], values, side="right")
    below = np.searchsorted(-borders[(borders < 0)][:0:-1], -values, side="left")
    out: Ints = np.where(values > 0, above, below).astype(np.int32)
    return out


def _unit_of_all(factor: float) -> Play:
    def made(case: Replay) -> Floats:
        mine = case.face.fapu
        names = ("irisd0", "es0", "ens0", "mns0", "mw0")
        return case.play(replace(case.playing, fapu=replace(mine, **{n: factor * getattr(mine, n) for n in names})))

    return made


def _slopes(chosen: Callable[[FaceDefTable], bool], factor: float) -> Play:
    """All displacements of some tables times a factor."""

    def made(case: Replay) -> Floats:
        if not any(chosen(t) for t in case.playing.tables):
            return case.right

        def table(t: FaceDefTable) -> FaceDefTable:
            meshes = (replace(m, displacements=m.displacements * np.float32(factor)) for m in t.meshes)
            return replace(t, meshes=tuple(meshes)) if chosen(t) else t

        return case.play(with_tables(case.playing, table))

    return made


def _unit_taken_for(wanted: Unit, taken: Unit) -> Play:
    """Frames in which tables of one unit alone play are as much larger as the other unit is."""

    def made(case: Replay) -> Floats:
        plays = Player(case.playing, rules=()).table_values(cut(case.stream, case.rows)) != 0
        others = np.array([fap(t.fap_id).unit is not wanted for t in case.playing.tables])
        factor = case.face.fapu.base(taken) / case.face.fapu.base(wanted)
        alone = ~(plays & others).any(axis=1)
        scaled: Floats = case.rest + np.where(alone, factor, 1.0)[:, None, None] * (case.right - case.rest)
        return scaled

    return made


def _without_centers(case: Replay) -> Floats:
    def node(n: Node) -> Node:
        if not isinstance(n, Transform):
            return n
        return replace(n, center=(0.0, 0.0, 0.0), children=tuple(node(c) for c in n.children))

    scene = replace(case.playing.scene, roots=tuple(node(n) for n in case.playing.scene.roots))
    return case.play(replace(case.playing, scene=scene))


def _sides_swapped(stream: FapStream) -> FapStream:
    other = [(f.mirror or f.id) - 1 for f in faps()]
    return replace(stream, values=stream.values[:, other], mask=stream.mask[:, other])


def _shifted(stream: FapStream, frames: int) -> FapStream:
    rows = np.clip(np.arange(len(stream)) + frames, 0, len(stream) - 1)
    return cut(stream, rows.astype(np.int32))


def _normalised(stream: FapStream) -> FapStream:
    sums = stream.expressions[:, 1] + stream.expressions[:, 3]
    shares = np.where(sums > BLEND_MAX, BLEND_MAX / np.maximum(sums, 1), 1.0)
    scaled = {k: np.rint(stream.expressions[:, k] * shares).astype(np.int32) for k in (1, 3)}
    return _columns(stream, "expressions", scaled)


def _one_kind_alone(stream: FapStream, high: bool) -> FapStream:
    """Where FAPs 1 or 2 and low-level ones come together, one of the two kinds is left out."""
    mask = stream.mask.copy()
    both = mask[:, :2].any(axis=1) & mask[:, 2:].any(axis=1)
    mask[both, slice(2, None) if high else slice(0, 2)] = False
    return replace(stream, mask=mask)


def _high(table: FaceDefTable) -> bool:
    return fap(table.fap_id).unit is Unit.NONE


def _angular(table: FaceDefTable) -> bool:
    return fap(table.fap_id).unit is Unit.AU


_LENGTHS: Sequence[Unit] = (Unit.IRISD, Unit.ES, Unit.ENS, Unit.MNS, Unit.MW)

MISTAKES: tuple[Mistake, ...] = (
    Mistake(
        "values count with the wrong sign",
        "a positive value takes the intervals above 0",
        _streams(lambda s: replace(s, values=-s.values)),
    ),
    Mistake("left and right are swapped", "left is the subject's own left", _streams(_sides_swapped)),
    Mistake(
        "values stop at the outermost border",
        "beyond it the line of the last interval goes on",
        _meshes(_clamped),
    ),
    Mistake("FAPUs are not divided by 1024", "one FAP unit is the distance / 1024", _unit_of_all(FAPU_DIVISOR)),
    Mistake("FAPUs are divided by 1024 twice", "one FAP unit is the distance / 1024", _unit_of_all(1 / FAPU_DIVISOR)),
    *(
        Mistake(
            f"the FAPU {taken.value} is taken for {wanted.value}",
            "each FAP has the unit that the standard gives it",
            _unit_taken_for(wanted, taken),
        )
        for wanted in _LENGTHS
        for taken in _LENGTHS
        if wanted is not taken
    ),
    Mistake(
        "visemes and expressions move nothing, or hardly: a FAPU is applied to them",
        "the unit of FAPs 1 and 2 is 1, so that their slopes are lengths",
        _slopes(_high, 0.0),
    ),
    Mistake(
        "blend and intensities are divided by 63",
        "slopes of FAPs 1 and 2 count for each of the 63 steps",
        _slopes(_high, 1 / BLEND_MAX),
    ),
    Mistake(
        "the unit of angles is left out for slopes of a FAP with the unit AU",
        "their slopes are multiplied by 1e-5",
        _slopes(_angular, 1 / ANGLE_UNIT),
    ),
    Mistake(
        "the slope of the value's interval is multiplied by the whole value",
        "each interval between 0 and the value adds its own length times its own slope",
        _last_slope_alone,
    ),
    Mistake(
        "slopes of intervals below zero are multiplied by negative numbers",
        "they point to where the vertex goes as the value falls",
        _meshes(_below_turned),
    ),
    Mistake(
        "displacements are read interval by interval",
        "they are stored vertex by vertex: all intervals of one, then of the next",
        _by_interval,
    ),
    Mistake(
        "viseme_blend weighs the wrong viseme",
        "viseme_select1 has viseme_blend / 63, viseme_select2 the rest",
        _streams(lambda s: _columns(s, "visemes", {2: BLEND_MAX - s.visemes[:, 2]})),
    ),
    Mistake(
        "the second viseme is left out",
        "viseme_select2 has what viseme_blend leaves of 63",
        _streams(lambda s: _columns(s, "visemes", {1: 0 * s.visemes[:, 1]})),
    ),
    Mistake(
        "the second viseme is left out where the first is 0",
        "viseme 0 is the neutral face, and blends like the others",
        _streams(lambda s: _columns(s, "visemes", {1: np.where(s.visemes[:, 0] == 0, 0, s.visemes[:, 1])})),
    ),
    Mistake(
        "the second expression is left out",
        "expression_select2 has expression_intensity2 / 63",
        _streams(lambda s: _columns(s, "expressions", {2: 0 * s.expressions[:, 2]})),
    ),
    Mistake(
        "the second expression is left out where the first is 0",
        "each expression has its own intensity",
        _streams(lambda s: _columns(s, "expressions", {2: np.where(s.expressions[:, 0] == 0, 0, s.expressions[:, 2])})),
    ),
    Mistake(
        "two expressions are scaled until their intensities add up to 63",
        "each counts by its own intensity",
        _streams(_normalised),
    ),
    Mistake(
        "FAPs that a frame does not mask keep their last value", "they are 0 in that frame", _streams(FapStream.held)
    ),
    Mistake("frames come one too late", "frame k holds values k", _streams(lambda s: _shifted(s, -1))),
    Mistake("frames come one too early", "frame k holds values k", _streams(lambda s: _shifted(s, 1))),
    Mistake(
        "low-level FAPs are left out where a viseme or expression plays",
        "displacements of all tables add up",
        _streams(lambda s: _one_kind_alone(s, high=True)),
    ),
    Mistake(
        "visemes and expressions are left out where low-level FAPs play",
        "displacements of all tables add up",
        _streams(lambda s: _one_kind_alone(s, high=False)),
    ),
    Mistake(
        "FAPs that fight are combined by this toolkit's rules",
        "golden frames are the standard's plain sum (fba play --rules none)",
        Replay.play_combined,
    ),
    Mistake("FaceDefTransforms are not played", "they turn eyeballs and head", _turns(lambda definition: None)),
    Mistake(
        "Transforms turn the other way round",
        "a positive angle turns counter-clockwise, seen against the axis",
        _turns(lambda definition: _angle(definition, -1.0)),
    ),
    Mistake(
        "radians are taken for degrees",
        "the angle is theta times the value times 1e-5, in radians",
        _turns(lambda definition: _angle(definition, np.pi / 180)),
    ),
    Mistake(
        "angles are turned into degrees where radians are wanted",
        "the angle is theta times the value times 1e-5, in radians",
        _turns(lambda definition: _angle(definition, 180 / np.pi)),
    ),
    Mistake("Transforms turn about the origin", "they turn about their center", _without_centers),
)
"""A mistake that explains as much as another one is told if it comes first."""
