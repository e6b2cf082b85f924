"""Do the feature points of a face contradict each other? In inside axes, so after `fba.orientation.orient`."""

from __future__ import annotations

from collections.abc import Mapping

from fba.arrays import Floats
from fba.errors import LandmarkError
from fba.feature_points import FeaturePoints, feature_point_definitions
from fba.findings import Finding
from fba.scene import FaceScene

LEFT_POINTS = (
    "2.4", "2.6", "2.8", "2.11", "2.13",
    "3.1", "3.3", "3.5", "3.7", "3.9", "3.11", "3.13",
    "4.1", "4.3", "4.5", "5.1", "5.3", "6.3",
    "8.3", "8.5", "8.7", "8.10", "9.1", "9.5", "9.7", "9.13",
    "10.1", "10.3", "10.5", "10.7", "10.9", "11.3",
)  # fmt: skip
"""The point of each pair that lies on the subject's left."""

_ABOVE = (
    ("3.1", "3.3"), ("3.2", "3.4"), ("3.13", "3.9"), ("3.14", "3.10"),
    ("4.3", "3.3"), ("4.4", "3.4"), ("11.1", "9.15"), ("11.4", "9.15"),
    ("3.5", "9.15"), ("3.6", "9.15"), ("9.15", "2.2"), ("9.15", "8.1"),
    ("8.1", "8.2"), ("8.1", "2.3"), ("2.2", "8.2"), ("8.2", "2.1"), ("2.3", "2.1"),
    ("10.1", "10.5"), ("10.2", "10.6"),
)  # fmt: skip
"""Upper point, lower point: true of every upright face with its mouth open or closed."""

_MORE_LEFT = (("3.7", "3.11"), ("3.8", "3.12"), ("4.5", "4.1"), ("4.2", "4.6"))
"""Within one eye or brow: the end nearer to the subject's left, the other end."""

_TOLERANCE = 0.02
"""Part of the face's size by which two points may be the wrong way round: coarse meshes let points coincide."""

_OFF_CENTRE = 0.15
"""Part of the eye separation by which a midline point may lie off the middle; the two real heads measured for
this toolkit stay below 0.001, and an uneven smile reaches about 0.1."""

_MIDLINE = ("2.1", "2.2", "2.3", "2.10", "8.1", "8.2", "9.3", "9.12", "9.15", "11.1", "11.4", "11.6")


def pairs(points: Mapping[str, object]) -> list[tuple[str, str]]:
    """(left, right) ids of every pair of which both points are given."""
    known = feature_point_definitions()
    both = [(left, known[left].counterpart) for left in LEFT_POINTS if left in points]
    return [(left, right) for left, right in both if right is not None and right in points]


def check_points(scene: FaceScene, points: FeaturePoints) -> list[Finding]:
    """Check that the points of an oriented face can belong to a face at all.

    Returns
    -------
    findings : warnings about points that are unlikely but usable.

    Raises
    ------
    LandmarkError
        If left and right or upper and lower points are exchanged; the message names them.
    """
    at = points.positions(scene)
    both = pairs(at)
    size = _size(at, both)
    swapped = [f"{a}/{b}" for a, b in both if at[a][0] - at[b][0] < -_TOLERANCE * size]
    if swapped:
        raise LandmarkError(
            f"left and right are exchanged for the feature points {', '.join(swapped)}: left means the subject's "
            "left, which is +X here; exchange each pair"
        )
    for axis, words in ((1, "above"), (0, "to the left of")):
        wrong = [f"{a} must lie {words} {b}" for a, b in contradictions(at, axis)]
        if wrong:
            raise LandmarkError(f"feature points contradict each other: {'; '.join(wrong)}; check these points")
    return _midline(at, both)


def contradictions(at: Mapping[str, Floats], axis: int) -> list[tuple[str, str]]:
    """Pairs of points of which the first must lie above (axis 1) or more to the left (axis 0), but does not."""
    size = _size(at, pairs(at))
    rows = _ABOVE if axis else _MORE_LEFT
    return [(a, b) for a, b in rows if a in at and b in at and float(at[a][axis] - at[b][axis]) < -_TOLERANCE * size]


def _size(at: Mapping[str, Floats], both: list[tuple[str, str]]) -> float:
    """The eye separation, or the widest pair where the pupils are not given."""
    if "3.5" in at and "3.6" in at:
        return abs(float(at["3.5"][0] - at["3.6"][0]))
    return max((abs(float(at[a][0] - at[b][0])) for a, b in both), default=0.0)


def _midline(at: Mapping[str, Floats], both: list[tuple[str, str]]) -> list[Finding]:
    eyes = [p for p in (("3.5", "3.6"), ("3.7", "3.12"), ("3.11", "3.8")) if p in both]
    if not eyes:
        return []
    centre = sum(float(at[a][0] + at[b][0]) for a, b in eyes) / (2 * len(eyes))
    limit = _OFF_CENTRE * _size(at, both)
    off = [i for i in _MIDLINE if i in at and abs(float(at[i][0]) - centre) > limit]
    if not off:
        return []
    return [
        Finding(
            "warning",
            "off-centre",
            f"the midline points {', '.join(off)} lie more than {_OFF_CENTRE:g} eye separations beside the middle "
            "of the eyes: the face is turned or uneven, or the points are misplaced",
            where=off[0],
        )
    ]
