"""Float64 to decimal text in bulk: the shortest text that reads back as the same number, many times as fast as `repr`.

Most arrays of a file hold short decimals: indices, and numbers that were rounded to some places. Times a power of ten
they are integers, whose digits numpy finds for all of them together. Other arrays are left to `repr`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fba.arrays import Bools, Floats

_MOST_PLACES = 12
"""Places behind the point that are tried."""

_LARGEST = 10**15
"""Integers below this have at most 15 digits: such a decimal is the only one so short that reads as its float64."""

_TRIED = 64
"""Numbers that are looked at before all of them are."""

_ZERO = np.uint8(ord("0"))


def decimals(values: Floats, per_line: int) -> str | None:
    """Write numbers with spaces between them and a line feed after every `per_line` of them.

    Parameters
    ----------
    values : (n,) at least one.

    Returns
    -------
    Text without a separator at its end; None where some number has too many digits for this.

    >>> decimals(np.array([1.0, -0.25, 0.00003]), 2)
    '1 -0.25\\n0.00003'
    """
    places = _places(values)
    if places is None:
        return None
    whole, behind = np.divmod(np.rint(np.abs(values) * 10.0**places).astype(np.int64), 10**places)
    front, back = _digits(whole, len(str(int(whole.max())))), _digits(behind, places)
    leading, trailing = _zeros_before(front).T, _zeros_before(back[::-1])[::-1].T
    n, width = len(values), len(front)
    text = np.empty((n, width + places + 3), dtype=np.uint8)
    kept = np.ones(text.shape, dtype=bool)
    text[:, 0], kept[:, 0] = ord("-"), np.signbit(values)
    text[:, 1 : width + 1], kept[:, 1:width] = front.T + _ZERO, ~leading[:, :-1]
    text[:, width + 1], text[:, width + 2 : -1] = ord("."), back.T + _ZERO
    kept[:, width + 1] = ~trailing[:, 0] if places else False
    kept[:, width + 2 : -1] = ~trailing
    text[:, -1] = ord(" ")
    text[per_line - 1 :: per_line, -1] = ord("\n")
    kept[-1, -1] = False
    return text[kept].tobytes().decode("ascii")


def _places(values: Floats) -> int | None:
    """The fewest places behind the point with which all numbers are written exactly."""
    if not np.all(np.isfinite(values)):
        return None
    some = values[:: max(1, len(values) // _TRIED)]
    for places in range(_MOST_PLACES + 1):
        if _exact(some, places) and _exact(values, places):
            return places
    return None


def _exact(values: Floats, places: int) -> bool:
    with np.errstate(over="ignore"):
        whole = np.rint(values * 10.0**places)
    # A power of ten up to 10**22 is exact, so that one rounding gives the float64 nearest to the decimal.
    return bool(np.all((whole / 10.0**places == values) & (np.abs(whole) < _LARGEST)))


def _digits(numbers: NDArray[np.int64], count: int) -> NDArray[np.uint8]:
    """The last digits (count, n) of (n,) numbers."""
    digits = np.empty((count, len(numbers)), dtype=np.uint8)
    rest = numbers.astype(np.uint32) if int(numbers.max(initial=0)) < 2**32 else numbers
    for place in range(count - 1, -1, -1):
        tens = rest // 10
        digits[place] = rest - 10 * tens
        rest = tens
    return digits


def _zeros_before(digits: NDArray[np.uint8]) -> Bools:
    """(count, n) which digits are zeros before the first other one."""
    zeros: Bools = digits == 0
    for place in range(1, len(zeros)):
        zeros[place] &= zeros[place - 1]
    return zeros
