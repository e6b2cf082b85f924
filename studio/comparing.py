"""Cloning grids: every source onto every target, by several backends, in pictures and numbers.

After Pandzic (2001), figures 11 to 13: a row is one source on all targets, a column one target from all sources, and
where the two are the same face it is shown as it is. A source that is not among the targets stands in a column of its
own, so that every row shows what was cloned.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from cloning import clone
from cloning.surface import Surface, build_surface
from fat.evaluate import Player, Pose
from fat.face import AnimatableFace
from fat.quality import edge_stretch, fap_error, fap_values, feature_point_motion, flips, truth_error
from fba.arrays import Floats
from fba.errors import FbaError
from fba.findings import Finding
from fba.scene import Role
from formats import read_face
from studio.compared_faces import Model
from studio.comparison import Cell, Comparison, Way
from studio.render import Figure, Renderer, make_renderer
from studio.sheet import GAP, PAPER, TALL, PosePick, Sheet, UInt8

Progress = Callable[[str, float], None]

BOTH_FIT = 145
"""Width of a picture from which on both numbers fit below it, pixels."""


@dataclass(frozen=True, eq=False)
class _Actor:
    """A face ready to be posed, measured and drawn."""

    face: AnimatableFace
    player: Player
    skin: Surface
    figure: Figure

    @classmethod
    def of(cls, face: AnimatableFace) -> _Actor:
        names = [s.name for s in face.scene.with_role(Role.SKIN)]
        skin = build_surface(face.scene, face.feature_points, names, face.fapu.es0)
        return cls(face, Player(face), skin, Figure.of_face(face))

    def pose(self, pick: PosePick) -> Pose:
        return self.player.pose(pick.faps, pick.viseme, pick.expression)

    def draw(self, pose: Pose, width: int, renderer: Renderer) -> UInt8:
        size = (width, round(TALL * width))
        return self.figure.draw(pose.world_shapes(), size, self.figure.camera, renderer)


@dataclass(frozen=True, eq=False)
class _Motion:
    """One pose of one face, measured."""

    values: Mapping[int, float]
    skin: Floats
    flips: float
    stretch: float

    @classmethod
    def of(cls, actor: _Actor, pose: Pose) -> _Motion:
        face, skin = actor.face, actor.skin
        offsets = pose.mesh_offsets()
        moved = skin.join(offsets) / face.fapu.es0
        return cls(
            fap_values(feature_point_motion(face.feature_points, offsets), face.fapu),
            moved,
            flips(skin.vertices, skin.triangles, moved),
            edge_stretch(skin.vertices, skin.edges, moved),
        )


@dataclass(eq=False)
class _Row:
    label: str
    pictures: list[list[UInt8]] = field(default_factory=list)
    captions: list[list[str]] = field(default_factory=list)

    def add(self, pictures: list[UInt8], captions: list[str]) -> None:
        self.pictures.append(pictures)
        self.captions.append(captions)


def compare(
    sources: Sequence[Model],
    targets: Sequence[Model],
    picks: Sequence[PosePick],
    ways: Sequence[Way] = (Way("fit"),),
    *,
    generations: int = 1,
    cell: int = 180,
    renderer: Renderer | None = None,
    progress: Progress | None = None,
) -> Comparison:
    """Clone every source onto every target, and measure and draw the motions.

    Parameters
    ----------
    sources : a source without tables first gets the shipped source's motion by the default backend.
    picks : motions; each makes a grid of its own.
    generations : how often a clone is made: the second one is cloned back onto the source's mesh and from there onto
        the target again, and so on.
    cell : width of one picture, pixels.
    progress : called with (what is done, share done).

    Returns
    -------
    A pair of faces that cannot be cloned leaves its cell empty, a source that cannot be played has no row; findings
    say why.
    """
    comparer = _Comparer(sources, targets, picks, ways, generations, cell, renderer or make_renderer(), progress)
    for source in sources:
        try:
            comparer.add(source)
        except FbaError as error:
            comparer.findings.append(Finding("error", "left-out", f"left out as a source: {error}", source.name))
    return Comparison(tuple(comparer.cells), comparer.grids(), tuple(comparer.findings))


class _Comparer:
    def __init__(
        self,
        sources: Sequence[Model],
        targets: Sequence[Model],
        picks: Sequence[PosePick],
        ways: Sequence[Way],
        generations: int,
        cell: int,
        renderer: Renderer,
        progress: Progress | None,
    ) -> None:
        self.targets, self.picks, self.ways, self.generations = targets, picks, ways, generations
        self.width, self.renderer, self.progress = cell, renderer, progress
        self.faps = sorted({number for pick in picks for number, _ in pick.tables()})
        self.cells: list[Cell] = []
        self.rows: list[_Row] = []
        self.findings: list[Finding] = []
        self.neutral: dict[str, UInt8] = {}
        self.steps, self.done = len(sources) * (len(ways) * len(targets) * (2 * generations - 1) + 1), 0
        self.several = len(sources) > 1
        among = {target.path for target in targets}
        self.apart = [source for source in sources if source.path not in among]

    def add(self, source: Model) -> None:
        """All clones of one source: a row for each way and generation."""
        face = self._animatable(source)
        lacking = [p.caption for p in self.picks if not p.tables() <= {t.key for t in face.tables}]
        if lacking:
            text = f"the source has no tables for all of {', '.join(lacking)}, so it shows what it has"
            self.findings.append(Finding("warning", "motion-missing", text, source.name))
        actor = _Actor.of(face)
        self.neutral[source.path] = actor.draw(actor.pose(PosePick("neutral")), self.width, self.renderer)
        poses = [actor.pose(pick) for pick in self.picks]
        own = [_Motion.of(actor, pose) for pose in poses]
        itself = [actor.draw(pose, self.width, self.renderer) for pose in poses]
        for way in self.ways:
            rows = [_Row(self._label(source, way, g)) for g in range(1, self.generations + 1)]
            for row in rows if self.apart else ():
                here = source in self.apart and way == self.ways[0] and row is rows[0]
                row.add(itself if here else [self._blank()] * len(itself), ["source" if here else ""] * len(itself))
            for target in self.targets:
                if target.path == source.path:
                    for row in rows:
                        row.add(itself, ["source"] * len(itself))
                    self._tell(f"{source.name}", 2 * self.generations - 1)
                else:
                    self._clone(source, face, target, way, own, rows)
            self.rows += rows

    def _label(self, source: Model, way: Way, generation: int) -> str:
        parts = [str(way)] if len(self.ways) > 1 or way.as_published else []
        parts += [f"generation {generation}"] if self.generations > 1 else []
        return ", ".join([source.name, *parts] if self.several or not parts else parts)

    def _animatable(self, model: Model) -> AnimatableFace:
        if isinstance(model.neutral, AnimatableFace):
            self._tell(model.name, 1)
            return model.neutral
        text = "the source has no tables; it moves as a clone of the shipped source"
        self.findings.append(Finding("info", "source-cloned", text, model.name))
        face = clone(read_face("default"), model.neutral, model.points, faps=self.faps)
        self._tell(model.name, 1)
        return face

    def _clone(
        self, source: Model, face: AnimatableFace, target: Model, way: Way, own: Sequence[_Motion], rows: Sequence[_Row]
    ) -> None:
        first: list[_Motion] = []
        made = self._generations(face, target, way)
        for generation, row in enumerate(rows, start=1):
            try:
                actor = _Actor.of(next(made))
            except FbaError as error:
                where = f"{source.name} onto {target.name}, {way}"
                self.findings.append(Finding("error", "not-cloned", str(error), where))
                for rest in rows[generation - 1 :]:
                    rest.add([self._blank()] * len(self.picks), ["not cloned"] * len(self.picks))
                return
            if target.path not in self.neutral:
                self.neutral[target.path] = actor.draw(actor.pose(PosePick("neutral")), self.width, self.renderer)
            poses = [actor.pose(pick) for pick in self.picks]
            found = [_Motion.of(actor, pose) for pose in poses]
            first = first or found
            cells = [
                _cell(source, target, way, generation, *parts)
                for parts in zip(self.picks, own, found, first, strict=True)
            ]
            self.cells += cells
            row.add([actor.draw(p, self.width, self.renderer) for p in poses], [_caption(c, self.width) for c in cells])

    def _generations(self, face: AnimatableFace, target: Model, way: Way) -> Iterator[AnimatableFace]:
        """The clone on the target; then, again and again, that one's clone on the source's mesh cloned once more."""
        there = face
        for generation in range(self.generations):
            if generation:
                there = clone(there, face, backend=way.backend, as_published=way.as_published, faps=self.faps)
                self._tell(f"{target.name}, {way}", 1)
            onto, points = target.neutral, target.points_for(way)
            there = clone(there, onto, points, backend=way.backend, as_published=way.as_published, faps=self.faps)
            self._tell(f"{target.name}, {way}", 1)
            yield there

    def _tell(self, what: str, steps: int) -> None:
        self.done += steps
        if self.progress is not None:
            self.progress(what, self.done / self.steps)

    def _blank(self) -> UInt8:
        picture: UInt8 = np.full((round(TALL * self.width), self.width, 3), PAPER, dtype=np.uint8)
        return picture

    def grids(self) -> tuple[Sheet, ...]:
        """One grid for each motion."""
        shown = [*([self.apart[0]] if self.apart else []), *self.targets]
        neutral = [self.neutral.get(model.path, self._blank()) for model in shown]
        names = [model.name for model in shown]
        if len(self.apart) > 1:
            neutral[0], names[0] = self._blank(), ""
        out = []
        for k, pick in enumerate(self.picks):
            grid = Sheet(pick.caption)
            grid.add_row("at rest", neutral, names)
            for number, row in enumerate(self.rows):
                pictures = [pictures[k] for pictures in row.pictures]
                captions = [captions[k] for captions in row.captions]
                grid.add_row(row.label, pictures, captions, space_before=GAP if number else 3 * GAP)
            out.append(grid)
        return tuple(out)


def _cell(
    source: Model,
    target: Model,
    way: Way,
    generation: int,
    pick: PosePick,
    own: _Motion,
    found: _Motion,
    first: _Motion,
) -> Cell:
    error = fap_error(own.values, found.values)
    return Cell(
        source.name,
        target.name,
        way.backend,
        way.as_published,
        generation,
        pick.caption,
        error.relative,
        error.largest,
        found.flips,
        own.flips,
        found.stretch,
        own.stretch,
        truth_error(found.skin, first.skin) if generation > 1 else None,
    )


def _caption(cell: Cell, width: int) -> str:
    first = f"FP {100 * cell.fp_error:.1f} %" if cell.drift is None else f"drift {cell.drift:.2f}"
    return first if width < BOTH_FIT else f"{first}, flips {cell.flips:.1f} %"
