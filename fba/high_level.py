"""The 14 visemes (FAP 1) and 6 expressions (FAP 2) of ISO/IEC 14496-2, and how two of each blend."""

from __future__ import annotations

from dataclasses import dataclass

BLEND_MAX = 63
"""Largest viseme_blend and expression_intensity; also the border of a high-level table's interval."""


@dataclass(frozen=True, slots=True)
class Viseme:
    """One viseme: its number in ``viseme_select``, a short name, SAMPA phonemes and example words."""

    id: int
    name: str
    phonemes: str
    examples: str


@dataclass(frozen=True, slots=True)
class Expression:
    """One expression: its number in ``expression_select``, its name and what the face does."""

    id: int
    name: str
    description: str


VISEMES: tuple[Viseme, ...] = (
    Viseme(1, "PP", "p b m", "put, bed, mill"),
    Viseme(2, "FF", "f v", "far, voice"),
    Viseme(3, "TH", "T D", "think, that"),
    Viseme(4, "DD", "t d", "tip, doll"),
    Viseme(5, "kk", "k g", "call, gas"),
    Viseme(6, "CH", "tS dZ S", "chair, join, she"),
    Viseme(7, "SS", "s z", "sir, zeal"),
    Viseme(8, "nn", "n l", "lot, not"),
    Viseme(9, "RR", "r", "red"),
    Viseme(10, "aa", "A:", "car"),
    Viseme(11, "E", "e", "bed"),
    Viseme(12, "ih", "I", "tip"),
    Viseme(13, "oh", "Q", "top"),
    Viseme(14, "ou", "U", "book"),
)

EXPRESSIONS: tuple[Expression, ...] = (
    Expression(1, "joy", "brows relaxed, mouth open, corners pulled back toward the ears"),
    Expression(2, "sadness", "inner brows bent up, eyes slightly closed, mouth relaxed"),
    Expression(3, "anger", "inner brows pulled down and together, eyes wide, lips pressed or opened on the teeth"),
    Expression(4, "fear", "brows raised and pulled together, inner brows bent up, eyes tense and alert"),
    Expression(5, "disgust", "brows and lids relaxed, upper lip raised and curled, often asymmetric"),
    Expression(6, "surprise", "brows raised, upper lids wide open and lower lids relaxed, jaw opened"),
)


def viseme_weights(select1: int, select2: int, blend: int) -> dict[int, float]:
    """Return viseme number -> value 0..63 for one frame's FAP 1.

    ``viseme = viseme1 * blend/63 + viseme2 * (63 - blend)/63``; number 0 (silence) is the neutral face
    and has no table, so it is left out.

    >>> viseme_weights(10, 0, 42)
    {10: 42.0}
    >>> viseme_weights(1, 2, 63)
    {1: 63.0}
    """
    weights: dict[int, float] = {}
    for select, value in ((select1, float(blend)), (select2, float(BLEND_MAX - blend))):
        if select and value:
            weights[select] = weights.get(select, 0.0) + value
    return weights


def expression_weights(select1: int, intensity1: int, select2: int, intensity2: int) -> dict[int, float]:
    """Return expression number -> value 0..63 for one frame's FAP 2: each is a displacement from neutral.

    >>> expression_weights(1, 63, 6, 20)
    {1: 63.0, 6: 20.0}
    """
    weights: dict[int, float] = {}
    for select, value in ((select1, intensity1), (select2, intensity2)):
        if select and value:
            weights[select] = weights.get(select, 0.0) + float(value)
    return weights
