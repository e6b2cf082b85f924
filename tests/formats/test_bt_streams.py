"""FAP streams in MPEG-4 BT: timed updates of the FAP node, there and back."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from faces import assert_same_face, small_face

from fba import FapStream
from fba.errors import FapStreamError, FbaError, UnsupportedFeatureError
from formats import bt, read_face, write
from formats.fap import read_fap
from formats.streams import read_stream
from samples import sample


def assert_same_stream(found: FapStream, wanted: FapStream) -> None:
    for field in ("values", "mask", "visemes", "expressions", "frame_numbers"):
        np.testing.assert_array_equal(getattr(found, field), getattr(wanted, field), field)
    assert (found.frame_rate, found.name, found.version) == (wanted.frame_rate, wanted.name, wanted.version)


def patchy_stream(rate: float = 25.0) -> FapStream:
    """FAPs that come and go, both high-level FAPs, missing frames, frames that change nothing, any first number."""
    random = np.random.default_rng(3)
    mask = random.random((9, 68)) < 0.2
    mask[4] = mask[3]
    values = random.integers(-2000, 2000, (9, 68), np.int32) * mask
    values[:, :2] = 0
    visemes = random.integers(0, 2, (9, 4), np.int32) * mask[:, :1]
    expressions = random.integers(0, 2, (9, 6), np.int32) * mask[:, 1:2]
    for rows in (values, visemes, expressions):
        rows[4] = rows[3]
    return FapStream(
        rate, values, mask, visemes, expressions, np.array([3, 4, 5, 6, 7, 11, 12, 20, 21]), 'ä "q" \\', "2.0"
    )


@pytest.mark.parametrize("rate", [25.0, 30.0, 30000 / 1001, 12.5, 24.0, 1.0, 1000.0, 7.3])
@pytest.mark.parametrize("suffix", [".bt", ".bt.gz"])
def test_streams_read_back(rate: float, suffix: str, tmp_path: Path) -> None:
    stream = patchy_stream(rate)
    path = tmp_path / f"a{suffix}"
    write(small_face(), path, stream)
    found, findings = bt.read_stream(path)
    assert findings == []
    assert_same_stream(found, stream)
    assert_same_face(read_face(path), small_face())


def test_the_updates_are_plain_bifs(tmp_path: Path) -> None:
    stream = FapStream.build(
        25, 4, {3: [0, 100, 100, -20], 6: [1, 1, 1, 2]}, visemes=[[0] * 4, [1, 0, 63, 1], [1, 0, 63, 1], [0] * 4]
    )
    text = bt.to_text(small_face(), stream)
    assert re.search(
        r"fap DEF FAPS FAP \{\s+viseme DEF VISEME Viseme \{ \}\s+open_jaw 0\s+stretch_l_corner 1\s+\}", text
    )
    assert re.search(r"fit FIT \{ \}", text)
    assert text[text.index("AT ") :] == (
        "AT 40 {\n REPLACE VISEME.viseme_select1 BY 1\n REPLACE VISEME.viseme_blend BY 63\n"
        " REPLACE VISEME.viseme_def BY TRUE\n REPLACE FAPS.open_jaw BY 100\n}\n"
        "AT 120 {\n REPLACE VISEME.viseme_select1 BY 0\n REPLACE VISEME.viseme_blend BY 0\n"
        " REPLACE VISEME.viseme_def BY FALSE\n REPLACE FAPS.open_jaw BY -20\n REPLACE FAPS.stretch_l_corner BY 2\n}\n"
    )
    assert "timeStampResolution" not in text
    assert "timeStampResolution 30\n" in bt.to_text(small_face(), patchy_stream(30))


def test_a_stream_does_not_stay_in_the_face(tmp_path: Path) -> None:
    write(small_face(), tmp_path / "a.bt", patchy_stream())
    face = read_face(tmp_path / "a.bt")
    assert [f.code for f in getattr(face.scene.document, "findings", ())] == ["stream"]
    write(face, tmp_path / "b.bt")
    write(small_face(), tmp_path / "c.bt")
    write(read_face(tmp_path / "c.bt"), tmp_path / "d.bt")
    assert (tmp_path / "b.bt").read_bytes() == (tmp_path / "d.bt").read_bytes()
    with pytest.raises(FapStreamError, match="no timed updates"):
        bt.read_stream(tmp_path / "b.bt")


def test_the_shipped_stream_reads_back(tmp_path: Path) -> None:
    stream = read_fap(sample("streams/demo.fap"))[0]
    write(small_face(), tmp_path / "a.bt", stream)
    assert_same_stream(read_stream(tmp_path / "a.bt")[0], stream)


HEAD = """Group { children [ Face { fap DEF F FAP { open_jaw 5 raise_b_midlip +I
  viseme DEF V Viseme { viseme_select1 3 viseme_blend 10 } } } ] }
"""


def of(text: str, tmp_path: Path) -> tuple[FapStream, list[str]]:
    (tmp_path / "x.bt").write_text(text)
    stream, findings = bt.read_stream(tmp_path / "x.bt")
    return stream, [f.message for f in findings]


def test_updates_of_other_programs(tmp_path: Path) -> None:
    stream, said = of(
        HEAD
        + """
RAP AT 0 { REPLACE F.open_jaw BY 7 INSERT ROUTE a.b TO c.d }
AT 40 IN 3 { REPLACE V.viseme_blend BY 20 # REPLACE F.open_jaw BY 9
  REPLACE Nobody.open_jaw BY 8 INSERT AT X.children[0] WorldInfo { title "} REPLACE F.open_jaw BY 1" }
  REPLACE T.translation BY 1 2 3 }
AT D40 { MULTIPLEREPLACE F { open_jaw -30 raise_b_midlip 2 expression Expression { expression_select1 2
  init_face true } viseme NULL } }
AT 160 { REPLACE F.open_jaw BY +I REPLACE F.viseme BY USE V REPLACE F.nothing BY 3 }
""",
        tmp_path,
    )
    assert said == ["the file does not tell its frame rate; its updates fall on frames of 25 a second"]
    assert (len(stream), stream.frame_rate, stream.name) == (5, 25.0, "x")
    assert stream.values[:, 2].tolist() == [7, 7, -30, -30, 0]
    assert stream.mask[:, 2].tolist() == [True, True, True, True, False]
    assert stream.mask[:, 4].tolist() == [False, False, True, True, True]
    assert stream.visemes[:, 0].tolist() == [3, 3, 0, 0, 0]
    assert stream.visemes[:, 2].tolist() == [10, 20, 0, 0, 0]
    assert stream.expressions[2:, (0, 4)].tolist() == [[2, 1]] * 3
    assert stream.mask[:, 1].tolist() == [False, False, True, True, True]


@pytest.mark.parametrize(
    ("times", "clock", "rate", "frames"),
    [
        ([33, 67, 100], "", 30.0, [1, 2, 3]),
        ([33, 66, 133], "", 30.0, [1, 2, 4]),
        ([1, 5], "timeStampResolution 24", 24.0, [1, 5]),
        ([13, 29], "", 100.0, [1, 3]),
    ],
)
def test_frame_rates_are_found(times: list[int], clock: str, rate: float, frames: list[int], tmp_path: Path) -> None:
    text = f"InitialObjectDescriptor {{ slConfigDescr SLConfigDescriptor {{ {clock} }} }}\n" + HEAD
    text += "".join(f"AT {t} {{ REPLACE F.open_jaw BY {100 + t} }}\n" for t in times)
    stream, said = of(text, tmp_path)
    assert stream.frame_rate == rate
    assert (np.flatnonzero(np.diff(stream.values[:, 2])) + 1).tolist() == frames
    assert ("no usual rate" in said[0]) == (rate == 100.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("Group { }", "no Face with a FAP node"),
        (HEAD, "nothing moves it"),
        (HEAD + "AT x { }", "expected a time after AT, found 'x'"),
        (HEAD + "AT 9999999999 { REPLACE F.open_jaw BY 1 }", "500000 are read at most"),
        (HEAD + "AT 40 { REPLACE F.viseme BY Viseme { 3 } }", "expected a field name"),
        (HEAD + "AT 40 { REPLACE F.open_jaw BY 1", "not closed"),
    ],
)
def test_what_is_no_stream_is_refused(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(FbaError, match=said):
        of(text, tmp_path)


@pytest.mark.parametrize(
    "note", ["[]", '{"frames":[[0,9]]}', "x", '{"name":"a","version":"2","frame_rate":0,"frames":[[0,2]]}',
             '{"name":"a","version":"2","frame_rate":25,"frames":[[0,999999999]]}',
             '{"name":"a","version":"2","frame_rate":25,"frames":[[5,2],[0,2]]}'],
)  # fmt: skip
def test_damaged_notes_are_passed_over(note: str, tmp_path: Path) -> None:
    quoted = note.replace('"', '\\"')
    text = HEAD.replace("] }\n", f'DEF fba_toolkit WorldInfo {{ info [ "stream: {quoted}" ] }} ] }}\n')
    stream, said = of(text + "AT 80 { REPLACE F.open_jaw BY 1 }", tmp_path)
    assert len(stream) == 3
    assert len(said) == 1


def test_streams_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(UnsupportedFeatureError, match="no frames"):
        write(small_face(), tmp_path / "a.bt", FapStream.build(25, 0))
    with pytest.raises(UnsupportedFeatureError, match="small integers"):
        write(small_face(), tmp_path / "a.bt", patchy_stream(1e-5))
    long = FapStream.build(1, 2, {3: [0, 1]})
    long = FapStream(1, long.values, long.mask, long.visemes, long.expressions, np.array([0, 2**31 - 1]))
    with pytest.raises(UnsupportedFeatureError, match="too long"):
        write(small_face(), tmp_path / "a.bt", long)
    assert list(tmp_path.iterdir()) == []
