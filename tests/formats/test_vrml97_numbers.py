"""Numbers as text in bulk: every number reads back the same, as short as it can be."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from formats.vrml97.decimals import decimals
from formats.vrml97.printer import number_words, shortest_float32

ROUNDED = st.integers(-(10**9), 10**9).flatmap(lambda k: st.integers(0, 9).map(lambda p: k / 10.0**p))


@given(st.lists(ROUNDED | st.sampled_from([0.0, -0.0, 1e-5, 123456.0]), min_size=1, max_size=40), st.integers(1, 7))
def test_what_is_written_reads_back_the_same(values: list[float], per_line: int) -> None:
    text = decimals(np.array(values), per_line)
    if text is None:
        return
    read = [float(word) for word in text.split()]
    assert read == values
    assert [np.signbit(x) for x in read] == [np.signbit(x) for x in values]
    assert [len(line.split(" ")) for line in text.split("\n")[:-1]] == [per_line] * ((len(values) - 1) // per_line)


def test_rounded_numbers_are_written_as_repr_does() -> None:
    values = np.round(np.random.default_rng(3).normal(size=2000), 4)
    values = values[(np.abs(values) >= 1e-4) | (values == 0.0)]
    text = decimals(values, 12)
    assert text is not None
    assert text.split() == number_words(values)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1 / 3, 1e22, 1e-20, 0.1 + 0.2])
def test_numbers_of_many_digits_are_left_to_others(value: float) -> None:
    assert decimals(np.array([1.0, value]), 12) is None


@given(st.lists(st.floats(width=32, allow_nan=False) | ROUNDED, min_size=1, max_size=30))
def test_shortest_decimal_of_a_float32(values: list[float]) -> None:
    single = np.array(values).astype(np.float32)
    found = shortest_float32(single)
    assert np.array_equal(found.astype(np.float32), single)
    assert [float(str(x)) for x in single] == found.tolist()
