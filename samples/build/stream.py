"""The shipped FAP stream: six seconds in which every kind of parameter plays, written by rule."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from fba.arrays import Floats, Ints
from fba.high_level import BLEND_MAX, EXPRESSIONS, VISEMES
from fba.stream import EXPRESSION_FIELDS, VISEME_FIELDS, FapStream
from samples.build.geodesic import smoothstep

FRAME_RATE = 25.0
FRAMES = 150

Key = tuple[float, float]
"""Time in seconds, value."""

DEGREE = np.pi / 180.0 / 1e-5
"""In FAP angle units."""

_BLINK = ((0.0, 0.0), (0.12, 1.0), (0.16, 1.0), (0.36, 0.0))

SPEECH = (
    (1.8, "sil"),
    (1.96, "E"),
    (2.12, "nn"),
    (2.32, "oh"),
    (2.48, "ou"),
    (2.68, "PP"),
    (2.84, "aa"),
    (3.04, "sil"),
)
"""Time of each viseme's full value: about "hello pa"."""


def demo_stream() -> FapStream:
    """Blink, look around, raise the brows, speak, smile, be surprised, nod."""
    blinks = _blinks(0.4, 1.7, 3.4, 5.5)
    yaw = _curve(
        ((0.6, 0), (0.75, 18 * DEGREE), (1.0, 18 * DEGREE), (1.15, -18 * DEGREE), (1.4, -18 * DEGREE), (1.55, 0))
    )
    pitch = _curve(((0.6, 0), (0.75, 5 * DEGREE), (1.4, -6 * DEGREE), (1.55, 0)))
    brows = _curve(((1.4, 0), (1.6, 180), (1.8, 180), (2.0, 0)))
    nod = _curve(((5.0, 0), (5.2, 10 * DEGREE), (5.4, -3 * DEGREE), (5.6, 7 * DEGREE), (5.85, 0)))
    turn = _curve(((0.6, 0), (0.9, 6 * DEGREE), (1.3, -6 * DEGREE), (1.6, 0)))
    tilt = _curve(((3.3, 0), (3.6, 4 * DEGREE), (4.0, 4 * DEGREE), (4.2, 0)))
    jaw = _curve(((1.8, 0), (1.96, 60), (2.32, 120), (2.68, 0), (2.84, 160), (3.04, 0)))
    faps: dict[int, object] = {
        3: jaw,
        19: 1024 * blinks,
        20: 1024 * blinks,
        23: yaw,
        24: yaw,
        25: pitch,
        26: pitch,
        **dict.fromkeys((31, 32), brows),
        **dict.fromkeys((33, 34), 0.9 * brows),
        **dict.fromkeys((35, 36), 0.6 * brows),
        48: nod,
        49: turn,
        50: tilt,
    }
    return FapStream.build(FRAME_RATE, FRAMES, faps, _speech(), _moods(), name="demo")


def _times() -> Floats:
    return np.arange(FRAMES) / FRAME_RATE


def _curve(keys: Sequence[Key]) -> Floats:
    """Values (FRAMES,) that ease from key to key and hold before the first and after the last."""
    t = _times()
    out = np.full(FRAMES, float(keys[0][1]))
    for (start, a), (end, b) in pairwise(keys):
        inside = t >= start
        out[inside] = a + (b - a) * smoothstep((t[inside] - start) / (end - start))
    return out


def _blinks(*starts: float) -> Floats:
    out = np.zeros(FRAMES)
    for start in starts:
        out = np.maximum(out, _curve([(start + t, v) for t, v in _BLINK]))
    return out


def _speech() -> Ints:
    """Fields of FAP 1: between two visemes the blend runs from the first to the second."""
    number = {"sil": 0} | {v.name: v.id for v in VISEMES}
    rows = np.zeros((FRAMES, len(VISEME_FIELDS)), dtype=np.int32)
    for (start, first), (end, second) in pairwise(SPEECH):
        t = _times()
        inside = (t >= start) & (t < end)
        share = 1.0 - smoothstep((t[inside] - start) / (end - start))
        rows[inside, 0] = number[first]
        rows[inside, 1] = number[second]
        rows[inside, 2] = np.rint(BLEND_MAX * share)
    return rows


def _moods() -> Ints:
    """Fields of FAP 2: joy first, then surprise takes over."""
    number = {e.name: e.id for e in EXPRESSIONS}
    joy = _curve(((3.1, 0), (3.4, BLEND_MAX), (4.0, BLEND_MAX), (4.25, 0)))
    surprise = _curve(((4.05, 0), (4.3, BLEND_MAX), (4.7, BLEND_MAX), (5.0, 0)))
    rows = np.zeros((FRAMES, len(EXPRESSION_FIELDS)), dtype=np.int32)
    rows[:, 1], rows[:, 3] = np.rint(joy), np.rint(surprise)
    rows[:, 0] = np.where(rows[:, 1] > 0, number["joy"], 0)
    rows[:, 2] = np.where(rows[:, 3] > 0, number["surprise"], 0)
    return rows
