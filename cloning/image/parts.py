"""Long rows of pixels in parts that stay in the processor's cache from one step to the next."""

from __future__ import annotations

LONG = 16384
"""Pixels of a part: some ten arrays of it fit into a cache of 1 MB. Steps over whole pictures wait for the memory
instead: a cubic interpolation of 85,000 pixels takes 1.9 ms in parts of 8,000 to 32,000, 2.3 ms at once."""


def parts(count: int) -> list[slice]:
    """Slices that cover so many pixels.

    >>> parts(20000)
    [slice(0, 16384, None), slice(16384, 20000, None)]
    """
    return [slice(start, min(start + LONG, count)) for start in range(0, count, LONG)]
