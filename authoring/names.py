"""What the name of a shape means: FAP, viseme, expression or unit, in the spellings that face kits use.

Names are read without regard to case, separators and what stands before them: ``Wolf3D.mouthSmileLeft``,
``mouth_smile_L`` and ``MouthSmile.l`` are the same unit.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Literal

from fat.profiles.names import ARKIT
from fba.faps import EXPRESSION_FAP, FAP_COUNT, VISEME_FAP, faps
from fba.high_level import EXPRESSIONS, VISEMES

Kind = Literal["fap", "viseme", "expression", "unit", "ignored"]


@dataclass(frozen=True, slots=True)
class Meaning:
    """What one shape shows.

    Attributes
    ----------
    kind : "unit" is a shape of a face kit that FAPs and poses are made of; "ignored" says nothing about a FAP.
    number : of the FAP, viseme or expression; 0 for the others.
    unit : canonical name of the unit: one of ARKit's, or one of `MORE_UNITS`; ``...Left`` and ``...Right`` are
        halves. For "ignored": why.
    value : FAP value at which the shape holds; None where its name does not say it.
    """

    kind: Kind
    number: int = 0
    unit: str = ""
    value: int | None = None

    @property
    def key(self) -> tuple[str, int, str, int | None]:
        """Two shapes of one key mean the same."""
        return (self.kind, self.number, self.unit, self.value)


SIDES = ("Left", "Right")

MORE_STEMS = ("cheekRaiser", "pupilDilate", "browUp", "noseWide")
"""Paired units that ARKit does not have: ICT-FaceKit's cheek raiser and pupil; MakeHuman's whole brow and nostril."""

HALVED = ("browInnerUp", "cheekPuff")
"""Units of both sides at once in ARKit that some kits split in two."""

_KITS: dict[str, str] = {
    # MakeHuman's older expression units.
    "eye-left-closure": "eyeBlinkLeft",
    "eye-right-closure": "eyeBlinkRight",
    "eye-left-opened-up": "eyeWideLeft",
    "eye-right-opened-up": "eyeWideRight",
    "eye-left-slit": "eyeSquintLeft",
    "eye-right-slit": "eyeSquintRight",
    "eyebrows-left-down": "browDownLeft",
    "eyebrows-right-down": "browDownRight",
    "eyebrows-left-extern-up": "browOuterUpLeft",
    "eyebrows-right-extern-up": "browOuterUpRight",
    "eyebrows-left-inner-up": "browInnerUpLeft",
    "eyebrows-right-inner-up": "browInnerUpRight",
    "eyebrows-left-up": "browUpLeft",
    "eyebrows-right-up": "browUpRight",
    "mouth-corner-puller": "mouthSmile",
    "mouth-depression": "mouthFrown",
    "mouth-open": "jawOpen",
    "mouth-pursing": "mouthPucker",
    "mouth-protusion": "mouthFunnel",
    "mouth-eversion": "mouthShrugLower",
    "mouth-retraction": "mouthDimple",
    "mouth-depression-retraction": "mouthLowerDown",
    "mouth-elevation": "mouthUpperUp",
    "mouth-compression": "mouthPress",
    "nose-left-dilatation": "noseWideLeft",
    "nose-right-dilatation": "noseWideRight",
    "nose-left-elevation": "noseSneerLeft",
    "nose-right-elevation": "noseSneerRight",
    # Candide-3's animation units.
    "Nose wrinkler": "noseSneer",
    "Jaw z-push": "jawForward",
    "Jaw x-push": "jawLeft",
    "Jaw drop": "jawOpen",
    "Upper lip raiser": "mouthUpperUp",
    "Lip stretcher": "mouthStretch",
    "Lip corner depressor": "mouthFrown",
    "Lip presser": "mouthPress",
    "Outer brow raiser": "browOuterUp",
    "Inner brows raiser": "browInnerUp",
    "Brow lowerer": "browDown",
    "Eyes closed": "eyeBlink",
    "Lid tightener": "eyeSquint",
    "Upper lid raiser": "eyeWide",
}
"""Whole names of other kits -> the unit that moves the feature points alike; one without a side is split in halves."""

_PRESETS: dict[str, Meaning] = {
    **{v.name: Meaning("viseme", v.id) for v in VISEMES if len(v.name) == 2},
    "ee": Meaning("viseme", 11),
    **{e.name: Meaning("expression", e.id) for e in EXPRESSIONS},
    "happy": Meaning("expression", 1),
    "sad": Meaning("expression", 2),
    "sorrow": Meaning("expression", 2),
    "angry": Meaning("expression", 3),
    "surprised": Meaning("expression", 6),
    "blink": Meaning("unit", unit="eyeBlink"),
    "blinkLeft": Meaning("unit", unit="eyeBlinkLeft"),
    "blinkRight": Meaning("unit", unit="eyeBlinkRight"),
    **{name: Meaning("ignored", unit="the neutral face") for name in ("neutral", "basis", "relaxed")},
}
"""Whole names without any prefix: MPEG-4's own and VRM's presets."""

_VOWELS = {"i": 12, "o": 13, "u": 14, "silence": 0, "sil": 0}
"""Other spellings of visemes: Ready Player Me writes viseme_I, viseme_O, viseme_U."""

GAZES = ("eyeLookDown", "eyeLookIn", "eyeLookOut", "eyeLookUp")
"""Units that turn the eyes; FAPs 23 to 26 turn them exactly."""


def meaning(name: str) -> Meaning | None:
    """Read a shape's name; None if it is not known.

    >>> meaning("Wolf3D.mouthSmileLeft").unit
    'mouthSmileLeft'
    >>> meaning("fap_03").number, meaning("raise_l_cornerlip").number
    (3, 12)
    >>> meaning("viseme_U"), meaning("my smile")
    (Meaning(kind='viseme', number=14, unit='', value=None), None)
    """
    squeezed = _squeezed(name)
    whole = _whole_names().get(squeezed) or _numbered(squeezed, "f")
    if whole is not None:
        return whole
    for tail in _tails(name):
        found = _known().get(tail) or _numbered(tail, "fap|viseme|expression")
        if found is not None:
            return found
    return None


def unit_name(text: str) -> str | None:
    """Canonical name of a unit in any spelling; None if there is none.

    >>> unit_name("mouth_smile_l"), unit_name("BrowInnerUp_R"), unit_name("open_jaw")
    ('mouthSmileLeft', 'browInnerUpRight', None)
    """
    found = meaning(text)
    return found.unit if found is not None and found.kind == "unit" else None


def _squeezed(name: str) -> str:
    """Letters and digits alone, in small letters."""
    return re.sub(r"[^0-9a-z]", "", name.casefold())


def _tails(name: str) -> Iterator[str]:
    """The squeezed name, then without its first word, without its first two ..."""
    words = re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|[0-9]+", name)
    for start in range(len(words)):
        yield _squeezed("".join(words[start:]))


@cache
def _whole_names() -> dict[str, Meaning]:
    """Names that count only as a whole: short words would turn up at the end of many others."""
    found = {_squeezed(name): value for name, value in _PRESETS.items()}
    found.update({_squeezed(name): Meaning("unit", unit=unit) for name, unit in _KITS.items()})
    return found


@cache
def _known() -> dict[str, Meaning]:
    """Squeezed name -> meaning, for names that may have anything before them."""
    found: dict[str, Meaning] = {}
    stems = {name.removesuffix(side) for name in ARKIT for side in SIDES if name.endswith(side)}
    paired = {s for s in stems if f"{s}Left" in ARKIT} - {"jaw", "mouth"} | {*MORE_STEMS, *HALVED}
    for unit in (*ARKIT, *paired):
        found[_squeezed(unit)] = Meaning("unit", unit=unit)
    for stem in paired:
        for side in SIDES:
            for spelling in (stem + side, stem + side[0], side + stem, side[0] + stem):
                found[_squeezed(spelling)] = Meaning("unit", unit=stem + side)
    for fap in faps()[EXPRESSION_FAP:]:
        found[_squeezed(fap.name)] = Meaning("fap", fap.id)
    for v in VISEMES:
        found[f"viseme{_squeezed(v.name)}"] = Meaning("viseme", v.id)
    for spelling, number in _VOWELS.items():
        kind = Meaning("viseme", number) if number else Meaning("ignored", unit="silence, the neutral face")
        found[f"viseme{spelling}"] = kind
    for e in EXPRESSIONS:
        found[f"expression{e.name}"] = Meaning("expression", e.id)
    return found


def _numbered(tail: str, words: str) -> Meaning | None:
    """FAP3, fap_03, viseme1, expression6; F3 only as a whole name."""
    match = re.fullmatch(rf"({words})0*([0-9]{{1,2}})", tail)
    if match is None:
        return None
    word, number = match[1], int(match[2])
    if word == "viseme":
        return _high(VISEME_FAP, number)
    if word == "expression":
        return _high(EXPRESSION_FAP, number)
    return Meaning("fap", number) if EXPRESSION_FAP < number <= FAP_COUNT else None


def _high(fap_id: int, number: int) -> Meaning | None:
    """A viseme or expression by its number; 0 is the neutral face."""
    if number == 0:
        return Meaning("ignored", unit="number 0, the neutral face")
    if fap_id == VISEME_FAP:
        return Meaning("viseme", number) if number <= len(VISEMES) else None
    return Meaning("expression", number) if number <= len(EXPRESSIONS) else None
