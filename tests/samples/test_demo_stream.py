"""The shipped stream reads back, uses what the source can play, and stays within the standard's ranges."""

from __future__ import annotations

import numpy as np

from fat.evaluate import Player
from fba.faps import fap
from formats import read_face
from formats.fap import read_fap, write_fap
from samples import default_source, sample
from samples.build.stream import FRAMES, demo_stream


def test_file_is_what_the_script_writes(tmp_path) -> None:
    write_fap(demo_stream(), tmp_path / "demo.fap")
    assert (tmp_path / "demo.fap").read_bytes() == sample("streams/demo.fap").read_bytes()


def test_reads_without_findings() -> None:
    stream, findings = read_fap(sample("streams/demo.fap"))
    assert findings == []
    assert len(stream) == FRAMES
    assert stream.frame_rate == 25.0


def test_values_are_in_range_and_have_tables() -> None:
    stream, _ = read_fap(sample("streams/demo.fap"))
    face = read_face(default_source())
    for number in np.flatnonzero(stream.mask[:, 2:].any(axis=0)) + 3:
        low, high = fap(int(number)).i_range
        column = stream.values[:, number - 1]
        assert low <= column.min()
        assert column.max() <= high
        assert face.tables.get(int(number)) is not None


def test_face_moves_and_comes_back_to_rest() -> None:
    stream, _ = read_fap(sample("streams/demo.fap"))
    face = read_face(default_source())
    rest = face.scene.world_neutral()
    frames = [pose.world() for pose in Player(face).frames(stream)]
    assert np.abs(frames[0] - rest).max() < 1e-9
    assert np.abs(frames[-1] - rest).max() < 1e-3 * face.fapu.es0
    assert max(float(np.abs(f - rest).max()) for f in frames) > 0.2 * face.fapu.es0
