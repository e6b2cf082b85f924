from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fba import FapStream, FbaError
from fba.errors import FapStreamError, InputFileError
from formats.fap import parse_fap, read_fap, write_fap

OFF, ON = "0", "1"


def mask(*numbers: int, columns: int = 68) -> str:
    return " ".join(ON if k + 1 in numbers else OFF for k in range(columns))


def text(*frames: tuple[str, str], header: str = "2.1 demo 25 {n}") -> bytes:
    lines = [header.format(n=len(frames)), *(line for frame in frames for line in frame)]
    return ("\n".join(lines) + "\n").encode()


def same(a: FapStream, b: FapStream) -> bool:
    arrays = ("values", "mask", "visemes", "expressions", "frame_numbers")
    return (a.frame_rate, a.name, a.version) == (b.frame_rate, b.name, b.version) and all(
        np.array_equal(getattr(a, n), getattr(b, n)) for n in arrays
    )


def codes(data: bytes) -> list[str]:
    return [f.code for f in parse_fap(data)[1]]


def test_frame_with_viseme_expression_and_low_level_faps() -> None:
    stream, findings = parse_fap(
        text((mask(1, 3), "0 1 0 63 0 120"), (mask(1, 2, 3, 68), "1 1 10 32 1 6 40 1 20 0 1 240 -7"))
    )
    assert not findings
    assert (len(stream), stream.frame_rate, stream.name, stream.version) == (2, 25.0, "demo", "2.1")
    assert stream.visemes.tolist() == [[1, 0, 63, 0], [1, 10, 32, 1]]
    assert stream.expressions.tolist() == [[0] * 6, [6, 40, 1, 20, 0, 1]]
    assert stream.values[:, 2].tolist() == [120, 240]
    assert stream.values[:, 67].tolist() == [0, -7]
    assert stream.values[:, :2].any() == np.False_
    assert [np.flatnonzero(m).tolist() for m in stream.mask] == [[0, 2], [0, 1, 2, 67]]


SAMPLES = {
    "greta_au_interpolation_1131.fap": (1, 25, "AU Interpolation_1131.fap", {"mask-columns"}),
    "vreng_eyes.fap": (52, 2, None, set()),
    "vreng_jag.fap": (169, 5, "jag", {"fap-range"}),
    "xface_anger.fap": (108, 25, None, {"fap-range"}),
    "xface_fear.fap": (107, 25, None, set()),
    "xface_joy.fap": (108, 25, None, {"fap-range"}),
}


@pytest.mark.parametrize("name", SAMPLES)
def test_public_files(shared: Path, name: str, tmp_path: Path) -> None:
    stream, findings = read_fap(shared / "fap_samples" / name)
    frames, rate, title, expected = SAMPLES[name]
    assert (len(stream), stream.frame_rate) == (frames, rate)
    assert title is None or stream.name == title
    assert expected <= {f.code for f in findings} <= {"fap-range", "mask-columns"}
    write_fap(stream, tmp_path / "again.fap")
    assert same(read_fap(tmp_path / "again.fap")[0], stream)


def test_values_of_public_files(shared: Path) -> None:
    greta = read_fap(shared / "fap_samples" / "greta_au_interpolation_1131.fap")[0]
    assert greta.values[0, 18:22].tolist() == [626, 626, 133, 133]
    jag = read_fap(shared / "fap_samples" / "vreng_jag.fap")[0]
    assert jag.values[0, 2:6].tolist() == [57, 26, -114, -36]
    assert jag.values[:, 47:50].max() == 56298 or jag.values[:, 47:50].min() == -56298
    assert read_fap(shared / "fap_samples" / "vreng_eyes.fap")[0].frame_numbers[0] == 1


def test_every_cut_of_a_real_file_is_told(shared: Path) -> None:
    data = (shared / "fap_samples" / "vreng_eyes.fap").read_bytes()
    unnoticed, unplaced = [], []
    for end in range(0, len(data) - 200, 97):
        try:
            _, findings = parse_fap(data[:end])
        except FapStreamError as error:
            if end > 80 and not ("line" in str(error) and "frame" in str(error)):
                unplaced.append(end)
        else:
            if "frame-count" not in [f.code for f in findings]:
                unnoticed.append(end)
    assert not unnoticed
    assert not unplaced


def test_line_ends_tabs_blanks_comments_and_missing_final_newline() -> None:
    plain = parse_fap(text((mask(3), "0 5"), (mask(3), "1 6")))[0]
    messy = f"# one\r\n\r\n \t# two\r\n2.1 \t demo\t25   2 \r\n{mask(3)}  \r\n0\t5\t\r\n# three\r\n\t{mask(3)}\r\n1 6"
    assert same(parse_fap(messy.encode())[0], plain)
    assert same(parse_fap(messy.replace("\r\n", "\r").encode())[0], plain)
    assert same(parse_fap(b"\xef\xbb\xbf" + messy.encode())[0], plain)


@pytest.mark.parametrize("name", ["a b  c", r"C:\fap files\x 25 3", "héllo", "#x", "25"])
def test_names_with_blanks(name: str) -> None:
    frame = (mask(3), "0 5")
    assert parse_fap(text(frame, header=f"2.1 {name} 25 {{n}}"))[0].name == name
    latin = text(frame, header=f"2.1 {name} 25 {{n}}").decode().encode("latin-1")
    assert parse_fap(latin)[0].name == name


def test_header_without_name_and_other_versions() -> None:
    stream = parse_fap(text((mask(3), "0 5"), header="2.0 30 {n}"))[0]
    assert (stream.version, stream.frame_rate, stream.values[0, 2]) == ("2.0", 30.0, 5), "2.0 is not scaled"


def test_an_extra_mask_column_is_dropped_with_its_value() -> None:
    zero = text((mask(3, columns=69), "0 5"))
    one = text((mask(3, 69, columns=69), "0 5 99"))
    for data in (zero, one):
        assert parse_fap(data)[0].values[0, 2] == 5
        assert codes(data) == ["mask-columns"]


@pytest.mark.parametrize(
    ("numbers", "line", "kept"),
    [
        ((1, 3), "0 4 50", set()),
        ((2, 3), "0 4 50", set()),
        ((1, 2, 3), "0 4 6 50", set()),
        ((1, 2, 3), "0 4 6 1 2 3 4 5 50", {2}),
    ],
)
def test_single_values_of_high_level_faps_are_reported(numbers: tuple, line: str, kept: set) -> None:
    stream, findings = parse_fap(text((mask(*numbers), line)))
    assert stream.values[0, 2] == 50
    assert {f.code for f in findings} >= {f"single-value-fap{k}" for k in {1, 2} & set(numbers) - kept}
    assert set(np.flatnonzero(stream.mask[0, :2]) + 1) == kept


def test_numbers_with_decimals_are_rounded() -> None:
    assert parse_fap(text((mask(3, 4, 5), "0. 5.0 -6.7 1e2")))[0].values[0, 2:5].tolist() == [5, -7, 100]


def test_frames_and_ranges_that_are_unusual_are_reported() -> None:
    frames = [(mask(3), "4 5"), (mask(3), "9 -6")]
    assert codes(text(*frames)) == ["missing-frames", "fap-range"]
    assert codes(text(*frames[:1], header="2.1 x 25 7")) == ["frame-count"]
    stream, findings = parse_fap(text((mask(1, 2), "0 15 0 64 0 7 0 0 0 0 0")))
    assert [f.code for f in findings] == ["high-level-range"] * 3
    assert stream.visemes[0, 0] == 15


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"hello", "starts with a line"),
        (b"# only a comment\n", "starts with a line"),
        (b"2.1 demo 25 x\n", "starts with a line"),
        (b"2.1 demo nan 1\n", "starts with a line"),
        (b"2.1 demo 0 1\n", "frame rate must be positive"),
        (b"2.1 demo 25 1\n", "no frames"),
        (text((mask(3, columns=67), "0 5")), "line 2, frame 1 of the file: the mask has 67"),
        (text((mask(3).replace("1", "2"), "0 5")), "line 2, frame 1 of the file: the mask holds '2'"),
        (text((mask(3), "0 5"), (mask(3), "1")), "line 5, frame 2 of the file: the mask announces 1 values"),
        (text((mask(3), "0 5 6")), "the line has 2"),
        (text((mask(3), "0 nan")), "line 3, frame 1 of the file: 'nan' is not a finite number"),
        (text((mask(3), "0 1e999")), "not a finite number"),
        (text((mask(3), "0 1_0")), "not a finite number"),
        (text((mask(3), "0 3000000000")), "too large"),
        (text((mask(3), "1 5"), (mask(3), "1 5")), "must increase"),
        (text((mask(3), "0 5")) + mask(3).encode(), "line 4, frame 2 of the file: the file ends after the mask"),
    ],
)
def test_damage_is_named_with_line_and_frame(data: bytes, words: str) -> None:
    with pytest.raises(FapStreamError, match=words):
        parse_fap(data)


def test_empty_and_missing_files(tmp_path: Path) -> None:
    (tmp_path / "empty.fap").touch()
    for name in ("empty.fap", "missing.fap"):
        with pytest.raises(InputFileError):
            read_fap(tmp_path / name)


@st.composite
def streams(draw: st.DrawFn) -> FapStream:
    count = draw(st.integers(1, 6))
    seed = draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    masks = rng.random((count, 68)) < draw(st.sampled_from([0.0, 0.3, 1.0]))
    values = np.where(masks, rng.integers(-(2**31), 2**31, (count, 68)), 0)
    values[:, :2] = 0
    fields = [np.where(masks[:, k : k + 1], rng.integers(-9, 99, (count, w)), 0) for k, w in ((0, 4), (1, 6))]
    numbers = draw(st.integers(0, 5)) + np.cumsum(rng.integers(1, 3, count))
    name = draw(
        st.text(st.characters(blacklist_categories=("Cs",), blacklist_characters="\r\n"), min_size=1, max_size=9)
    )
    name = name.strip(" \t\f\v") or "x"
    rate = draw(st.sampled_from([25.0, 29.97, 1e-3, 1e17]))
    return FapStream(rate, values, masks, *fields, numbers, name, draw(st.sampled_from(["2.1", "2.0", "2.2"])))


@settings(max_examples=60, deadline=None)
@given(streams())
def test_round_trip_is_exact(tmp_path_factory: pytest.TempPathFactory, stream: FapStream) -> None:
    path = tmp_path_factory.getbasetemp() / "round.fap"
    write_fap(stream, path)
    first = path.read_bytes()
    again = read_fap(path)[0]
    assert same(again, stream)
    write_fap(again, path)
    assert path.read_bytes() == first


def test_an_empty_stream_is_not_written(tmp_path: Path) -> None:
    with pytest.raises(FapStreamError, match="no frames"):
        write_fap(FapStream.build(25, 0), tmp_path / "x.fap")
    assert not list(tmp_path.iterdir())


BASE = text((mask(1, 3, 5), "0 1 0 63 0 120 -5"), (mask(2, 3, 5), "1 1 1 0 0 0 0 240 -7"))


@settings(max_examples=300, deadline=None)
@given(st.lists(st.tuples(st.integers(0, len(BASE) - 1), st.binary(max_size=4), st.integers(0, 30)), max_size=4))
def test_damaged_files_only_raise_the_toolkits_errors(edits: list[tuple[int, bytes, int]]) -> None:
    data = BASE
    for at, insert, remove in edits:
        data = data[:at] + insert + data[at + remove :]
    try:
        stream, findings = parse_fap(data)
    except FbaError:
        return
    assert len(stream) > 0
    assert all(f.message for f in findings)


def test_a_path_may_be_plain_text(tmp_path: Path) -> None:
    path = str(tmp_path / "s.fap")
    write_fap(FapStream.build(25.0, 1, {3: [7]}), path)
    assert read_fap(path)[0].values[0, 2] == 7


def test_blanks_without_end_are_read_in_one_go() -> None:
    """Where the name ends was once tried at every blank, again and again."""
    blanks = "\f" * 100_000
    with pytest.raises(FapStreamError, match=r"a \.fap file starts with"):
        parse_fap(f"2.1{blanks}25 x 3 {blanks} y\n".encode())
    head = f"2.1{blanks}a  b{blanks}25{blanks}1\n"
    stream, _ = parse_fap((head + " ".join("0" * 68) + "\n0\n").encode())
    assert (stream.name, stream.frame_rate, stream.version) == ("a  b", 25.0, "2.1")
