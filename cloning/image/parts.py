"""Long rows of pixels in parts, so that what is found on the way stays small and near the processor."""

from __future__ import annotations

LONG = 32768
"""Pixels of a part: a dozen arrays of it take 1.5 MB, whatever the picture's size."""


def parts(count: int) -> list[slice]:
    """Slices that cover so many pixels.

    >>> parts(40000)
    [slice(0, 32768, None), slice(32768, 40000, None)]
    """
    return [slice(start, min(start + LONG, count)) for start in range(0, count, LONG)]
