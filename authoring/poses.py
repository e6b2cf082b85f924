"""The 14 visemes and 6 expressions as poses of units, or of the FAPs that stand in for a missing unit."""

from __future__ import annotations

from collections.abc import Mapping

from authoring.recipes import both

TONGUE_UP = "tongueUp"
"""Name of a pose's own unit beside ARKit's: the front of the tongue behind the upper teeth (FAPs 44 and 45)."""

VISEME_POSES: dict[str, dict[str, float]] = {
    "PP": {**both("mouthPress", 0.6), "mouthRollLower": 0.25, "mouthRollUpper": 0.3},
    "FF": {"jawOpen": 0.06, "mouthRollLower": 1.0, "mouthShrugLower": 0.2, **both("mouthUpperUp", 0.5)},
    "TH": {"jawOpen": 0.17, "tongueOut": 0.35, **both("mouthUpperUp", 0.25)},
    "DD": {"jawOpen": 0.12, TONGUE_UP: 0.7, **both("mouthUpperUp", 0.3), **both("mouthLowerDown", 0.3)},
    "kk": {"jawOpen": 0.2, **both("mouthUpperUp", 0.25), **both("mouthLowerDown", 0.2)},
    "CH": {"jawOpen": 0.08, "mouthFunnel": 0.75, "mouthPucker": 0.3, **both("mouthUpperUp", 0.2)},
    "SS": {"jawOpen": 0.04, **both("mouthStretch", 0.5), **both("mouthUpperUp", 0.35), **both("mouthLowerDown", 0.45)},
    "nn": {"jawOpen": 0.15, TONGUE_UP: 0.9, **both("mouthUpperUp", 0.2), **both("mouthLowerDown", 0.2)},
    "RR": {"jawOpen": 0.12, "mouthFunnel": 0.45, "mouthPucker": 0.35, TONGUE_UP: 0.3},
    "aa": {"jawOpen": 0.6, **both("mouthUpperUp", 0.25)},
    "E": {"jawOpen": 0.3, **both("mouthStretch", 0.5), **both("mouthUpperUp", 0.3), **both("mouthLowerDown", 0.15)},
    "ih": {"jawOpen": 0.16, **both("mouthStretch", 0.4), **both("mouthSmile", 0.25), **both("mouthUpperUp", 0.25)},
    "oh": {"jawOpen": 0.4, "mouthFunnel": 0.65},
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


def _mirrored(stem: str, left: Mapping[int, int], right: Mapping[int, int]) -> dict[str, dict[int, int]]:
    return {f"{stem}Left": dict(left), f"{stem}Right": dict(right)}


STAND_INS: dict[str, dict[int, int]] = {
    "jawOpen": {3: 1100},
    "mouthFunnel": {16: 350, 17: 350, 51: -150, 52: -250, 4: -150, 5: -250, 53: -120, 54: -120},
    "mouthPucker": {16: 450, 17: 450, 53: -200, 54: -200},
    "mouthRollLower": {16: -250, 5: 60},
    "mouthRollUpper": {17: -250, 4: 60},
    "mouthShrugLower": {18: 120, 52: 80},
    "tongueOut": {45: 500},
    TONGUE_UP: {44: 450, 45: 40},
    **_mirrored("mouthPress", {10: 30, 8: 30}, {11: 30, 9: 30}),
    **_mirrored("mouthUpperUp", {8: -220, 55: -220, 4: -90, 51: -90}, {9: -220, 56: -220, 4: -90, 51: -90}),
    **_mirrored("mouthLowerDown", {10: -220, 57: -220, 5: -90, 52: -90}, {11: -220, 58: -220, 5: -90, 52: -90}),
    **_mirrored("mouthStretch", {53: 130, 59: -60}, {54: 130, 60: -60}),
    **_mirrored("mouthSmile", {59: 450, 53: 110, 41: 60}, {60: 450, 54: 110, 42: 60}),
    **_mirrored("mouthFrown", {59: -300}, {60: -300}),
    **_mirrored("cheekSquint", {41: 140}, {42: 140}),
    **_mirrored("eyeSquint", {21: 300}, {22: 300}),
    **_mirrored("eyeBlink", {19: 1024}, {20: 1024}),
    **_mirrored("eyeWide", {19: -350}, {20: -350}),
    **_mirrored("browInnerUp", {31: 120, 33: 40}, {32: 120, 34: 40}),
    "browInnerUp": {31: 120, 33: 40, 32: 120, 34: 40},
    **_mirrored("browOuterUp", {35: 90, 33: 90}, {36: 90, 34: 90}),
    **_mirrored("browDown", {31: -80, 33: -60, 37: 90}, {32: -80, 34: -60, 38: 90}),
    **_mirrored("noseSneer", {61: 60, 55: -90}, {62: 60, 56: -90}),
}
"""Unit -> FAP values of about its size, for faces that have no such unit."""
