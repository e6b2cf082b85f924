"""Frame rates as a bitstream has them: sixteenths, also times 1000/1001."""

from __future__ import annotations

from fba.errors import UnsupportedFeatureError


def coded_rate(rate: float) -> tuple[int, bool]:
    """The frame rate that can be written nearest to this one: sixteenths, and whether they are times 1000/1001.

    Raises
    ------
    UnsupportedFeatureError
        Beyond 1/16 to 255.9 frames a second.
    """
    choices = [(round(rate * (1.001 if ntsc else 1.0) * 16), ntsc) for ntsc in (False, True)]
    best = min(choices, key=lambda c: abs(rate_of(*c) - rate))
    if not 1 <= best[0] < 16 * 256:
        raise UnsupportedFeatureError(f"an FBA bitstream has 1/16 to 255.9 frames a second, not {rate:g}")
    return best


def rate_of(sixteenths: int, ntsc: bool) -> float:
    """Frames a second."""
    return sixteenths / 16 * (1000 / 1001 if ntsc else 1.0)
