"""A value with the place where it is worst."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Spot:
    """A measure and where it is worst: a vertex of the joined skin, or a feature point."""

    value: float
    vertex: int | None = None
    point: str | None = None
