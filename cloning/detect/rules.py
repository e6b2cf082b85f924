"""Feature points by their definitions: edges of lips and lids, ends of the slits, points of the profile, eyeballs.

Every rule is tried on the source first, where the points are known: what it is off there, it is taken to be off on
every face. So the standard's words ("corner", "lowest point") mean on a target what they mean on the source.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cloning.detect.slices import Slicer, deepest
from cloning.surface import Surface
from fba.arrays import Floats

MARGIN = 0.05
"""How far from the guessed edge of a lip or lid the search starts, in eye separations: on the lip or lid itself."""

FARTHEST = 0.16
"""An edge farther than this from the guess is another one (a crease, the teeth), in eye separations."""

STEP = 0.008
"""Distance of the slices in which an opening is followed, in eye separations: 2 % of an eye's width."""

NEAR = 0.05
"""An edge is at most this much higher or lower than in the slice before, in eye separations."""

OPEN = 0.03
"""Lids nearer to each other than this, in eye separations, are closed: their edges are no opening. Lips may touch."""

GAP = 2
"""Slices without an opening that are passed over: a lid or lip may touch the other one."""

CORNER = 0.3
"""A corner farther from the guess than this is the end of something else, in eye separations."""


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
    "2.1": Extreme(-0.87, 0.5, 0.2, 0.3),
}
"""Tip of the nose: most forward. Chin: lowest, leaning forward by 30 degrees, since below the chin the
skin runs on nearly level to the neck."""

WINGS = (("9.1", 1.0), ("9.2", -1.0))
"""Borders of the nostrils, and their side."""

WING_SLICES = 0.12
"""How far above and below the guess the crease behind a nose wing is sought, in eye separations."""

CREASE = 0.03
"""A crease is at least this deep, in eye separations; measured 0.06 to 0.10."""

FOLD = 0.01
"""Depth of the fold under the lip from which on it tells where the chin begins, in eye separations; beards fill it."""

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
    found.update(_wings(skin, {**guess, **found}))
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
        depth = float(np.interp(height, heights, depths))
        if np.isfinite(depth):
            found[key] = np.array([middle, height, depth])
    if "9.3" in found:
        # The corner between nose and upper lip.
        heights = np.linspace(float(guess["8.1"][1]), float(found["9.3"][1]), 100)
        depths = cut.profile(heights)
        if not np.isnan(depths).any():
            best, _ = deepest(heights, depths)
            found["9.15"] = np.array([middle, heights[best], depths[best]])
    # The chin boss is half way between the fold under the lip and the chin: a receding chin has no foremost place.
    heights = np.linspace(float(found.get("2.1", guess["2.1"])[1]), float(guess["8.2"][1]), 200)
    depths = cut.profile(heights)
    fold, behind = deepest(heights, depths) if not np.isnan(depths).any() else (0, 0.0)
    if behind > FOLD:
        height = 0.5 * float(heights[fold] + heights[0])
        found["2.10"] = np.array([middle, height, float(np.interp(height, heights, depths))])
    return found


def _wings(skin: Surface, guess: Mapping[str, Floats]) -> dict[str, Floats]:
    """The borders of the nostrils: in the crease between nose wing and cheek, as high as the guess."""
    found = {}
    for key, side in WINGS:
        place = guess[key]
        slicer = Slicer(skin, place - 0.5, place + 0.5, axis=1)
        # From the wing's side, past the nostril, to the cheek.
        across = side * np.linspace(0.6 * side * place[0], side * place[0] + 0.2, 120)
        depths = [slicer.at(place[1] + up).profile(across) for up in np.linspace(-WING_SLICES, WING_SLICES, 13)]
        creases = [
            (depth, best) for best, depth in (deepest(side * across, z) for z in depths if not np.isnan(z).any())
        ]
        if not creases or max(creases)[0] < CREASE:
            continue
        x = float(across[max(creases)[1]])
        z = float(slicer.at(float(place[1])).profile(np.array([x]))[0])
        if np.isfinite(z):
            found[key] = np.array([x, place[1], z])
    return found


def _opening(skin: Surface, guess: Mapping[str, Floats], opening: Opening) -> dict[str, Floats]:
    """Edges and corners of one opening; nothing where it is grown together."""
    ids = [opening.left, opening.right, opening.upper, opening.lower]
    places = np.array([guess[i] for i in ids])
    slicer = Slicer(skin, places.min(axis=0) - 0.5, places.max(axis=0) + 0.5)
    middle = float(guess[opening.upper][0])
    start = _edges(slicer, middle, float(guess[opening.upper][1]), float(guess[opening.lower][1]), FARTHEST)
    if start is None or (not opening.quarters and start[0][1] - start[1][1] < OPEN):
        return {}
    ways = [_followed(slicer, start, float(guess[corner][0]) - middle) for corner in (opening.left, opening.right)]
    found: dict[str, Floats] = {}
    for corner, way in zip((opening.left, opening.right), ways, strict=True):
        end = _end(way)
        if abs(float(end[0] - guess[corner][0])) < CORNER:
            found[corner] = end
    whole = [*reversed(ways[1]), *ways[0][1:]]
    if not opening.quarters:
        # The middle of a lid is half way between its corners.
        middle = 0.5 * float(whole[0][0][0] + whole[-1][0][0])
    found[opening.upper], found[opening.lower] = _at(whole, middle)
    for corner, quarter in zip((opening.left, opening.right), opening.quarters, strict=False):
        if corner in found:
            found.update(zip(quarter, _at(whole, 0.5 * (middle + float(found[corner][0]))), strict=True))
    return found


Pair = tuple[Floats, Floats]
"""Places on the upper and on the lower edge, (3,) each."""


def _edges(slicer: Slicer, x: float, above: float, below: float, farthest: float) -> Pair | None:
    """The edges of an opening in the slice at x, near two heights; None where there is none."""
    cut = slicer.at(x)
    top = cut.edge(above + MARGIN, True, below - FARTHEST)
    bottom = cut.edge(below - MARGIN, False, above + FARTHEST)
    if top is None or bottom is None or max(abs(top[0] - above), abs(bottom[0] - below)) > farthest:
        return None
    return np.array([x, *top]), np.array([x, *bottom])


def _followed(slicer: Slicer, start: Pair, way: float) -> list[Pair]:
    """Follow an opening from its middle to one side, slice by slice, as long as it is there."""
    found = [start]
    closed = 0
    for x in float(start[0][0]) + np.sign(way) * np.arange(STEP, 2.0 * abs(way), STEP):
        pair = _edges(slicer, float(x), float(found[-1][0][1]), float(found[-1][1][1]), NEAR)
        closed = closed + 1 if pair is None else 0
        if closed > GAP:
            break
        if pair is not None:
            found.append(pair)
    return found


def _end(way: list[Pair]) -> Floats:
    """The corner: the middle of the last two edges, as far in front as the one in front."""
    upper, lower = way[-1]
    end: Floats = 0.5 * (upper + lower)
    end[2] = max(float(upper[2]), float(lower[2]))
    return end


def _at(whole: list[Pair], x: float) -> Pair:
    """The edges at one x, between slices."""
    upper, lower = np.array([u for u, _ in whole]), np.array([p for _, p in whole])
    order = np.argsort(upper[:, 0])
    places = [np.array([x, *(np.interp(x, edge[order, 0], edge[order, k]) for k in (1, 2))]) for edge in (upper, lower)]
    return places[0], places[1]
