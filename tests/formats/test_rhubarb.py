"""Rhubarb's mouth cues as visemes with cross-fades."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fba import VISEMES, FbaError
from fba.errors import FapStreamError, InputFileError, TextSyntaxError
from fba.high_level import viseme_weights
from formats.rhubarb import FADE, mouth_visemes, parse_rhubarb, read_rhubarb

HI = "0.00\tX\n0.05\tD\n0.27\tC\n0.31\tB\n0.43\tX\n0.47\tX\n"
"""Rhubarb's own example: somebody says hi."""


def document(*cues: tuple[float, float, str]) -> bytes:
    listed = [{"start": a, "end": b, "value": v} for a, b, v in cues]
    return json.dumps({"metadata": {"soundFile": "x.wav", "duration": cues[-1][1]}, "mouthCues": listed}).encode()


HI_JSON = document((0, 0.05, "X"), (0.05, 0.27, "D"), (0.27, 0.31, "C"), (0.31, 0.43, "B"), (0.43, 0.47, "X"))


def weights(data: bytes, rate: float = 1000.0) -> np.ndarray:
    """(frames, 15): how far each viseme is shown, the neutral face among them as number 0."""
    stream, _ = parse_rhubarb(data, rate=rate)
    out = np.zeros((len(stream), 15))
    for frame, (first, second, blend, _) in enumerate(stream.visemes.tolist()):
        for number, value in viseme_weights(first, second, blend).items():
            out[frame, number] = value / 63
    out[:, 0] = 1.0 - out.sum(axis=1)
    return out


def test_the_table_names_visemes_of_the_standard() -> None:
    names = {v.id: v.name for v in VISEMES} | {0: "sil"}
    wanted = {"A": "PP", "B": "SS", "C": "E", "D": "aa", "E": "oh", "F": "ou", "G": "FF", "H": "nn", "X": "sil"}
    assert {mouth: names[number] for mouth, number in mouth_visemes().items()} == wanted


def test_hi() -> None:
    stream, said = parse_rhubarb(HI.encode())
    assert not said
    assert (len(stream), stream.frame_rate) == (24, 50.0)
    assert np.flatnonzero(stream.mask.any(axis=0)).tolist() == [0]
    assert stream.mask[:, 0].all()
    assert stream.visemes[0].tolist() == [0, 0, 63, 0]
    assert stream.visemes[8].tolist() == [10, 0, 63, 0], "the open mouth in full at 0.16 s"
    assert stream.visemes[18].tolist() == [7, 0, 63, 0]
    again, said = parse_rhubarb(HI_JSON)
    assert not said
    assert np.array_equal(again.visemes, stream.visemes)


def test_every_cue_is_shown_in_full_at_its_middle() -> None:
    mouths = "XABCDEFGHX"
    cues = [(0.1 * k, 0.1 * k + 0.1, m) for k, m in enumerate(mouths)]
    shown = weights(document(*cues))
    for start, end, mouth in cues:
        assert shown[round(500 * (start + end)), mouth_visemes()[mouth]] == pytest.approx(1.0, abs=0.02)


def test_fades_are_smooth_symmetric_and_as_long_as_said() -> None:
    shown = weights(document((0, 0.4, "D"), (0.4, 0.8, "F")))
    wide, round_ = shown[:, 10], shown[:, 14]
    assert np.allclose(wide + round_, 1.0)
    assert round_[400] == pytest.approx(0.5, abs=0.01)
    assert np.all(np.diff(round_) >= 0)
    assert np.abs(np.diff(round_)).max() <= 1.5 / (1000 * FADE) + 2 / 63
    moving = np.flatnonzero((round_ > 0) & (round_ < 1))
    assert moving[0] >= 400 - 500 * FADE
    assert moving[-1] <= 400 + 500 * FADE
    assert np.allclose(round_[350:450], 1.0 - round_[450:350:-1], atol=1 / 63)


def test_short_cues_keep_their_time() -> None:
    shown = weights(document((0, 0.2, "D"), (0.2, 0.24, "A"), (0.24, 0.5, "D")))
    lips = shown[:, mouth_visemes()["A"]]
    assert lips[220] == 1.0
    assert not lips[:180].any()
    assert not lips[261:].any()


def test_a_recording_of_one_shape_and_merged_neighbours() -> None:
    assert np.all(weights(b"0.00\tX\n1.00\tX\n")[:, 0] == 1.0)
    shown = weights(document((0, 0.2, "D"), (0.2, 0.4, "D"), (0.4, 0.4, "A"), (0.4, 0.6, "X")))
    assert np.all(shown[:340, 10] == 1.0)
    assert not shown[:, 1].any()


def test_gaps_overlaps_and_a_late_start() -> None:
    data = document((0.2, 0.4, "D"), (0.6, 0.8, "F"), (0.7, 1.0, "A"))
    stream, said = parse_rhubarb(data)
    assert [f.code for f in said] == ["cue-gaps"]
    shown = weights(data)
    assert len(stream) == 50
    assert shown[100, 0] == shown[300, 10] == shown[500, 0] == shown[650, 14] == shown[850, 1] == 1.0


def test_a_late_start_of_lines() -> None:
    shown = weights(b"0.30\tD\n0.60\tX\n")
    assert shown[100, 0] == shown[450, 10] == 1.0


def test_contents_decide_not_the_name(tmp_path: Path) -> None:
    (tmp_path / "speech.tsv").write_bytes(HI_JSON)
    (tmp_path / "speech.json").write_text("\ufeff" + HI.replace("\n", "\r\n"), "utf-8")
    one, two = (read_rhubarb(tmp_path / f"speech.{e}", 25)[0] for e in ("tsv", "json"))
    assert np.array_equal(one.visemes, two.visemes)
    assert (one.name, one.frame_rate, len(one)) == ("speech", 25, 12)


@pytest.mark.parametrize(
    ("data", "error", "message"),
    [
        (b"0.0\tX\n0.5 D E\n", TextSyntaxError, "line 2, column 1: a time and a mouth shape"),
        (b"0.0\tX\nabc\tD\n", TextSyntaxError, "line 2, column 1: 'abc' is not a time"),
        (b"0.0\tX\n-1\tD\n", TextSyntaxError, "'-1' is not a time"),
        (b"0.0\tX\nnan\tD\n", TextSyntaxError, "'nan' is not a time"),
        (b"0.0\tX\n0.5\tQ\n", TextSyntaxError, "line 2, column 1: 'Q' is no mouth shape; Rhubarb's are A, B, C"),
        (b"0.5\tX\n0.2\tD\n", TextSyntaxError, "0.2 is before 0.5"),
        (b"0.5\tX\n", FapStreamError, "1 mouth cues"),
        (b"0.0\tD\n0.0\tX\n", FapStreamError, "no mouth cue lasts"),
        (b"1e9\tX\n2e9\tX\n", FapStreamError, "more than 200000 frames"),
        (b"{", TextSyntaxError, "line 1, column 2: no valid JSON"),
        (b"[" * 100_000, FapStreamError, "nested too deeply"),
        (b"{}", FapStreamError, "no list 'mouthCues'"),
        (b"[]", FapStreamError, "no list 'mouthCues'"),
        (b'{"mouthCues": []}', FapStreamError, "no list 'mouthCues'"),
        (b'{"mouthCues": [3]}', FapStreamError, "cue 1: an object"),
        (document((0, 0.5, "D"), (0.4, 0.2, "X")), FapStreamError, "cue 2: start and end must be times"),
        (document((0, 0.5, "D"), (0.5, float("nan"), "X")), FapStreamError, "cue 2: start and end must be times"),
        (document((0, 0.5, "D"), (0.5, 1e300, "X")), FapStreamError, "more than 200000 frames"),
        (document((0.5, 0.6, "D"), (0.1, 0.7, "X")), FapStreamError, "cue 2: it starts at 0.1, before"),
        (document((0, 0.5, "Z")), FapStreamError, "cue 1: 'Z' is no mouth shape"),
        (b'{"mouthCues": [{"start": 0, "end": true, "value": "A"}]}', FapStreamError, "cue 1: start and end"),
        (b'{"mouthCues": [{"start": 0, "end": 1, "value": ["A"]}]}', FapStreamError, "is no mouth shape"),
    ],
)
def test_damage_is_told_with_its_place(tmp_path: Path, data: bytes, error: type, message: str) -> None:
    (tmp_path / "cues.json").write_bytes(data)
    with pytest.raises(error) as caught:
        read_rhubarb(tmp_path / "cues.json")
    assert message in str(caught.value)
    assert "cues.json" in str(caught.value)


def test_rates_and_files_that_are_refused(tmp_path: Path) -> None:
    for rate in (0.0, -3.0, float("nan"), float("inf")):
        with pytest.raises(FapStreamError, match="frame rate"):
            parse_rhubarb(HI.encode(), rate=rate)
    with pytest.raises(InputFileError):
        read_rhubarb(tmp_path / "none.tsv")


@settings(max_examples=80, deadline=None)
@given(st.binary(max_size=60), st.integers(0, len(HI_JSON)))
def test_garbage_is_refused_or_read(garbage: bytes, at: int) -> None:
    for data in (garbage, HI.encode() + garbage, HI_JSON[:at] + garbage + HI_JSON[at:]):
        try:
            stream, _ = parse_rhubarb(data)
        except FbaError as error:
            said = str(error)
        else:
            said = f"{len(stream)} frames"
        assert said


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.integers(1, 60), st.sampled_from("ABCDEFGHX")), min_size=1, max_size=12))
def test_two_visemes_at_most_and_always_the_whole_mouth(cues: list[tuple[int, str]]) -> None:
    ends = np.cumsum([length for length, _ in cues]) / 100
    starts = np.concatenate([[0], ends[:-1]])
    data = document(*((float(a), float(b), v) for a, b, (_, v) in zip(starts, ends, cues, strict=True)))
    stream, said = parse_rhubarb(data, rate=200)
    assert not said
    fields = stream.visemes
    assert len(stream) == round(200 * ends[-1])
    assert fields.min() >= 0
    assert fields[:, :2].max() <= 14
    assert fields[:, 2].max() <= 63
    assert not fields[:, 3].any()
