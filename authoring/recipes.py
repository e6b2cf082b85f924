"""Which units serve which low-level FAP, and how far."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

Mix = Mapping[str, float]
"""Unit -> relative weight; the first unit must be there, the others help where they are."""


@dataclass(frozen=True)
class Border:
    """One border of a FAP's intervals made of units.

    Attributes
    ----------
    value : of the FAP.
    mixes : alternatives; the first that serves is scaled until the FAP's own point moves by the value.
    rivals : feature points that share the mix out between them; none = the FAP takes all of it.
    side : "left", "right" = that half of the mix only; "" = all of it.
    axes : the only components that are kept; "" = all.
    """

    value: int
    mixes: tuple[Mix, ...]
    rivals: tuple[str, ...] = ()
    side: str = ""
    axes: str = ""


@dataclass(frozen=True)
class Recipe:
    """How one FAP is made of units.

    Attributes
    ----------
    tied : further feature points that move by the same amount (inner and outer lip corner).
    carried : feature points that go along as they do in the units, in all axes.
    judged : the feature point at which it is judged whether a unit serves; "" = the FAP's own. The two FAPs of a tied
        pair shall be made of the same.
    whole : the motion of teeth, tongue and all else belongs to the FAP too, not the skin's alone.
    """

    fap_id: int
    borders: tuple[Border, ...]
    tied: tuple[str, ...] = ()
    carried: tuple[str, ...] = ()
    judged: str = ""
    whole: bool = False


TIED_NOTE = "the inner and the outer lip corner move together; a stream should drive one of the two FAPs"
TIED_FAPS = (6, 7, 12, 13, 53, 54, 59, 60)

UPPER_LIP = ("2.2", "2.6", "2.7", "8.1", "8.5", "8.6")
LOWER_LIP = ("2.3", "2.8", "2.9", "8.2", "8.7", "8.8")
LIP_CORNERS = ("2.4", "2.5", "8.3", "8.4")
JAW = (*LOWER_LIP, *LIP_CORNERS, "2.1", "2.10", "5.1", "5.2")
MIDLIPS = ("2.2", "2.3")
BROWS = ("4.1", "4.2", "4.3", "4.4", "4.5", "4.6")

_BOTH = ("Left", "Right")


def both(name: str, weight: float = 1.0) -> dict[str, float]:
    """A unit of both sides.

    >>> both("mouthSmile", 0.5)
    {'mouthSmileLeft': 0.5, 'mouthSmileRight': 0.5}
    """
    return {name + side: weight for side in _BOTH}


_UPPER_UP = {**both("mouthUpperUp"), "mouthShrugUpper": 1.0}
_LOWER_DOWN = both("mouthLowerDown")


def _contours() -> list[Recipe]:
    """Inner and outer contours of the lips: a lip that moves as a whole, shared out between its points."""
    upper = ((4, "2.2"), (8, "2.6"), (9, "2.7"), (51, "8.1"), (55, "8.5"), (56, "8.6"))
    lower = ((5, "2.3"), (10, "2.8"), (11, "2.9"), (52, "8.2"), (57, "8.7"), (58, "8.8"))
    rows = [(f, Border(-300, (_UPPER_UP,), (*UPPER_LIP, *LIP_CORNERS))) for f, _ in upper]
    rows += [(f, Border(-300, (_LOWER_DOWN,), (*LOWER_LIP, *LIP_CORNERS), axes="y")) for f, _ in lower]
    return [Recipe(f, (border,)) for f, border in rows]


def _sided(k: int, side: str) -> list[Recipe]:
    """FAPs that come in pairs; k = 0 left, 1 right."""
    half = side.lower()
    inner, outer = ("2.4", "2.5")[k], ("8.3", "8.4")[k]
    stretched = (
        Border(-200, ({"mouthPucker": 1.0},), side=half),
        Border(300, ({f"mouthStretch{side}": 1.0, f"mouthDimple{side}": 1.0}, {f"mouthDimple{side}": 1.0}), side=half),
    )
    raised = (
        Border(-300, ({f"mouthFrown{side}": 1.0},), side=half),
        Border(600, ({f"mouthSmile{side}": 1.0},), side=half),
    )
    up = ({f"browUp{side}": 1.0}, {f"browInnerUp{side}": 1.0, f"browOuterUp{side}": 2.0})
    outer_up = ({f"browUp{side}": 1.0}, {f"browOuterUp{side}": 1.0})
    down = ({f"browDown{side}": 1.0},)
    brow = ((31 + k, 250, up), (33 + k, 200, up), (35 + k, 150, outer_up))
    return [
        Recipe(6 + k, stretched, (outer,)),
        Recipe(53 + k, stretched, (inner,), judged=inner),
        Recipe(12 + k, raised, (outer,)),
        Recipe(59 + k, raised, (inner,), judged=inner),
        Recipe(19 + k, (Border(-350, ({f"eyeWide{side}": 1.0},)), Border(1024, ({f"eyeBlink{side}": 1.0},)))),
        Recipe(21 + k, (Border(512, ({f"eyeSquint{side}": 1.0},)),)),
        *(Recipe(f, (Border(-100, down, BROWS), Border(value, mixes, BROWS))) for f, value, mixes in brow),
        Recipe(37 + k, (Border(100, down, BROWS, axes="xz"),)),
        Recipe(39 + k, (Border(250, ({f"cheekPuff{side}": 1.0},)),)),
        Recipe(41 + k, (Border(140, ({f"cheekSquint{side}": 1.0}, {f"cheekRaiser{side}": 1.0})),)),
        Recipe(61 + k, (Border(150, ({f"noseWide{side}": 1.0},)),)),
    ]


RECIPES: dict[int, Recipe] = {
    recipe.fap_id: recipe
    for recipe in (
        Recipe(3, (Border(1024, ({"jawOpen": 1.0},)),), carried=JAW, whole=True),
        Recipe(14, (Border(500, ({"jawForward": 1.0},)),), carried=JAW, whole=True),
        Recipe(
            15,
            (Border(-300, ({"jawLeft": 1.0},)), Border(300, ({"jawRight": 1.0},))),
            carried=(*LOWER_LIP, *LIP_CORNERS, "2.1", "2.10"),
            whole=True,
        ),
        Recipe(
            16,
            (
                Border(-300, ({"mouthRollLower": 1.0},), MIDLIPS),
                Border(500, ({"mouthPucker": 1.0}, {"mouthFunnel": 1.0}), MIDLIPS),
            ),
        ),
        Recipe(
            17,
            (
                Border(-400, ({"mouthRollUpper": 1.0},)),
                Border(500, ({"mouthFunnel": 1.0}, {"mouthPucker": 1.0}), MIDLIPS),
            ),
        ),
        *_contours(),
        *_sided(0, "Left"),
        *_sided(1, "Right"),
    )
}
"""FAP -> recipe."""

UNITS_FIRST = frozenset((3, 19, 20, 21, 22, 29, 30))
"""FAPs for which a unit is better than a construction: opening jaw and lids, whose spread over the skin modellers know,
and pupils. Everywhere else the unit of a face kit moves many feature points at once; what is left of it when only one
may move folds the lips and kinks the brows, while constructions stay smooth. Judged by looks on the ICT-FaceKit and
MakeHuman units; the units themselves show in visemes and expressions."""
