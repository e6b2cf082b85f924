"""glTF's colours are linear light; those of a `Material`, like VRML97's, are what a screen shows (sRGB)."""

from __future__ import annotations

from collections.abc import Iterable


def to_linear(color: Iterable[float]) -> list[float]:
    """Linear light of an sRGB colour (IEC 61966-2-1), each 0 to 1."""
    values = (min(max(c, 0.0), 1.0) for c in color)
    return [round(c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4, 9) for c in values]


def from_linear(color: Iterable[float]) -> tuple[float, float, float]:
    """The sRGB colour of linear light."""
    values = (min(max(c, 0.0), 1.0) for c in color)
    red, green, blue = (round(12.92 * c if c <= 0.0031308 else 1.055 * c ** (1 / 2.4) - 0.055, 9) for c in values)
    return red, green, blue
