from __future__ import annotations

import numpy as np
import pytest

from fat import deform
from fat.deform import LONGEST, SHORTEST, Column, Deformer

COUNT = 2 * LONGEST + 3 * SHORTEST + 5
"""Vertices that fill neither the last tile nor the last stretch."""


def columns_of(rng: np.random.Generator) -> list[Column]:
    """Local and wide columns, one without vertices, one with a vertex twice, and one that comes twice."""
    made = []
    for size in (1, 5, SHORTEST, 100, 700, COUNT, 0):
        start = int(rng.integers(0, COUNT - size + 1))
        index = rng.permutation(np.arange(start, start + size, dtype=np.int32))
        made.append(Column(index, rng.normal(size=(size, 3))))
    made.append(Column(np.array([7, COUNT - 1, 7], dtype=np.int32), rng.normal(size=(3, 3))))
    made.insert(2, made[4])
    return made


def plain(neutral: np.ndarray, columns: list[Column], weights: np.ndarray) -> np.ndarray:
    """The sum, one column after the other."""
    out = np.repeat(neutral[None], len(weights), axis=0)
    for frame, row in zip(out, weights, strict=True):
        for weight, column in zip(row, columns, strict=True):
            np.add.at(frame, column.index, weight * column.slopes)
    return out


@pytest.mark.parametrize("active", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("costs", [(0, 0), (0, 1000), (200_000, 20), (10**9, 0)], ids=str)
def test_stretches_of_any_length_give_the_plain_sum(
    active: float, costs: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(deform, "PRODUCT_COST", costs[0])
    monkeypatch.setattr(deform, "COPY_COST", costs[1])
    rng = np.random.default_rng(5)
    neutral, columns = rng.normal(size=(COUNT, 3)), columns_of(rng)
    weights = rng.normal(size=(4, len(columns))) * (rng.random(len(columns)) < active)
    expected = plain(neutral, columns, weights)
    size = np.abs(expected).max()
    found = Deformer(neutral, columns, np.float64)(weights)
    assert found.dtype == np.float64
    assert np.abs(found - expected).max() < 1e-15 * len(columns) * size
    found32 = Deformer(neutral, columns, np.float32)(weights)
    assert found32.dtype == np.float32
    assert np.abs(found32 - expected).max() < 1e-7 * len(columns) * size


def test_vertices_without_weights_are_neutral_bit_by_bit() -> None:
    rng = np.random.default_rng(6)
    neutral, columns = rng.normal(size=(COUNT, 3)), columns_of(rng)
    weights = np.zeros((3, len(columns)))
    weights[1, 1] = 1e30
    still = np.delete(np.arange(COUNT), columns[1].index)
    for number in (np.float64, np.float32):
        found = Deformer(neutral, columns, number)(weights)
        rest = neutral.astype(number)
        assert found[0].tobytes() == found[2].tobytes() == rest.tobytes()
        assert found[1, still].tobytes() == rest[still].tobytes()
        assert (found[1] != rest).any()


def test_nothing_to_move() -> None:
    neutral = np.arange(9.0).reshape(3, 3)
    assert np.array_equal(Deformer(neutral, [], np.float64)(np.zeros((2, 0))), [neutral, neutral])
    assert Deformer(neutral[:0], [], np.float64)(np.zeros((2, 0))).shape == (2, 0, 3)


def test_stretches_are_long_where_few_columns_are_used() -> None:
    tiles = 2 * LONGEST // SHORTEST
    length, used = deform._stretches(SHORTEST, np.ones((tiles, 1), dtype=bool), 64, 20)
    assert (length, used.shape) == (LONGEST, (2, 1))
    # Sixty columns of their own in every tile: together, they would multiply more zeros than a product costs.
    apart = np.kron(np.eye(tiles, dtype=bool), np.ones((1, 60), dtype=bool))
    length, used = deform._stretches(SHORTEST, apart, 512, 20)
    assert length == SHORTEST
    assert used is apart
