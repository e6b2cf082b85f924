"""The demo: everything it promises for one head, and how it ends when it is interrupted."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import psutil
import pytest
from PIL import Image, ImageSequence

from fat.evaluate import Player
from formats import read_face, read_scene
from formats.fap import read_fap
from samples import sample
from studio.checking import check_face
from studio.cli.outcome import Outcome
from studio.demo import HEADS, DemoRow, make_head


@pytest.fixture(scope="module")
def row(tmp_path_factory: pytest.TempPathFactory) -> DemoRow:
    return make_head("tri_head.obj", tmp_path_factory.mktemp("demo"))


def test_every_head_is_shipped_with_its_points() -> None:
    for head in HEADS:
        assert sample(f"faces/{head}").exists()
        assert sample(f"faces/{head}").with_suffix(".fps.json").exists()


def test_the_row_tells_of_the_head(row: DemoRow) -> None:
    head = read_scene(sample("faces/tri_head.obj"))
    assert row.vertices == head.vertex_count
    assert row.tables == len(read_face("default").tables)
    assert row.worst_own < 0.05
    assert row.seconds > 0
    assert not [f for f in row.findings if f.severity == "error"]


def test_both_faces_read_back_check_and_play_alike(row: DemoRow) -> None:
    vrml, usd = (read_face(path) for path in row.files[:2])
    for face in (vrml, usd):
        result = check_face(face, read_face("default"))
        assert result.passed, result.problems
        assert len(face.tables) == row.tables
    smile = {3: 200, 12: 200, 13: 200, 48: 3000}
    np.testing.assert_array_equal(Player(vrml).pose(smile).world(), Player(usd).pose(smile).world())


def test_the_film_lasts_as_long_as_the_stream_and_moves(row: DemoRow) -> None:
    stream, _ = read_fap(sample("streams/demo.fap"))
    with Image.open(row.files[2]) as film:
        frames = [np.asarray(f.convert("RGB")).astype(int) for f in ImageSequence.Iterator(film)]
        lasts = [f.info["duration"] for f in ImageSequence.Iterator(film)]
    # Equal pictures in a row are one picture that stays longer.
    assert len(stream) / 2 < len(frames) <= len(stream)
    assert sum(lasts) == round(1000 * len(stream) / stream.frame_rate)
    assert max(np.abs(f - frames[0]).max() for f in frames) > 50


def test_the_sheet_shows_more_than_paper(row: DemoRow) -> None:
    with Image.open(row.files[3]) as sheet:
        assert np.asarray(sheet.convert("L")).std() > 10


def test_nothing_else_is_left_in_the_folder(row: DemoRow) -> None:
    assert sorted(row.files[0].parent.iterdir()) == sorted(row.files)


def _running(group: int) -> list[int]:
    """The processes of a group that still run; what has ended but was not collected by its parent does not."""
    found = []
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error, ProcessLookupError, PermissionError):
            if os.getpgid(process.pid) == group and process.status() != psutil.STATUS_ZOMBIE:
                found.append(process.pid)
    return found


def _all_gone(group: int) -> bool:
    """Wait until a group has no process left; helpers of the interpreter end a little after it."""
    for _ in range(200):
        if not _running(group):
            return True
        time.sleep(0.05)
    return False


@pytest.mark.parametrize("times", [1, 2])
def test_an_interrupt_ends_the_workers_too(tmp_path: Path, times: int) -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "studio.cli", "demo", "-o", str(tmp_path)],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    for _ in range(400):
        if len(_running(process.pid)) > 1:
            break
        time.sleep(0.05)
    assert len(_running(process.pid)) > 1
    time.sleep(1.0)
    for _ in range(times):
        process.send_signal(signal.SIGINT)
        # Two signals that arrive together are one.
        time.sleep(0.004)
    _, said = process.communicate(timeout=30)
    assert process.returncode == Outcome.INTERRUPTED
    assert said.endswith("fba: interrupted\n")
    assert _all_gone(process.pid)
    assert not [p for p in tmp_path.iterdir() if p.name.startswith(".") or p.suffix == ".png"]
