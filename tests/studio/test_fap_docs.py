"""docs/faps.md says what the data say."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from fba.amplitudes import amplitudes
from fba.faps import Fap, faps
from fba.high_level import EXPRESSIONS, VISEMES
from studio.fap_sheet import SECTIONS

TEXT = (Path(__file__).resolve().parents[2] / "docs" / "faps.md").read_text("utf-8")
ROWS = [[cell.strip() for cell in line.strip("|").split("|")] for line in TEXT.splitlines() if re.match(r"\| \d", line)]


@pytest.mark.parametrize("definition", faps()[2:], ids=lambda f: f.name)
def test_a_fap_is_told_with_its_amplitudes(definition: Fap) -> None:
    (row,) = [r for r in ROWS if r[1] == definition.name]
    amplitude = amplitudes()[definition.id]
    values = ", ".join(f"{v:+d}" for v in sorted(amplitude.values))
    assert row == [
        str(definition.id),
        definition.name,
        definition.unit.value,
        definition.positive_motion,
        values,
        amplitude.reason,
    ]


def test_visemes_and_expressions_are_told() -> None:
    told = {(r[0], r[1]) for r in ROWS}
    assert {(str(e.id), e.name) for e in (*VISEMES, *EXPRESSIONS)} <= told


def test_every_picture_of_the_sheet_is_shown() -> None:
    names = [s.name for s in SECTIONS] + ["visemes", "expressions"]
    assert re.findall(r"images/faps_(\w+)\.png", TEXT) == names
