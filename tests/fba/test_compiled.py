"""Loops are compiled where numba is there and wanted, and only then."""

from __future__ import annotations

import subprocess
import sys

import pytest

from fba.compiled import SWITCH, compiled


def _sum_of_squares(count: int) -> int:
    total = 0
    for k in range(count):
        total += k * k
    return total


def test_a_loop_is_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("numba")
    monkeypatch.delenv(SWITCH, raising=False)
    loop = compiled(_sum_of_squares)
    assert loop is not None
    assert loop is not _sum_of_squares
    assert loop(1000) == _sum_of_squares(1000)


def test_the_switch_takes_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(SWITCH, "0")
    assert compiled(_sum_of_squares) is None


def test_without_numba_there_is_no_loop() -> None:
    code = (
        "import sys; sys.modules['numba'] = None\n"
        "from fba.compiled import compiled\n"
        "def loop(): pass\n"
        "print(compiled(loop))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "None"
