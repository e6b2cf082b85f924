"""Fit a face's skin onto another face: the elastic template of Xiang et al. (2008), section 3.2.

Two schedules. `PUBLISHED` holds the paper's weights: in eye separations a pure membrane, which leaves cusps at the
landmarks, and each step's result is the next one's rest shape. `BENDING` is ruled by bending and elastic: it starts
from a spline through the landmarks and remembers that start, so that skin slides no farther than it must.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cloning.align import anchor_ids, warp_by_points
from cloning.locate import closest_on_triangles
from cloning.similarity import fit_similarity
from cloning.surface import Surface
from cloning.template.closest import Memory, TriangleSearch
from cloning.template.energies import energies
from cloning.template.landmarks import landmarks_of
from cloning.template.level import FEWEST, Level, welded
from cloning.template.solver import Solver
from cloning.visibility import visible as visible_vertices
from fba.arrays import Bools, Floats, Ints

FACING = 0.5
"""Pairs of closest points whose normals differ by more than 60 degrees do not pull."""

REACH = 0.5
"""Pairs of closest points farther apart than this do not pull, in eye separations."""

HIDDEN_REACH = 0.1
"""The same for vertices that are hidden from outside: what they belong to may be missing in the target."""

LOOSE = 1e-9
"""Weight of every vertex's own place, against closest points."""

LEAST_LANDMARKS = 4
"""With fewer the template starts where it is."""

LEAST_ANCHORS = 12
"""With fewer a spline of space would bend where nothing is known; a similarity starts the fit."""


@dataclass(frozen=True, slots=True)
class Schedule:
    """Weights of the energies from the first to the last step, for lengths in eye separations.

    Attributes
    ----------
    k_s, k_b : membrane and bending, first and last.
    k_m : landmarks; of their mean squared distance, or with `by_area` of that times the area around each.
    k_c : closest points, integrated over the skin, from the first step after the `alone` steps to the last.
    steps : solves; each finds closest points from the last one's result.
    alone : first steps without closest points: landmarks come first.
    even : weights change by the same factor from step to step, not by the same amount.
    by_area : see `k_m`.
    remembers : energies count from the start, not from the last step: the fit is elastic, it does not flow.
    fine : last steps on the whole template; those before are taken on coarser meshes of it. None = all on the whole.
    """

    k_s: tuple[float, float]
    k_b: tuple[float, float]
    k_m: tuple[float, float]
    k_c: tuple[float, float]
    steps: int
    alone: int
    even: bool
    by_area: bool
    remembers: bool
    fine: int | None = None

    def weights(self, step: int) -> tuple[float, float, float, float]:
        """k_s, k_b, k_m, k_c of one step."""
        along = step / max(self.steps - 1, 1)
        late = (step - self.alone) / max(self.steps - 1 - self.alone, 1)
        k_c = 0.0 if step < self.alone else self._between(self.k_c, late)
        return self._between(self.k_s, along), self._between(self.k_b, along), self._between(self.k_m, along), k_c

    def _between(self, ends: tuple[float, float], along: float) -> float:
        first, last = ends
        if self.even and first > 0.0:
            return float(first * (last / first) ** along)
        return first + (last - first) * along


PUBLISHED = Schedule((1.0, 1e-3), (1e-9, 1e-12), (200.0, 2000.0), (0.0, 6000.0), 10, 1, False, True, False)
"""The paper's schedule; k_m and k_c are printed as 100 to 1000 and 0 to 3000 and stand in the equation twice."""

BENDING = Schedule((0.05, 5e-4), (1e-2, 1e-4), (1e4, 1e4), (3.0, 300.0), 20, 2, True, False, True, 2)
"""Bending rules what is smaller than 2.8 eye separations; the membrane keeps the rest from drifting."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A template in the place of a target.

    Attributes
    ----------
    vertices : (n, 3) the template's vertices, in the target's space and eye separations.
    residual : (n,) distance to the triangle of the target that pulled last; inf where none did.
    valid : (n,) bool, vertices that a closest point has pulled in the last step.
    """

    vertices: Floats
    residual: Floats
    valid: Bools


def fit_template(
    template: Surface,
    target: Surface,
    landmarks: Sequence[str] | None = None,
    *,
    labels: tuple[Ints, Ints] | None = None,
    schedule: Schedule = BENDING,
    visible: Bools | None = None,
    start: Floats | None = None,
    progress: Callable[[float], None] | None = None,
) -> Fitted:
    """Deform a template so that it lies on a target.

    Parameters
    ----------
    landmarks : feature points that are drawn together; None = all that both have, () = none.
    labels : labels of lips and lids of template and target: a side is never drawn to the opposite one, and the rims
        of the lids are landmarks.
    visible : (n,) bool, template vertices that look for closest points; None = those seen from outside, and hidden
        ones in their very neighbourhood.
    start : (n, 3) where the template starts; None = where the landmarks take it.
    progress : called with the share done.
    """
    ids = anchor_ids(template, target) if landmarks is None else list(landmarks)
    mine, yours = (None, None) if labels is None else labels
    if visible is None:
        reach = np.where(visible_vertices(template), REACH, HIDDEN_REACH)
    else:
        reach = np.where(visible, REACH, 0.0)
    start = _start(template, target, ids, schedule) if start is None else start
    search = TriangleSearch(target.vertices, target.triangles, yours)
    finest = welded(template, start, landmarks_of(template, target, ids, mine), reach, mine)
    fit = _Fit(finest, search, schedule, progress)
    current, pulled, distances = fit.run()
    places = template.places
    return Fitted(current[places], distances[places], pulled[places])


def _start(template: Surface, target: Surface, ids: Sequence[str], schedule: Schedule) -> Floats:
    """The template where its landmarks say: by a similarity, and what is to be remembered by a spline of space."""
    if len(ids) < LEAST_LANDMARKS:
        return template.vertices
    if schedule.remembers and len(ids) >= LEAST_ANCHORS:
        return warp_by_points(template, target, ids)
    places, goals = (np.array([surface.positions[i] for i in ids]) for surface in (template, target))
    return fit_similarity(places, goals).apply(template.vertices)


class _Fit:
    """A fit under way."""

    def __init__(
        self, finest: Level, search: TriangleSearch, schedule: Schedule, progress: Callable[[float], None] | None
    ) -> None:
        self._search, self._schedule, self._progress = search, schedule, progress
        self._levels = [finest]
        while schedule.fine is not None and len(self._levels[-1].start) > FEWEST:
            self._levels.append(self._levels[-1].coarser())

    def run(self) -> tuple[Floats, Bools, Floats]:
        """From the coarsest mesh to the finest.

        Returns
        -------
        vertices, which of them a closest point has pulled in the last step, and their distances from the target.
        """
        schedule, done = self._schedule, 0
        current = self._levels[-1].start
        for number in reversed(range(len(self._levels))):
            level = self._levels[number]
            pull, solver = _Pull(self._search, level), Solver()
            stop = schedule.steps - (schedule.fine or 0) * number
            for step in range(done, stop):
                current = _stepped(level, current, pull, solver, schedule.weights(step), schedule)
                if self._progress is not None:
                    self._progress((step + 1) / schedule.steps)
            done = stop
            if level.finer is not None:
                current = level.finer.spread(current - level.start)
        return current, pull.pulled, pull.distances(current)


def _stepped(
    level: Level,
    current: Floats,
    pull: _Pull,
    solver: Solver,
    weights: tuple[float, float, float, float],
    schedule: Schedule,
) -> Floats:
    """One solve: (n, 3) where the vertices go."""
    from scipy.sparse import diags_array

    k_s, k_b, k_m, k_c = weights
    energy = level.energies if schedule.remembers else energies(current, level.triangles)
    rest = level.start if schedule.remembers else current
    system, areas, marks = energy.system(k_s, k_b), energy.areas, level.marks
    size = k_m * (marks.rows @ areas) if schedule.by_area else k_m / max(len(marks.goals), 1)
    more, right = marks.term(current, size)
    right = right - system @ (current - rest)
    # A part without any landmark or closest point stays where it is.
    diagonal = LOOSE * areas
    if k_c > 0.0:
        pulled, way = pull.ways(current)
        pull_size = np.where(pulled, k_c * areas, 0.0)
        diagonal, right = diagonal + pull_size, right + pull_size[:, None] * way
    return current + solver.solve(system + more + diags_array(diagonal), right)


class _Pull:
    """Where each vertex of the template is drawn to."""

    def __init__(self, search: TriangleSearch, level: Level) -> None:
        self._search, self._level, self._labels = search, level, level.labels
        self._seen = np.flatnonzero(level.reach > 0.0)
        self._reach = level.reach[self._seen]
        self._memory = Memory()
        self._last: Ints = np.full(len(level.start), -1, np.int32)
        self.pulled: Bools = np.zeros(len(level.start), bool)

    def ways(self, current: Floats) -> tuple[Bools, Floats]:
        """Which vertices are drawn, and how far, (n, 3)."""
        seen = self._seen
        normals = self._level.normals(current)[seen]
        labels = None if self._labels is None else self._labels[seen]
        found = self._search.closest(current[seen], normals, labels, FACING, self._reach, self._memory)
        self._last[seen] = found.triangles
        self.pulled = self._last >= 0
        way = np.zeros_like(current)
        way[seen] = np.where(found.triangles[:, None] >= 0, self._search.positions(found) - current[seen], 0.0)
        return self.pulled, way

    def distances(self, current: Floats) -> Floats:
        """(n,) distances to the triangles that drew last; inf where none did."""
        found = np.full(len(current), np.inf)
        some = self.pulled
        found[some] = closest_on_triangles(current[some], self._search.corners[self._last[some]])[1]
        return found
