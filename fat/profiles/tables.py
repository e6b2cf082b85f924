"""The published tables: which FAPs, visemes and expressions show a profile's shapes, and ARKit's shapes for a FAP."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Literal

from fba.high_level import BLEND_MAX

Profile = Literal["arkit", "oculus", "vrm"]
PROFILES: tuple[Profile, ...] = ("arkit", "oculus", "vrm")


@dataclass(frozen=True)
class ProfileShape:
    """How MPEG-4 shows one shape at weight 1; everything adds up.

    Attributes
    ----------
    name : as files of the profile call the shape.
    faps : FAP 3..68 -> value.
    strict_faps : the same for a face whose open_jaw leaves the lips (`fat.open_jaw`), where that differs.
    viseme : number 1..14, shown in full; 0 = none.
    expression, intensity : number 1..6 and 0..63; 0 = none.
    residuals : what is left over on the faces it was measured on, e.g. ``{"makehuman_fp": 0.22}``.
    """

    name: str
    faps: Mapping[int, float] = field(default_factory=dict)
    viseme: int = 0
    expression: int = 0
    intensity: int = 0
    residuals: Mapping[str, float] = field(default_factory=dict)
    strict_faps: Mapping[int, float] = field(default_factory=dict)

    @property
    def still(self) -> bool:
        """The shape is the neutral face itself."""
        return not (self.faps or self.viseme or self.expression)


@dataclass(frozen=True)
class FapAsShapes:
    """One direction of one FAP in shapes of ARKit.

    Attributes
    ----------
    value : FAP value at which the weights hold; a lower value takes less of each.
    weights : shape -> weight, 1 = the whole shape; empty where ARKit has nothing like it.
    note : why it is empty, or what to heed.
    """

    fap_id: int
    value: int
    weights: Mapping[str, float]
    note: str = ""
    residuals: Mapping[str, float] = field(default_factory=dict)


@cache
def profile_table(profile: Profile) -> tuple[ProfileShape, ...]:
    """All shapes of a profile in its own order.

    >>> profile_table("oculus")[1]
    ProfileShape(name='viseme_PP', faps={}, viseme=1, expression=0, intensity=0, residuals={}, strict_faps={})
    """
    return tuple(_shape(row) for row in _rows(profile))


@cache
def faps_as_arkit() -> tuple[FapAsShapes, ...]:
    """Both directions of the FAPs 3 to 68 in shapes of ARKit, ascending."""
    return tuple(
        FapAsShapes(
            int(row["fap"]),
            int(row["value"]),
            {name: percent / 100.0 for name, percent in _pairs(row["percent"])},
            row["note"],
            _residuals(row),
        )
        for row in _rows("arkit_from_faps")
    )


def _rows(name: str) -> list[dict[str, str]]:
    text = (files("fat.profiles") / "data" / f"{name}.csv").read_text("utf-8")
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def _shape(row: Mapping[str, str]) -> ProfileShape:
    faps: dict[int, float] = {}
    for part in row.get("arkit", "").split():
        for number, value in _by_name(part).faps.items():
            faps[number] = faps.get(number, 0.0) + value
    faps |= {int(number): value for number, value in _pairs(row.get("faps", ""))}
    expression = int(row.get("expression") or 0)
    intensity = BLEND_MAX if expression else 0
    strict = {int(number): value for number, value in _pairs(row.get("strict_faps", ""))}
    return ProfileShape(row["shape"], faps, int(row.get("viseme") or 0), expression, intensity, _residuals(row), strict)


def _by_name(name: str) -> ProfileShape:
    return next(shape for shape in profile_table("arkit") if shape.name == name)


def _pairs(text: str) -> Iterator[tuple[str, float]]:
    """Parts of ``12:600 59:600``."""
    for part in text.split():
        name, _, value = part.partition(":")
        yield name, float(value)


def _residuals(row: Mapping[str, str]) -> dict[str, float]:
    return {k: float(v) for k, v in row.items() if k.endswith(("_fp", "_dense")) and v}
