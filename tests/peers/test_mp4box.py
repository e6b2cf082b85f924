"""MP4Box (GPAC), an independent BIFS encoder and decoder: it takes what the toolkit writes, and gives it back."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from bifs_peer import MP4BOX, assert_peer_agrees, decoded, golden_stream
from faces import small_face

from fba import FapStream
from formats import read_face, write
from formats.fap import read_fap
from samples import sample

pytestmark = [pytest.mark.peer, pytest.mark.skipif(MP4BOX is None, reason="needs MP4Box on PATH")]


@pytest.mark.parametrize("names", [True, False], ids=["names", "numbers"])
@pytest.mark.parametrize("dump", ["bt", "xmt"])
@pytest.mark.parametrize("suffix", [".bt", ".xmt"])
def test_a_face_with_a_stream_survives_mp4(suffix: str, dump: str, names: bool, tmp_path: Path) -> None:
    source = tmp_path / f"face{suffix}"
    write(small_face(), source, golden_stream())
    assert_peer_agrees(decoded(source, tmp_path / "mp4", dump, names=names), small_face(), golden_stream(), names=names)


@pytest.mark.parametrize("rate", [30.0, 30000 / 1001])
def test_frame_rates_that_milliseconds_cannot_tell(rate: float, tmp_path: Path) -> None:
    stream = golden_stream()
    other = FapStream(
        rate, stream.values, stream.mask, stream.visemes, stream.expressions, stream.frame_numbers, stream.name
    )
    for suffix in (".bt", ".xmt"):
        source = tmp_path / f"face{suffix}"
        write(small_face(), source, other)
        assert_peer_agrees(decoded(source, tmp_path / suffix, "bt"), small_face(), other)


def test_both_forms_give_the_same_bits(tmp_path: Path) -> None:
    """The shipped face with the shipped stream: what MP4Box decodes of both files is the same text."""
    face, stream = read_face("default"), read_fap(sample("streams/demo.fap"))[0]
    texts = []
    for suffix in (".bt", ".xmt"):
        source = tmp_path / f"face{suffix}"
        write(face, source, stream)
        found = decoded(source, tmp_path / suffix, "bt")
        texts.append(re.sub(r"\s+(bufferSizeDB|avgBitrate) \d+", "", found.read_text()))
    assert texts[0] == texts[1]
    assert_peer_agrees(found, face, stream)
