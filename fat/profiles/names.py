"""The shape names of three common profiles: ARKit's 52, Oculus' 15 visemes, VRM 1.0's presets.

Sources: Apple, "ARFaceAnchor.BlendShapeLocation"; Meta, "Oculus Lipsync viseme reference"; VRM Consortium,
"VRMC_vrm-1.0: expressions".
"""

from __future__ import annotations


def _sides(*stems: str) -> tuple[str, ...]:
    return tuple(f"{stem}{side}" for stem in stems for side in ("Left", "Right"))


ARKIT: tuple[str, ...] = (
    *_sides("eyeBlink", "eyeLookDown", "eyeLookIn", "eyeLookOut", "eyeLookUp", "eyeSquint", "eyeWide"),
    "jawForward",
    "jawLeft",
    "jawRight",
    "jawOpen",
    "mouthClose",
    "mouthFunnel",
    "mouthPucker",
    "mouthLeft",
    "mouthRight",
    *_sides("mouthSmile", "mouthFrown", "mouthDimple", "mouthStretch"),
    "mouthRollLower",
    "mouthRollUpper",
    "mouthShrugLower",
    "mouthShrugUpper",
    *_sides("mouthPress", "mouthLowerDown", "mouthUpperUp"),
    *_sides("browDown"),
    "browInnerUp",
    *_sides("browOuterUp"),
    "cheekPuff",
    *_sides("cheekSquint", "noseSneer"),
    "tongueOut",
)
"""The 52 shapes of ARKit; left is the subject's left."""

OCULUS: tuple[str, ...] = (
    "sil", "PP", "FF", "TH", "DD", "kk", "CH", "SS", "nn", "RR", "aa", "E", "ih", "oh", "ou",
)  # fmt: skip
"""The 15 visemes of Oculus Lipsync in their order: number k is MPEG-4's viseme k, 0 the closed mouth at rest.
Files call them ``viseme_PP``; three vowels are also written I, O and U."""

VRM: tuple[str, ...] = (
    "happy", "angry", "sad", "relaxed", "surprised",
    "aa", "ih", "ou", "ee", "oh",
    "blink", "blinkLeft", "blinkRight",
    "lookUp", "lookDown", "lookLeft", "lookRight",
    "neutral",
)  # fmt: skip
"""The presets of VRM 1.0: emotions, vowels, blinks, gazes, neutral."""
