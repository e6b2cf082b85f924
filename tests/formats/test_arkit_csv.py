"""ARKit's curves as CSV: into FAPs by the published table, and back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fat.profiles import ARKIT, profile_table
from fba import FapStream, FbaError, fap
from fba.errors import FapStreamError, InputFileError, TextSyntaxError, UnsupportedFeatureError
from formats import arkit_csv
from formats.arkit_csv import (
    ANGLES,
    COLUMNS,
    RADIAN,
    TURN,
    format_arkit_csv,
    parse_arkit_csv,
    read_arkit_csv,
    write_arkit_csv,
)
from formats.fap import read_fap
from formats.timecode import frame_numbers_of, timecode, timecode_seconds
from samples import sample

SHAPES = {s.name: s for s in profile_table("arkit")}
FAPS_OF_ANGLES = {number for _, number, _ in ANGLES if number}


def take(
    frames: Sequence[Mapping[str, float]], *, rate: float = 60, columns: Sequence[str] = COLUMNS, times: bool = True
) -> bytes:
    """A file as the app writes it; names may be written either way."""
    lines = [",".join([*(["Timecode", "BlendShapeCount"] if times else []), *columns])]
    for k, frame in enumerate(frames):
        given = {n.lower(): v for n, v in frame.items()}
        row = [f"{given.get(c.lower(), 0.0):.10f}" for c in columns]
        lines.append(",".join([*([timecode(k / rate), str(len(columns))] if times else []), *row]))
    return ("\n".join(lines) + "\n").encode()


def values(data: bytes, **options: bool) -> dict[int, int]:
    """The FAPs of the first frame that are not 0."""
    stream, _ = parse_arkit_csv(data, **options)
    return {k + 1: int(v) for k, v in enumerate(stream.values[0]) if v}


def curves(text: str) -> dict[str, np.ndarray]:
    rows = [line.split(",") for line in text.splitlines()]
    table = np.array(rows[1:])[:, 2:].astype(float)
    return {name[0].lower() + name[1:]: table[:, k] for k, name in enumerate(rows[0][2:])}


def test_layout_of_the_app() -> None:
    assert len(COLUMNS) == 61
    assert COLUMNS[14:18] == ("JawForward", "JawRight", "JawLeft", "JawOpen")
    assert COLUMNS[51:] == ("TongueOut", *(name for name, _, _ in ANGLES))
    assert {n[0].lower() + n[1:] for n in COLUMNS[:52]} == set(ARKIT)


@pytest.mark.parametrize("name", [n for n in ARKIT if not n.startswith("eyeLook")])
def test_each_shape_becomes_the_faps_of_the_table(name: str) -> None:
    expected = {k: round(v) for k, v in SHAPES[name].faps.items() if round(v)}
    assert values(take([{name: 1.0}])) == expected
    strict = SHAPES[name].strict_faps or SHAPES[name].faps
    assert values(take([{name: 1.0}]), strict_jaw=True) == {k: round(v) for k, v in strict.items() if round(v)}


def test_weights_add_up_and_scale() -> None:
    data = take([{"EyeBlinkLeft": 0.5, "JawOpen": 0.25, "EyeSquintLeft": 0.5}])
    found = values(data)
    assert found[19] == 512
    assert found[3] == round(0.25 * SHAPES["jawOpen"].faps[3])
    assert found[21] == round(0.5 * SHAPES["eyeSquintLeft"].faps[21])


def test_the_gaze_turns_the_eyeballs() -> None:
    turn = round(TURN * RADIAN)
    left = values(take([{"eyeLookOutLeft": 1.0, "eyeLookInRight": 1.0}]))
    assert (left[23], left[24]) == (turn, turn)
    right = values(take([{"eyeLookInLeft": 0.5, "eyeLookOutRight": 0.5}]))
    assert (right[23], right[24]) == (-turn / 2, -turn / 2)
    down = values(take([{"eyeLookDownLeft": 1.0, "eyeLookUpRight": 1.0}]))
    assert (down[25], down[26]) == (turn, -turn)
    assert down[19] == SHAPES["eyeLookDownLeft"].faps[19]


def test_angles_are_exact_and_rule_the_eyes() -> None:
    """Radians; yaw to the subject's right, pitch down, roll to the subject's left: FAPs turn yaw and roll round."""
    found = values(
        take([{"HeadYaw": 0.2, "HeadPitch": 0.1, "HeadRoll": -0.05, "LeftEyeYaw": 0.3, "RightEyePitch": -0.25}])
    )
    assert found == {49: -20000, 48: 10000, 50: 5000, 23: -30000, 26: -25000}
    both = values(take([{"LeftEyePitch": 0.3, "eyeLookDownLeft": 1.0}]))
    assert both[25] == 30000
    assert both[19] == SHAPES["eyeLookDownLeft"].faps[19]
    without = take([{"eyeLookDownLeft": 1.0}], columns=COLUMNS[:52])
    stream, _ = parse_arkit_csv(without)
    assert stream.values[0, 24] == TURN * RADIAN
    assert not stream.mask[0, 47:50].any()


def test_signs_agree_with_the_standard() -> None:
    assert fap("head_yaw").positive_motion == fap("yaw_l_eyeball").positive_motion == "left"
    assert fap("head_pitch").positive_motion == fap("pitch_l_eyeball").positive_motion == "down"
    assert fap("head_roll").positive_motion == "right"


def test_masks_tell_what_the_columns_drive() -> None:
    stream, said = parse_arkit_csv(take([{"EyeBlinkLeft": 1}, {}], columns=["EyeBlinkLeft", "JawOpen", "Smell"]))
    assert (np.flatnonzero(stream.mask[0]) + 1).tolist() == [3, 19]
    assert stream.mask[1].tolist() == stream.mask[0].tolist()
    assert {f.code for f in said} == {"missing-shapes", "unknown-columns"}


def known_take() -> list[dict[str, float]]:
    """Blink, jaw, smile, pucker, brows and gaze, each rising and falling."""
    groups = (
        ("eyeBlinkLeft", "eyeBlinkRight"),
        ("jawOpen",),
        ("mouthSmileLeft", "mouthSmileRight"),
        ("mouthPucker",),
        ("browInnerUp", "browOuterUpLeft", "browOuterUpRight"),
        ("eyeLookOutLeft", "eyeLookInRight"),
        ("jawOpen", "mouthFunnel", "cheekPuff"),
        ("headYaw", "leftEyeYaw", "rightEyeYaw"),
    )
    return [dict.fromkeys(group, w) for group in groups for w in (0.0, 0.3, 0.8, 0.4)]


def test_there_and_back() -> None:
    data = take(known_take())
    stream, _ = parse_arkit_csv(data)
    text, said = format_arkit_csv(stream)
    assert not said
    before, after = curves(data.decode()), curves(text)
    for name in before:
        if not name.startswith("eyeLook"):
            assert np.abs(after[name] - before[name]).max() < 0.09, name
    assert all(np.allclose(after[n[0].lower() + n[1:]], before[n[0].lower() + n[1:]]) for n, k, _ in ANGLES if k)
    again, _ = parse_arkit_csv(text.encode())
    assert again.frame_rate == stream.frame_rate == 60
    assert np.array_equal(again.frame_numbers, stream.frame_numbers)
    amplitude = np.maximum(np.abs(stream.values).max(axis=0), 50)
    assert np.all(np.abs(again.values - stream.values) <= 0.03 * amplitude)


def test_the_gaze_comes_back_without_angles() -> None:
    names = [n for n in ARKIT if n.startswith("eyeLook")]
    frames = [{n: 0.7} for n in names]
    stream, _ = parse_arkit_csv(take(frames, columns=COLUMNS[:52]))
    after = curves(format_arkit_csv(stream)[0])
    for k, name in enumerate(names):
        assert after[name][k] == pytest.approx(0.7, abs=1e-4)
        others = [n for n in ARKIT if n != name]
        assert max(after[n][k] for n in others) < 0.02


def test_angles_of_a_stream_come_back_to_the_unit() -> None:
    faps = {k: np.arange(-3, 4) * 3333 + k for k in sorted(FAPS_OF_ANGLES)}
    stream = FapStream.build(30, 7, faps)
    again, _ = parse_arkit_csv(format_arkit_csv(stream)[0].encode())
    columns = [k - 1 for k in sorted(FAPS_OF_ANGLES)]
    assert np.array_equal(again.values[:, columns], stream.values[:, columns])


def test_curves_of_the_shipped_stream(tmp_path: Path) -> None:
    stream = read_fap(sample("streams/demo.fap"))[0]
    said = write_arkit_csv(stream, tmp_path / "demo.csv")
    assert {f.code for f in said} == {"high-level-lost", "faps-lost"}
    again, _ = read_arkit_csv(tmp_path / "demo.csv")
    assert again.name == "demo"
    assert (len(again), again.frame_rate) == (150, 25.0)
    after = curves((tmp_path / "demo.csv").read_text())
    assert np.allclose(after["eyeBlinkLeft"], stream.values[:, 18] / 1024, atol=0.05)
    assert all(v.min() >= 0.0 and v.max() <= 1.0 for n, v in after.items() if n in ARKIT)


def test_what_arkit_cannot_show_is_told() -> None:
    stream = FapStream.build(25, 2, {65: [0, 80], 19: [0, 1024]})
    said = format_arkit_csv(stream)[1]
    assert [f.code for f in said] == ["faps-lost"]
    assert "1 FAPs: raise_l_ear" in said[0].message
    speech = FapStream.build(25, 1, visemes=[[1, 0, 63, 0]])
    with pytest.raises(UnsupportedFeatureError, match="visemes or expressions alone"):
        format_arkit_csv(speech)
    with pytest.raises(FapStreamError, match="no frames"):
        format_arkit_csv(FapStream.build(25, 0))


@pytest.mark.parametrize(
    ("rate", "read"), [(60, 60), (30, 30), (25, 25), (24, 24), (2, 2), (59.94, 60 / 1.001), (7, 7)]
)
def test_frame_rates_of_time_codes(rate: float, read: float) -> None:
    stream, said = parse_arkit_csv(take([{"JawOpen": 0.1}] * 130, rate=rate))
    assert stream.frame_rate == pytest.approx(read, rel=1e-4)
    assert stream.frame_numbers.tolist() == list(range(130))
    assert not said


def test_time_codes_of_other_bases_missing_frames_and_midnight() -> None:
    def read(texts: list[str]) -> tuple[np.ndarray, float, list[str]]:
        numbers, rate, said = frame_numbers_of([timecode_seconds(t) for t in texts], len(texts), None)
        return numbers, rate, [f.code for f in said]

    thirty = [f"01:00:{k // 30:02d}:{k % 30:02d}" for k in range(90)]
    assert read(thirty)[1:] == (30.0, [])
    drop = [t.replace("00:00:", "00:00;") for t in thirty]
    assert read(drop)[1:] == (30.0, [])
    lost = thirty[:40] + thirty[43:]
    numbers, rate, said = read(lost)
    assert (rate, said, numbers[40]) == (30.0, ["missing-frames"], 43)
    night = [f"23:59:59:{k:02d}.500" for k in range(60)] + [f"00:00:00:{k:02d}.500" for k in range(60)]
    numbers, rate, said = read(night)
    assert (rate, said, numbers[-1]) == (60.0, [], 119)
    assert read(["00:00:00:00"] * 3)[1:] == (60.0, ["time-codes"])
    with pytest.raises(FapStreamError, match="--rate"):
        read(["00:00:00:00", "00:00:00:01", "00:00:00:02", "23:00:00:00", "23:00:00:01", "23:00:00:02"])


def test_rates_without_time_codes() -> None:
    data = take([{"JawOpen": 0.1}] * 3, times=False)
    assert parse_arkit_csv(data)[0].frame_rate == 60
    assert parse_arkit_csv(data, rate=24)[0].frame_rate == 24
    assert parse_arkit_csv(take([{}, {}], rate=30), rate=50)[0].frame_rate == 50
    assert parse_arkit_csv(take([{}]))[0].frame_rate == 60
    for rate in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(FapStreamError, match="frame rate"):
            parse_arkit_csv(data, rate=rate)


def test_variants_that_programs_write() -> None:
    plain = take([{"JawOpen": 0.5}, {"EyeBlinkLeft": 1}])
    wanted = parse_arkit_csv(plain)[0].values
    for data in (
        b"\xef\xbb\xbf" + plain,
        plain.replace(b"\n", b"\r\n"),
        plain.replace(b"JawOpen", b" jawOpen ").replace(b"EyeBlinkLeft", b"eyeblinkleft"),
        plain.rstrip(),
        plain + b"\n\n",
        plain.replace(b"BlendShapeCount", b"BlendshapeCount"),
    ):
        assert np.array_equal(parse_arkit_csv(data)[0].values, wanted)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        (lambda d: b"a,b\n1,2\n", FapStreamError, "x.csv, line 1: the first line names none"),
        (lambda d: d.splitlines()[0], FapStreamError, "header but no frames"),
        (
            lambda d: d[:-40],
            TextSyntaxError,
            "x.csv:line 3, column 1: 6. columns where the first line has 63; the file",
        ),
        (
            lambda d: d.replace(b"0.5000000000", b"abc"),
            TextSyntaxError,
            "line 2, column 20: 'abc' in the column jawOpen",
        ),
        (lambda d: d.replace(b"0.5000000000", b"nan"), TextSyntaxError, "'nan' in the column jawOpen is not a number"),
        (lambda d: d.replace(b"0.5000000000", b"50"), TextSyntaxError, "jawOpen is 50; weights run from 0 to 1"),
        (lambda d: d.replace(b"JawRight", b"JawOpen"), TextSyntaxError, "jawOpen stands there twice"),
        (lambda d: d.replace(b"00:00:00:01.000", b"1.5"), TextSyntaxError, "line 3, column 1: '1.5' is no time code"),
        (lambda d: d + b"\0", FapStreamError, "binary data"),
        (lambda d: b"\n", FapStreamError, "names none"),
        (lambda d: d + b'"' + b"x" * 200_000, TextSyntaxError, "field larger than field limit"),
    ],
)
def test_damage_is_told_with_its_place(tmp_path: Path, change: object, error: type, message: str) -> None:
    path = tmp_path / "x.csv"
    path.write_bytes(change(take([{"JawOpen": 0.5}, {"JawOpen": 0.25}])))  # type: ignore[operator]
    with pytest.raises(error) as caught:
        read_arkit_csv(path)
    text = str(caught.value)
    assert all(part in text for part in message.split("6. ")), text


def test_missing_and_empty_files(tmp_path: Path) -> None:
    (tmp_path / "empty.csv").touch()
    for name in ("empty.csv", "none.csv"):
        with pytest.raises(InputFileError):
            read_arkit_csv(tmp_path / name)


def test_overshoot_is_taken_and_negative_weights_are_told() -> None:
    stream, said = parse_arkit_csv(take([{"EyeBlinkLeft": 1.05}]))
    assert stream.values[0, 18] == 1075
    assert "weight-range" not in {f.code for f in said}
    assert "weight-range" in {f.code for f in parse_arkit_csv(take([{"JawOpen": -0.2}]))[1]}


@settings(max_examples=80, deadline=None)
@given(st.binary(max_size=120), st.integers(0, 900))
def test_garbage_is_refused_or_read(garbage: bytes, at: int) -> None:
    data = take([{"JawOpen": 0.5}])
    for broken in (garbage, data[:at] + garbage + data[at:], data + garbage):
        try:
            stream, _ = parse_arkit_csv(broken)
        except FbaError as error:
            said = str(error)
        else:
            said = f"{len(stream)} frames"
        assert said


def test_frames_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(arkit_csv, "LARGEST_FRAMES", 2)
    assert len(parse_arkit_csv(take([{}] * 2))[0]) == 2
    with pytest.raises(TextSyntaxError, match="line 4, column 1: more than 2 frames"):
        parse_arkit_csv(take([{}] * 3))


@settings(max_examples=60, deadline=None)
@given(st.floats(0, 86399))
def test_time_codes_come_back(seconds: float) -> None:
    found = timecode_seconds(timecode(seconds))
    assert found is not None
    assert found[0] + found[1] / 60 == pytest.approx(seconds, abs=1e-5)
    assert timecode_seconds(timecode(seconds) + "x") is None
