"""A FAP stream for testing players: every table of a face at and between its borders, and beyond them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from fat.face import AnimatableFace
from fat.tables import FaceDefTable
from fba.arrays import Ints
from fba.faps import EXPRESSION_FAP, FAP_COUNT
from fba.high_level import BLEND_MAX, EXPRESSIONS, VISEMES
from fba.stream import EXPRESSION_FIELDS, VISEME_FIELDS, FapStream

FRAME_RATE = 25.0
TURNS = (-60000, -20001, 7, 20000, 60000)
"""Values of FAPs that only turn a Transform, 1e-5 radians: small, ordinary, far."""
MIXTURES = 16
"""Frames in which many FAPs play together."""
SEED = 14496
AMOUNT = 0.5
"""Share of a table's outermost border that a mixture uses at most."""


def every_fap(face: AnimatableFace) -> FapStream:
    """One frame after another: neutral, each low-level FAP alone, visemes, expressions, their blends, mixtures."""
    low = [t for t in face.tables if t.fap_id > EXPRESSION_FAP]
    frames: list[dict[int, int]] = [{}]
    frames += [{table.fap_id: value} for table in low for value in values_of(table)]
    visemes, expressions = _viseme_rows(), _expression_rows()
    alone = len(frames)
    total = alone + len(visemes) + len(expressions) + MIXTURES
    values = np.zeros((total, FAP_COUNT), dtype=np.int32)
    mask = np.zeros((total, FAP_COUNT), dtype=bool)
    spoken = np.zeros((total, len(VISEME_FIELDS)), dtype=np.int32)
    felt = np.zeros((total, len(EXPRESSION_FIELDS)), dtype=np.int32)
    for k, frame in enumerate(frames + [{}] * (len(visemes) + len(expressions)) + _mixtures(low)):
        for number, value in frame.items():
            values[k, number - 1], mask[k, number - 1] = value, True
    talking = slice(alone, alone + len(visemes))
    spoken[talking], mask[talking, 0] = visemes, True
    feeling = slice(talking.stop, talking.stop + len(expressions))
    felt[feeling], mask[feeling, 1] = expressions, True
    last = np.arange(feeling.stop, total)
    spoken[last], felt[last] = (rows[np.arange(MIXTURES) % len(rows)] for rows in (visemes, expressions))
    mask[last, 0] = last % 2 == 0
    mask[last, 1] = last % 3 == 0
    spoken[~mask[:, 0]], felt[~mask[:, 1]] = 0, 0
    return FapStream(FRAME_RATE, values, mask, spoken, felt, np.arange(total, dtype=np.int32), "every_fap")


def values_of(table: FaceDefTable) -> list[int]:
    """Borders of a table's intervals, the middles between them, and as far again beyond both ends."""
    borders = sorted({int(b) for mesh in table.meshes for b in mesh.interval_borders} | {0})
    if len(borders) < 2:
        return list(TURNS)
    middles = [round((a + b) / 2) for a, b in pairwise(borders)]
    beyond = [2 * borders[0] - borders[1], 2 * borders[-1] - borders[-2]]
    return sorted({*borders, *middles, *beyond} - {0})


def _viseme_rows() -> Ints:
    rows = []
    for viseme in VISEMES:
        other = viseme.id % len(VISEMES) + 1
        rows += [(viseme.id, 0, BLEND_MAX, 0), (viseme.id, 0, 21, 0), (0, viseme.id, 21, 0), (viseme.id, other, 40, 0)]
    return np.array(rows, dtype=np.int32)


def _expression_rows() -> Ints:
    rows = []
    for expression in EXPRESSIONS:
        other = expression.id % len(EXPRESSIONS) + 1
        rows += [(expression.id, BLEND_MAX, 0, 0, 0, 0), (expression.id, 20, 0, 0, 0, 0)]
        rows += [(0, 0, expression.id, 30, 0, 0), (expression.id, 40, other, 30, 0, 0)]
    return np.array(rows, dtype=np.int32)


def _mixtures(tables: list[FaceDefTable]) -> list[dict[int, int]]:
    rng = np.random.default_rng(SEED)
    out = []
    for _ in range(MIXTURES):
        chosen = rng.choice(len(tables), size=12, replace=False)
        ends = [values_of(tables[k]) for k in sorted(chosen)]
        shares = rng.uniform(-AMOUNT, AMOUNT, size=len(ends))
        pairs = zip(sorted(chosen), ends, shares, strict=True)
        out.append({tables[k].fap_id: round(abs(s) * (e[-1] if s > 0 else e[0])) for k, e, s in pairs})
    return out
