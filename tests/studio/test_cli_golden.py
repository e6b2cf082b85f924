"""``fba check --stream --golden``: frames of other players on the command line."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from faces import small_face
from typer.testing import CliRunner, Result

from fat.golden import record
from fba.stream import FapStream
from formats import read_face, write
from formats.fap import write_fap
from formats.golden import write_golden
from samples import sample
from studio.cli.app import app
from studio.cli.outcome import Outcome

GOLDEN = sample("golden/every_fap.npz")


def fba(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def test_the_shipped_frames_are_right() -> None:
    result = fba("check", "default", "--stream", "every_fap", "--golden", GOLDEN)
    assert result.exit_code == Outcome.OK, result.output
    assert "90 of 90 motions are right" in result.stdout


def test_wrong_frames_are_findings_and_the_exit_code_says_so(tmp_path: Path) -> None:
    """A player that does not turn eyeballs, and moves too far in the frames in which several FAPs play."""
    write(small_face(), tmp_path / "face.wrl")
    face = read_face(tmp_path / "face.wrl")
    stream = FapStream.build(25.0, 4, {3: [0, 100, 0, 700], 23: [0, 0, 20000, 9000]}, name="two")
    write_fap(stream, tmp_path / "two.fap")
    golden = record(face, stream)
    frames = golden.frames.copy()
    frames[2] = golden.neutral
    frames[3] = golden.neutral + 1.5 * (frames[3] - golden.neutral)
    write_golden(replace(golden, frames=frames), tmp_path / "mine.npz")
    words = ("--stream", tmp_path / "two.fap", "--golden", tmp_path / "mine.npz")
    result = fba("check", tmp_path / "face.wrl", *words, "--json")
    assert result.exit_code == Outcome.FINDINGS
    found = json.loads(result.stdout)
    assert not found["passed"]
    wrong = [m["name"] for m in found["motions"] if not m["passed"]]
    assert wrong == ["yaw_l_eyeball", "several"]
    assert [f["where"] for f in found["findings"]] == wrong
    assert [e["motions"] for e in found["explanations"]] == [["yaw_l_eyeball"]]
    result = fba("check", tmp_path / "face.wrl", *words)
    assert result.exit_code == Outcome.FINDINGS
    assert "it seems that FaceDefTransforms are not played" in " ".join(result.stdout.split())
    assert result.stdout.count("ERROR") == 1  # What is explained is not told twice.
    assert "2 of 4 motions are right" in result.stdout


def test_what_play_writes_can_be_checked(tmp_path: Path) -> None:
    """All vertices of a face, in the file's own order, with the rules that play uses."""
    write(small_face(), tmp_path / "face.wrl")
    stream = FapStream.build(25.0, 3, {3: [0, 100, 700], 23: [0, 20000, -500]}, name="two")
    write_fap(stream, tmp_path / "two.fap")
    for rules in ("none", "all"):
        words = (tmp_path / "face.wrl", tmp_path / "two.fap", "-o", tmp_path / "frames.npz", "--rules", rules)
        assert fba("play", *words).exit_code == Outcome.OK
        words = ("--stream", tmp_path / "two.fap", "--golden", tmp_path / "frames.npz", "--rules", rules)
        result = fba("check", tmp_path / "face.wrl", *words)
        assert result.exit_code == Outcome.OK, result.output
    face = read_face(tmp_path / "face.wrl")
    assert record(face, stream).frames.shape == (3, face.scene.vertex_count, 3)


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("--stream", "every_fap"), Outcome.USAGE, "go together"),
        (("--golden", GOLDEN), Outcome.USAGE, "go together"),
        (("--stream", "demo", "--golden", GOLDEN, "--source", "default"), Outcome.USAGE, "does not go with"),
        (("--stream", "demo", "--golden", GOLDEN, "--rules", "magic"), Outcome.USAGE, "--rules"),
        (("--stream", "demo", "--golden", GOLDEN), Outcome.BAD_INPUT, "150 frames, but 740"),
        (("--stream", "demo", "--golden", "no.npz"), Outcome.BAD_INPUT, "no.npz does not exist"),
    ],
)
def test_wrong_use_says_what_to_do(words: tuple[object, ...], code: int, said: str) -> None:
    result = fba("check", "default", *words)
    assert result.exit_code == code, result.output
    assert said in result.stderr
