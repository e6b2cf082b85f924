"""Which FAPs may take part in an ARKit shape: those of the muscles and bones that move in it."""

from __future__ import annotations

from fat.profiles.names import ARKIT
from fba.faps import fap

LIDS, GAZE, BROW, CHEEK, NOSTRIL = (19, 21), (23, 25), (31, 33, 35, 37), (39, 41), (61,)
CORNER, UPPER_SIDE, LOWER_SIDE = (6, 12), (8, 55), (10, 57)
"""FAPs of the left side; the right side's are their mirrors."""
OUTER_CORNER = {6: 53, 7: 54, 12: 59, 13: 60}
"""The outer corner of the lips takes the inner one's value: they are one place on most faces."""
UPPER, LOWER = (4, 17, 51), (5, 16, 52)
JAW, CHIN, NOSE, TONGUE = (3, 14, 15), (18,), (63,), (44, 45, 46)
"""FAPs of the middle."""

_MOUTH = (*CORNER, *UPPER_SIDE, *LOWER_SIDE, *UPPER, *LOWER)
_LEFT: dict[str, tuple[int, ...]] = {
    "eyeBlink": LIDS,
    "eyeLookDown": (*GAZE, *LIDS),
    "eyeLookIn": GAZE,
    "eyeLookOut": GAZE,
    "eyeLookUp": (*GAZE, *LIDS),
    "eyeSquint": (*LIDS, 41),
    "eyeWide": LIDS,
    "jawForward": (14, *LOWER, *LOWER_SIDE, *CHIN),
    "jawLeft": (*JAW, *CORNER, *LOWER, *LOWER_SIDE),
    "jawOpen": (3, 14, *_MOUTH, *CHIN, *CHEEK),
    "mouthClose": (*_MOUTH, *CHIN),
    "mouthFunnel": _MOUTH,
    "mouthPucker": (*_MOUTH, 39),
    "mouthLeft": (*_MOUTH, 39),
    "mouthSmile": (*_MOUTH, *CHEEK),
    "mouthFrown": (*CORNER, *UPPER_SIDE, *LOWER_SIDE, *CHIN),
    "mouthDimple": (*CORNER, *UPPER_SIDE, *LOWER_SIDE, 39),
    "mouthStretch": (*CORNER, *UPPER_SIDE, *LOWER_SIDE, 39),
    "mouthRollLower": (3, *LOWER, *LOWER_SIDE, *CHIN),
    "mouthRollUpper": (*UPPER, *UPPER_SIDE),
    "mouthShrugLower": (*LOWER, *LOWER_SIDE, *CHIN),
    "mouthShrugUpper": (*UPPER, *UPPER_SIDE),
    "mouthPress": (*_MOUTH, 39, *CHIN),
    "mouthLowerDown": (*LOWER, *LOWER_SIDE, *CHIN),
    "mouthUpperUp": (*UPPER, *UPPER_SIDE, *CORNER, *NOSTRIL, *CHEEK),
    "browDown": (*BROW, 19),
    "browInnerUp": BROW,
    "browOuterUp": BROW,
    "cheekPuff": (*CHEEK, *_MOUTH),
    "cheekSquint": (*CHEEK, 21, 61),
    "noseSneer": (31, 33, 37, 41, *NOSTRIL, *NOSE, 8, 55),
    "tongueOut": TONGUE,
}
_BOTH = ("jawLeft", "mouthLeft")
"""Sideways shapes move both halves of the mouth, each in its own way."""


def mirrored(faps: dict[int, float]) -> dict[int, float]:
    """FAP values of the mirrored face.

    >>> mirrored({12: 600.0, 15: -300.0, 23: 100.0})
    {13: 600.0, 15: 300.0, 24: -100.0}
    """
    return {fap(k).mirror or k: -v if _sideways(k) else v for k, v in faps.items()}


def _sideways(number: int) -> bool:
    """Mirroring turns the sign: a middle point that moves to the side, a turn about an upright or a forward axis."""
    entry = fap(number)
    middle = entry.mirror is None and entry.direction is not None and entry.direction[0] != 0.0
    return middle or (entry.rotation_axis is not None and entry.rotation_axis[0] == 0.0)


def mirror_shape(name: str) -> str:
    """The shape of the other side; a middle shape itself."""
    for one, other in (("Left", "Right"), ("Right", "Left")):
        if name.endswith(one):
            return name.removesuffix(one) + other
    return name


def left_shapes() -> tuple[str, ...]:
    """ARKit's shapes without those that are another one's mirror image."""
    return tuple(name for name in ARKIT if not name.endswith("Right"))


def related(name: str) -> tuple[int, ...]:
    """FAPs that may take part in a shape of `left_shapes`, in order."""
    stem = name.removesuffix("Left") if name not in _BOTH else name
    own = _LEFT[stem]
    both = mirror_shape(name) == name or name in _BOTH
    mirrors = tuple(m for k in own if both and (m := fap(k).mirror) is not None)
    return tuple(sorted({*own, *mirrors}))
