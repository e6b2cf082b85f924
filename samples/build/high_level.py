"""The 14 visemes and 6 expressions as poses of ARKit units."""

from __future__ import annotations

from fat.motion import FaceMotion
from fat.tables import table_name
from fba.faps import EXPRESSION_FAP, VISEME_FAP
from fba.high_level import BLEND_MAX, EXPRESSIONS, VISEMES
from samples.build.low_level import Units
from samples.build.motions import TONGUE_UP, MotionBuilder


def _both(name: str, weight: float) -> Units:
    return {f"{name}Left": weight, f"{name}Right": weight}


VISEME_POSES: dict[str, Units] = {
    "PP": {**_both("mouthPress", 0.6), "mouthRollLower": 0.25, "mouthRollUpper": 0.3},
    "FF": {"jawOpen": 0.06, "mouthRollLower": 1.0, "mouthShrugLower": 0.2, **_both("mouthUpperUp", 0.5)},
    "TH": {"jawOpen": 0.17, "tongueOut": 0.35, **_both("mouthUpperUp", 0.25)},
    "DD": {"jawOpen": 0.12, TONGUE_UP: 0.7, **_both("mouthUpperUp", 0.3), **_both("mouthLowerDown", 0.3)},
    "kk": {"jawOpen": 0.2, **_both("mouthUpperUp", 0.25), **_both("mouthLowerDown", 0.2)},
    "CH": {"jawOpen": 0.08, "mouthFunnel": 0.75, "mouthPucker": 0.3, **_both("mouthUpperUp", 0.2)},
    "SS": {
        "jawOpen": 0.04,
        **_both("mouthStretch", 0.5),
        **_both("mouthUpperUp", 0.35),
        **_both("mouthLowerDown", 0.45),
    },
    "nn": {"jawOpen": 0.15, TONGUE_UP: 0.9, **_both("mouthUpperUp", 0.2), **_both("mouthLowerDown", 0.2)},
    "RR": {"jawOpen": 0.12, "mouthFunnel": 0.45, "mouthPucker": 0.35, TONGUE_UP: 0.3},
    "aa": {"jawOpen": 0.6, **_both("mouthUpperUp", 0.25)},
    "E": {"jawOpen": 0.3, **_both("mouthStretch", 0.5), **_both("mouthUpperUp", 0.3), **_both("mouthLowerDown", 0.15)},
    "ih": {"jawOpen": 0.16, **_both("mouthStretch", 0.4), **_both("mouthSmile", 0.25), **_both("mouthUpperUp", 0.25)},
    "oh": {"jawOpen": 0.4, "mouthFunnel": 0.65},
    "ou": {"jawOpen": 0.1, "mouthPucker": 0.9, "mouthFunnel": 0.35},
}

CLOSED = ("PP",)
"""Poses whose lips touch along their whole length."""

EXPRESSION_POSES: dict[str, Units] = {
    "joy": {
        "jawOpen": 0.14,
        **_both("mouthSmile", 0.95),
        **_both("mouthUpperUp", 0.3),
        **_both("cheekSquint", 0.8),
        **_both("eyeSquint", 0.4),
    },
    "sadness": {
        "browInnerUp": 1.2,
        **_both("browDown", 0.25),
        **_both("mouthFrown", 0.9),
        **_both("eyeBlink", 0.25),
        "mouthShrugLower": 0.4,
    },
    "anger": {
        **_both("browDown", 1.2),
        **_both("mouthPress", 0.7),
        **_both("mouthFrown", 0.4),
        **_both("eyeWide", 0.5),
        **_both("eyeSquint", 0.5),
        **_both("noseSneer", 0.5),
    },
    "fear": {
        "browInnerUp": 1.2,
        **_both("browDown", 0.3),
        **_both("browOuterUp", 0.5),
        **_both("eyeWide", 0.9),
        **_both("mouthStretch", 0.8),
        **_both("mouthLowerDown", 0.3),
        "jawOpen": 0.15,
    },
    "disgust": {
        **_both("noseSneer", 1.0),
        **_both("mouthUpperUp", 0.6),
        **_both("mouthFrown", 0.5),
        **_both("browDown", 0.4),
        **_both("eyeSquint", 0.5),
        **_both("cheekSquint", 0.4),
    },
    "surprise": {"browInnerUp": 1.2, **_both("browOuterUp", 1.6), **_both("eyeWide", 0.9), "jawOpen": 0.45},
}


def high_level_motions(builder: MotionBuilder) -> list[FaceMotion]:
    """The poses as motions of FAP 1 and FAP 2 at their full value, 63."""
    out = []
    for fap_id, entries, poses in (
        (VISEME_FAP, VISEMES, VISEME_POSES),
        (EXPRESSION_FAP, EXPRESSIONS, EXPRESSION_POSES),
    ):
        for entry in entries:
            offsets = builder.over_eyeballs(builder.pose(poses[entry.name]))
            offsets = builder.with_lips_in_contact(offsets, gaps=entry.name in CLOSED)
            out.append(FaceMotion(table_name(fap_id, entry.id), fap_id, entry.id, BLEND_MAX, offsets))
    return out
