"""Motions by name: what people write on a command line, as poses to show and to measure."""

from __future__ import annotations

from fba.amplitudes import amplitudes
from fba.errors import FapStreamError
from fba.faps import EXPRESSION_FAP, VISEME_FAP, fap
from fba.high_level import BLEND_MAX, EXPRESSIONS, VISEMES
from studio.sheet import PosePick

_LIPS = (4, 5, 8, 9, 10, 11, 51, 52, 55, 56, 57, 58)
"""All FAPs that raise or lower an inner or outer, upper or lower lip, but not its corner."""
_COMBINATION = {3: 800.0, 6: 150.0, 7: 150.0, **dict.fromkeys(_LIPS, -400.0)}
_LEFT_BROW, _RIGHT_BROW = (31, 33, 35), (32, 34, 36)

COMBINATIONS: dict[str, PosePick] = {
    "combination": PosePick("combination", {**_COMBINATION, **dict.fromkeys(_LEFT_BROW, 300.0)}),
    "combination-both-brows": PosePick(
        "combination, both brows", {**_COMBINATION, **dict.fromkeys((*_LEFT_BROW, *_RIGHT_BROW), 300.0)}
    ),
}
"""Pandzic (2001), figure 13: low-level FAPs cloned one by one, then shown together. Its caption names the left brow."""


def parse_motions(text: str) -> list[PosePick]:
    """Turn "surprise,viseme_ih,open_jaw=800+raise_l_i_eyebrow=300" into poses.

    A motion is an expression, a viseme ("viseme_" and its name or its number), a name in `COMBINATIONS`, or FAPs by
    name or number with their values, joined by "+"; a FAP without a value shows its normal amplitude.

    Raises
    ------
    FapStreamError
        If a motion is not known, or none is named.

    >>> parse_motions("open_jaw=800+37=100")[0].faps
    {3: 800.0, 37: 100.0}
    """
    picks = [_motion(part) for part in (p.strip() for p in text.split(",")) if part]
    if not picks:
        raise FapStreamError("no motion is named; write for example surprise,viseme_ih,combination,open_jaw=800")
    return picks


def _motion(name: str) -> PosePick:
    if name in COMBINATIONS:
        return COMBINATIONS[name]
    for expression in EXPRESSIONS:
        if name == expression.name:
            return PosePick(name, expression=(expression.id, BLEND_MAX, 0, 0))
    if name.startswith("viseme_"):
        wanted = name.removeprefix("viseme_")
        for viseme in VISEMES:
            if wanted in (viseme.name, str(viseme.id)):
                return PosePick(f"viseme {viseme.name}", viseme=(viseme.id, 0, BLEND_MAX))
    return PosePick(name, dict(_fap(part, name) for part in name.split("+")))


def _fap(part: str, motion: str) -> tuple[int, float]:
    name, _, value = (p.strip() for p in part.partition("="))
    try:
        number = fap(int(name) if name.isdecimal() else name).id
        if number in (VISEME_FAP, EXPRESSION_FAP):
            raise KeyError
        return number, float(value) if value else float(amplitudes()[number].values[0])
    except (KeyError, ValueError):
        known = ", ".join([e.name for e in EXPRESSIONS] + [f"viseme_{v.name}" for v in VISEMES] + list(COMBINATIONS))
        raise FapStreamError(
            f"'{motion}' is no motion; known are {known}, and FAPs with values, such as open_jaw=800+37"
        ) from None
