"""A player in another language, written from the page about golden frames, gives the golden frames."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fat.golden import compare
from formats import read_face
from formats.fap import read_fap
from formats.golden import read_golden
from samples import sample

pytestmark = pytest.mark.peer

PLAYER = Path(__file__).with_name("golden_player.mjs")


def test_a_player_in_javascript_gives_the_golden_frames(tmp_path: Path) -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not on PATH")
    golden = read_golden(sample("golden/every_fap.npz"))
    (tmp_path / "ids.json").write_text(json.dumps(golden.ids.tolist()))
    face, stream = sample("faces/source.wrl.gz"), sample("streams/every_fap.fap")
    words = (node, PLAYER, face, stream, tmp_path / "ids.json", tmp_path / "frames.f32")
    subprocess.run(words, check=True, timeout=120)
    places = np.fromfile(tmp_path / "frames.f32", "<f4").reshape(-1, len(golden.ids), 3)
    found = compare(read_face(face), read_fap(stream)[0], replace(golden, neutral=places[0], frames=places[1:]))
    assert len(found) == 90
    assert max(d.largest for d in found) < 0.02  # Single precision.
