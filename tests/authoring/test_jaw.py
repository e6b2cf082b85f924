"""The jaw turns about its joints: chin exact, teeth and tongue rigid with it, the rest of the face still."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from authoring.jaw import CONSTRUCTIONS, WIDEST, findings, jaw, joints, open_jaw
from cloning.prepare import PreparedFace, prepare
from cloning.rigid import fit_rigid
from fat.quality import asymmetry, cross_talk, fap_values, feature_point_motion, flips, mirror_map
from fba import FeaturePoints, Role
from fba.arrays import Floats

Shipped = Callable[[str], PreparedFace]
FOLDED = 0.05
"""Percent of moving triangles that may turn over: curls in the corners of the lips."""
HEADS = ("source", "quad_head", "tri_head", "closed_head")


def values(face: PreparedFace, offsets: dict[str, Floats]) -> dict[int, float]:
    return fap_values(feature_point_motion(face.points, offsets), face.fapu)


def exact(face: PreparedFace) -> None:
    """The chin goes exactly its way at every border, and nobody else's point goes along who should not."""
    for fap_id, made in CONSTRUCTIONS.items():
        for border in made.borders:
            found = values(face, made.make(face, border))
            assert found[fap_id] == pytest.approx(border, rel=1e-6), (fap_id, border)
            assert cross_talk(found, fap_id)[0] <= 0.05, (fap_id, border)


@pytest.mark.parametrize("name", HEADS)
def test_chin_is_exact_and_others_are_still(shipped: Shipped, name: str) -> None:
    exact(shipped(name))


def test_dense_face_is_exact_and_does_not_fold(ict: PreparedFace) -> None:
    exact(ict)
    opened = ict.skin.join(jaw(ict).opened(1024)) / ict.fapu.es0
    assert flips(ict.skin.vertices, ict.skin.triangles, opened) <= FOLDED


def test_teeth_turn_rigidly_about_the_joints(shipped: Shipped) -> None:
    face = shipped("source")
    es0 = face.fapu.es0
    joint, axis, _ = joints(face)
    (teeth,) = (s.name for s in face.scene.with_role(Role.LOWER_TEETH))
    (tongue,) = (s.name for s in face.scene.with_role(Role.TONGUE))
    (above,) = (s.name for s in face.scene.with_role(Role.UPPER_TEETH))
    for border in (256, 1024):
        moved = jaw(face).opened(border)
        assert above not in moved
        for name in (teeth, tongue):
            motion = fit_rigid(face.scene.world_vertices(name), moved[name][:, None], es0 * joint)
            assert motion.residual[0] < 1e-9
            assert np.abs(motion.shifts).max() < 1e-9 * es0, "the joint stays where it is"
            assert np.allclose(motion.turns[0] @ axis, axis)


def test_chords_between_borders_stay_on_the_arc(shipped: Shipped) -> None:
    face = shipped("source")
    joint, _, _ = joints(face)
    chin = face.skin.positions["2.1"] - joint
    lever = np.linalg.norm(chin[1:])
    borders = [0, *(b for b in CONSTRUCTIONS[3].borders if b <= 1024)]
    way = {0: np.zeros(3)}
    for border in borders[1:]:
        way[border] = feature_point_motion(face.points, jaw(face).opened(border))["2.1"] / face.fapu.es0
    for low, high in pairwise(borders):
        middle = chin + 0.5 * (way[low] + way[high])
        assert abs(np.linalg.norm(middle[1:]) - lever) < 2e-3 * lever


def test_beyond_its_widest_a_jaw_glides_straight_down(shipped: Shipped) -> None:
    face = shipped("source")
    far = [feature_point_motion(face.points, jaw(face).opened(v))["2.1"] for v in (2600, 3600)]
    step = far[1] - far[0]
    assert step[1] == pytest.approx(-1000 * face.fapu.mns0 / 1024)
    assert np.abs(step[[0, 2]]).max() < 1e-9
    chin = face.place("2.1") - face.fapu.es0 * joints(face)[0]
    widest = -chin[1] * (1 - np.cos(WIDEST)) + chin[2] * np.sin(WIDEST) * -1
    assert far[0][1] < widest < 0.0


def test_practical_jaw_opens_the_mouth_without_folds(shipped: Shipped) -> None:
    face = shipped("source")
    moved = jaw(face).opened(1024)
    motion = feature_point_motion(face.points, moved)
    drop = -motion["2.1"][1]
    assert motion["2.2"][1] - motion["2.3"][1] > 0.8 * drop
    assert abs(motion["2.2"][1]) < 0.02 * drop
    assert 0.2 < motion["2.4"][1] / motion["2.3"][1] < 0.7, "the corners follow half-way"
    skin = face.skin.join({k: v for k, v in moved.items() if k in face.skin.shapes}) / face.fapu.es0
    assert flips(face.skin.vertices, face.skin.triangles, skin) <= FOLDED
    end = face.skin.vertices[:, 1] < face.skin.vertices[:, 1].min() + 0.02
    assert not skin[end].any(), "where the neck ends a body may go on"


def test_lower_teeth_stay_behind_the_lip(shipped: Shipped) -> None:
    face = shipped("source")
    (teeth,) = (s.name for s in face.scene.with_role(Role.LOWER_TEETH))
    rest = face.place("8.2") - face.place("9.11")
    for border in (512, 1024, 1536):
        moved = jaw(face).opened(border)
        motion = feature_point_motion(face.points, moved)
        turn = fit_rigid(face.scene.world_vertices(teeth), moved[teeth][:, None], face.place("9.11")).turns[0]
        beside_teeth = turn.T @ (rest + motion["8.2"] - motion["9.11"])
        assert np.abs(beside_teeth - rest).max() < 0.25 * rest[2], "the lip stays before the teeth"


@pytest.mark.parametrize(("fap_id", "border", "other"), [(3, 1024, 1024), (14, 600, 600), (15, 200, -200)])
def test_left_is_the_mirror_image_of_right(shipped: Shipped, fap_id: int, border: int, other: int) -> None:
    face = shipped("source")
    mirror = mirror_map(face.skin.vertices, 1e-3)
    one, two = (face.skin.join(CONSTRUCTIONS[fap_id].make(face, v)) for v in (border, other))
    assert asymmetry(one, two, mirror) < 1e-4


def test_positive_shift_goes_to_the_subjects_right(shipped: Shipped) -> None:
    face = shipped("source")
    moved = CONSTRUCTIONS[15].make(face, 200)
    motion = feature_point_motion(face.points, moved)
    assert motion["2.1"][0] < 0.0
    assert motion["9.11"][0] == pytest.approx(motion["2.1"][0])


def test_spread_of_a_modelled_jaw_is_taken(shipped: Shipped) -> None:
    face = shipped("source")
    made = jaw(face)
    unit = {k: 0.7 * v for k, v in made.opened(900).items()}
    found = jaw(face, made.opened(900)).shares
    local = face.skin.vertices - joints(face)[0]
    far = np.hypot(local[:, 1], local[:, 2]) > 0.4
    assert np.abs(found - made.shares)[far].max() < 0.06
    again = open_jaw(face, [300], unit)[300]
    assert values(face, again)[3] == pytest.approx(300)


def test_without_ear_lobes_the_jaw_turns_about_the_heads_pivot(shipped: Shipped) -> None:
    face = shipped("source")
    kept = FeaturePoints({k: p for k, p in face.points.items() if k not in ("10.7", "10.8")})
    bare = prepare(face.scene, kept, "source")
    assert [f.code for f in findings(bare)] == ["derived-jaw-joint"]
    assert findings(face) == []
    assert values(bare, jaw(bare).opened(500))[3] == pytest.approx(500)
