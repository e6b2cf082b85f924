"""Eyeballs that come forward push their lids before them; pupils with a ring of vertices change their size."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from authoring.eyes import CONSTRUCTIONS, dilate, thrust
from authoring.on_eyeball import eyeball
from cloning.prepare import PreparedFace
from fat.build import build_tables
from fat.conformance import conformance
from fat.face import AnimatableFace
from fat.motion import FaceMotion
from fat.quality import asymmetry, cross_talk, fap_values, feature_point_motion, flips, mirror_map

Shipped = Callable[[str], PreparedFace]


@pytest.mark.parametrize("name", ["source", "quad_head"])
def test_thrust_and_dilation_are_exact(shipped: Shipped, name: str) -> None:
    face = shipped(name)
    motions = [
        FaceMotion(str(k), k, 1, border, made.make(face, border))
        for k, made in CONSTRUCTIONS.items()
        for border in made.borders
    ]
    finished = AnimatableFace(face.scene, face.points, build_tables(face.scene, face.fapu, motions), face.fapu, {})
    found = conformance(finished)
    assert [f.fap_id for f in found] == [27, 28, 29, 30]
    assert all(f.relative_error < 2e-4 for f in found), found
    for motion in motions[: 2 * len(CONSTRUCTIONS[27].borders)]:
        values = fap_values(feature_point_motion(face.points, motion.offsets), face.fapu)
        assert cross_talk(values, motion.fap_id or 0)[0] < 1e-9


@pytest.mark.parametrize("value", [40, 150])
def test_ball_does_not_come_through_the_lids(shipped: Shipped, value: int) -> None:
    face = shipped("source")
    ball = eyeball(face, "3.5")
    assert ball is not None
    offsets = thrust(face, 27, value)
    skin = face.skin.join({k: v for k, v in offsets.items() if k in face.skin.shapes})
    way = np.array([0.0, 0.0, value * face.fapu.es0 / 1024])
    assert np.allclose(offsets["eye_left"], way)
    rest = ball.rest - ball.center
    before = rest[:, 2] > 0.0
    now = ball.clearance(rest + skin[ball.vertices] - way)
    assert np.all(now[before] > np.minimum(ball.clearance(rest), 0.0)[before] - 0.02)
    assert flips(face.skin.vertices, face.skin.triangles, skin / face.fapu.es0) <= 0.1
    rim = face.skin.points["3.1"][0][0]
    assert skin[rim, 2] == pytest.approx(way[2], rel=0.15), "the lid's rim goes with the ball"


def test_both_eyes_alike(shipped: Shipped) -> None:
    face = shipped("source")
    mirror = mirror_map(face.skin.vertices, 1e-3)
    one, two = (face.skin.join(thrust(face, k, 100)) for k in (27, 28))
    assert asymmetry(one, two, mirror) < 1e-4


def test_only_pupil_and_iris_move_on_the_ball(shipped: Shipped) -> None:
    face = shipped("source")
    (moved,) = dilate(face, 29, 200).values()
    rest = face.scene.world_vertices("eye_left")
    pupil = face.place("3.5")
    away = np.linalg.norm(rest - pupil, axis=1)
    assert not moved[away > 0.52 * face.fapu.irisd0].any(), "the white of the eye rests"
    assert np.linalg.norm(moved[away == away.min()]) == 0.0
    center = rest.mean(axis=0)
    radius = np.linalg.norm(rest - center, axis=1)
    assert np.allclose(np.linalg.norm(rest + moved - center, axis=1), radius, rtol=1e-2), "along the ball"
    (smaller,) = dilate(face, 29, -200).values()
    assert np.all(np.einsum("ij,ij->i", moved, smaller) <= 1e-15)


def test_eyes_without_a_ring_keep_their_pupils(ict: PreparedFace, shipped: Shipped) -> None:
    assert dilate(ict, 29, 100) == {}
    assert dilate(shipped("tri_head"), 29, 100) == {}
    assert dilate(shipped("closed_head"), 29, 100) == {}
    assert thrust(shipped("closed_head"), 27, 100) == {}
