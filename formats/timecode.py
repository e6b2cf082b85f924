"""SMPTE time codes with parts of frames, and the frame rate that a series of them tells."""

from __future__ import annotations

import re
from itertools import pairwise

import numpy as np

from fba.arrays import Ints
from fba.errors import FapStreamError
from fba.findings import Finding

BASE = 60
"""Frames that a second of a time code counts in the app Live Link Face, whatever the rate of the take."""

_BASES = (BASE, 24, 25, 30, 48, 50, 100, 120)
_CODE = re.compile(r"\s*(\d{1,3}):(\d{1,2}):(\d{1,2})[:;](\d{1,3}(?:\.\d{1,9})?)\s*", re.ASCII)
_RATES = (24 / 1.001, 24.0, 25.0, 30 / 1.001, 30.0, 48.0, 50.0, 60 / 1.001, 60.0, 100.0, 120 / 1.001, 120.0)
_SNAP = 1e-3
"""Rates this near to a usual one are that one. The app's clock wanders by half of it against its time codes."""

_DAY = 86400.0
LARGEST_GAP = 1000
"""More missing frames than that for each that is there, and the time codes are not believed."""


def timecode(seconds: float) -> str:
    """Write a time as the app does, in sixtieths and their thousandths.

    >>> timecode(3661.5), timecode(0.04)
    ('01:01:01:30.000', '00:00:00:02.400')
    """
    parts = round(seconds * BASE * 1000)
    whole, parts = divmod(parts, BASE * 1000)
    minutes, second = divmod(whole, 60)
    hour, minute = divmod(minutes, 60)
    return f"{hour:02d}:{minute:02d}:{second:02d}:{parts // 1000:02d}.{parts % 1000:03d}"


def timecode_seconds(text: str) -> tuple[int, float] | None:
    """Whole seconds and frames of a time code; None where it is none.

    >>> timecode_seconds("01:01:01:30.5")
    (3661, 30.5)
    """
    found = _CODE.fullmatch(text)
    if found is None:
        return None
    hour, minute, second = (int(found[k]) for k in (1, 2, 3))
    return 3600 * hour + 60 * minute + second, float(found[4])


def frame_numbers_of(
    codes: list[tuple[int, float]] | None, count: int, rate: float | None
) -> tuple[Ints, float, list[Finding]]:
    """Numbers of frames, from 0, and the frame rate.

    Parameters
    ----------
    codes : of every frame; None where the file has none.
    rate : frames a second if they are known; then frames are only counted.

    Returns
    -------
    numbers (count,), rate, and a finding where frames are missing or the time codes are of no use.
    """
    counted = np.arange(count, dtype=np.int32)
    if rate is not None and not (np.isfinite(rate) and rate > 0.0):
        raise FapStreamError(f"the frame rate must be a positive number, not {rate}")
    if rate is not None or codes is None or count < 2:
        return counted, rate or float(BASE), []
    seconds = _seconds(codes)
    steps = np.diff(seconds)
    if steps.min() <= 0.0:
        at = int(np.flatnonzero(steps <= 0.0)[0]) + 2
        text = f"the time code of frame {at} is not later than the one before; {BASE} frames a second are taken"
        return counted, float(BASE), [Finding("warning", "time-codes", text, f"frame {at}")]
    step = float(np.median(steps))
    ahead = np.maximum(np.rint(steps / step), 1.0)
    numbers = np.concatenate([[0.0], np.cumsum(ahead)])
    if numbers[-1] > count * LARGEST_GAP or numbers[-1] >= 2**31:
        raise FapStreamError("the time codes leap too far; give the frame rate with --rate")
    found = _usual(float(numbers[-1] / (seconds[-1] - seconds[0])))
    missing = int((ahead - 1.0).sum())
    findings = []
    if missing:
        at = int(np.argmax(ahead)) + 2
        text = f"the take lacks {missing} of {int(numbers[-1]) + 1} frames, the most before frame {at} of the file"
        findings.append(Finding("info", "missing-frames", text, f"frame {at}"))
    return numbers.astype(np.int32), found, findings


def _seconds(codes: list[tuple[int, float]]) -> np.ndarray:
    """Times in seconds, rising over midnight, at the base that makes the steps most even."""
    whole = np.array([c[0] for c in codes], dtype=np.float64)
    whole += _DAY * np.concatenate([[0], np.cumsum([b - a < -_DAY / 2 for a, b in pairwise(whole.tolist())])])
    parts = np.array([c[1] for c in codes])
    times = [whole + parts / base for base in _BASES if parts.max() < base] or [whole + parts / (parts.max() + 1.0)]
    return min(times, key=_unevenness)


def _unevenness(seconds: np.ndarray) -> float:
    """Mean distance of the steps from the middle one, in steps; rounded, so that the first of equals is taken."""
    steps = np.diff(seconds)
    middle = float(np.median(steps))
    return round(float(np.abs(steps / middle - 1.0).mean()), 2) if middle > 0.0 else np.inf


def _usual(rate: float) -> float:
    """The usual frame rate that is nearest, if it is near."""
    best = min(_RATES, key=lambda r: abs(r - rate))
    return best if abs(best - rate) <= _SNAP * best else rate
