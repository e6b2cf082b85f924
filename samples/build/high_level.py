"""The 14 visemes and 6 expressions as poses of ARKit units."""

from __future__ import annotations

from fat.motion import FaceMotion
from fat.tables import table_name
from fba.faps import EXPRESSION_FAP, VISEME_FAP
from fba.high_level import BLEND_MAX, EXPRESSIONS, VISEMES
from samples.build.low_level import Units
from samples.build.motions import MotionBuilder


def _both(name: str, weight: float) -> Units:
    return {f"{name}Left": weight, f"{name}Right": weight}


VISEME_POSES: dict[str, Units] = {
    "PP": {**_both("mouthPress", 0.6), "mouthRollLower": 0.25, "mouthRollUpper": 0.25},
    "FF": {"jawOpen": 0.05, "mouthRollLower": 0.9, "mouthShrugLower": 0.3, **_both("mouthUpperUp", 0.35)},
    "TH": {"jawOpen": 0.17, "tongueOut": 0.35, **_both("mouthUpperUp", 0.15)},
    "DD": {"jawOpen": 0.12, "tongueOut": 0.1, **_both("mouthUpperUp", 0.2), **_both("mouthLowerDown", 0.3)},
    "kk": {"jawOpen": 0.2, **_both("mouthUpperUp", 0.15), **_both("mouthLowerDown", 0.2)},
    "CH": {"jawOpen": 0.12, "mouthFunnel": 0.75, "mouthPucker": 0.2},
    "SS": {"jawOpen": 0.06, **_both("mouthStretch", 0.5), **_both("mouthUpperUp", 0.2), **_both("mouthLowerDown", 0.4)},
    "nn": {"jawOpen": 0.14, "tongueOut": 0.05, **_both("mouthUpperUp", 0.1), **_both("mouthLowerDown", 0.2)},
    "RR": {"jawOpen": 0.14, "mouthFunnel": 0.4, "mouthPucker": 0.35},
    "aa": {"jawOpen": 0.6, **_both("mouthUpperUp", 0.15)},
    "E": {"jawOpen": 0.3, **_both("mouthStretch", 0.5), **_both("mouthUpperUp", 0.2), **_both("mouthLowerDown", 0.15)},
    "ih": {"jawOpen": 0.16, **_both("mouthStretch", 0.4), **_both("mouthSmile", 0.25), **_both("mouthUpperUp", 0.1)},
    "oh": {"jawOpen": 0.4, "mouthFunnel": 0.65},
    "ou": {"jawOpen": 0.12, "mouthPucker": 0.8, "mouthFunnel": 0.3},
}

EXPRESSION_POSES: dict[str, Units] = {
    "joy": {"jawOpen": 0.1, **_both("mouthSmile", 0.75), **_both("cheekSquint", 0.7), **_both("eyeSquint", 0.3)},
    "sadness": {
        "browInnerUp": 0.9,
        **_both("mouthFrown", 0.9),
        **_both("eyeBlink", 0.25),
        "mouthShrugLower": 0.4,
    },
    "anger": {
        **_both("browDown", 1.0),
        **_both("mouthPress", 0.6),
        **_both("eyeWide", 0.3),
        **_both("eyeSquint", 0.5),
        **_both("noseSneer", 0.4),
    },
    "fear": {
        "browInnerUp": 0.9,
        **_both("browDown", 0.3),
        **_both("eyeWide", 0.8),
        **_both("mouthStretch", 0.8),
        "jawOpen": 0.15,
    },
    "disgust": {
        **_both("noseSneer", 0.9),
        **_both("mouthUpperUp", 0.5),
        **_both("mouthFrown", 0.4),
        **_both("eyeSquint", 0.3),
    },
    "surprise": {"browInnerUp": 0.8, **_both("browOuterUp", 1.0), **_both("eyeWide", 0.9), "jawOpen": 0.45},
}


def high_level_motions(builder: MotionBuilder) -> list[FaceMotion]:
    """The poses as motions of FAP 1 and FAP 2 at their full value, 63."""
    out = []
    for fap_id, entries, poses in (
        (VISEME_FAP, VISEMES, VISEME_POSES),
        (EXPRESSION_FAP, EXPRESSIONS, EXPRESSION_POSES),
    ):
        for entry in entries:
            offsets = builder.pose(poses[entry.name])
            out.append(FaceMotion(table_name(fap_id, entry.id), fap_id, entry.id, BLEND_MAX, offsets))
    return out
