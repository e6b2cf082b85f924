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
    finds = fuzz.at_random("fap", tmp_path, 1, files=20)
    assert finds.tried == 20
    assert len(finds) == len(list(tmp_path.glob("fap_*.bin"))) == 1


@pytest.mark.parametrize("kind", fuzz.kinds())
def test_seeds_are_good_files(kind: str) -> None:
    target, pool = fuzz.target_of(kind), fuzz.seeds(kind)
    assert pool
    for data in pool:
        assert target(data) is not None


@pytest.mark.parametrize("kind", fuzz.kinds())
def test_a_short_run_finds_nothing(kind: str, tmp_path: Path) -> None:
    finds = fuzz.at_random(kind, tmp_path, 7, files=25)
    assert len(finds) == 0, [p.read_bytes()[:200] for p in tmp_path.iterdir()]
