"""Feature points of photographs: names, contours, and the motion that one face gives another.

Points carry the numbers of MPEG-4 (ISO/IEC 14496-2), so that "left" is the subject's left; places are pixels, x to
the right, y down, (0, 0) the middle of the upper left pixel. Other names may be added: every point that all
pictures have takes part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from cloning.image.align import Similarity2D, fit_similarity_2d
from fba.arrays import Floats
from fba.errors import LandmarkError

Places = Mapping[str, tuple[float, float]]
"""Name of a point -> (x, y)."""

REQUIRED = ("3.7", "3.11", "3.8", "3.12", "8.3", "8.4", "8.1", "8.2", "2.1")
"""Corners of the eyes, four points of the lips, chin."""

RIGID = ("3.7", "3.11", "3.8", "3.12", "9.6", "9.7", "9.12", "9.15")
"""Points that hardly move with an expression: they tell how two pictures of one person lie to each other."""

Slits = tuple[tuple[tuple[str, ...], tuple[str, ...]], ...]
MOUTH: Slits = ((("2.5", "2.7", "2.2", "2.6", "2.4"), ("2.5", "2.9", "2.3", "2.8", "2.4")),)
EYES: Slits = ((("3.11", "3.1", "3.7"), ("3.11", "3.3", "3.7")), (("3.12", "3.2", "3.8"), ("3.12", "3.4", "3.8")))
"""Upper and lower rims that may touch."""

CONTOURS = (
    *(rim for slit in MOUTH + EYES for rim in slit),
    ("8.4", "8.6", "8.9", "8.1", "8.10", "8.5", "8.3"),
    ("8.4", "8.8", "8.2", "8.7", "8.3"),
    ("4.1", "4.3", "4.5"),
    ("4.2", "4.4", "4.6"),
    ("2.13", "2.11", "2.1", "2.12", "2.14"),
    ("11.3", "temple left", "outline left"),
    ("11.2", "temple right", "outline right"),
)
BETWEEN = 2
"""Points put on a contour between two neighbours: eight points of a lip become a curve."""

_T = np.arange(1, BETWEEN + 1) / (BETWEEN + 1)
CATMULL_ROM = 0.5 * np.stack(
    [-_T + 2 * _T**2 - _T**3, 2 - 5 * _T**2 + 3 * _T**3, _T + 4 * _T**2 - 3 * _T**3, _T**3 - _T**2]
)
"""(4, BETWEEN) weights of the four knots around, for each point between the middle two."""

MOVING = ("2", "3", "4", "5", "8", "9")
"""Groups of points that an expression moves; all others (hair line, outline) sit on the skull. Where they seem to
move the head has turned, and the target's shall not."""

NOT_FACE = (
    *("6.1", "6.2", "6.3", "6.4", "7.1", "7.2", "10.1", "10.2", "10.3", "10.4", "10.5", "10.6", "11.4", "11.5", "11.6"),
    *("9.8", "9.9", "9.10", "9.11", "3.5", "3.6", "2.10"),
)
"""Tongue, neck, free parts of the ears, skull and teeth, which are no face seen from the front; pupils and the boss of
the chin, which no contour ties to their surroundings."""

SAME_CAMERA = 0.03
"""Where the alignment of the source's two pictures would move no point by more than this, in eye separations, they lie
as they are: corners of the eyes and nose themselves move by up to 0.02 with the expressions of the shipped source."""


def face_points(*pictures: Places) -> list[str]:
    """Names of the points of the face that all these pictures have.

    Raises
    ------
    LandmarkError
        If one of `REQUIRED` is missing, or eyes or mouth have no width.
    """
    common = [name for name in pictures[0] if all(name in p for p in pictures)]
    missing = [name for name in REQUIRED if name not in common]
    if missing:
        raise LandmarkError(
            f"points {', '.join(missing)} are missing in one of the pictures; corners of the eyes (3.7, 3.11, 3.8, "
            "3.12), lips (8.1 to 8.4) and chin (2.1) are needed in each: fba analogy --template adds what is missing"
        )
    for places in pictures:
        if distance(places, "3.7", "3.12") < 8.0 or distance(places, "8.3", "8.4") < 4.0:
            raise LandmarkError("the eyes are less than 8 or the corners of the mouth less than 4 pixels apart")
    return [name for name in common if name not in NOT_FACE]


def distance(places: Places, one: str, other: str) -> float:
    """Pixels between two points."""
    return float(np.hypot(places[one][0] - places[other][0], places[one][1] - places[other][1]))


def eye_separation(places: Places) -> float:
    """Pixels between the middles of the eyes, from their corners."""
    return float(np.linalg.norm(_middle(places, "3.7", "3.11") - _middle(places, "3.8", "3.12")))


def from_eyes(places: Places, offsets: Sequence[tuple[float, float]]) -> Floats:
    """(n, 2) places so many eye separations to the subject's left and down the face from between the eyes."""
    eyes = _middle(places, "3.7", "3.11"), _middle(places, "3.8", "3.12")
    found: Floats = (eyes[0] + eyes[1]) / 2.0 + eye_separation(places) * np.array(offsets) @ _upright(places)
    return found


def to_array(places: Places, names: list[str]) -> Floats:
    """(n, 2) places in this order."""
    return np.array([places[name] for name in names], np.float64).reshape(-1, 2)


def moved_points(
    source: Places, expression: Places, target: Places, names: list[str]
) -> dict[str, tuple[float, float]]:
    """Where the source's motion takes the target's points.

    The expression is laid on the neutral source by the points that hardly move, the source on the target by all; what
    is left are motions in the target's pixels. As in facial animation parameters, they are scaled by what the target's
    face is like: width of the mouth, separation of mouth and nose, opening of the eye.
    """
    across = source_to_target(source, target, names)
    here, there = to_array(expression, names), to_array(source, names)
    aligned = _expression_to_source(source, expression, names).apply(here)
    if np.linalg.norm(aligned - here, axis=1).max() < SAME_CAMERA * eye_separation(source):
        aligned = here
    motions = across.turn(aligned - there)
    axis = _upright(target)
    motions[[name.partition(".")[0] not in MOVING for name in names]] = 0.0
    local = motions @ axis.T * _ratios(source, target, across.scale, names)
    places = to_array(target, names) + local @ axis
    return {name: (float(x), float(y)) for name, (x, y) in zip(names, places, strict=True)}


def _expression_to_source(source: Places, expression: Places, names: list[str]) -> Similarity2D:
    still = [name for name in RIGID if name in names]
    return fit_similarity_2d(to_array(expression, still), to_array(source, still))


def turned(source: Places, expression: Places, names: list[str]) -> float:
    """How badly rotation, scale and translation explain the points that hardly move, in eye separations (RMS)."""
    still = [name for name in RIGID if name in names]
    laid = _expression_to_source(source, expression, names).apply(to_array(expression, still))
    off = laid - to_array(source, still)
    return float(np.sqrt((off**2).sum(axis=1).mean())) / eye_separation(source)


def source_to_target(source: Places, target: Places, names: list[str]) -> Similarity2D:
    """Rotation, scale and translation from the source's to the target's picture."""
    return fit_similarity_2d(to_array(source, names), to_array(target, names))


def refined(places: Places) -> dict[str, tuple[float, float]]:
    """All points, and more on the contours between them (Catmull-Rom curves), named alike in every picture."""
    out = dict(places)
    for rim in CONTOURS:
        names = [n for n in rim if n in places]
        if len(names) < 2:
            continue
        knots = to_array(places, names)
        padded = np.concatenate([2 * knots[:1] - knots[1:2], knots, 2 * knots[-1:] - knots[-2:-1]])
        curve = sum(np.multiply.outer(weight, padded[j : len(names) - 1 + j]) for j, weight in enumerate(CATMULL_ROM))
        for i, (a, b) in enumerate(pairwise(names)):
            for k, (x, y) in enumerate(curve[:, i].tolist(), 1):
                out[between(rim, a, b, k)] = (x, y)
    return out


def between(rim: tuple[str, ...], a: str, b: str, k: int) -> str:
    """Name of the k-th point put between two neighbours on a contour."""
    return f"{rim[len(rim) // 2]}:{a}-{b}:{k}"


def rim_names(rim: tuple[str, ...], places: Places) -> list[str]:
    """All names of one refined contour, in order."""
    names = [n for n in rim if n in places]
    out = names[:1]
    for a, b in pairwise(names):
        out += [*(between(rim, a, b, k) for k in range(1, BETWEEN + 1)), b]
    return out


def _middle(places: Places, one: str, other: str) -> Floats:
    middle: Floats = (np.array(places[one], np.float64) + np.array(places[other], np.float64)) / 2.0
    return middle


def _upright(places: Places) -> Floats:
    """(2, 2) rows: along the line of the eyes, and down the face."""
    along = _middle(places, "3.7", "3.11") - _middle(places, "3.8", "3.12")
    along = along / np.linalg.norm(along)
    return np.array([along, [-along[1], along[0]]])


def _ratios(source: Places, target: Places, scale: float, names: list[str]) -> Floats:
    """(n, 2) factors of the motions along and down the face, beyond the scale of the alignment."""

    def ratio(one: str, other: str) -> float:
        if not all(n in p for n in (one, other) for p in (source, target)):
            return 1.0
        return float(np.clip(distance(target, one, other) / max(scale * distance(source, one, other), 1e-9), 0.5, 2.0))

    wide, high = ratio("8.3", "8.4"), ratio("9.15", "8.1")
    lids = {side: ratio(upper, lower) for side, upper, lower in ((1, "3.1", "3.3"), (0, "3.2", "3.4"))}
    out = np.ones((len(names), 2))
    for row, name in zip(out, names, strict=True):
        group, _, index = name.partition(".")
        if group in ("2", "8"):
            row[:] = wide, high
        elif group == "3" and name not in RIGID:
            row[1] = lids[int(index) % 2]
    return out
