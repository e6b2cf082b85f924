"""What a clone leaves out by default: nothing that can be seen, and no verdict changes."""

from __future__ import annotations

import numpy as np
import pytest

from cloning import clone
from cloning.clone import STILL
from fat.build import face_motions
from fat.compact import SMALL, UNSEEN
from fat.conformance import conformance
from fat.face import AnimatableFace
from formats import read_face, read_scene
from formats.landmarks import read_landmarks
from samples import sample

FAPS = (3, 6, 8, 19, 23, 31)


@pytest.fixture(scope="module")
def clones() -> tuple[AnimatableFace, AnimatableFace]:
    """The compact and the exact clone of a few FAPs onto a head of quads."""
    path = sample("faces/quad_head.obj")
    scene = read_scene(path)
    points = read_landmarks(path.with_suffix(".fps.json"), scene)
    source = read_face("default")
    small, whole = (clone(source, scene, points, backend="fmc", faps=FAPS, exact=exact) for exact in (False, True))
    return small, whole


def test_it_is_much_smaller_and_the_neutral_face_is_the_same(clones: tuple[AnimatableFace, AnimatableFace]) -> None:
    small, whole = clones
    assert np.array_equal(small.scene.world_neutral(), whole.scene.world_neutral())
    assert [t.key for t in small.tables] == [t.key for t in whole.tables]
    numbers = [sum(m.displacements.size for t in face.tables for m in t.meshes) for face in clones]
    assert numbers[0] < 0.9 * numbers[1]


def test_nobody_sees_what_is_left_out(clones: tuple[AnimatableFace, AnimatableFace]) -> None:
    """At every border of the exact clone, kept or not, each vertex is where it belongs, but for what is documented."""
    small, whole = clones
    unit = whole.fapu.es0
    kept = {(m.fap_id, m.select, m.value): m for m in face_motions(small)}
    compared = 0
    for motion in face_motions(whole):
        found = kept.get((motion.fap_id, motion.select, motion.value))
        if found is None:
            continue
        compared += 1
        largest = max(float(np.linalg.norm(o, axis=1).max()) for o in motion.offsets.values())
        for name, offsets in motion.offsets.items():
            missed = np.linalg.norm(found.offsets.get(name, np.zeros_like(offsets)) - offsets, axis=1).max()
            assert missed <= max(UNSEEN * largest, SMALL * unit) + 2.0 * STILL * unit, (motion.name, motion.value)
    assert compared > len(FAPS)


def test_verdicts_on_feature_points_are_the_same(clones: tuple[AnimatableFace, AnimatableFace]) -> None:
    small, whole = ({(r.fap_id, r.value): r for r in conformance(face)} for face in clones)
    assert {key[0] for key, r in small.items() if not r.passed} == {key[0] for key, r in whole.items() if not r.passed}
    assert {key[0] for key in small} == {key[0] for key in whole}
    for key in small.keys() & whole.keys():
        assert small[key].error_units <= whole[key].error_units + max(2e-4 * abs(key[1]), 0.1), small[key].name
