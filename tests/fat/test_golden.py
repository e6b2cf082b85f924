"""Golden frames: a second player passes them, and each mistake that players make is told by its motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from literal_player import play

from fat import AnimatableFace, FaceDefTables
from fat.golden import EVERY, Golden, compare, record, telling_vertices
from fba.errors import FapStreamError, InputFileError
from fba.faps import LOW_LEVEL_FAPS
from fba.stream import FapStream
from formats import read_face
from formats.fap import read_fap, write_fap
from formats.golden import read_golden, write_golden
from samples import sample
from samples.build.every import every_fap, values_of

STEP = 9
"""Of the shipped stream every so many-th frame is played by the slow second player."""


@pytest.fixture(scope="module")
def face() -> AnimatableFace:
    return read_face("default")


@pytest.fixture(scope="module")
def stream() -> FapStream:
    return read_fap(sample("streams/every_fap.fap"))[0]


@pytest.fixture(scope="module")
def golden() -> Golden:
    return read_golden(sample("golden/every_fap.npz"))


def cut(stream: FapStream, step: int) -> FapStream:
    names = ("values", "mask", "visemes", "expressions", "frame_numbers")
    return replace(stream, **{name: getattr(stream, name)[::step] for name in names})


def test_the_shipped_stream_and_frames_are_those_of_the_shipped_face(
    face: AnimatableFace, stream: FapStream, golden: Golden, tmp_path: Path
) -> None:
    made = every_fap(face)
    write_fap(made, tmp_path / "made.fap")
    assert (tmp_path / "made.fap").read_bytes() == sample("streams/every_fap.fap").read_bytes()
    assert np.array_equal(golden.ids, telling_vertices(face, made))
    found = compare(face, stream, golden)
    assert max(d.largest for d in found) < 0.02  # Single precision.
    assert all(d.passed for d in found)


def test_the_stream_plays_every_table_at_and_beyond_its_borders(face: AnimatableFace, stream: FapStream) -> None:
    for table in face.tables:
        if table.fap_id in LOW_LEVEL_FAPS:
            column = stream.values[:, table.fap_id - 1]
            alone = (stream.mask.sum(axis=1) == 1) & stream.mask[:, table.fap_id - 1]
            assert set(values_of(table)) == set(column[alone].tolist())
            borders = {int(b) for mesh in table.meshes for b in mesh.interval_borders} - {0}
            assert borders <= set(column.tolist())
            if borders:
                assert column.max() > max(borders)
    for field in (stream.visemes[:, 0], stream.visemes[:, 1]):
        assert set(range(15)) <= set(field.tolist())
    for field in (stream.expressions[:, 0], stream.expressions[:, 2]):
        assert set(range(7)) <= set(field.tolist())
    assert (stream.mask.sum(axis=1) > 10).sum() == 16


def test_a_second_player_passes(face: AnimatableFace, stream: FapStream, golden: Golden) -> None:
    """The standard's cases written out, for the kept vertices of every ninth frame."""
    kept = set(golden.ids.tolist())
    order = face.scene.file_order()
    short = cut(stream, STEP)
    tables = [
        replace(
            t,
            meshes=tuple(
                replace(m, coord_index=m.coord_index[rows], displacements=m.displacements[rows])
                for m in t.meshes
                if (rows := np.flatnonzero([int(order[m.shape][v]) in kept for v in m.coord_index])).size
            ),
        )
        for t in face.tables
    ]
    frames = np.empty((len(short), len(golden.ids), 3))
    for k in range(len(short)):
        values = {n: int(short.values[k, n - 1]) for n in LOW_LEVEL_FAPS if short.values[k, n - 1]}
        playing = [t for t in tables if t.fap_id in values or (t.fap_id <= 2 and short.mask[k, t.fap_id - 1])]
        some = replace(face, tables=FaceDefTables(tuple(playing)))
        viseme, expression = tuple(short.visemes[k, :3].tolist()), tuple(short.expressions[k, :4].tolist())
        frames[k] = face.scene.frame.to_file(play(some, values, viseme, expression))[golden.ids]
    found = compare(face, short, replace(golden, frames=frames))
    assert max(d.largest for d in found) < 0.02
    assert len(found) > 60


Mistake = Callable[[FapStream, Golden], np.ndarray]


def scaled(stream: FapStream, golden: Golden) -> np.ndarray:
    rows = (stream.mask[:, 30]) & (stream.mask.sum(axis=1) == 1)
    frames = golden.frames.copy()
    frames[rows] = golden.neutral + 1.25 * (frames[rows] - golden.neutral)
    return frames


def still(stream: FapStream, golden: Golden) -> np.ndarray:
    rows = (stream.mask[:, 22]) & (stream.mask.sum(axis=1) == 1)
    frames = golden.frames.copy()
    frames[rows] = golden.neutral
    return frames


@pytest.mark.parametrize(
    ("mistake", "name", "said"),
    [(scaled, "raise_l_i_eyebrow", "1.25 times as large"), (still, "yaw_l_eyeball", "nothing moves")],
)
def test_a_mistake_is_told_by_its_motion_alone(
    face: AnimatableFace, stream: FapStream, golden: Golden, mistake: Mistake, name: str, said: str
) -> None:
    wrong = [d for d in compare(face, stream, replace(golden, frames=mistake(stream, golden))) if not d.passed]
    assert [d.name for d in wrong] == [name]
    assert said in wrong[0].finding().message


def test_a_player_that_stops_at_the_last_border_is_found(
    face: AnimatableFace, stream: FapStream, golden: Golden
) -> None:
    """Values beyond the outermost border go on along its line."""
    table = face.tables.get(3)
    assert table is not None
    last = max(int(b) for m in table.meshes for b in m.interval_borders)
    clamped = replace(stream, values=np.where(np.arange(68) == 2, np.minimum(stream.values, last), stream.values))
    found = compare(face, stream, record(face, clamped, golden.ids))
    assert "open_jaw" in {d.name for d in found if not d.passed}
    assert {d.name for d in found if not d.passed} <= {"open_jaw", "several"}


def test_what_cannot_be_compared_is_refused(face: AnimatableFace, stream: FapStream, golden: Golden) -> None:
    for broken, said in (
        (replace(golden, frames=golden.frames[1:]), "740 frames, but 739"),
        (replace(golden, neutral=golden.neutral[:, ::-1]), "order, axes and units"),
        (replace(golden, ids=golden.ids + face.scene.vertex_count), "are of a vertex"),
    ):
        with pytest.raises(FapStreamError, match=said):
            compare(face, stream, broken)


def test_files_read_back_and_are_the_same_bytes(golden: Golden, tmp_path: Path) -> None:
    write_golden(golden, tmp_path / "a.npz")
    assert (tmp_path / "a.npz").read_bytes() == sample("golden/every_fap.npz").read_bytes()
    assert set(range(0, int(golden.ids[-1]), EVERY)) <= set(golden.ids.tolist())
    everything = {"neutral": np.zeros((4, 3)), "vertices": np.zeros((2, 4, 3)), "fps": np.array(25)}
    np.savez(tmp_path / "b.npz", **everything)
    assert read_golden(tmp_path / "b.npz").ids.tolist() == [0, 1, 2, 3]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"vertices": None}, "no array 'vertices'"),
        ({"vertices": np.zeros((2, 3, 3))}, "do not fit"),
        ({"neutral": np.array(3.0)}, "do not fit"),
        ({"ids": np.arange(4) - 1}, "from 0"),
        ({"ids": np.array(["a"] * 4)}, "do not fit"),
        ({"fps": np.array([1, 2])}, "do not fit"),
        ({"vertices": np.array([{}])}, "not a readable"),
    ],
)
def test_damaged_files_are_refused(change: dict[str, np.ndarray | None], said: str, tmp_path: Path) -> None:
    arrays = {"neutral": np.zeros((4, 3)), "vertices": np.zeros((2, 4, 3)), "fps": np.array(25), **change}
    np.savez(tmp_path / "b.npz", **{name: value for name, value in arrays.items() if value is not None})
    with pytest.raises(InputFileError, match=said):
        read_golden(tmp_path / "b.npz")
