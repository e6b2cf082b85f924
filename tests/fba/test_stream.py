from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fba import FapStream
from fba.errors import FapStreamError


def test_build_masks_what_is_given() -> None:
    stream = FapStream.build(25, 2, {3: [1.4, 2.6]}, visemes=[[1, 0, 63, 0], [2, 0, 63, 0]])
    assert stream.values[:, 2].tolist() == [1, 3]
    assert np.flatnonzero(stream.mask[0]).tolist() == [0, 2]
    assert stream.visemes[1, 0] == 2
    assert not stream.expressions.any()
    assert len(stream) == 2


def test_held_keeps_the_last_value_of_faps_that_a_frame_leaves_out() -> None:
    stream = FapStream.build(25, 4, {3: [5, 0, 0, 7], 4: [0, 9, 0, 0]}, [[1, 0, 63, 0]] * 4, [[6, 40, 0, 0, 0, 0]] * 4)
    mask = stream.mask.copy()
    mask[:, 2] = [True, False, False, True]
    mask[:, 3] = [False, True, False, False]
    mask[:, 0] = [False, False, True, False]
    mask[:, 1] = [True, False, False, False]
    visemes = stream.visemes * mask[:, :1]
    expressions = stream.expressions * mask[:, 1:2]
    held = replace(stream, mask=mask, visemes=visemes, expressions=expressions).held()
    assert held.values[:, 2].tolist() == [5, 5, 5, 7]
    assert held.values[:, 3].tolist() == [0, 9, 9, 9]
    assert held.visemes[:, 0].tolist() == [0, 0, 1, 1]
    assert held.expressions[:, 1].tolist() == [40, 40, 40, 40]
    assert held.mask[:, 3].tolist() == [False, True, True, True]
    assert held.mask[:, 0].tolist() == [False, False, True, True]
    assert not held.mask[:, 4:].any()


def test_an_explicit_zero_ends_the_holding() -> None:
    stream = FapStream.build(25, 3, {3: [5, 0, 0]})
    mask = stream.mask.copy()
    mask[2, 2] = False
    assert replace(stream, mask=mask).held().values[:, 2].tolist() == [5, 0, 0]


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), float("inf")])
def test_bad_frame_rates(rate: float) -> None:
    with pytest.raises(FapStreamError, match="frame rate"):
        FapStream.build(rate, 1)


def test_arrays_of_different_length() -> None:
    stream = FapStream.build(25, 3)
    with pytest.raises(FapStreamError, match="different numbers of frames"):
        replace(stream, frame_numbers=np.arange(2))
