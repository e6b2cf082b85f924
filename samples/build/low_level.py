"""Which ARKit face units serve which low-level FAP, and how far."""

from __future__ import annotations

from dataclasses import dataclass

Units = dict[str, float]


@dataclass(frozen=True)
class Border:
    """One interval border of a FAP: its value, the units whose mix goes that way, and which part of it is used.

    value : FAP value.
    units : ARKit unit -> relative weight; the whole is scaled until the FAP's own point moves by its value.
    masks : names of `Masks` whose product splits the mix; none = all of it, teeth and tongue included.
    axes : the only components that are kept, e.g. "x"; none = all.
    most : largest scale of the units; what is missing comes from sliding the masked skin along itself.
    """

    value: int
    units: Units
    masks: tuple[str, ...] = ()
    axes: str = ""
    most: float = 4.0


@dataclass(frozen=True)
class Recipe:
    """How one FAP is made.

    tied : further feature points that move by the same amount (inner and outer lip corner).
    carried : feature points that go along as they do in the units, in all axes.
    lid : side and part of the eyelid whose rim has to close on a line; None for every other FAP.
    note : what a user should know; "practical" = the jaw carries the lower lip, as most players expect.
    """

    fap: int
    borders: tuple[Border, ...]
    tied: tuple[str, ...] = ()
    carried: tuple[str, ...] = ()
    lid: tuple[str, str] | None = None
    note: str = ""


LOWER_LIP = ("2.3", "2.8", "2.9", "8.2", "8.7", "8.8")
LIP_CORNERS = ("2.4", "2.5", "8.3", "8.4")
CHIN = ("2.1", "2.10")
CHEEKS = ("5.1", "5.2")
JAW = (*LOWER_LIP, *LIP_CORNERS, *CHIN, *CHEEKS)
LIDS = ("3.1", "3.2", "3.3", "3.4")

_TIED = "the inner and the outer lip corner move together; a stream should drive one of the two FAPs"


def _both(name: str, weight: float = 1.0) -> Units:
    return {f"{name}Left": weight, f"{name}Right": weight}


_UPPER_LIP_UP = {**_both("mouthUpperUp"), "mouthShrugUpper": 1.0}
_LOWER_LIP_DOWN = _both("mouthLowerDown")
_BROW_UP = {"browInnerUp": 1.0, **_both("browOuterUp", 2.0)}
"""Mixes that move a whole lip or brow evenly; masks share them out between its feature points."""

_CONTOUR = (
    ((4, "2.2"), (8, "2.6"), (9, "2.7"), (51, "8.1"), (55, "8.5"), (56, "8.6")),
    ((5, "2.3"), (10, "2.8"), (11, "2.9"), (52, "8.2"), (57, "8.7"), (58, "8.8")),
)
_BROW = ((31, "4.1", 250), (32, "4.2", 250), (33, "4.3", 200), (34, "4.4", 200), (35, "4.5", 150), (36, "4.6", 150))


def _lips() -> list[Recipe]:
    upper, lower = _CONTOUR
    return [
        *(Recipe(fap, (Border(-300, _UPPER_LIP_UP, (key,)),)) for fap, key in upper),
        *(Recipe(fap, (Border(-300, _LOWER_LIP_DOWN, (key,), axes="y"),)) for fap, key in lower),
        Recipe(16, (Border(500, {"mouthPucker": 1.0}, ("lower", "mouth")),)),
        Recipe(17, (Border(-400, {"mouthRollUpper": 1.0}), Border(500, {"mouthFunnel": 1.0}, ("upper", "mouth")))),
    ]


def _sided(k: int, side: str) -> list[Recipe]:
    """The FAPs of one side but for lip contours and brows; k = 0 left, 1 right."""
    half = side.lower()
    corner = (f"corner_{half}",)
    stretch = (Border(300, {f"mouthStretch{side}": 1.0, f"mouthDimple{side}": 1.0}, corner),)
    raised = (Border(-300, {f"mouthFrown{side}": 1.0}, corner), Border(600, {f"mouthSmile{side}": 1.0}, corner))
    inner, outer = ("2.4", "2.5")[k], ("8.3", "8.4")[k]
    return [
        Recipe(6 + k, stretch, (outer,), carried=CHEEKS, note=_TIED),
        Recipe(53 + k, stretch, (inner,), carried=CHEEKS, note=_TIED),
        Recipe(12 + k, raised, (outer,), carried=CHEEKS, note=_TIED),
        Recipe(59 + k, raised, (inner,), carried=CHEEKS, note=_TIED),
        Recipe(
            19 + k,
            (Border(-350, {f"eyeWide{side}": 1.0}), Border(1024, {f"eyeBlink{side}": 1.0})),
            carried=LIDS,
            lid=(half, "upper"),
        ),
        Recipe(21 + k, (Border(512, {f"eyeSquint{side}": 1.0}),), carried=LIDS, lid=(half, "lower")),
        Recipe(37 + k, (Border(100, {f"browDown{side}": 1.0}, (f"beside_{half}",), axes="x"),), carried=LIDS),
        Recipe(41 + k, (Border(140, {f"cheekSquint{side}": 1.0}),), carried=LIDS),
    ]


RECIPES: tuple[Recipe, ...] = tuple(
    sorted(
        [
            Recipe(3, (Border(1024, {"jawOpen": 1.0}),), carried=JAW, note="practical"),
            Recipe(14, (Border(500, {"jawForward": 1.0}),), carried=JAW),
            Recipe(15, (Border(-300, {"jawLeft": 1.0}), Border(300, {"jawRight": 1.0})), carried=JAW),
            *_lips(),
            *_sided(0, "Left"),
            *_sided(1, "Right"),
            *(Recipe(fap, (Border(value, _BROW_UP, (key,), most=0.25),)) for fap, key, value in _BROW),
        ],
        key=lambda r: r.fap,
    )
)
