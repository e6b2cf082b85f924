"""The fuzz runner: it finds what is broken, and a short run finds nothing in the readers of streams."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks import fuzz
from fba.errors import FapStreamError


def test_crashes_silence_and_slowness_are_finds(monkeypatch: pytest.MonkeyPatch) -> None:
    def ends(error: Exception | None) -> fuzz.Target:
        def target(data: bytes) -> object:
            if error is not None:
                raise error
            return data

        return target

    assert fuzz.check(ends(None), b"x") is None
    assert fuzz.check(ends(FapStreamError("line 3: damaged")), b"x") is None
    assert fuzz.check(ends(FapStreamError("")), b"x") == "an error without a message"
    assert "IndexError: 7" in str(fuzz.check(ends(IndexError(7)), b"x"))
    monkeypatch.setattr(fuzz, "SLOW", -1.0)
    assert "took" in str(fuzz.check(ends(None), b"x"))


def test_finds_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(data: bytes) -> object:
        return data[10_000]

    monkeypatch.setattr(fuzz, "STREAMS", {"fap": broken})
    tried, finds = fuzz.at_random("fap", 0.001, tmp_path, 1)
    assert tried > 1
    assert finds == len(list(tmp_path.glob("fap_*.bin"))) == 1


@pytest.mark.parametrize("name", sorted([*fuzz.STREAMS, *fuzz.SCENES]))
def test_seeds_are_good_files(name: str) -> None:
    target = fuzz.target_of(name)
    for data in fuzz.seeds(name):
        assert target(data) is not None


@pytest.mark.parametrize("name", sorted(fuzz.STREAMS))
def test_a_short_run_finds_nothing(name: str, tmp_path: Path) -> None:
    tried, finds = fuzz.at_random(name, 0.003, tmp_path, 7)
    assert tried > 0
    assert finds == 0, [p.read_bytes()[:200] for p in tmp_path.iterdir()]
