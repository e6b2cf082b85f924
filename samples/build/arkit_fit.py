"""Fit FAP values to a modelled shape, and modelled shapes to a FAP: sparse, bounded least squares."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from fat.quality import fap_error, truth_error
from fba.amplitudes import amplitudes
from fba.arrays import Bools, Floats
from fba.faps import Unit, fap
from samples.build.arkit_anatomy import OUTER_CORNER, mirror_shape, mirrored, related
from samples.build.known_shapes import COMPARED, TURNS, KnownShapes

POINTS, POINTS_BACK = 2.0, 1.0
"""How many times the skin the feature points count: they are what FAP values mean, but shapes move many of them."""
WORTH, WORTH_BACK = 0.01, 0.02
"""What a term must take off the sum of the two squared relative errors to stay: a FAP in a shape, a shape in a FAP."""
SMALL, SMALL_BACK = 0.1, 0.05
"""Terms below this are not seen and left out: a share of a FAP's normal motion, a weight of a shape."""
MOST = 3.0
"""Largest weight of a shape: what needs more, that shape does not show."""
STEPS = 3
"""Fits, each with the motions taken at the values of the one before: jaws and lids move on arcs."""
SMALL_TURN = 0.05
"""Share of an eye's larger turn below which the other one is left out."""
CLOSED = 1024.0
"""FAPs 19-22: the opening of the eye; further down the lid would run through the other one."""
UPPER_LIDS = (19, 20)

Orbit = dict[int, float]
"""FAPs that take one common value, each with its sign."""
T = TypeVar("T")


@dataclass(frozen=True)
class Term(Generic[T]):
    """One unknown: what it stands for, its lowest and highest value, and the least that is kept of it."""

    what: T
    low: float
    high: float
    least: float


@dataclass(frozen=True)
class Residual:
    """What a combination leaves over.

    fp : sum of the errors / sum of the motion, over the feature points along the axes of all FAPs, and the eyeballs.
    dense : ||D_shape - D_combination|| / ||D_shape|| over visible skin and eyeballs (the tongue where these are still).
    """

    fp: float
    dense: float


def residual(known: KnownShapes, offsets: Floats, made: Floats) -> Residual:
    """Compare a motion (N, 3) with what a combination makes of it."""
    error = fap_error(known.lengths(offsets), known.lengths(made))
    return Residual(error.relative, truth_error(made, offsets, known.judged(offsets)))


def combine(known: KnownShapes, weights: Mapping[str, float]) -> Floats:
    """(N, 3) weighted sum of a face's modelled shapes."""
    total = np.zeros_like(known.neutral)
    for name, weight in weights.items():
        total += weight * known.shapes[name]
    return total


def shape_to_faps(known: KnownShapes, name: str) -> dict[int, int]:
    """FAP values, left and right alike, that come nearest to a shape and its mirror image."""
    wanted = [known.shapes[name], known.shapes[mirror_shape(name)]]
    orbits = _orbits(name, [k for k in related(name) if k in known.moving and k not in TURNS])

    def motions(orbit: Orbit, value: float) -> list[Floats]:
        at = value if abs(value) >= 1.0 else float(amplitudes()[next(iter(orbit))].positive)
        left = {k: sign * at for k, sign in orbit.items()}
        return [known.motion(left) / at, known.motion(mirrored(left)) / at]

    leading = [next(iter(orbit)) for orbit in orbits]
    terms = [
        Term(orbit, *_limits(k), SMALL * amplitudes()[k].positive) for orbit, k in zip(orbits, leading, strict=True)
    ]
    values = _solve(known, wanted, terms, motions, WORTH, POINTS)
    found = {k: sign * v for orbit, v in zip(orbits, values, strict=True) for k, sign in orbit.items()}
    found |= _turns(known, name, wanted)
    return {k: round(v) for k, v in sorted(found.items()) if round(v)}


def fap_to_shapes(
    known: KnownShapes, number: int, value: float, table: Mapping[str, Mapping[int, float]]
) -> dict[str, int]:
    """Weights in percent of the shapes that come nearest to one FAP, and to its mirror image.

    Parameters
    ----------
    table : shape -> the FAP values that show it. A shape may stand for a FAP only where it moves that FAP's own
        point the same way. Gaze and closed eyes are taken exactly, whatever the skin around does; no lid turns an
        eyeball.
    """
    names = [n for n, faps in table.items() if faps.get(number, 0.0) * value > 0.0]
    if number not in TURNS:
        names = [n for n in names if table[n].keys().isdisjoint(TURNS)]
    if number in TURNS or (number in UPPER_LIDS and value > 0.0):
        best = max(names, key=lambda n: abs(table[n][number]), default=None)
        return {} if best is None else {best: round(100.0 * value / table[best][number])}
    wanted = [known.motion({number: value}), known.motion(mirrored({number: value}))]
    middle = mirrored({number: value}) == {number: value}
    groups = list(dict.fromkeys(tuple(sorted({n, mirror_shape(n)} if middle else {n})) for n in names))

    def motions(group: tuple[str, ...], _weight: float) -> list[Floats]:
        there = (mirror_shape(n) for n in group)
        return [combine(known, dict.fromkeys(some, 1.0)) for some in (group, there)]

    terms = [Term(group, 0.0, MOST, SMALL_BACK) for group in groups]
    weights = _solve(known, wanted, terms, motions, WORTH_BACK, POINTS_BACK)
    found = {n: round(100.0 * w) for group, w in zip(groups, weights, strict=True) for n in group}
    return {n: w for n, w in found.items() if w}


def _limits(number: int) -> tuple[float, float]:
    """Lowest and highest value of a FAP."""
    entry = fap(number)
    low, high = map(float, entry.i_range)
    if entry.unit is Unit.IRISD:
        low, high = max(low, -CLOSED), min(high, CLOSED)
    return (low if entry.bidirectional else 0.0), high


def _turns(known: KnownShapes, name: str, wanted: Sequence[Floats]) -> dict[int, float]:
    """The eyeballs' turns, mean of the shape and its mirror image."""
    here, there = known.values(wanted[0]), mirrored(known.values(wanted[1]))
    mean = {k: 0.5 * (here[k] + there[k]) for k in related(name) if k in TURNS and k in here}
    largest = max(map(abs, mean.values()), default=0.0)
    return {k: round(v, -2) for k, v in mean.items() if abs(v) > SMALL_TURN * largest}


def _orbits(name: str, numbers: Sequence[int]) -> list[Orbit]:
    """FAPs that go together: mirrored pairs in a middle shape, inner and outer corner of the lips."""
    orbits: list[Orbit] = []
    for number in numbers:
        orbit = {number: 1.0}
        if mirror_shape(name) == name:
            other = mirrored(orbit)
            if other.get(number, 1.0) != 1.0:
                continue
            orbit |= other
        orbit |= {OUTER_CORNER[k]: sign for k, sign in orbit.items() if k in OUTER_CORNER}
        if all(orbit.keys() != seen.keys() for seen in orbits):
            orbits.append(orbit)
    return orbits


def _solve(
    known: KnownShapes,
    wanted: Sequence[Floats],
    terms: Sequence[Term[T]],
    motions: Callable[[T, float], list[Floats]],
    worth: float,
    emphasis: float,
) -> Floats:
    """Value of each term (t,); 0 for terms that are not worth it.

    Parameters
    ----------
    wanted : motions (N, 3): that of one side and of its mirror image.
    motions : what a term stands for and its value -> the same two of it, for a value of 1.
    worth : what a term must take off the squared error.
    emphasis : how many times the skin the feature points count.
    """
    values = np.zeros(len(terms))
    kept = list(range(len(terms)))
    for _ in range(STEPS):
        if kept:
            columns = [motions(terms[k].what, values[k]) for k in kept]
            left, found = _thinned(_system(known, wanted, columns, [terms[k] for k in kept], emphasis), worth)
            places = [kept[k] for k in left]
            values[:] = 0.0
            values[places] = found
            kept = [k for k in places if abs(values[k]) >= terms[k].least]
    return np.where([abs(v) >= t.least for v, t in zip(values, terms, strict=True)], values, 0.0)


@dataclass(frozen=True)
class _System:
    """``matrix (r, c) @ values (c,) = goal (r,)``, reduced by QR; `rest` is what no column reaches."""

    matrix: Floats
    goal: Floats
    rest: float
    low: Floats
    high: Floats

    def solve(self, kept: Sequence[int]) -> tuple[Floats, float]:
        """Bounded values of the kept columns, and the squared error."""
        from scipy.optimize import lsq_linear

        columns = self.matrix[:, kept]
        size = np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
        found = lsq_linear(columns / size, self.goal, (self.low[kept] * size, self.high[kept] * size), method="bvls")
        return np.asarray(found.x) / size, 2.0 * float(found.cost) + self.rest


def _system(
    known: KnownShapes,
    wanted: Sequence[Floats],
    columns: Sequence[Sequence[Floats]],
    terms: Sequence[Term[T]],
    emphasis: float,
) -> _System:
    """Rows of feature points and of visible skin, each relative to the motion wanted there."""
    blocks, goals = [], []
    for place, goal in enumerate(wanted):
        skin = known.judged(goal)
        points = max(known.point_motion(goal) / emphasis, 1e-12)
        size = max(float(np.linalg.norm(goal[skin])), 1e-12)

        def rows(offsets: Floats, skin: Bools = skin, points: float = points, size: float = size) -> Floats:
            lengths = known.lengths(offsets)
            seen = np.array([lengths.get(k, 0.0) for k in COMPARED]) / points
            return np.concatenate([seen, offsets[skin].ravel() / size])

        blocks.append(np.stack([rows(column[place]) for column in columns], axis=1))
        goals.append(rows(goal))
    share = 1.0 / np.sqrt(len(wanted))
    basis, matrix = np.linalg.qr(share * np.concatenate(blocks))
    aim = share * np.concatenate(goals)
    goal = basis.T @ aim
    low, high = (np.array([getattr(t, side) for t in terms]) for side in ("low", "high"))
    return _System(matrix, goal, float(aim @ aim - goal @ goal), low, high)


def _thinned(system: _System, worth: float) -> tuple[list[int], Floats]:
    """Leave out one column after the other while the error grows by less than `worth`; what is left, and its values."""
    left = list(range(len(system.low)))
    values, error = system.solve(left)
    while left:
        trials = []
        for out in left:
            rest = [k for k in left if k != out]
            trials.append((system.solve(rest)[1] if rest else float(system.goal @ system.goal) + system.rest, out))
        best, out = min(trials)
        if best - error > worth:
            break
        left.remove(out)
        if not left:
            return [], np.zeros(0)
        values, error = system.solve(left)
    return left, values
