"""Make a face animatable: clone every motion of a source onto it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import TypeVar

import numpy as np

from cloning.backends import DEFAULT_BACKEND, find_backend
from cloning.parts import PUPILS, eye_center
from cloning.prepare import PreparedFace, prepare
from cloning.report import CloneReport
from cloning.source import source_motions, turning_keys
from cloning.target import target_points
from cloning.transfer import FaceTransfer, build_face_transfer
from fat.build import build_tables
from fat.compact import compact
from fat.face import AnimatableFace
from fat.motion import FaceMotion
from fat.rig import EYE_FAPS, HEAD_FAPS, rig_eye, rig_head
from fat.tables import FaceDefTables, FaceDefTransform
from fba.arrays import Floats
from fba.errors import CloningError
from fba.fapu import Fapu
from fba.feature_points import FeaturePoints
from fba.findings import Finding
from fba.orientation import to_file_order
from fba.scene import FaceScene, Role
from fba.shapes import ShapeSet

Progress = Callable[[str, float], None]
Key = tuple[int, int]
T = TypeVar("T")

EYEBALL_FAPS = {Role.EYE_LEFT: (27, 29), Role.EYE_RIGHT: (28, 30)}
"""Thrust and pupil of each eye; gaze is a transform of the eyeball."""

STILL = 1e-4
"""Vertices that never move farther than this, in eye separations (six thousandths of a millimetre), are left out ..."""

ROUNDING = 1e-5
"""... and written numbers are this exact at the outermost border of a table."""


@dataclass(frozen=True, eq=False)
class _Stages:
    """Times each stage and tells the caller about it."""

    progress: Progress | None
    timings: dict[str, float]

    def run(self, name: str, work: Callable[[], T]) -> T:
        if self.progress is not None:
            self.progress(name, 0.0)
        start = perf_counter()
        done = work()
        self.timings[name] = self.timings.get(name, 0.0) + perf_counter() - start
        if self.progress is not None:
            self.progress(name, 1.0)
        return done


def clone(
    source: FaceScene | AnimatableFace,
    onto: FaceScene | AnimatableFace,
    landmarks: FeaturePoints | None = None,
    *,
    backend: str = DEFAULT_BACKEND,
    as_published: bool = False,
    faps: Collection[int] | None = None,
    exact: bool = False,
    progress: Progress | None = None,
) -> AnimatableFace:
    """Clone every motion of a source onto a face.

    See `clone_with_report`.
    """
    return clone_with_report(
        source, onto, landmarks, backend=backend, as_published=as_published, faps=faps, exact=exact, progress=progress
    )[0]


def clone_with_report(
    source: FaceScene | AnimatableFace,
    onto: FaceScene | AnimatableFace,
    landmarks: FeaturePoints | None = None,
    *,
    backend: str = DEFAULT_BACKEND,
    as_published: bool = False,
    faps: Collection[int] | None = None,
    exact: bool = False,
    progress: Progress | None = None,
) -> tuple[AnimatableFace, CloneReport]:
    """Clone every motion of a source onto a face, and say what was done.

    Parameters
    ----------
    source : a face with Facial Animation Tables (what `formats.read` returns for one).
    onto : the target; its vertices, their order, polygons and materials stay as they are.
    landmarks : feature points of the target; None uses those that `onto` carries, or detects them.
    backend : name of a registered backend.
    as_published : run the paper's own method instead of the repaired default. The result of vertex tents is then the
        target's shape in the source's topology.
    faps : FAP numbers to clone, 1 (visemes) and 2 (expressions) among them; None = all.
    exact : keep every border, vertex and digit; otherwise the tables are without what nobody sees (`fat.compact`),
        and a third as large. Published mode is always exact.
    progress : called with (stage, share done).

    Returns
    -------
    face : the target with tables of its own.
    report : measures, findings and timings.

    Raises
    ------
    LandmarkError
        If feature points are missing.
    CloningError
        If the backend is not known, or the source has no tables or no motion of these FAPs.
    """
    source = _with_tables(source)
    way = find_backend(backend)
    stages = _Stages(progress, {})
    mine, yours, transfer = _build(
        source.scene, source.feature_points, onto, landmarks, way.name, as_published, stages, recast=as_published
    )
    wanted = None if faps is None else frozenset(faps)
    motions, turning = _read_source(source, mine.scene, wanted)
    idle = _without_eyeballs(yours.scene)
    motions = [m for m in motions if m.fap_id not in idle]
    cloned = _carry_motions(transfer, motions, stages)
    rigged, transforms, said = _rig(yours, turning, wanted, as_published)
    whole = exact or as_published
    tables = stages.run("tables", lambda: _tables(rigged, yours.fapu, cloned, transforms, whole, source.scene.name))
    how = way.name + (" as published" if as_published else "")
    notes = {**source.notes, "backend": how, "source": source.scene.name}
    face = AnimatableFace(rigged, yours.points, tables, yours.fapu, notes)
    return face, _report(transfer, way.name, as_published, len(motions), stages, said)


def clone_shapes(
    source: FaceScene,
    source_points: FeaturePoints,
    shapes: ShapeSet,
    onto: FaceScene | AnimatableFace,
    landmarks: FeaturePoints | None = None,
    *,
    backend: str = DEFAULT_BACKEND,
    as_published: bool = False,
    progress: Progress | None = None,
) -> tuple[ShapeSet, CloneReport]:
    """Clone free expressions: any named morph targets, as they are; they always fit the target's own vertices.

    Parameters
    ----------
    shapes : morph targets of the source in its file's own axes, units and vertex order.

    Returns
    -------
    shapes : the same names on the target, in the target's file's own axes, units and vertex order.
    report : measures, findings and timings.
    """
    way = find_backend(backend)
    stages = _Stages(progress, {})
    if shapes.neutral.shape[0] != source.vertex_count:
        raise CloningError(
            f"the morph targets have {shapes.neutral.shape[0]} vertices, but the source '{source.name}' has "
            f"{source.vertex_count}; they must be of the same file"
        )
    mine, yours, transfer = _build(source, source_points, onto, landmarks, way.name, as_published, stages)
    motions = [mine.scene.scatter(mine.scene.frame.from_file(delta)) for delta in shapes.deltas]
    offsets = _carry(transfer, motions, stages)
    rest = {s.name: np.zeros((s.mesh.vertex_count, 3)) for s in yours.scene.shapes}
    deltas = np.stack([to_file_order(yours.scene, yours.scene.gather({**rest, **o})) for o in offsets])
    neutral = to_file_order(yours.scene, yours.scene.world_neutral())
    return ShapeSet(shapes.names, neutral, deltas), _report(transfer, way.name, as_published, len(motions), stages, [])


def _build(
    source: FaceScene,
    source_points: FeaturePoints,
    onto: FaceScene | AnimatableFace,
    landmarks: FeaturePoints | None,
    backend: str,
    as_published: bool,
    stages: _Stages,
    recast: bool = False,
) -> tuple[PreparedFace, PreparedFace, FaceTransfer]:
    """Prepare both faces and what carries motion; a recast target is what the paper makes of the one given."""
    mine = stages.run("source", lambda: prepare(source, source_points, "source"))
    way = find_backend(backend)
    detector = way.detector if as_published else "auto"
    scene, points, found = stages.run("landmarks", lambda: target_points(mine, onto, landmarks, detector))
    yours = stages.run("target", lambda: prepare(scene, points, "target"))
    yours = replace(yours, findings=(*found, *yours.findings))
    if recast:
        yours, skin = stages.run("correspondence", lambda: way.build_published(mine, yours))
    else:
        skin = stages.run("correspondence", lambda: way.build(mine, yours, as_published))
    transfer = stages.run("parts", lambda: build_face_transfer(mine, yours, skin, as_published))
    return mine, yours, transfer


def _with_tables(source: FaceScene | AnimatableFace) -> AnimatableFace:
    if isinstance(source, AnimatableFace):
        return source
    raise CloningError(
        f"the source '{getattr(source, 'name', source)}' holds no Facial Animation Tables, so it has no motion to "
        "clone; clone_shapes carries its morph targets"
    )


def _read_source(
    source: AnimatableFace, prepared: FaceScene, wanted: frozenset[int] | None
) -> tuple[list[FaceMotion], frozenset[Key]]:
    """Motions of the source, in terms of the shapes and axes that it has after preparation.

    Raises
    ------
    CloningError
        If there is none.
    """
    motions, turning = source_motions(source, wanted), turning_keys(source)
    if not motions and not turning:
        raise CloningError(
            f"the source '{source.scene.name}' holds no motion" + (" of these FAPs" if wanted else "") + " to clone"
        )
    same = np.array_equal(source.scene.frame.axes, prepared.frame.axes)
    if not same or [s.name for s in source.scene.shapes] != [s.name for s in prepared.shapes]:
        motions = [replace(m, offsets=_reshaped(m.offsets, source.scene, prepared)) for m in motions]
    return motions, turning


def _reshaped(offsets: Mapping[str, Floats], old: FaceScene, new: FaceScene) -> dict[str, Floats]:
    rest = {s.name: np.zeros((s.mesh.vertex_count, 3)) for s in old.shapes}
    joined = new.frame.from_file(old.frame.to_file(old.gather({**rest, **offsets})))
    return {name: part for name, part in new.scatter(joined).items() if np.any(part)}


def _carry(transfer: FaceTransfer, motions: Sequence[Mapping[str, Floats]], stages: _Stages) -> list[dict[str, Floats]]:
    start = perf_counter()
    progress = stages.progress
    tick = None if progress is None else (lambda share: progress("motion", share))
    offsets = transfer.apply(motions, tick)
    stages.timings["motion"] = perf_counter() - start
    return offsets


def _carry_motions(transfer: FaceTransfer, motions: Sequence[FaceMotion], stages: _Stages) -> list[FaceMotion]:
    """The motions that move something on the target."""
    offsets = _carry(transfer, [m.offsets for m in motions], stages)
    return [replace(m, offsets=o) for m, o in zip(motions, offsets, strict=True) if o]


def _rig(
    target: PreparedFace, turning: frozenset[Key], wanted: frozenset[int] | None, as_published: bool
) -> tuple[FaceScene, dict[Key, Sequence[FaceDefTransform]], list[Finding]]:
    """Insert the transforms of eyes and head; in published mode only where the source has them."""
    scene = target.scene
    tables: dict[Key, Sequence[FaceDefTransform]] = {}
    findings: list[Finding] = []

    def asked(numbers: Sequence[int]) -> bool:
        return any(wanted is None or n in wanted for n in numbers)

    for pupil, role in PUPILS.items():
        side = "left" if role is Role.EYE_LEFT else "right"
        numbers = [n for _, n in EYE_FAPS[side]]
        shapes = [s.name for s in scene.with_role(role)]
        if not shapes or not asked(numbers):
            continue
        if as_published and not any((n, 1) in turning for n in numbers):
            findings.append(_no_node(f"the source's {side} eye", numbers, scene.name))
            continue
        vertices = np.concatenate([scene.world_vertices(name) for name in shapes])
        scene, more = rig_eye(scene, side, shapes, eye_center(vertices, target.place(pupil)))
        tables.update(more)
    numbers = [n for _, n in HEAD_FAPS]
    if asked(numbers):
        if as_published and not any((n, 1) in turning for n in numbers):
            findings.append(_no_node("the source's head", numbers, scene.name))
        else:
            scene, more = rig_head(scene, target.place("7.2" if as_published else "7.1"))
            tables.update(more)
    kept = {key: value for key, value in tables.items() if wanted is None or key[0] in wanted}
    return scene, kept, findings


def _tables(
    scene: FaceScene,
    fapu: Fapu,
    motions: Sequence[FaceMotion],
    transforms: Mapping[Key, Sequence[FaceDefTransform]],
    exact: bool,
    source: str,
) -> FaceDefTables:
    left_out = {} if exact else {"threshold": STILL}
    tables = build_tables(scene, fapu, motions, transforms, **left_out)
    if not len(tables):
        raise CloningError(f"the source '{source}' holds no motion of these FAPs that '{scene.name}' can take")
    return tables if exact else compact(tables, fapu, rounding=ROUNDING)


def _without_eyeballs(scene: FaceScene) -> frozenset[int]:
    """FAPs of eyeballs (thrust, pupils) that the face does not have: lids alone would press on nothing."""
    return frozenset(fap for role, faps in EYEBALL_FAPS.items() if not scene.with_role(role) for fap in faps)


def _no_node(what: str, numbers: Sequence[int], where: str) -> Finding:
    listed = ", ".join(map(str, numbers))
    return Finding("warning", "no-transform", f"{what} has no transform that moves; FAPs {listed} are left out", where)


def _report(
    transfer: FaceTransfer,
    backend: str,
    as_published: bool,
    count: int,
    stages: _Stages,
    said: Sequence[Finding],
) -> CloneReport:
    source, target = transfer.source, transfer.target
    about_source = tuple(f for f in source.findings if not f.code.startswith("no-"))
    return CloneReport(
        backend,
        as_published,
        source.scene.name,
        target.scene.name,
        count,
        {**transfer.skin.measures, **transfer.tally.measures()},
        dict(transfer.skin.parameters),
        (*about_source, *target.findings, *transfer.findings, *transfer.inexact(), *said),
        dict(stages.timings),
        target.parts.rows,
    )
