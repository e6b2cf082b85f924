"""Golden files: what the writers write today, and what MP4Box decoded of just these files once.

They keep the syntax honest where there is no MP4Box. `bifs_peer.make_golden` writes them anew.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from bifs_peer import assert_peer_agrees, assert_same_frames, golden_stream
from faces import assert_same_face, small_face

from formats import bt, read_face, xmta
from formats.streams import read_stream

GOLDEN = Path(__file__).parents[1] / "golden" / "mpeg4"


@pytest.mark.parametrize("kind", ["bt", "xmt"])
def test_the_writers_write_what_mp4box_accepted(kind: str) -> None:
    text = {"bt": bt, "xmt": xmta}[kind].to_text(small_face(), golden_stream())
    assert text == (GOLDEN / f"face.{kind}").read_text("utf-8")


@pytest.mark.parametrize("kind", ["bt", "xmt"])
def test_own_files_read_exactly(kind: str) -> None:
    assert_same_face(read_face(GOLDEN / f"face.{kind}"), small_face())
    assert_same_frames(GOLDEN / f"face.{kind}", golden_stream(), names=True)


@pytest.mark.parametrize("name", ["mp4box.bt", "mp4box.xmt", "mp4box_without_names.bt"])
def test_what_mp4box_decoded_is_the_same_face_and_stream(name: str) -> None:
    assert_peer_agrees(GOLDEN / name, small_face(), golden_stream(), names="without" not in name)


@pytest.mark.parametrize(
    ("page", "start", "suffix", "keys"),
    [
        ("reference/fat_nodes.md", "InitialObjectDescriptor {", ".bt", [(1, 1), (3, 1), (5, 1), (23, 1)]),
        ("reference/fat_nodes.md", "<?xml", ".xmt", [(3, 1)]),
        ("knowhow/ecosystem.md", "InitialObjectDescriptor {", ".bt", [(2, 1), (3, 1), (23, 1)]),
    ],
)
def test_examples_of_the_standard_are_read(
    page: str, start: str, suffix: str, keys: list[tuple[int, int]], shared: Path, tmp_path: Path
) -> None:
    text = (shared / page).read_text("utf-8")
    at = text.index(start)
    path = tmp_path / f"example{suffix}"
    path.write_text(text[at : text.index("```", at)])
    assert [t.key for t in read_face(path).tables] == keys
    if "AT 40" in path.read_text():
        stream, _ = read_stream(path)
        assert (stream.frame_rate, stream.values[:, 2].tolist()) == (25.0, [512, 600, 300])
        assert (stream.visemes[:, 2].tolist(), stream.expressions[:, 1].tolist()) == ([63] * 3, [40] * 3)
