"""The 14 visemes and 6 expressions as poses of units, or of the FAPs that stand in for a missing unit."""

from __future__ import annotations

from collections.abc import Mapping

from authoring.recipes import both
from fat.profiles.tables import profile_table

TONGUE_UP, TONGUE_BACK, TONGUE_DOWN = "tongueUp", "tongueBack", "tongueDown"
"""Names of the poses' own units beside ARKit's: the front of the tongue behind the upper teeth (FAPs 44 and 45), its
body at the palate, its body low (FAP 46)."""

VISEME_POSES: dict[str, dict[str, float]] = {
    "PP": {**both("mouthPress", 0.6), "mouthRollLower": 0.25, "mouthRollUpper": 0.3},
    "FF": {"mouthRollLower": 0.45, "mouthShrugUpper": 0.2, **both("mouthUpperUp", 0.5)},
    "TH": {"jawOpen": 0.17, "tongueOut": 0.35, **both("mouthUpperUp", 0.25)},
    "DD": {"jawOpen": 0.12, TONGUE_UP: 0.35, **both("mouthUpperUp", 0.3), **both("mouthLowerDown", 0.3)},
    "kk": {"jawOpen": 0.2, TONGUE_BACK: 1.0, **both("mouthUpperUp", 0.25), **both("mouthLowerDown", 0.2)},
    "CH": {"jawOpen": 0.05, "mouthFunnel": 0.75, "mouthPucker": 0.3, **both("mouthUpperUp", 0.1)},
    "SS": {"jawOpen": 0.03, **both("mouthStretch", 0.5), **both("mouthUpperUp", 0.45), **both("mouthLowerDown", 0.4)},
    "nn": {"jawOpen": 0.15, TONGUE_UP: 0.45, **both("mouthUpperUp", 0.3), **both("mouthLowerDown", 0.2)},
    "RR": {"jawOpen": 0.15, "mouthFunnel": 0.5, "mouthPucker": 0.3, TONGUE_UP: 0.3},
    "aa": {"jawOpen": 0.6, TONGUE_DOWN: 0.5, **both("mouthUpperUp", 0.25)},
    "E": {"jawOpen": 0.3, **both("mouthStretch", 0.5), **both("mouthUpperUp", 0.3), **both("mouthLowerDown", 0.15)},
    "ih": {"jawOpen": 0.16, **both("mouthStretch", 0.4), **both("mouthSmile", 0.25), **both("mouthUpperUp", 0.25)},
    "oh": {"jawOpen": 0.4, "mouthFunnel": 0.6, "mouthPucker": 0.25},
    "ou": {"jawOpen": 0.1, "mouthPucker": 0.9, "mouthFunnel": 0.35},
}

CLOSED = ("PP",)
"""Poses whose lips touch along their whole length."""

EXPRESSION_POSES: dict[str, dict[str, float]] = {
    "joy": {
        "jawOpen": 0.14,
        **both("mouthSmile", 0.95),
        **both("mouthUpperUp", 0.3),
        **both("cheekSquint", 0.8),
        **both("eyeSquint", 0.4),
    },
    "sadness": {
        "browInnerUp": 1.2,
        **both("browDown", 0.25),
        **both("mouthFrown", 0.9),
        **both("eyeBlink", 0.25),
        "mouthShrugLower": 0.4,
    },
    "anger": {
        **both("browDown", 1.2),
        **both("mouthPress", 0.7),
        **both("mouthFrown", 0.4),
        **both("eyeWide", 0.5),
        **both("eyeSquint", 0.5),
        **both("noseSneer", 0.5),
    },
    "fear": {
        "browInnerUp": 1.2,
        **both("browDown", 0.3),
        **both("browOuterUp", 0.5),
        **both("eyeWide", 0.9),
        **both("mouthStretch", 0.8),
        **both("mouthLowerDown", 0.3),
        "jawOpen": 0.15,
    },
    "disgust": {
        **both("noseSneer", 1.0),
        **both("mouthUpperUp", 0.6),
        **both("mouthFrown", 0.5),
        **both("browDown", 0.4),
        **both("eyeSquint", 0.5),
        **both("cheekSquint", 0.4),
    },
    "surprise": {"browInnerUp": 1.2, **both("browOuterUp", 1.6), **both("eyeWide", 0.9), "jawOpen": 0.45},
}


_MORE: dict[str, dict[int, float]] = {
    TONGUE_UP: {44: 450, 45: 40},
    TONGUE_BACK: {46: 350},
    TONGUE_DOWN: {46: -300},
    "tongueOut": {45: 500},
    "browInnerUpLeft": {31: 120, 33: 40},
    "browInnerUpRight": {32: 120, 34: 40},
}
"""What stands in for units that ARKit does not have or that no FAP was fitted to."""


def stand_in(unit: str) -> Mapping[int, float]:
    """FAP -> value of about the size of a unit, for faces that have no such unit; empty where there is nothing.

    >>> stand_in("jawOpen").keys()
    dict_keys([3])
    """
    fitted = {shape.name: shape.faps for shape in profile_table("arkit")}
    return fitted.get(unit) or _MORE.get(unit, {})
