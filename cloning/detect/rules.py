"""Feature points by their definitions: edges of lips and lids, ends of the slits, points of the profile, eyeballs.

Every rule is tried on the source first, where the points are known: what it is off there, it is taken to be off on
every face. So the standard's words ("corner", "lowest point") mean on a target what they mean on the source.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from cloning.detect.slices import Slicer
from cloning.surface import Surface
from fba.arrays import Floats

MARGIN = 0.05
"""How far from the guessed edge of a lip or lid the search starts, in eye separations: on the lip or lid itself."""

FARTHEST = 0.16
"""An edge farther than this from the guess is another one (a crease, the teeth), in eye separations."""

STEP = 0.008
"""Distance of the slices between which a corner is sought, in eye separations: 2 % of an eye's width."""

Line = Callable[[float], float]


@dataclass(frozen=True, slots=True)
class Opening:
    """Feature points of the mouth or of one eye: corners (subject's left, right), upper and lower edge.

    Attributes
    ----------
    quarters : points on the upper and on the lower edge half way to the left and to the right corner.
    """

    left: str
    right: str
    upper: str
    lower: str
    quarters: tuple[tuple[str, str], ...] = ()


MOUTH = Opening("2.4", "2.5", "2.2", "2.3", (("2.6", "2.8"), ("2.7", "2.9")))
LEFT_EYE = Opening("3.7", "3.11", "3.1", "3.3")
RIGHT_EYE = Opening("3.12", "3.8", "3.2", "3.4")
OPENINGS = (MOUTH, LEFT_EYE, RIGHT_EYE)


@dataclass(frozen=True, slots=True)
class Extreme:
    """A point of the profile that lies farthest in one direction.

    Attributes
    ----------
    up, ahead : the direction.
    above, below : how far from the guess it is sought, in eye separations.
    """

    up: float
    ahead: float
    above: float
    below: float


EXTREMES = {
    "9.3": Extreme(0.0, 1.0, 0.25, 0.2),
    "2.10": Extreme(0.0, 1.0, 0.15, 0.15),
    "2.1": Extreme(-0.87, 0.5, 0.2, 0.3),
}
"""Tip of the nose and chin boss: most forward. Chin: lowest, leaning forward by 30 degrees, since below the chin the
skin runs on nearly level to the neck."""

FLAT = 0.01
"""A profile is flat over the heights at which it lies this little behind its extreme point, in eye separations."""

GUESSED = 0.05
"""How far off a guess is, in eye separations, when it is weighed against an extreme point of a flat profile."""


def by_rule(skin: Surface, guess: Mapping[str, Floats]) -> dict[str, Floats]:
    """The feature points that can be told by their definition, (3,) each.

    Parameters
    ----------
    guess : where the points are about, in the head's space.
    """
    found: dict[str, Floats] = {}
    for opening in OPENINGS:
        found.update(_opening(skin, guess, opening))
    found.update(_profile(skin, guess))
    return found


def _profile(skin: Surface, guess: Mapping[str, Floats]) -> dict[str, Floats]:
    """Nose tip, nose base and chin on the slice through the middle."""
    middle = float(guess["9.3"][0])
    cut = Slicer(skin, guess["2.1"] - 1.0, guess["9.3"] + 1.0).at(middle)
    found: dict[str, Floats] = {}
    for key, extreme in EXTREMES.items():
        near = float(guess[key][1])
        heights = np.linspace(near - extreme.below, near + extreme.above, 200)
        depths = cut.profile(heights)
        along = extreme.up * heights + extreme.ahead * depths
        if np.isnan(along).all():
            continue
        best = int(np.nanargmax(along))
        if best in (0, len(heights) - 1):
            continue
        flat = heights[along > along[best] - FLAT]
        doubt = 0.5 * float(np.ptp(flat))
        share = GUESSED**2 / (GUESSED**2 + doubt**2)
        height = share * heights[best] + (1.0 - share) * near
        found[key] = np.array([middle, height, np.interp(height, heights, depths)])
    if "9.3" in found:
        # The corner between nose and upper lip: farthest behind the line from the lip to the tip.
        heights = np.linspace(float(guess["8.1"][1]), float(found["9.3"][1]), 100)
        depths = cut.profile(heights)
        if not np.isnan(depths).any():
            way = np.array([heights[-1] - heights[0], depths[-1] - depths[0]])
            behind = (depths - depths[0]) * way[0] - (heights - heights[0]) * way[1]
            best = int(np.argmin(behind))
            found["9.15"] = np.array([middle, heights[best], depths[best]])
    return found


def _opening(skin: Surface, guess: Mapping[str, Floats], opening: Opening) -> dict[str, Floats]:
    """Edges and corners of one opening; nothing where it is grown together."""
    ids = [opening.left, opening.right, opening.upper, opening.lower]
    ids += [i for pair in opening.quarters for i in pair]
    places = np.array([guess[i] for i in ids])
    slicer = Slicer(skin, places.min(axis=0) - 0.4, places.max(axis=0) + 0.4)
    upper, lower = _edges(guess, opening)

    def edges(x: float) -> tuple[Floats, Floats] | None:
        cut = slicer.at(x)
        above, below = upper(x), lower(x)
        top = cut.edge(above + MARGIN, True, below - FARTHEST)
        bottom = cut.edge(below - MARGIN, False, above + FARTHEST)
        if top is None or bottom is None:
            return None
        if abs(top[0] - above) > FARTHEST or abs(bottom[0] - below) > FARTHEST:
            return None
        return np.array([x, *top]), np.array([x, *bottom])

    middle = float(guess[opening.upper][0])
    pair = edges(middle)
    if pair is None:
        return {}
    found = {opening.upper: pair[0], opening.lower: pair[1]}
    for corner, quarter in zip((opening.left, opening.right), opening.quarters or ((), ()), strict=True):
        end = _corner(edges, middle, float(guess[corner][0]))
        if end is None:
            continue
        found[corner] = end
        if quarter and (pair := edges(0.5 * (middle + float(end[0])))) is not None:
            found.update(zip(quarter, pair, strict=True))
    return found


def _corner(edges: Callable[[float], tuple[Floats, Floats] | None], middle: float, guess: float) -> Floats | None:
    """Where the opening ends: the last slice that shows it, from the middle outwards."""
    way = guess - middle
    last = None
    closed = 0
    for share in np.arange(0.6, 1.4, STEP / max(abs(way), STEP)):
        pair = edges(middle + float(share) * way)
        if pair is not None:
            # The edge in front: the other one may already lie inside.
            last, closed = 0.5 * (pair[0] + pair[1]), 0
            last[2] = max(float(pair[0][2]), float(pair[1][2]))
        elif last is not None:
            closed += 1
            if closed > 2:
                break
    if last is None or abs(float(last[0]) - guess) > FARTHEST:
        return None
    return last


def _edges(guess: Mapping[str, Floats], opening: Opening) -> tuple[Line, Line]:
    """Heights of the guessed edges over x."""
    lines = []
    for k, middle in enumerate((opening.upper, opening.lower)):
        ids = [opening.right, middle, opening.left]
        if opening.quarters:
            left, right = opening.quarters
            ids = [opening.right, right[k], middle, left[k], opening.left]
        knots = np.array(sorted(tuple(guess[i][:2]) for i in ids))
        lines.append(_line(knots, curved=not opening.quarters))
    return lines[0], lines[1]


def _line(knots: Floats, curved: bool) -> Line:
    """Height over x through knots (k, 2): straight between them, or the parabola through three."""
    if not curved:
        return lambda x: float(np.interp(x, knots[:, 0], knots[:, 1]))
    curve = np.polynomial.Polynomial.fit(knots[:, 0], knots[:, 1], 2)
    low, high = knots[0, 0], knots[-1, 0]
    return lambda x: float(curve(np.clip(x, low, high)))
