"""The backend `ec`: its rules, its morph, its local frames, and whole faces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cloning.backends import find_backend
from cloning.ec import EVEN, ClonedTransfer, evened, morph, motion_maps
from cloning.ec_rules import rule_points
from cloning.prepare import PreparedFace, prepare
from cloning.source import source_motions
from cloning.surface import Surface
from fat import AnimatableFace
from fba.scene import rotation_matrix
from formats import read_scene
from formats.landmarks import read_landmarks
from samples import sample

TURN = rotation_matrix((0.3, 0.9, -0.2, 0.8))[:3, :3]
SAME = {
    "nose tip": "9.3",
    "nose base": "9.15",
    "upper lip": "8.1",
    "mouth": "2.2",
    "lower lip": "8.2",
    "chin": "2.1",
    "left mouth corner": "8.3",
    "right mouth corner": "8.4",
    "left nose wing": "9.1",
    "right nose wing": "9.2",
}
"""Points by rule, and the feature points that lie about there."""


def test_rules_find_the_parts_of_a_face(mine: PreparedFace, yours: PreparedFace) -> None:
    scene = read_scene(sample("faces/quad_head.obj"))
    parted_lips = prepare(scene, read_landmarks(sample("faces/quad_head.fps.json"), scene), "target")
    for face in (mine, yours, parted_lips):
        found = rule_points(face.skin)
        for name, key in SAME.items():
            assert np.linalg.norm(found[name] - face.skin.positions[key]) < 0.2, name
        assert found["nose bridge"][1] > found["nose tip"][1]
        assert found["left side"][0] > found["left eye corner"][0] > 0.0 > found["right eye corner"][0]


def test_rules_know_no_feature_points(mine: PreparedFace) -> None:
    bare = replace(mine.skin, points={}, positions={})
    for name, place in rule_points(bare).items():
        assert np.array_equal(place, rule_points(mine.skin)[name])


def test_rules_leave_out_what_is_not_there(mine: PreparedFace) -> None:
    skin = mine.skin
    mask = skin.triangles[skin.vertices[skin.triangles][:, :, 1].min(axis=1) > skin.positions["9.15"][1]]
    found = rule_points(replace(skin, triangles=mask))
    assert "nose tip" in found
    assert "mouth" not in found


def test_morph_takes_points_to_their_goals_and_knows_similarities() -> None:
    random = np.random.default_rng(0)
    centers = random.normal(size=(25, 3))
    places = random.normal(size=(60, 3))
    assert np.allclose(morph(places, centers, 1.7 * centers @ TURN.T + 2.0), 1.7 * places @ TURN.T + 2.0, atol=1e-9)
    goals = centers + 0.1 * random.normal(size=centers.shape)
    assert np.abs(morph(centers, centers, goals) - goals).max() < 0.01


def sheet(n: int = 9) -> Surface:
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-1.0, 1.0, n), np.linspace(-1.0, 1.0, n), indexing="ij"))
    vertices = np.stack([x, y, 0.4 * np.cos(2.0 * x) * np.cos(y)], axis=1)
    corner = np.arange(n * n).reshape(n, n)
    cells = np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]], axis=-1).reshape(-1, 4)
    cells = cells.astype(np.int32)
    polygons = cells.ravel(), 4 * np.arange(len(cells) + 1, dtype=np.int32)
    triangles = np.concatenate([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])
    return Surface(("a",), np.array([0, n * n]), vertices, polygons, triangles, np.zeros((0, 2), np.int32), {}, {})


def test_motion_turns_and_grows_with_the_surface() -> None:
    surface = sheet()
    maps = motion_maps(surface, 1.8 * surface.vertices @ TURN.T + 1.0)
    assert np.allclose(maps, 1.8 * TURN, atol=1e-9)


def test_a_stretched_place_stretches_motion_along_it() -> None:
    surface = sheet()
    flat = replace(surface, vertices=surface.vertices * [1.0, 1.0, 0.0])
    maps = motion_maps(flat, flat.vertices * [2.0, 0.5, 1.0])
    # The sheet's first row measures along its other edge: an exception, and bounded like one.
    assert np.allclose(maps[9:, 0, 0], 2.0)
    assert np.allclose(maps[9:, 1, 1], 0.5)


def test_one_wild_place_does_not_blow_motion_up() -> None:
    surface = sheet()
    copy = surface.vertices.copy()
    copy[40] += [0.0, 0.0, 30.0]
    assert np.linalg.norm(motion_maps(surface, copy), axis=(1, 2)).max() < 30.0


def test_turn_and_growth_are_evened_out_over_a_length_whatever_the_mesh() -> None:
    spread = []
    for n in (21, 41):
        surface = sheet(n)
        alone = np.zeros((n * n, 3, 3))
        alone[n * n // 2] = np.eye(3)
        found = evened(surface, alone)[:, 0, 0]
        away = np.sum((surface.vertices - surface.vertices[n * n // 2]) ** 2, axis=1)
        spread.append(float(np.sqrt((found @ away) / found.sum())))
    assert 0.5 * EVEN < spread[1] < 1.5 * EVEN
    assert abs(spread[0] / spread[1] - 1.0) < 0.1
    same = np.broadcast_to(TURN, (81, 3, 3))
    assert np.allclose(evened(sheet(), same), same)


def test_skin_far_from_the_morph_rests_where_it_can_be_seen(mine: PreparedFace, yours: PreparedFace) -> None:
    skin = yours.skin
    behind = np.clip(skin.positions["7.1"][2] - skin.vertices[:, 2], 0.0, None)
    long = replace(skin, vertices=skin.vertices - np.stack([0.0 * behind, 0.0 * behind, 0.6 * behind], axis=1))
    jaw = np.zeros((mine.skin.vertex_count, 1, 3))
    jaw[mine.skin.vertices[:, 2] > mine.skin.positions["7.1"][2], 0, 1] = 0.1
    moved = find_backend("ec").build(mine, replace(yours, skin=long), False).apply(jaw)
    assert (behind > 0.6).sum() > 100
    assert not moved[behind > 0.6].any()


@pytest.fixture(scope="module", params=[False, True], ids=["default", "published"])
def transfer(request: pytest.FixtureRequest, mine: PreparedFace, yours: PreparedFace) -> ClonedTransfer:
    made = find_backend("ec").build(mine, yours, request.param)
    assert isinstance(made, ClonedTransfer)
    by_rule = len(rule_points(mine.skin))
    points = made.parameters["points"]
    assert points == by_rule if request.param else float(points) > 2 * by_rule, "published mode starts from rules"
    return made


def test_lips_move_with_their_own_side(mine: PreparedFace, yours: PreparedFace, transfer: ClonedTransfer) -> None:
    lift = np.zeros((mine.skin.vertex_count, 1, 3))
    lift[mine.labels.values == 1, 0, 1] = 0.1 * mine.fapu.es0
    moved = transfer.apply(lift)[transfer.line, 0]
    side = yours.labels.values[transfer.line]
    assert (side == 1).sum() > 10
    assert (side == 2).sum() > 10
    assert np.allclose(transfer.on_line.sum(axis=1), 1.0)
    lifted = np.linalg.norm(moved, axis=1) > 0.01 * yours.fapu.es0
    assert lifted[side == 1].mean() > 0.9
    assert not lifted[side == 2].any()


def test_a_face_onto_itself_gives_its_own_motion(mine: PreparedFace, source: AnimatableFace) -> None:
    motions = np.stack([mine.skin.join(m.offsets) for m in source_motions(source, frozenset((3, 12, 19)))], axis=1)
    found = find_backend("ec").build(mine, mine, False).apply(motions)
    assert np.linalg.norm(found - motions) < 1e-3 * np.linalg.norm(motions)


def test_a_closed_mouth_has_no_line(mine: PreparedFace, yours: PreparedFace) -> None:
    sealed = replace(yours, labels=replace(yours.labels, sealed=(1,)))
    transfer = find_backend("ec").build(mine, sealed, False)
    assert isinstance(transfer, ClonedTransfer)
    assert len(transfer.line) == 0
