"""``fba convert``, and playing and inspecting every kind of stream."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from faces import small_face
from typer.testing import CliRunner, Result

from fat.open_jaw import open_jaw_mode
from formats import read_face, write
from formats.arkit_csv import COLUMNS
from formats.fap import read_fap
from formats.timecode import timecode
from samples import sample
from studio.cli.app import app
from studio.cli.outcome import Outcome

CUES = "0.00\tX\n0.10\tD\n0.30\tA\n0.40\tX\n"


def fba(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def refused(result: Result, *said: str) -> None:
    assert result.exit_code == Outcome.BAD_INPUT, result.output
    assert result.stderr.startswith("fba: error: ")
    assert result.stderr.count("\n") == 1
    for words in said:
        assert words in result.stderr


@pytest.fixture
def cues(tmp_path: Path) -> Path:
    path = tmp_path / "cues.tsv"
    path.write_text(CUES)
    return path


@pytest.fixture
def curves(tmp_path: Path) -> Path:
    """Three frames: at rest, jaw half open, eyes shut and the head turned."""
    path = tmp_path / "take.csv"
    frames = ({}, {"JawOpen": 0.5}, {"EyeBlinkLeft": 1.0, "EyeBlinkRight": 1.0, "HeadYaw": 0.3})
    lines = ["Timecode,BlendShapeCount," + ",".join(COLUMNS)]
    lines += [
        f"{timecode(k / 30)},61," + ",".join(str(frame.get(c, 0.0)) for c in COLUMNS) for k, frame in enumerate(frames)
    ]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_help() -> None:
    result = fba("convert", "--help")
    assert result.exit_code == 0
    assert all(f"--{option}" in result.stdout for option in ("rate", "quantizer", "open-jaw"))


def test_every_kind_becomes_every_other(tmp_path: Path, cues: Path, curves: Path) -> None:
    assert fba("convert", cues, tmp_path / "cues.fap").exit_code == 0
    assert fba("convert", cues, tmp_path / "cues.fba").exit_code == 0
    result = fba("convert", tmp_path / "cues.fba", tmp_path / "again.fap")
    assert result.exit_code == 0
    assert "experimental" in result.stdout
    assert "again.fap: FAP text, 20 frames at 50/s" in result.stdout
    wanted, again = read_fap(tmp_path / "cues.fap")[0], read_fap(tmp_path / "again.fap")[0]
    assert np.array_equal(wanted.visemes, again.visemes)
    for name in ("take.fap", "take.fba", "take2.csv"):
        result = fba("convert", curves, tmp_path / name)
        assert result.exit_code == 0, result.output
        assert "3 frames at 30/s" in result.stdout
    stream = read_fap(tmp_path / "take.fap")[0]
    assert stream.values[1, 2] > 500
    assert stream.values[2, [18, 19, 48]].tolist() == [1024, 1024, -30000]


def test_the_same_input_gives_the_same_bytes(tmp_path: Path, curves: Path) -> None:
    for kind in ("fap", "fba", "csv"):
        for name in ("a", "b"):
            assert fba("convert", curves, tmp_path / f"{name}.{kind}").exit_code == 0
        assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()


def test_the_shipped_stream_by_name_and_the_quantizer(tmp_path: Path) -> None:
    sizes = []
    for scale in ("1", "8"):
        result = fba("convert", "demo", tmp_path / "demo.fba", "--quantizer", scale)
        assert result.exit_code == 0
        assert f"steps of the scale {scale}" in result.stdout
        sizes.append((tmp_path / "demo.fba").stat().st_size)
    assert sizes[1] < sizes[0]


def test_rates(tmp_path: Path, cues: Path, curves: Path) -> None:
    for path, frames in ((cues, 10), (curves, 3)):
        result = fba("convert", path, tmp_path / "x.fap", "--rate", 25)
        assert f"{frames} frames at 25/s" in result.stdout
    refused(fba("convert", "demo", tmp_path / "x.fap", "--rate", 25), "tells its own frame rate")
    refused(fba("convert", cues, tmp_path / "x.fap", "--rate", 0), "positive")


def test_strict_jaws(tmp_path: Path, curves: Path) -> None:
    assert fba("convert", curves, tmp_path / "x.fap", "--open-jaw", "strict").exit_code == 0
    assert read_fap(tmp_path / "x.fap")[0].values[1, 4] < -500, "the lower lip is lowered by its own FAP"
    result = fba("convert", curves, tmp_path / "x.csv", "--open-jaw", "strict")
    assert result.exit_code == Outcome.USAGE


def test_wrong_names_and_options(tmp_path: Path, cues: Path) -> None:
    refused(fba("convert", cues, tmp_path / "x.tsv"), "x.tsv", "cannot be written", ".fap, .fba, .csv")
    refused(fba("convert", tmp_path / "x.wav", tmp_path / "x.fap"), "x.wav", "cannot be read", ".tsv")
    refused(fba("convert", tmp_path / "none.fap", tmp_path / "x.fap"), "does not exist")
    refused(fba("convert", cues, tmp_path / "nowhere" / "x.fap"), "cannot write")
    refused(fba("convert", cues, tmp_path / "x.csv"), "visemes or expressions alone")
    assert fba("convert", cues, tmp_path / "x.fap", "--quantizer", 3).exit_code == Outcome.USAGE
    assert fba("convert", cues, tmp_path / "x.fba", "--quantizer", 32).exit_code == Outcome.USAGE
    assert not list(tmp_path.glob("x.*"))


@pytest.mark.parametrize("name", ["bad.fap", "bad.fba", "bad.csv", "bad.json", "bad.tsv"])
def test_damaged_streams_end_with_one_message(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"\x7f garbage\n\xff\xfe 3\n")
    refused(fba("convert", tmp_path / name, tmp_path / "out.fap"), name)
    assert not (tmp_path / "out.fap").exists()


def test_playing_cues_and_curves(tmp_path: Path, cues: Path, curves: Path) -> None:
    """The open jaw and the shut lips of the streams are seen in the vertices."""
    face = read_face("default")
    assert open_jaw_mode(face) == "practical"

    def moved(stream: Path) -> np.ndarray:
        result = fba("play", "default", stream, "-o", tmp_path / "out.npz")
        assert result.exit_code == 0, result.output
        with np.load(tmp_path / "out.npz") as arrays:
            assert arrays["fps"] == (30.0 if stream == curves else 50.0)
            return np.abs(arrays["vertices"] - arrays["neutral"]).sum(axis=2).max(axis=1)

    take, speech = moved(curves), moved(cues)
    assert take[0] == 0.0
    assert take[1] > 0.0
    assert take[2] > take[1]
    assert speech[0] == 0.0
    assert speech[10] > 3 * speech[17] > 0.0, "wide open, then lips together"


def test_inspecting_streams(tmp_path: Path, cues: Path, curves: Path) -> None:
    assert fba("convert", "demo", tmp_path / "demo.fba").exit_code == 0
    for path, frames in ((cues, 20), (curves, 3), (tmp_path / "demo.fba", 150), (sample("streams/demo.fap"), 150)):
        result = fba("inspect", path, "--json")
        assert result.exit_code == 0
        about = json.loads(result.stdout)
        assert (about["kind"], about["frames"]) == ("FAP stream", frames)


def test_every_kind_becomes_the_animation_of_a_face(tmp_path: Path, cues: Path, curves: Path) -> None:
    write(small_face(), tmp_path / "face.wrl")
    assert fba("convert", curves, tmp_path / "take.fba").exit_code == 0
    for path, frames in ((cues, 20), (curves, 3), (tmp_path / "take.fba", 3)):
        result = fba("export", tmp_path / "face.wrl", "-o", tmp_path / "face.bt", "--stream", path)
        assert result.exit_code == 0, result.output
        assert f"{frames} frames" in result.stdout
        assert fba("convert", tmp_path / "face.bt", tmp_path / "again.fap").exit_code == 0
        assert len(read_fap(tmp_path / "again.fap")[0]) == frames


def test_messages_do_not_steer_the_terminal(tmp_path: Path) -> None:
    (tmp_path / "x.fap").write_bytes(b"\x1b[2J\x07 x\x9b31m\n")
    refused(fba("convert", tmp_path / "x.fap", tmp_path / "y.fap"), "not '\N{REPLACEMENT CHARACTER}[2J")
