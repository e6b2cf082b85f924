"""Fit a face's skin onto another face: the elastic template of Xiang et al. (2008), section 3.2.

Two schedules. `PUBLISHED` holds the paper's weights: in eye separations a pure membrane, which leaves cusps at the
landmarks, and each step's result is the next one's rest shape. `BENDING` is ruled by bending and elastic: it starts
from a spline through the landmarks and remembers that start, so that skin slides no farther than it must.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cloning.align import anchor_ids, warp_by_points
from cloning.locate import Places
from cloning.similarity import fit_similarity
from cloning.surface import Surface
from cloning.template.closest import TriangleSearch
from cloning.template.energies import elastic
from cloning.template.landmarks import landmarks_of
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

BENDING = Schedule((0.05, 5e-4), (1e-2, 1e-4), (1e4, 1e4), (3.0, 300.0), 14, 2, True, False, True)
"""Bending rules what is smaller than 2.8 eye separations; the membrane keeps the rest from drifting."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A template in the place of a target.

    Attributes
    ----------
    vertices : (n, 3) the template's vertices, in the target's space and eye separations.
    residual : (n,) distance to the target's skin; inf where nothing there fits.
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
    from scipy.sparse import diags_array

    ids = anchor_ids(template, target) if landmarks is None else list(landmarks)
    mine, yours = (None, None) if labels is None else labels
    mesh = _Welded(template)
    marks = landmarks_of(template, target, ids, mine)
    marks = replace(marks, rows=marks.rows @ mesh.spread)
    if visible is None:
        reach = np.where(visible_vertices(template), REACH, HIDDEN_REACH)
    else:
        reach = np.where(visible, REACH, 0.0)
    search = TriangleSearch(target.vertices, target.triangles, yours)
    pull = _Pull(search, mesh.triangles, mesh.pick(reach), None if mine is None else mesh.pick(mine))
    current = mesh.pick(_start(template, target, ids, schedule) if start is None else start)
    rest, even = current, np.full(len(marks.goals), 1.0 / max(len(marks.goals), 1))
    pulled = np.zeros(len(current), bool)
    for step in range(schedule.steps):
        k_s, k_b, k_m, k_c = schedule.weights(step)
        rest = rest if schedule.remembers else current
        system, areas = elastic(rest, mesh.triangles, k_s, k_b)
        more, right = marks.term(current, k_m * (marks.rows @ areas if schedule.by_area else even))
        right = right - system @ (current - rest)
        if k_c > 0.0:
            pulled, way = pull.ways(current)
            size = np.where(pulled, k_c * areas, 0.0)
            more, right = more + diags_array(size), right + size[:, None] * way
        # A part without any landmark or closest point stays where it is.
        held = system + more + diags_array(LOOSE * areas)
        current = current + _solve(held, right)
        if progress is not None:
            progress((step + 1) / schedule.steps)
    places = pull.places(current)
    return Fitted(mesh.spread @ current, mesh.expand(places.distances), mesh.expand(pulled))


def _start(template: Surface, target: Surface, ids: Sequence[str], schedule: Schedule) -> Floats:
    """The template where its landmarks say: by a similarity, and what is to be remembers by a spline of space."""
    if len(ids) < LEAST_LANDMARKS:
        return template.vertices
    if schedule.remembers and len(ids) >= LEAST_ANCHORS:
        return warp_by_points(template, target, ids)
    places, goals = (np.array([surface.positions[i] for i in ids]) for surface in (template, target))
    return fit_similarity(places, goals).apply(template.vertices)


class _Welded:
    """A surface whose seams are closed: one vertex for all that lie at one place of a seam."""

    def __init__(self, surface: Surface) -> None:
        from scipy.sparse import coo_array, csr_array
        from scipy.sparse.csgraph import connected_components

        n = surface.vertex_count
        pairs = coo_array((np.ones(len(surface.links)), (surface.links[:, 0], surface.links[:, 1])), shape=(n, n))
        count, self.group = connected_components(pairs, directed=False)
        self.first = np.unique(self.group, return_index=True)[1]
        self.triangles: Ints = self.group[surface.triangles]
        self.spread: Any = csr_array((np.ones(n), (np.arange(n), self.group)), shape=(n, count))

    def pick(self, values: Any) -> Any:
        """One value for each welded vertex, from (n, ...)."""
        return values[self.first]

    def expand(self, values: Any) -> Any:
        """(n, ...) values, from one for each welded vertex."""
        return values[self.group]


class _Pull:
    """Where each vertex of the template is drawn to."""

    def __init__(self, search: TriangleSearch, triangles: Ints, reach: Floats, labels: Ints | None) -> None:
        self._search, self._triangles, self._labels = search, triangles, labels
        self._seen = np.flatnonzero(reach > 0.0)
        self._reach = reach[self._seen]
        self._last: Ints | None = None

    def places(self, current: Floats) -> Places:
        """The closest points on the target of all vertices that look for one."""
        n = len(current)
        normals = vertex_normals(current, self._triangles)[self._seen]
        labels = None if self._labels is None else self._labels[self._seen]
        found = self._search.closest(current[self._seen], normals, labels, FACING, self._reach, self._last)
        self._last = found.triangles.copy()
        every = Places(np.full(n, -1, np.int32), np.zeros((n, 3)), np.full(n, np.inf), np.full(n, -1.0))
        every.triangles[self._seen], every.weights[self._seen] = found.triangles, found.weights
        every.distances[self._seen], every.facing[self._seen] = found.distances, found.facing
        return every

    def ways(self, current: Floats) -> tuple[Bools, Floats]:
        """Which vertices are drawn, and how far, (n, 3)."""
        places = self.places(current)
        found = places.triangles >= 0
        return found, np.where(found[:, None], self._search.positions(places) - current, 0.0)


def _solve(system: Any, right: Floats) -> Floats:
    """Solve a symmetric positive definite system for (n, 3) right sides.

    Finding the order of elimination costs less than a tenth of the factorisation, so it is not kept between steps.
    """
    from scipy.sparse.linalg import splu

    lu = splu(system.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    solved: Floats = lu.solve(np.asfortranarray(right))
    return solved


def vertex_normals(vertices: Floats, triangles: Ints) -> Floats:
    """(n, 3) unit normals, triangles counted by area."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    normals = np.stack(
        [np.bincount(triangles.ravel(), np.repeat(cross[:, axis], 3), len(vertices)) for axis in range(3)], axis=1
    )
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    unit: Floats = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
    return unit
