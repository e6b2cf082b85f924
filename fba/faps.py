"""The 68 facial animation parameters (FAPs) of ISO/IEC 14496-2 as data."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from importlib.resources import files

FAP_COUNT = 68
VISEME_FAP = 1
EXPRESSION_FAP = 2
LOW_LEVEL_FAPS = range(3, FAP_COUNT + 1)


class Unit(StrEnum):
    """The unit in which a FAP's value is measured (a FAPU)."""

    NONE = ""
    MNS = "MNS"
    MW = "MW"
    IRISD = "IRISD"
    ES = "ES"
    ENS = "ENS"
    AU = "AU"


class Directionality(StrEnum):
    """Whether the standard gives a FAP one sign of motion or both."""

    NONE = ""
    UNIDIRECTIONAL = "U"
    BIDIRECTIONAL = "B"


@dataclass(frozen=True, slots=True)
class Fap:
    """One row of the FAP table.

    Attributes
    ----------
    id : 1 (viseme), 2 (expression), 3..68 (low level).
    name : the standard's name, e.g. ``open_jaw``.
    unit : FAPU of the value.
    direction : unit vector in head axes (+X subject's left, +Y up, +Z gaze) in which a value of +1
        moves the feature point; None for rotations, scalings and high-level FAPs.
    rotation_axis : axis of a positive rotation (right-hand rule); None for all other FAPs.
    mirror : the FAP of the other side, or None.
    feature_points : ids of the points that the FAP moves (for eyeballs and head: the pivot's point).
    quantizer : quantizer step; value = level x quantizer.
    i_range : lowest and highest *value* of an intra frame (levels x quantizer).
    """

    id: int
    name: str
    unit: Unit
    directionality: Directionality
    positive_motion: str
    direction: tuple[float, float, float] | None
    rotation_axis: tuple[float, float, float] | None
    mirror: int | None
    feature_points: tuple[str, ...]
    quantizer: int
    i_range: tuple[int, int]
    p_range: tuple[int, int]
    description: str

    @property
    def bidirectional(self) -> bool:
        return self.directionality is Directionality.BIDIRECTIONAL


_AXES = {"+X": (1.0, 0.0, 0.0), "+Y": (0.0, 1.0, 0.0), "+Z": (0.0, 0.0, 1.0)}


def _row(row: dict[str, str]) -> Fap:
    axis = row["axis"]
    direction = rotation = None
    if axis.startswith("rotation"):
        rotation = _AXES[axis.split()[1]]
    elif axis and axis not in ("scale", "roll"):
        x, y, z = map(float, axis.split())
        direction = (x, y, z)
    quantizer = int(row["quantizer"])
    return Fap(
        id=int(row["fap"]),
        name=row["name"],
        unit=Unit(row["unit"]),
        directionality=Directionality(row["directionality"]),
        positive_motion=row["positive_motion"],
        direction=direction,
        rotation_axis=rotation,
        mirror=int(row["mirror"]) if row["mirror"] else None,
        feature_points=tuple(row["feature_points"].split()),
        quantizer=quantizer,
        i_range=(int(row["i_min"]) * quantizer, int(row["i_max"]) * quantizer),
        p_range=(int(row["p_min"]) * quantizer, int(row["p_max"]) * quantizer),
        description=row["description"],
    )


@cache
def faps() -> tuple[Fap, ...]:
    """Return all 68 FAPs in order.

    >>> faps()[2].name
    'open_jaw'
    """
    text = (files("fba") / "data" / "faps.csv").read_text("utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    return tuple(_row(row) for row in csv.DictReader(lines))


@cache
def _by_name() -> dict[str, Fap]:
    return {f.name: f for f in faps()}


def fap(key: int | str) -> Fap:
    """Return one FAP by number (1..68) or by its name in the standard.

    Raises
    ------
    KeyError
        If there is no such FAP.

    >>> fap("close_t_l_eyelid").id
    19
    >>> fap(23).rotation_axis
    (0.0, 1.0, 0.0)
    """
    if isinstance(key, str):
        return _by_name()[key]
    if not 1 <= key <= FAP_COUNT:
        raise KeyError(f"there is no FAP {key}: FAPs are numbered 1 to {FAP_COUNT}")
    return faps()[key - 1]
