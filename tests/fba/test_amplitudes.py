"""Normal amplitudes: one for each direction that the standard gives a FAP."""

from __future__ import annotations

import pytest

from fba.amplitudes import amplitudes
from fba.faps import LOW_LEVEL_FAPS, Fap, fap, faps


def test_every_low_level_fap_has_one() -> None:
    assert list(amplitudes()) == list(LOW_LEVEL_FAPS)


@pytest.mark.parametrize("definition", faps()[2:], ids=lambda f: f.name)
def test_amplitudes_keep_to_the_standard(definition: Fap) -> None:
    amplitude = amplitudes()[definition.id]
    low, high = definition.i_range
    assert 0 < amplitude.positive <= high
    assert definition.bidirectional == (amplitude.negative is not None)
    assert amplitude.negative is None or low <= amplitude.negative < 0
    assert amplitude.reason


def test_both_sides_have_the_same() -> None:
    for definition in faps()[2:]:
        if definition.mirror is not None:
            assert amplitudes()[definition.id].values == amplitudes()[fap(definition.mirror).id].values
