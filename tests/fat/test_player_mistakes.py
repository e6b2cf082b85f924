"""Mistakes of players are told by the frames they make, and right frames and unknown mistakes by none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from faces import small_face

from fat import AnimatableFace
from fat.golden import Golden, compare, record
from fat.intervals import interval_weights
from fat.mistaken_play import MISTAKES
from fat.player_mistakes import Explanation, explain, unexplained
from fat.replay import Replay
from fba.faps import fap
from fba.stream import FapStream


@pytest.fixture(scope="module")
def face() -> AnimatableFace:
    return small_face()


@pytest.fixture(scope="module")
def stream(face: AnimatableFace) -> FapStream:
    """Each table alone at several values, both blends, and all together."""
    low = [t.fap_id for t in face.tables if t.fap_id > 2]
    rows = [{number: value} for number in low for value in (-30000, -900, -100, 60, 700, 3000, 20000)]
    rows += [{}] * 12 + [dict.fromkeys(low, 300 + 10 * k) for k in range(4)]
    values = np.zeros((len(rows), 68), dtype=np.int32)
    for k, row in enumerate(rows):
        for number, value in row.items():
            values[k, number - 1] = value
    visemes = np.zeros((len(rows), 4), dtype=np.int32)
    expressions = np.zeros((len(rows), 6), dtype=np.int32)
    said, felt = ([t.high_level_select for t in face.tables if t.fap_id == number] for number in (1, 2))
    blends = [(n, 0, 50, 0) for n in said] + [(0, n, 20, 0) for n in said]
    feelings = [(n, 50, 0, 0, 0, 0) for n in felt] + [(0, 0, n, 30, 0, 0) for n in felt]
    start = len(rows) - 16
    visemes[start : start + len(blends)] = blends
    expressions[start + 6 : start + 6 + len(feelings)] = feelings
    visemes[-2:], expressions[-1] = (said[0], 0, 40, 0), (felt[0], 20, 0, 0, 0, 0)
    mask = values != 0
    mask[:, 0], mask[:, 1] = visemes.any(axis=1), expressions.any(axis=1)
    return FapStream(25.0, values, mask, visemes, expressions, np.arange(len(rows), dtype=np.int32), "all")


def wrong_of(face: AnimatableFace, stream: FapStream, found: Golden) -> list[str]:
    return [d.name for d in compare(face, stream, found) if not d.passed]


Change = Callable[[FapStream], FapStream]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda s: replace(s, values=-s.values), "wrong sign"),
        (lambda s: replace(s, visemes=s.visemes * [1, 1, -1, 1] + [0, 0, 63, 0]), "viseme_blend weighs"),
        (lambda s: replace(s, visemes=s.visemes * [1, 0, 1, 1]), "the second viseme is left out"),
        (lambda s: replace(s, expressions=s.expressions * [1, 1, 0, 1, 1, 1]), "the second expression is left out"),
        (lambda s: replace(s, values=np.roll(s.values, 1, axis=0), mask=np.roll(s.mask, 1, axis=0)), "one too late"),
        (FapStream.held, "keep their last value"),
    ],
)
def test_a_stream_read_wrongly_is_named(face: AnimatableFace, stream: FapStream, change: Change, said: str) -> None:
    found = record(face, change(stream))
    wrong = wrong_of(face, stream, found)
    first = explain(face, stream, found, wrong)[0]
    assert said in first.what
    assert set(first.motions) <= set(wrong)
    assert first.right in first.finding().message


def test_the_slope_of_the_last_interval_alone_is_named(face: AnimatableFace) -> None:
    """The formula that is wrong, written out, for a FAP whose table has several intervals."""
    table = max((t for t in face.tables if t.fap_id > 2 and t.meshes), key=lambda t: len(t.meshes[0].interval_borders))
    borders = table.meshes[0].interval_borders
    assert len(borders) > 2
    values = [0, *(int(b) + 30 for b in borders), *(int(b) - 30 for b in borders)]
    stream = FapStream.build(25.0, len(values), {table.fap_id: values}, name="one")
    right = record(face, stream)
    moved = np.repeat(face.scene.world_neutral()[None], len(values), axis=0)
    for mesh in table.meshes:
        turn = face.scene.world_matrix(mesh.shape)[:3, :3]
        index = face.scene.file_order()[mesh.shape][mesh.coord_index]
        for k, value in enumerate(values):
            weights = np.flatnonzero(interval_weights(mesh.interval_borders, value))
            if weights.size:
                last = int(weights[-1] if value > 0 else weights[0])
                slope = mesh.displacements[:, last].astype(float) @ turn.T
                moved[k, index] += face.fapu.unit(fap(table.fap_id).unit) * abs(value) * slope
    found = replace(right, frames=face.scene.frame.to_file(moved))
    wrong = wrong_of(face, stream, found)
    assert len(wrong) == 1
    assert "multiplied by the whole value" in explain(face, stream, found, wrong)[0].what


def test_what_a_mistake_makes_is_explained_by_it_or_its_like(face: AnimatableFace, stream: FapStream) -> None:
    """Whatever changes frames here is found again; other mistakes may give the same frames on so small a face."""
    right = record(face, stream)
    every = Replay(face, stream, right.ids, np.arange(len(stream), dtype=np.int32))
    named, made = 0, 0
    for mistake in MISTAKES:
        found = replace(right, frames=mistake.play(every))
        wrong = wrong_of(face, stream, found)
        if wrong:
            made += 1
            why = explain(face, stream, found, wrong)
            assert {name for e in why for name in e.motions} == set(wrong), mistake.what
            named += mistake.what in {e.what for e in why}
    assert made > 20
    assert named > 0.8 * made


def test_right_frames_and_unknown_mistakes_have_no_explanation(face: AnimatableFace, stream: FapStream) -> None:
    right = record(face, stream)
    assert explain(face, stream, right, []) == []
    noise = np.random.default_rng(1).normal(0.0, 0.5, right.frames.shape)
    found = replace(right, frames=right.frames + noise)
    wrong = wrong_of(face, stream, found)
    assert len(wrong) > 5
    assert explain(face, stream, found, wrong) == []


def test_frames_in_which_several_play_are_told_apart() -> None:
    alone = unexplained(["several"], [])
    after = unexplained(["several", "open_jaw"], [Explanation("this is wrong", "that is right", ("open_jaw",))])
    assert alone is not None
    assert after is not None
    assert "each motion alone is right" in alone.message
    assert "when the others are right" in after.message
    assert unexplained(["open_jaw"], []) is None
