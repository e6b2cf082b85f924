"""Rules for FAPs that fight when their displacements are summed.

The standard adds the displacements of all tables. Some FAPs describe almost the same skin, or two rims that meet; sums
of them double a motion or push one rim through the other. The rules lower the *values* of such FAPs before the tables
are evaluated. A low-level FAP that comes alone is never changed. docs/combining.md explains each rule.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from fat.face import AnimatableFace
from fat.response import Probe, Response, points_on_surface
from fba.arrays import Floats, Ints
from fba.errors import FapStreamError
from fba.faps import fap

RULES = ("corners", "contours", "brows", "lids", "lips")
"""All rules, in the order in which they apply."""

CORNER_PAIRS = ((6, 53), (7, 54), (12, 59), (13, 60))
"""Inner and outer lip corner: the same place on most faces."""

CONTOUR_PAIRS = ((4, 51), (8, 55), (9, 56), (5, 52), (10, 57), (11, 58))
"""Inner and outer contour of the same stretch of lip."""

MEETING_PAIRS: Mapping[str, tuple[tuple[int, int], ...]] = MappingProxyType(
    {"brows": ((37, 38),), "lids": ((19, 21), (20, 22)), "lips": ((4, 5), (8, 10), (9, 11))}
)
"""Rule -> FAPs that move two points towards each other: the inner ends of the brows, the lids of an eye, the lips."""

KEPT = MappingProxyType({"brows": 0.5, "lids": -0.02, "lips": 0.0})
"""Share of the neutral distance that stays between the two.

The skin between the brows can be squeezed to half its width before it folds (no triangle of the shipped source flips
down to .52 of the distance, some do at .28). Lips meet. Lids overlap by a hair, because their rims are curved and meet
at the feature points first: with nothing, twice as much of the eyeballs can be seen through the slits beside them.
"""

PROBE_VALUE = 100.0
"""FAP units at which the tie of a pair is measured: well inside the range of every FAP involved."""

INDEPENDENT = 0.05
"""Two FAPs are independent where each moves the other's feature point by no more than this share of its own motion:
the cross-talk that fat.quality allows."""


ROUNDING = 1e-9
"""Eye separations: rims that overlap by less than this meet."""


@dataclass(frozen=True, slots=True)
class _Ties:
    """Columns (t,) of pairs of FAPs, and how much of one's motion the other's point gets: 0..1, each (t,).

    No column is in two pairs. `below` holds for values below 0, `above` for values above.
    """

    first: Ints
    second: Ints
    below: Floats
    above: Floats


@dataclass(frozen=True, slots=True)
class _Rims:
    """Columns of two FAPs that close a gap, its probe, how far it may close, and columns (inner, outer) of contours."""

    first: int
    second: int
    probe: int
    opening: float
    contours: tuple[tuple[int, int], ...]


class Combination:
    """The rules that hold on one face: from the values of its tables to the values that they get.

    Parameters
    ----------
    face : its tables and feature points say which pairs are tied and where rims meet. A pair without tables or
        without feature points on a surface has no rule.
    rules : names out of RULES; None for all of them, empty for the standard's plain sum.

    Raises
    ------
    FapStreamError
        If a name is unknown.

    Notes
    -----
    Continuous in the values, the same for every frame, and piecewise smooth. Values of visemes and expressions are
    taken into account, and left as they are.
    """

    def __init__(self, face: AnimatableFace, rules: Collection[str] | None = None) -> None:
        self.rules = chosen_rules(rules)
        columns = _columns(face)
        tied = (
            *(CORNER_PAIRS if "corners" in self.rules else ()),
            *(CONTOUR_PAIRS if "contours" in self.rules else ()),
        )
        self._ties = _measured_ties(face, columns, [p for p in tied if p[0] in columns and p[1] in columns])
        meeting = [
            (rule, pair)
            for rule, pairs in MEETING_PAIRS.items()
            for pair in pairs
            if rule in self.rules and pair[0] in columns and pair[1] in columns
        ]
        self._rounding = ROUNDING * face.fapu.es0
        self._response = Response(face, [_closing(pair) for _, pair in meeting])
        places = points_on_surface(face).positions(face.scene)
        self._rims = []
        for number, (rule, pair) in enumerate(meeting):
            apart = -sum(float(places[key] @ direction) for key, direction in _closing(pair).items())
            outer = tuple((columns[a], columns[b]) for a, b in CONTOUR_PAIRS if a in pair and b in columns)
            opening = max(apart * (1.0 - KEPT[rule]), 0.0)
            self._rims.append(_Rims(columns[pair[0]], columns[pair[1]], number, opening, outer))

    def __call__(self, values: Floats) -> Floats:
        """Return the values (f, tables) that the tables get; the given array itself where no rule takes hold."""
        out = _share_ties(values, self._ties)
        if not self._rims:
            return out
        closing = self._response(out)
        summed = out
        for rims in self._rims:
            out = self._meet(out, summed, closing[:, rims.probe], rims)
        return out

    def _meet(self, values: Floats, summed: Floats, closing: Floats, rims: _Rims) -> Floats:
        """Lower the two FAPs of a gap where together they close it more than it is open."""
        if not np.any(closing > rims.opening):
            return values
        own = np.zeros(len(values))
        sides = []
        for column in (rims.first, rims.second):
            side = self._moved(column, summed, rims)
            own += np.maximum(side, 0.0)
            for inner, follower in rims.contours:
                if inner == column:
                    side = side + self._moved(follower, summed, rims)
            sides.append(np.maximum(side, 0.0))
        # What one rim does beyond the other stays: so one FAP alone is unchanged, and equal ones end in contact.
        limit = np.maximum(rims.opening, np.abs(sides[0] - sides[1]))
        (over,) = np.nonzero((closing > limit + self._rounding) & (own > 0.0))
        if not over.size:
            return values
        wanted = np.maximum(own[over] - (closing - limit)[over], 0.0)
        out = values.copy()
        for column, scaled in self._scaled(summed[over], wanted, rims).items():
            taken = summed[over, column] - scaled
            out[over, column] = scaled
            for inner, follower in rims.contours:
                if inner == column:
                    # The outer contour goes along, or it would roll over the inner one.
                    value = summed[over, follower]
                    same = np.where(value * taken > 0.0, np.minimum(np.abs(value), np.abs(taken)), 0.0)
                    out[over, follower] = value - np.sign(value) * same
        return out

    def _moved(self, column: int, values: Floats, rims: _Rims) -> Floats:
        """How far one table closes the gap (f,) at table values (f, tables)."""
        moved: Floats = self._response.of(column, values[:, column])[:, rims.probe]
        return moved

    def _scaled(self, values: Floats, wanted: Floats, rims: _Rims) -> dict[int, Floats]:
        """Values of the closing FAPs, scaled by one factor so that they close by `wanted` (f,) together."""
        parts = {}
        shares = [np.zeros((len(values), 1)), np.ones((len(values), 1))]
        for column in (rims.first, rims.second):
            value = values[:, column]
            value = np.where(self._response.of(column, value)[:, rims.probe] > 0.0, value, 0.0)
            parts[column] = value
            # Closing is linear between the shares at which a value passes an interval border.
            with np.errstate(divide="ignore", invalid="ignore"):
                bends = self._response.borders[column] / value[:, None]
            shares.append(np.where(np.isfinite(bends), np.clip(bends, 0.0, 1.0), 0.0))
        share = np.sort(np.concatenate(shares, axis=1), axis=1)
        closing = sum(self._response.of(c, share * v[:, None])[..., rims.probe] for c, v in parts.items())
        factor = _first_crossing(share, np.asarray(closing), wanted)
        return {c: np.where(v != 0.0, factor * v, values[:, c]) for c, v in parts.items()}


def chosen_rules(names: Collection[str] | None) -> tuple[str, ...]:
    """Return the chosen rules in the order in which they apply; None means all.

    Raises
    ------
    FapStreamError
        If a name is unknown.

    >>> chosen_rules({"lips", "corners"})
    ('corners', 'lips')
    """
    if names is None:
        return RULES
    unknown = sorted(set(names) - set(RULES))
    if unknown:
        raise FapStreamError(f"there is no combination rule '{unknown[0]}'; the rules are {', '.join(RULES)}")
    return tuple(rule for rule in RULES if rule in names)


def _columns(face: AnimatableFace) -> dict[int, int]:
    """FAP -> its column, for FAPs in rules that move vertices and whose feature point is on a surface."""
    pairs = (*CORNER_PAIRS, *CONTOUR_PAIRS, *(pair for found in MEETING_PAIRS.values() for pair in found))
    members = {number for pair in pairs for number in pair}
    points = points_on_surface(face)
    return {
        table.fap_id: column
        for column, table in enumerate(face.tables)
        if table.fap_id in members and table.meshes and fap(table.fap_id).feature_points[0] in points
    }


def _own(number: int) -> Probe:
    """A FAP's own feature point along the FAP's direction."""
    direction = fap(number).direction
    assert direction is not None  # every FAP in a rule is a translation
    return {fap(number).feature_points[0]: direction}


def _closing(pair: tuple[int, int]) -> Probe:
    """How far two points come together, each along the direction of its FAP."""
    return {**_own(pair[0]), **_own(pair[1])}


def _measured_ties(face: AnimatableFace, columns: dict[int, int], pairs: list[tuple[int, int]]) -> _Ties:
    """The pairs of which each FAP also moves the other's feature point on this face."""
    response = Response(face, [_own(number) for pair in pairs for number in pair])
    strengths = np.zeros((2, len(pairs)))
    for k, (a, b) in enumerate(pairs):
        for row, value in enumerate((-PROBE_VALUE, PROBE_VALUE)):
            first, second = (response.of(columns[n], np.array(value))[2 * k : 2 * k + 2] for n in (a, b))
            strengths[row, k] = min(_share(first[1], first[0]), _share(second[0], second[1]))
    strengths[strengths <= INDEPENDENT] = 0.0
    kept = strengths.any(axis=0)
    ids = np.array([[columns[n] for n in pair] for pair in pairs], dtype=np.int32).reshape(-1, 2)[kept]
    return _Ties(ids[:, 0], ids[:, 1], strengths[0, kept], strengths[1, kept])


def _share(other: float, own: float) -> float:
    return float(np.clip(other / own, 0.0, 1.0)) if own else 0.0


def _share_ties(values: Floats, ties: _Ties) -> Floats:
    """Scale two tied FAPs so that the point of the larger one moves by what its FAP alone asks for."""
    first, second = values[:, ties.first], values[:, ties.second]
    together = first * second > 0.0
    if not together.any():
        return values
    sizes = np.abs(first), np.abs(second)
    large, small = np.maximum(*sizes), np.minimum(*sizes)
    whole = large + np.where(first > 0.0, ties.above, ties.below) * small
    factor = np.divide(large, whole, out=np.ones_like(large), where=together)
    out = values.copy()
    out[:, ties.first] = first * factor
    out[:, ties.second] = second * factor
    return out


def _first_crossing(x: Floats, y: Floats, wanted: Floats) -> Floats:
    """For each row the smallest x (f,) at which the polyline x, y (f, m), which starts at y = 0, reaches `wanted`."""
    rows = np.arange(len(x))
    wanted = np.minimum(wanted, y[:, -1])
    end = np.argmax(y >= wanted[:, None], axis=1)
    start = np.maximum(end - 1, 0)
    rise = y[rows, end] - y[rows, start]
    share = np.divide(wanted - y[rows, start], rise, out=np.zeros(len(x)), where=rise > 0.0)
    crossing: Floats = x[rows, start] + share * (x[rows, end] - x[rows, start])
    return crossing
