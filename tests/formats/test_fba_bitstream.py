"""FBA bitstreams: what is coded comes back, and damage is told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fba import FapStream, FbaError, faps
from fba.errors import FapStreamError, UnsupportedFeatureError
from formats.fap import read_fap
from formats.fba_bitstream import decode_fba, decoder, encode_fba, read_fba, write_fba
from formats.fba_bitstream.arithmetic import FULL, AdaptiveModel, RunDecoder, RunEncoder, UniformModel
from formats.fba_bitstream.bits import BitReader, BitWriter
from formats.fba_bitstream.corrections import MAGIC, put_number
from formats.fba_bitstream.sequence import wrapped
from formats.fba_bitstream.syntax import HIGH_LEVEL, OBJECT_START, SEQUENCE_END, Ranges, Segment
from samples import sample

SAMPLES = (
    "greta_au_interpolation_1131.fap",
    "vreng_eyes.fap",
    "vreng_jag.fap",
    "xface_anger.fap",
    "xface_fear.fap",
    "xface_joy.fap",
)
ARRAYS = ("values", "mask", "visemes", "expressions", "frame_numbers")
STEPS = np.array([f.quantizer for f in faps()])


def same(a: FapStream, b: FapStream) -> bool:
    return a.frame_rate == b.frame_rate and all(np.array_equal(getattr(a, n), getattr(b, n)) for n in ARRAYS)


def codes(findings: list) -> set[str]:
    return {f.code for f in findings}


def bits_of(text: str) -> bytes:
    digits = "".join(text.split())
    assert len(digits) % 8 == 0
    return int(digits, 2).to_bytes(len(digits) // 8, "big")


def outcome(data: bytes) -> tuple[FapStream | None, str]:
    """The stream, or what the reader says; any other end is a failure."""
    try:
        stream, said = decode_fba(data)
    except FbaError as error:
        return None, str(error)
    return stream, " ".join(sorted(codes(said)))


def small(frames: int = 4, **changes: object) -> FapStream:
    t = np.arange(frames)
    faps = {3: 40 * t, 19: 1024 * (t % 2), 48: -300 * t}
    return FapStream.build(25, frames, faps, **changes)


EMPTY_PLANE = (
    "1 01  1 00011001 0000 0  0  0"  # intra, face; 25 + 0/16 a second; no time code; nothing skipped
    "00000" + 10 * " 1 00" + " 0 0 1111"  # scale 0, ten empty groups, gender, predictive, four tables of ranges
    + 4 * (18 * "1")  # of which only the markers are there
    + "01"  # a run without symbols
)  # fmt: skip


def test_bits_of_the_smallest_stream() -> None:
    stream = FapStream.build(25, 2)
    start, end = f"{OBJECT_START:032b}", f"{SEQUENCE_END:032b}"
    body = EMPTY_PLANE + "0 01 0 01"
    used = len("".join(body.split()))
    expected = bits_of(start + body + "0" + "1" * (-(used + 1) % 8) + end)
    assert encode_fba(stream)[0] == expected
    assert same(decode_fba(expected)[0], stream)


@pytest.mark.parametrize("name", SAMPLES)
def test_public_streams(shared: Path, name: str, tmp_path: Path) -> None:
    stream = read_fap(shared / "fap_samples" / name)[0]
    said = write_fba(stream, tmp_path / "s.fba")
    again = read_fba(tmp_path / "s.fba")[0]
    assert same(again, stream)
    # The head of this one turns further in a frame than values without quantization can be coded.
    leaps = name == "vreng_jag.fap"
    assert codes(said) == {"experimental", "fap-corrections"} if leaps else {"experimental"}
    write_fba(again, tmp_path / "again.fba")
    assert (tmp_path / "again.fba").read_bytes() == (tmp_path / "s.fba").read_bytes()


def test_decoders_without_corrections_see_values_rounded_to_the_first_scale(shared: Path) -> None:
    stream = read_fap(shared / "fap_samples" / "vreng_jag.fap")[0]
    data, said = encode_fba(stream)
    told = next(f.message for f in said if f.code == "fap-corrections")
    assert "head_yaw" in told
    assert "1860" in told
    inside = data[data.index(OBJECT_START.to_bytes(4, "big")) :]
    assert inside == encode_fba(stream, 1)[0]
    values = decode_fba(inside)[0].values
    assert not np.any(values % STEPS)
    assert np.all(2 * np.abs(values - stream.values) <= STEPS)


def test_visemes_expressions_and_flags_of_the_shipped_stream() -> None:
    stream = read_fap(sample("streams/demo.fap"))[0]
    flags = np.random.default_rng(1).integers(0, 2, (len(stream), 3))
    visemes, expressions = stream.visemes.copy(), stream.expressions.copy()
    visemes[:, 3], expressions[:, 4:] = flags[:, 0], flags[:, 1:]
    moving = dict(enumerate((stream.values // 64).T, start=1))
    marked = FapStream.build(25, len(stream), {k: moving[k] for k in range(3, 69)}, visemes, expressions)
    assert same(decode_fba(encode_fba(marked)[0])[0], marked)


@pytest.mark.parametrize("scale", [1, 2, 7, 31])
def test_values_are_the_nearest_multiples_of_the_step(scale: int) -> None:
    rng = np.random.default_rng(scale)
    limits = np.array([f.i_range[1] for f in faps()[2:]])
    values = np.clip(np.cumsum(rng.normal(0, 0.05, (30, 66)), axis=0), -1, 1) * np.minimum(limits, 1800 * STEPS[2:])
    stream = FapStream.build(25, 30, {k: values[:, k - 3] for k in range(3, 69)})
    data, said = encode_fba(stream, scale)
    again = decode_fba(data)[0]
    steps = STEPS[2:] * scale
    assert not np.any(again.values[:, 2:] % steps)
    assert np.all(2 * np.abs(again.values - stream.values)[:, 2:] <= steps)
    assert codes(said) == {"experimental", "fap-rounded"}
    assert encode_fba(again, scale)[0] == data


def test_values_beyond_the_range_are_cut_and_told() -> None:
    stream = FapStream.build(25, 3, {48: [400_000, 400_000, 0], 3: [5, 6, 7]})
    data, said = encode_fba(stream, 1)
    assert decode_fba(data)[0].values[:, 47].tolist() == [1860 * 170, 400_010, 0]
    assert {"fap-clipped", "fap-rounded"} <= codes(said)
    assert "head_pitch (83800)" in next(f.message for f in said if f.code == "fap-clipped")
    data, said = encode_fba(stream)
    assert same(decode_fba(data)[0], stream)
    assert "head_pitch (398140)" in next(f.message for f in said if f.code == "fap-corrections")


def test_a_leap_that_no_difference_can_tell_begins_anew() -> None:
    stream = FapStream.build(25, 3, {51: [-1500, 1500, 1400]})
    data, said = encode_fba(stream, 0)
    assert codes(said) == {"experimental"}
    assert data.count(b"\0\0\1\xbb") == 1
    assert same(decode_fba(data)[0], stream)


@pytest.mark.parametrize("gap", [1, 14, 15, 16, 30, 1000])
def test_missing_frames(gap: int) -> None:
    plain = small()
    numbers = plain.frame_numbers + np.array([3, 3, 3 + gap, 3 + gap])
    stream = FapStream(25, plain.values, plain.mask, plain.visemes, plain.expressions, numbers)
    again, said = decode_fba(encode_fba(stream)[0])
    assert same(again, stream)
    assert "missing-frames" in codes(said)


def test_frames_before_zero_and_wide_gaps() -> None:
    plain = small(2)
    early = FapStream(25, plain.values, plain.mask, plain.visemes, plain.expressions, np.array([-4, -2]))
    data, said = encode_fba(early)
    assert "frame-numbers" in codes(said)
    assert decode_fba(data)[0].frame_numbers.tolist() == [0, 2]
    wide = FapStream(25, plain.values, plain.mask, plain.visemes, plain.expressions, np.array([0, 10**6]))
    with pytest.raises(FapStreamError, match="999999 frames are missing"):
        encode_fba(wide)


@pytest.mark.parametrize("rate", [25, 0.5, 12.0625, 255.9375, 30 * 1000 / 1001, 24 * 1000 / 1001])
def test_frame_rates(rate: float) -> None:
    stream = FapStream.build(rate, 2, {3: [1, 2]})
    data, said = encode_fba(stream)
    assert codes(said) == {"experimental"}
    assert decode_fba(data)[0].frame_rate == pytest.approx(rate, rel=1e-12)


def test_frame_rates_that_cannot_be_coded() -> None:
    data, said = encode_fba(FapStream.build(25.03, 1, {3: [1]}))
    assert "frame-rate" in codes(said)
    assert decode_fba(data)[0].frame_rate == pytest.approx(25.0625 / 1.001)
    for rate in (0.01, 300.0, 1e300):
        with pytest.raises(UnsupportedFeatureError, match="frames a second"):
            encode_fba(FapStream.build(rate, 1, {3: [1]}))


def test_empty_streams_and_wrong_scales_are_refused() -> None:
    with pytest.raises(FapStreamError, match="no frames"):
        encode_fba(FapStream.build(25, 0))
    for scale in (-1, 32):
        with pytest.raises(FapStreamError, match="0 to 31"):
            encode_fba(small(), scale)


@st.composite
def streams(draw: st.DrawFn) -> FapStream:
    frames = draw(st.integers(1, 6))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    mask = np.repeat(rng.random((2, 68)) < draw(st.sampled_from([0.05, 0.5, 1.0])), 3, axis=0)[:frames]
    reach = draw(st.sampled_from([3, 200, 930]))
    values = np.where(mask, rng.integers(-reach, reach + 1, (frames, 68)), 0)
    values[:, :2] = 0
    fields = [np.zeros((frames, n + k), np.int32) for n, k in ((3, 1), (4, 2))]
    for k, table in enumerate(fields):
        for column, limit in enumerate(HIGH_LEVEL[k + 1]):
            table[:, column] = rng.integers(0, limit + 1, frames)
        table[:, len(HIGH_LEVEL[k + 1]) :] = rng.integers(0, 2, (frames, k + 1))
        table[~mask[:, k]] = 0
    numbers = np.cumsum(rng.integers(1, draw(st.sampled_from([2, 40])), frames)) - 1
    return FapStream(draw(st.sampled_from([25.0, 2.5, 60.0])), values, mask, *fields, numbers)


@settings(max_examples=60, deadline=None)
@given(streams())
def test_any_stream_within_the_range_comes_back(stream: FapStream) -> None:
    data, said = encode_fba(stream)
    assert codes(said) == {"experimental"}
    assert same(decode_fba(data)[0], stream)


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 3721), st.lists(st.integers(0, 10**6), max_size=300), st.integers(0, 7), st.binary(max_size=3))
def test_runs_end_where_they_should(count: int, symbols: list[int], start: int, behind: bytes) -> None:
    out = BitWriter()
    out.bits(0, start)
    coder, model, once = RunEncoder(out), AdaptiveModel(count), UniformModel(count)
    wanted = [s % count for s in symbols]
    for k, symbol in enumerate(wanted):
        coder.put(symbol, once if k % 5 == 0 else model)
    coder.finish()
    out.bits(int.from_bytes(behind, "big"), 8 * len(behind))
    out.start_code(SEQUENCE_END)
    reader = BitReader(out.bytes(), "here")
    reader.position = start
    run, model = RunDecoder(reader), AdaptiveModel(count)
    assert [run.get(once if k % 5 == 0 else model) for k in range(len(wanted))] == wanted
    run.finish()
    assert reader.bits(8 * len(behind)) == int.from_bytes(behind, "big")


def test_no_start_code_arises_inside() -> None:
    """A symbol that is nearly certain, and then runs of the least likely ones, give long rows of equal bits."""
    for symbol in (0, 1):
        out = BitWriter()
        coder, model = RunEncoder(out), AdaptiveModel(2)
        symbols = ([symbol] * 4000 + [1 - symbol] * 40) * 6
        for s in symbols:
            coder.put(s, model)
        coder.finish()
        assert model.total <= FULL
        out.start_code(SEQUENCE_END)
        bits = "".join(f"{byte:08b}" for byte in out.bytes()[:-4])
        assert "0" * 22 in bits
        assert "0" * 23 not in bits
        run, model = RunDecoder(BitReader(out.bytes(), "here")), AdaptiveModel(2)
        assert [run.get(model) for _ in symbols] == symbols
        run.finish()


def test_a_missing_stuffing_bit_is_an_error_inside_a_run_only() -> None:
    run = RunDecoder(BitReader(bytes(8), "here"))
    model = UniformModel(2)
    for _ in range(40):
        run.get(model)
    with pytest.raises(FapStreamError, match="byte 2, bit 6: more than 22 zeros"):
        run.finish()
    short = RunDecoder(BitReader(bytes(8), "here"))
    assert short.get(model) == 1
    short.finish()


def stream_of(bits: str) -> bytes:
    whole = bits + "0" + "1" * (-(len(bits) + 1) % 8)
    return OBJECT_START.to_bytes(4, "big") + bits_of(whole) + SEQUENCE_END.to_bytes(4, "big")


def test_start_codes_of_old_drafts_and_before_every_plane() -> None:
    data = encode_fba(FapStream.build(25, 1))[0]
    assert len(decode_fba(b"\0\0\1\1" + data[4:])[0]) == 1
    plane = "".join(EMPTY_PLANE.split())
    for code in (0x1BB, 0x103):
        for pads in ("01111111", ""):
            head = pads + f"{code:032b}" + plane
            tail = "0" + "1" * (-(len(head) + 1) % 8) + f"{code:032b}" + "0010" + "01"
            assert len(decode_fba(stream_of(head + tail))[0]) == 2


EVERYTHING = FapStream.build(
    25,
    3,
    {3: [5, 2**31 - 1, -(2**31)], 19: [0, 1024, 0]},
    visemes=[[1, 2, 63, 1], [99, -5, 70, 2], [0, 0, 0, -3]],
    expressions=[[1, 60, 2, 0, 1, 0], [7, 2**31 - 1, 0, 0, 9, 1], [-1, 0, 0, 0, 0, -(2**31)]],
)
"""Values that no bitstream of this syntax holds."""


def test_corrections_make_any_stream_exact() -> None:
    data, said = encode_fba(EVERYTHING)
    assert "fap-corrections" in codes(said)
    assert same(decode_fba(data)[0], EVERYTHING)


def test_a_sequence_around_the_face_is_passed_over() -> None:
    stream = small()
    data = encode_fba(stream, 0)[0]
    for head in (b"", b"\0\0\1\xb0\x61", b"\0\0\1\xb0\x61\0\0\1\xb2of another program"):
        for identified in (b"\x23", b"\x91\x47"):
            assert same(decode_fba(head + b"\0\0\1\xb5" + identified + data)[0], stream)
    with pytest.raises(UnsupportedFeatureError, match=r"byte 5: .* of type 1"):
        decode_fba(b"\0\0\1\xb0\x61\0\0\1\xb5\x09" + data)


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ([1, 3], "corrections in the user data are damaged"),
        ([1, 3, 2, 0, 0], "corrects what frame 1 does not hold"),
        ([1, 200, 2, 0, 0], "corrects what frame 1 does not hold"),
        ([1, 2, 2**32, 0, 0], "corrects what frame 1 does not hold"),
        ([1, 2, 2**37, 0, 0], "corrections in the user data are damaged"),
    ],
)
def test_corrections_that_do_not_fit_are_told(numbers: list[int], message: str) -> None:
    written = bytearray(MAGIC)
    for number in numbers:
        put_number(written, number)
    plain = encode_fba(FapStream.build(25, 3, {3: [0, 1, 2]}), 0)[0]
    with pytest.raises(FapStreamError, match=message):
        decode_fba(wrapped(plain, bytes(written)))
    with pytest.raises(FapStreamError, match="damaged"):
        decode_fba(wrapped(plain, MAGIC + b"\x80\x80a"))


def test_corrections_of_other_frames_are_told() -> None:
    stream = FapStream.build(25, 3, {3: [0, 1, 2]})
    plain = encode_fba(stream, 0)[0]
    for count in (0, 2, 4):
        again, said = decode_fba(wrapped(plain, MAGIC + count * b"\x81\x82\x84"))
        assert "corrections" in codes(said)
        assert (again.values - stream.values)[:, 2].tolist() == [2 * (k < count) for k in range(3)]


def test_a_missing_end_code_is_told() -> None:
    plane = "".join(EMPTY_PLANE.split())
    whole = OBJECT_START.to_bytes(4, "big") + bits_of(plane + "0" * (-len(plane) % 8))
    assert "no-end-code" in codes(decode_fba(whole)[1])
    assert "no-end-code" not in codes(decode_fba(stream_of(plane))[1])


def test_every_cut_is_told() -> None:
    data = encode_fba(read_fap(sample("streams/demo.fap"))[0])[0]
    whole = len(decode_fba(data)[0])
    for end in range(0, len(data) - 3, 97):
        found, said = outcome(data[:end])
        assert found is None or len(found) < whole
        assert ("byte" if found is None else "no-end-code") in said or ("corrections" in said and "damaged" in said)


@pytest.mark.parametrize(
    ("bits", "error", "message"),
    [
        ("1 10", UnsupportedFeatureError, "animates a body"),
        ("1 11", UnsupportedFeatureError, "animates a body"),
        ("1 00", FapStreamError, "neither face nor body"),
        ("0 01 0 01", FapStreamError, "begins with a predicted plane"),
        ("1 01 0 0 0 00000 0", FapStreamError, "marker bit of the mask of FAP 1 is 0"),
        ("1 01 0 1 00000 000000 0", FapStreamError, "marker bit of the time code is 0"),
        ("1 01 1 00000000 0000 0", FapStreamError, "frame rate is 0"),
        ("1 01 0 0 0 00000" + 10 * "100" + "0 1", UnsupportedFeatureError, "DCT"),
        ("1 01 0 0 0 00000" + 10 * "100" + "0 0 1000 0", FapStreamError, "marker bit in a table of ranges is 0"),
    ],
)
def test_what_cannot_be_read_is_told(bits: str, error: type[FbaError], message: str) -> None:
    with pytest.raises(error, match=f"here, byte 4|here, byte.*{message}") as caught:
        decode_fba(stream_of("".join(bits.split()) + "1" * 64), "here")
    assert message in str(caught.value)


def test_other_files_are_refused(tmp_path: Path) -> None:
    for data in (b"x", b"\0\0\1\xb0abc", b"2.1 demo 25 1\n"):
        (tmp_path / "x.fba").write_bytes(data)
        with pytest.raises(FapStreamError, match=r"x\.fba, byte \d, bit 0: there is no FBA object start code"):
            read_fba(tmp_path / "x.fba")
    with pytest.raises(FapStreamError, match="holds no frames"):
        decode_fba(b"\0\0\1\xba\x7f\0\0\1\xb1")


def test_time_code_interpolation_and_default_ranges() -> None:
    """A plane as another coder might write it: no frame rate, a time code, a mask of type 2, no ranges."""
    out = BitWriter()
    out.bits(OBJECT_START, 32)
    for value, count in ((1, 1), (1, 2), (0, 1), (1, 1), (13, 5), (59, 6), (1, 1), (30, 6), (0, 1), (3, 5)):
        out.bits(value, count)
    for group in range(10):
        out.bits(0b110 if group == 1 else 0b100, 3)
        if group == 1:
            out.bits(0b1000000000000000, 16)
    out.bits(0, 6)
    ranges = (Ranges.default(0), Ranges.default(1))
    segment = Segment(3, (3,), ranges)
    assert segment.field_range(3, 0, True) == (-360, 360)
    run = RunEncoder(out)
    low, model = segment.model(3, 0, True)
    run.put(25 - low, model)
    run.finish()
    out.start_code(SEQUENCE_END)
    stream, said = decode_fba(out.bytes())
    assert stream.values[0, 2] == 25 * 4 * 3
    assert np.flatnonzero(stream.mask[0]).tolist() == [2]
    assert stream.frame_rate == 30.0
    assert codes(said) >= {"no-frame-rate", "time-code", "interpolated-faps", "default-ranges"}


def test_frames_and_values_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    data = encode_fba(small())[0]
    monkeypatch.setattr(decoder, "LARGEST_FRAMES", 3)
    with pytest.raises(FapStreamError, match="more than 3 frames"):
        decode_fba(data)
    monkeypatch.setattr(decoder, "LARGEST_FRAMES", 4)
    monkeypatch.setattr(decoder, "_INT32", 700)
    with pytest.raises(FapStreamError, match="out of all bounds"):
        decode_fba(data)


GOOD = encode_fba(small(12, visemes=np.tile([3, 4, 30, 0], (12, 1))))[0]


@settings(max_examples=150, deadline=None)
@given(st.binary(max_size=200))
def test_garbage_is_refused_or_read(tail: bytes) -> None:
    for head in (GOOD[:4], GOOD[:24], GOOD[:-20]):
        stream, said = outcome(head + tail)
        assert said if stream is None else len(stream) <= 8 * len(GOOD + tail)


@settings(max_examples=150, deadline=None)
@given(st.lists(st.integers(0, 8 * len(GOOD) - 1), min_size=1, max_size=3))
def test_flipped_bits_are_refused_or_read(flipped: list[int]) -> None:
    data = bytearray(GOOD)
    for k in flipped:
        data[k >> 3] ^= 1 << (k & 7)
    stream, said = outcome(bytes(data))
    if stream is None:
        assert said
    else:
        assert encode_fba(stream, 31)
