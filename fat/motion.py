"""A motion: where the vertices of a face go at one value of one FAP, viseme, expression or free shape."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from fba.arrays import Floats


@dataclass(frozen=True, eq=False)
class FaceMotion:
    """One target pose.

    Attributes
    ----------
    name : FAP, viseme or expression name, or a free name.
    fap_id : 1..68, or None for a free expression.
    select : viseme or expression number where fap_id is 1 or 2; else 1.
    value : the FAP value at which the offsets hold (never 0): one interval border.
    offsets : shape name -> (n, 3) float64 offsets from neutral, world coordinates, inside axes, mesh units.
        Shapes that do not move are absent.
    """

    name: str
    fap_id: int | None
    select: int
    value: int
    offsets: Mapping[str, Floats]
