"""Which ARKit face units serve which low-level FAP, and how far."""

from __future__ import annotations

from dataclasses import dataclass

Units = dict[str, float]


@dataclass(frozen=True)
class Border:
    """One interval border of a FAP: its value, the units whose mix goes that way, and which part of it is used.

    value : FAP value.
    units : ARKit unit -> relative weight; the whole is scaled until the FAP's own point moves by its value.
    part : "" = all of it; "left"/"right" half; "upper"/"lower" lip.
    most : largest scale of the units; what is missing then comes from the local kernel of the own point.
    """

    value: int
    units: Units
    part: str = ""
    most: float = 4.0


@dataclass(frozen=True)
class Recipe:
    """How one FAP is made.

    tied : further feature points that move by the same amount (inner and outer lip corner).
    carried : feature points that go along as they do in the units, in all axes.
    note : what a user should know.
    """

    fap: int
    borders: tuple[Border, ...]
    tied: tuple[str, ...] = ()
    carried: tuple[str, ...] = ()
    note: str = ""


LOWER_LIP = ("2.3", "2.8", "2.9", "8.2", "8.7", "8.8")
LIP_CORNERS = ("2.4", "2.5", "8.3", "8.4")
CHIN = ("2.1", "2.10")
JAW = (*LOWER_LIP, *LIP_CORNERS, *CHIN)

_TIED = "the inner and the outer lip corner move together; send one of the two FAPs"


def _both(name: str, weight: float = 1.0) -> Units:
    return {f"{name}Left": weight, f"{name}Right": weight}


def _corner(fap: int, side: str, inner: str, outer: str, up: bool) -> list[Recipe]:
    """The inner (fap) and the outer (fap + 47) corner of one side."""
    if up:
        borders = (Border(-300, {f"mouthFrown{side}": 1.0}), Border(600, {f"mouthSmile{side}": 1.0}))
    else:
        half = side.lower()
        borders = (Border(-250, {"mouthPucker": 1.0}, half), Border(300, {f"mouthStretch{side}": 1.0}))
    return [Recipe(fap, borders, (outer,), note=_TIED), Recipe(fap + 47, borders, (inner,), note=_TIED)]


def _sided() -> list[Recipe]:
    out: list[Recipe] = []
    for k, side in enumerate(("Left", "Right")):
        half = side.lower()
        inner, outer = ("2.4", "2.5")[k], ("8.3", "8.4")[k]
        up, down = {f"mouthUpperUp{side}": 1.0}, {f"mouthLowerDown{side}": 1.0}
        out += _corner(6 + k, side, inner, outer, up=False)
        out += _corner(12 + k, side, inner, outer, up=True)
        out += [
            Recipe(8 + k, (Border(-400, up),)),
            Recipe(55 + k, (Border(-400, up),)),
            Recipe(10 + k, (Border(-500, down),)),
            Recipe(57 + k, (Border(-500, down),)),
            Recipe(19 + k, (Border(-350, {f"eyeWide{side}": 1.0}), Border(1024, {f"eyeBlink{side}": 1.0}))),
            Recipe(21 + k, (Border(600, {f"eyeSquint{side}": 1.0}),)),
            Recipe(31 + k, (Border(-150, {f"browDown{side}": 1.0}), Border(250, {"browInnerUp": 1.0}, half))),
            Recipe(
                33 + k,
                (Border(-150, {f"browDown{side}": 1.0}), Border(250, {f"browOuterUp{side}": 1.0}, most=3.0)),
                note="the raise is completed by a local bump",
            ),
            Recipe(
                35 + k,
                (Border(-150, {f"browDown{side}": 1.0}), Border(200, {f"browOuterUp{side}": 1.0}, most=3.0)),
                note="the raise is completed by a local bump",
            ),
            Recipe(37 + k, (Border(200, {f"browDown{side}": 1.0}),)),
            Recipe(41 + k, (Border(300, {f"cheekSquint{side}": 1.0}),)),
        ]
    return out


RECIPES: tuple[Recipe, ...] = tuple(
    sorted(
        [
            Recipe(3, (Border(1024, {"jawOpen": 1.0}),), carried=JAW, note="practical: the jaw carries the lower lip"),
            Recipe(4, (Border(-300, {"mouthShrugUpper": 1.0}),)),
            Recipe(51, (Border(-300, {"mouthShrugUpper": 1.0}),)),
            Recipe(5, (Border(-500, _both("mouthLowerDown")), Border(400, {"mouthShrugLower": 1.0}))),
            Recipe(52, (Border(-500, _both("mouthLowerDown")), Border(400, {"mouthShrugLower": 1.0}))),
            Recipe(14, (Border(500, {"jawForward": 1.0}),), carried=JAW),
            Recipe(15, (Border(-300, {"jawLeft": 1.0}), Border(300, {"jawRight": 1.0})), carried=JAW),
            Recipe(16, (Border(-400, {"mouthRollLower": 1.0}), Border(500, {"mouthPucker": 1.0}, "lower"))),
            Recipe(17, (Border(-400, {"mouthRollUpper": 1.0}), Border(500, {"mouthFunnel": 1.0}, "upper"))),
            *_sided(),
        ],
        key=lambda r: r.fap,
    )
)
