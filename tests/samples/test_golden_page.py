"""The page for authors of players says what the shipped files hold."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from fat import AnimatableFace
from fat.golden import EVERY
from fba.faps import faps
from formats import read_face
from formats.fap import read_fap
from formats.golden import read_golden
from samples import sample

PAGE = (Path(__file__).parents[2] / "docs" / "golden.md").read_text("utf-8")


@pytest.fixture(scope="module")
def face() -> AnimatableFace:
    return read_face("default")


def test_sizes_are_those_of_the_files(face: AnimatableFace) -> None:
    stream, golden = read_fap(sample("streams/every_fap.fap"))[0], read_golden(sample("golden/every_fap.npz"))
    frames, kept = len(stream), len(golden.ids)
    assert f"{frames} frames as text" in PAGE
    assert f"`ids ({kept},)`" in PAGE
    assert f"`neutral ({kept}, 3)`" in PAGE
    assert f"`vertices ({frames}, {kept}, 3)`" in PAGE
    assert f"The {kept} vertices" in PAGE
    assert f"every {EVERY}th" in PAGE
    assert f"{len(face.tables)} `FaceDefTables`" in PAGE
    assert stream.frame_rate == 25
    assert not stream.visemes[:, 3].any()
    assert not stream.expressions[:, 4:].any()


def test_units_are_those_of_the_standard_and_of_the_face(face: AnimatableFace) -> None:
    rows = re.findall(r"^\| (\w+) \| [^|]*\| ([\d.]*) *\| [^|]*\| ([\d, to]+) \|$", PAGE, re.MULTILINE)
    named = {unit: numbers(text) for unit, _, text in rows}
    for one in faps():
        assert one.id in named[one.unit.value or "none"], one.name
    assert sum(map(len, named.values())) == len(faps())
    distances = {unit: float(value) for unit, value, _ in rows if value}
    mine = face.fapu
    wanted = {"IRISD": mine.irisd0, "ES": mine.es0, "ENS": mine.ens0, "MNS": mine.mns0, "MW": mine.mw0}
    assert distances == pytest.approx(wanted, rel=1e-7)


def numbers(text: str) -> set[int]:
    """What "3 to 5, 8" names."""
    out: set[int] = set()
    for part in text.split(", "):
        first, _, last = part.partition(" to ")
        out |= set(range(int(first), int(last or first) + 1))
    return out
