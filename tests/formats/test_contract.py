"""What every registered format promises."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faces import assert_same_face, small_face

from cloning import clone
from fat import AnimatableFace, FaceDefTables
from fba.errors import FbaError, InputFileError, OutputFileError
from formats import Format, format_of, formats, read, read_face, read_scene, write
from formats.landmarks import read_landmarks
from samples import sample

READERS = [(entry, extension) for entry in formats() if entry.reads for extension in entry.extensions]
WRITERS = [(entry, extension) for entry in formats() if entry.writes for extension in entry.extensions]
BOTH = [pair for pair in WRITERS if pair[0].reads]


def named(pairs: list[tuple[Format, str]]) -> list[str]:
    return [extension for _, extension in pairs]


@pytest.mark.parametrize(("entry", "extension"), BOTH, ids=named(BOTH))
def test_what_is_written_reads_back(entry: Format, extension: str, tmp_path: Path) -> None:
    face = small_face()
    path = tmp_path / f"face{extension}"
    write(face, path)
    found = read(path)
    assert isinstance(found, AnimatableFace) == entry.carries_tables
    if isinstance(found, AnimatableFace):
        assert_same_face(found, face)
    else:
        before, after = face.scene.world_neutral(), read_scene(path).world_neutral()
        if extension == ".stl":  # Triangle soup in float32: vertices are merged by position, their order is its own.
            before, after = (np.unique(v.astype(np.float32), axis=0) for v in (before, after))
        np.testing.assert_array_equal(after, before)


FAPS = frozenset({1, 2, 3, 5, 12, 19, 20, 23, 25, 37, 44, 48})
"""Two visemes and expressions each, and low-level FAPs of every kind: skin, lids, eyeballs, brows, tongue, head."""


@pytest.mark.parametrize("name", ["source", "quad_head", "tri_head", "closed_head"])
def test_shipped_faces_read_back_exactly(name: str, tmp_path: Path) -> None:
    face = read_face("default")
    face = replace(
        face, tables=FaceDefTables(tuple(t for t in face.tables if t.fap_id in FAPS and t.high_level_select < 3))
    )
    if name != "source":
        scene = read_scene(sample(f"faces/{name}.obj"))
        points = read_landmarks(sample(f"faces/{name}.fps.json"), scene)
        face = clone(face, scene, points, backend="ec")
    assert len(face.tables) > 10
    for entry in {e.module: e for e in reversed(formats())}.values():
        if entry.carries_tables:
            path = tmp_path / f"face{entry.extensions[0]}"
            write(face, path)
            assert_same_face(read_face(path), face)


@pytest.mark.parametrize(("entry", "extension"), WRITERS, ids=named(WRITERS))
def test_same_face_same_bytes(entry: Format, extension: str, tmp_path: Path) -> None:
    data = []
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        path = tmp_path / folder / f"face{extension}"
        write(small_face(), path)
        data.append(path.read_bytes())
    assert data[0] == data[1]


@pytest.mark.parametrize(("entry", "extension"), WRITERS, ids=named(WRITERS))
def test_a_folder_that_is_not_there_is_said_and_nothing_is_left(entry: Format, extension: str, tmp_path: Path) -> None:
    with pytest.raises(OutputFileError, match="cannot write"):
        write(small_face(), tmp_path / "nowhere" / f"face{extension}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("entry", "extension"), READERS, ids=named(READERS))
@pytest.mark.parametrize("content", [b"", b"\x00\xff\xfe garbage " * 40, b"hello world\n", b"\x1f\x8b\x08\x00"])
def test_what_is_no_face_is_refused_by_name(entry: Format, extension: str, content: bytes, tmp_path: Path) -> None:
    path = tmp_path / f"wrong{extension}"
    path.write_bytes(content)
    with pytest.raises(FbaError, match="wrong"):
        read(path)


@pytest.mark.parametrize(("entry", "extension"), BOTH, ids=named(BOTH))
def test_a_file_cut_short_is_refused_or_read_without_the_rest(entry: Format, extension: str, tmp_path: Path) -> None:
    whole = tmp_path / f"whole{extension}"
    write(small_face(), whole)
    data = whole.read_bytes()
    cut = tmp_path / f"cut{extension}"
    for part in (0.1, 0.5, 0.9, 0.999):
        cut.write_bytes(data[: int(len(data) * part)])
        refused = ""
        try:
            read(cut)
        except FbaError as error:
            refused = str(error)
        assert "cut" in refused or extension in (".obj", ".off", ".ply"), "a cut file was taken for whole"


@pytest.mark.parametrize(("entry", "extension"), READERS, ids=named(READERS))
def test_a_missing_file_is_said(entry: Format, extension: str, tmp_path: Path) -> None:
    with pytest.raises(InputFileError, match="does not exist"):
        read(tmp_path / f"none{extension}")


def test_the_longest_extension_decides() -> None:
    assert format_of(Path("a.wrl.gz")).name == "VRML97"
    assert format_of(Path("A.OBJ")).name == "Wavefront OBJ"
