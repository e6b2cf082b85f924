"""Make a source: an animatable face from its own shapes, with what they do not show constructed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Literal, TypeVar

import numpy as np

from authoring.fitting import Fitting
from authoring.from_units import UnitMaker
from authoring.high_level import HighLevel, high_level_keys
from authoring.low_level import LowLevel, Made
from authoring.names import Meaning
from authoring.open_jaw import strict
from authoring.recipes import TIED_FAPS, TIED_NOTE
from authoring.report import AuthorReport, Entry, Step
from authoring.units import ROTATIONS, FaceShapes, sort_shapes
from cloning.parts import PUPILS, eye_center
from cloning.prepare import NECESSARY, PreparedFace, prepare
from fat.build import build_tables
from fat.conformance import conformance
from fat.evaluate import Player
from fat.face import AnimatableFace
from fat.motion import FaceMotion
from fat.open_jaw import JAW, NOTE, open_jaw_mode
from fat.rig import RigTables, rig_eye, rig_head
from fat.tables import table_name
from fba.arrays import Floats
from fba.errors import LandmarkError
from fba.faps import LOW_LEVEL_FAPS, fap
from fba.fapu import FAPU_POINTS
from fba.feature_points import FeaturePoints
from fba.findings import Finding
from fba.scene import FaceScene, Role
from fba.shapes import ShapeSet

OpenJaw = Literal["practical", "strict"]
Progress = Callable[[str, float], None]
T = TypeVar("T")
K = TypeVar("K")


def author(
    scene: FaceScene,
    points: FeaturePoints | None,
    shapes: ShapeSet | Mapping[str, Mapping[str, Floats]],
    *,
    map: Mapping[str, Meaning] | None = None,
    open_jaw: OpenJaw = "practical",
    construct: bool = True,
    progress: Progress | None = None,
) -> tuple[AnimatableFace, AuthorReport]:
    """Make a face animatable from its own shapes.

    Parameters
    ----------
    scene : the neutral face.
    points : its feature points.
    shapes : morph targets in the file's own axes, units and vertex order; or name -> offsets by shape (world
        coordinates, inside axes).
    map : shape name -> meaning, before what the names themselves say; see `authoring.shape_map`.
    open_jaw : "practical": FAP 3 opens the mouth, as most players expect; "strict": it leaves the lips, as the
        standard has it.
    construct : make FAPs that no shape shows from the feature points.
    progress : called with (stage, share done).

    Returns
    -------
    face : with tables for all FAPs, visemes and expressions that could be made.
    report : what each was made from.

    Raises
    ------
    LandmarkError
        If the feature points that measure a face (FAPUs) are missing.
    MeshError
        If the shapes do not fit the face.
    """
    stages = _Stages(progress, {})
    face, findings = stages.run("neutral face", lambda: _prepared(scene, points, construct))
    found = stages.run("shapes", lambda: sort_shapes(face, shapes, map))
    fitting = Fitting(face)
    low = LowLevel(face, found, UnitMaker(fitting, found.units), construct and not findings)
    made = stages.each("FAPs", [n for n in LOW_LEVEL_FAPS if n not in ROTATIONS], low.make)
    motions = [motion for one in made.values() for motion in one.motions]
    rigged, transforms = _rig(face)
    notes = _notes(made)
    draft = _assembled(face, rigged, motions, transforms, notes)
    high = HighLevel(fitting, found, Player(draft))
    posed = stages.each("visemes and expressions", high_level_keys(), lambda key: high.make(*key))
    motions += [motion for motion, _, _ in posed.values() if motion is not None]
    done = _with_jaw(_assembled(face, rigged, motions, transforms, notes), open_jaw)
    entries = stages.run("measuring", lambda: _entries(done, made, posed, transforms))
    report = AuthorReport(
        scene.name,
        done.notes.get(NOTE, ""),
        entries,
        _used(found),
        found.ignored,
        found.unknown,
        (*face.findings, *findings, *found.findings, *(f for one in made.values() for f in one.findings)),
        stages.timings,
    )
    return done, report


@dataclass(frozen=True, eq=False)
class _Stages:
    """Times each stage and tells the caller about it."""

    progress: Progress | None
    timings: dict[str, float]

    def run(self, name: str, work: Callable[[], T]) -> T:
        return self.each(name, [0], lambda _: work())[0]

    def each(self, name: str, items: list[K], work: Callable[[K], T]) -> dict[K, T]:
        start = perf_counter()
        done = {}
        for k, item in enumerate(items):
            if self.progress is not None:
                self.progress(name, k / len(items))
            done[item] = work(item)
        if self.progress is not None:
            self.progress(name, 1.0)
        self.timings[name] = perf_counter() - start
        return done


def _prepared(
    scene: FaceScene, points: FeaturePoints | None, construct: bool
) -> tuple[PreparedFace, tuple[Finding, ...]]:
    """The face with whatever feature points it has; findings say what too few of them cost."""
    needed = ", ".join(FAPU_POINTS)
    if points is None:
        raise LandmarkError(
            f"'{scene.name}' has no feature points, and FAP values are measured with them: give at least {needed} "
            "with --landmarks POINTS.json, or as NAME.fps.json beside the file"
        )
    derived = {"3.5": ("3.1", "3.3", "3.7", "3.11"), "3.6": ("3.2", "3.4", "3.8", "3.12")}
    lacking = [k for k in FAPU_POINTS if k not in points and not all(i in points for i in derived.get(k, ("",)))]
    if lacking:
        raise LandmarkError(
            f"'{scene.name}' lacks the feature points {', '.join(lacking)}: FAP values are measured with {needed}; "
            "add them to the landmark file"
        )
    few = [k for k in NECESSARY if k not in points and k not in derived]
    if not few:
        return prepare(scene, points, "source", purpose=f"a source of '{scene.name}'"), ()
    face = prepare(scene, points, "source", FAPU_POINTS, f"a source of '{scene.name}'")
    text = (
        f"the feature points {', '.join(few)} are not given, so nothing is constructed: only what the shapes show is "
        "made"
    )
    return face, (Finding("warning", "no-constructions", text, scene.name),) if construct else ()


def _rig(face: PreparedFace) -> tuple[FaceScene, RigTables]:
    """Insert the transforms of eyes and head."""
    scene = face.scene
    tables: RigTables = {}
    for pupil, role in PUPILS.items():
        shapes = [s.name for s in scene.with_role(role)]
        if shapes:
            vertices = np.concatenate([scene.world_vertices(name) for name in shapes])
            side = "left" if role is Role.EYE_LEFT else "right"
            scene, more = rig_eye(scene, side, shapes, eye_center(vertices, face.place(pupil)))
            tables |= more
    scene, more = rig_head(scene, face.place("7.1"))
    return scene, tables | more


def _assembled(
    face: PreparedFace,
    rigged: FaceScene,
    motions: list[FaceMotion],
    transforms: RigTables,
    notes: Mapping[str, str],
) -> AnimatableFace:
    tables = build_tables(rigged, face.fapu, motions, transforms)
    return AnimatableFace(rigged, face.points, tables, face.fapu, notes)


def _notes(made: Mapping[int, Made]) -> dict[str, str]:
    tied = {table_name(n): TIED_NOTE for n in TIED_FAPS if made[n].motions and made[n].steps[-1].how != "given"}
    return {"generator": "fba author", **tied}


def _with_jaw(face: AnimatableFace, wanted: OpenJaw) -> AnimatableFace:
    """The face with the open_jaw that is wanted, and a note of what it really does."""
    if face.tables.get(JAW) is None:
        return face
    if wanted == "strict":
        return strict(face)
    mode = open_jaw_mode(face)
    return face if mode is None else replace(face, notes={**face.notes, NOTE: mode})


def _entries(
    face: AnimatableFace,
    made: Mapping[int, Made],
    posed: Mapping[tuple[int, int], tuple[FaceMotion | None, Step | None, str]],
    transforms: RigTables,
) -> tuple[Entry, ...]:
    errors = {row.fap_id: row.error_units for row in conformance(face)}
    found = []
    for (fap_id, select), (_, step, why) in posed.items():
        steps = () if step is None else (step,)
        found.append(Entry(fap_id, select, table_name(fap_id, select), steps, why, None))
    for number in LOW_LEVEL_FAPS:
        if number in made:
            one = made[number]
            found.append(Entry(number, 1, fap(number).name, one.steps, "; ".join(one.why), errors.get(number)))
            continue
        there = (number, 1) in transforms
        why = "" if there else "no eyeball was found as a mesh of its own"
        steps = (Step(0, "rigged", {}),) if there else ()
        found.append(Entry(number, 1, fap(number).name, steps, why, errors.get(number)))
    return tuple(found)


def _used(found: FaceShapes) -> dict[str, str]:
    """Shape -> what it was taken for."""
    used = {shape: unit for unit, shape in found.units.shapes.items() if shape not in found.ignored}
    for (fap_id, select), rows in found.given.items():
        used.update({row.shape: table_name(fap_id, select) for row in rows})
    return used
