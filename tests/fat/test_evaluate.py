from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from literal_player import displacement, play, strip, turned_scene

from fat import AnimatableFace, FaceDefMesh, FaceDefTable, FaceDefTables, FaceDefTransform, TransformField
from fat.evaluate import Player
from fat.intervals import interval_weights
from fba import FaceScene, FapStream, Fapu, FeaturePoints, PolyMesh, Shape, Transform
from fba.errors import FaceDefTablesError, FapStreamError
from fba.high_level import expression_weights, viseme_weights

FAPU = Fapu(irisd0=0.11, es0=0.63, ens0=0.41, mns0=0.19, mw0=0.5)

BORDERS = (
    st.lists(st.integers(-2000, 2000), min_size=1, max_size=5)
    .map(lambda b: sorted({0, *b}))
    .filter(lambda b: len(b) > 1)
)


def face_of(scene: FaceScene, *tables: FaceDefTable) -> AnimatableFace:
    return AnimatableFace(scene, FeaturePoints({}), FaceDefTables(tables), FAPU)


def random_mesh(rng: np.random.Generator, shape: str, count: int, borders: list[int]) -> FaceDefMesh:
    index = rng.permutation(count)[: rng.integers(1, count)]
    return FaceDefMesh(shape, np.array(borders), index, rng.normal(size=(index.size, len(borders) - 1, 3)))


def random_face(seed: int, borders: list[list[int]]) -> AnimatableFace:
    """Low-level, viseme and expression tables over every shape, and every kind of transform."""
    rng = np.random.default_rng(seed)
    scene = turned_scene()
    turn = TransformField.ROTATION
    transforms = {
        23: (FaceDefTransform("eye_yaw", turn, (0.2, 1, 0, 1.0)),),
        25: (FaceDefTransform("eye_pitch", turn, (1, 0, 0, -0.7)),),
        27: (FaceDefTransform("eye_yaw", TransformField.TRANSLATION, translation_def=(0.0, 1e-4, 2e-4)),),
        29: (FaceDefTransform("eye_pitch", TransformField.SCALE, scale_def=(1e-3, 2e-3, 1e-3)),),
        48: (FaceDefTransform("head_pitch", turn, (1, 0, 0, 1.0)),),
        49: (FaceDefTransform("head_yaw", turn, (0, 2, 0, 1.0)),),
    }
    tables = []
    keys = [(3, 1), (5, 1), (19, 1), (48, 1), (1, 1), (1, 10), (2, 3), (2, 6)]
    for k, key in enumerate(keys):
        meshes = tuple(random_mesh(rng, s.name, s.mesh.vertex_count, borders[k % len(borders)]) for s in scene.shapes)
        tables.append(FaceDefTable(*key, meshes, transforms.pop(key[0], ()) if key[0] > 2 else ()))
    tables += [FaceDefTable(number, 1, (), value) for number, value in transforms.items()]
    return face_of(scene, *tables)


def test_the_worked_example_of_the_standard() -> None:
    slopes = np.array([(1, 0, 0), (0.9, 0, 0), (1.5, 0, 4), (0.8, 0, 0), (0.7, 0, 0), (2, 0, 0)])
    mesh = FaceDefMesh("skin", np.array([-1000, 0, 500, 1000]), np.array([50, 51]), slopes)
    scene = FaceScene((strip("skin", 60, 0),))
    player = Player(face_of(scene, FaceDefTable(3, 1, (mesh,))))
    neutral = scene.shapes[0].mesh.vertices
    unit = FAPU.mns0 / 1024
    moved = player.pose({3: 600}).local["skin"] - neutral
    assert moved[50] / unit == pytest.approx((600, 0, 400), abs=1e-4)
    assert moved[51] / unit == pytest.approx((550, 0, 0), abs=1e-4)
    assert np.count_nonzero(moved.any(axis=1)) == 2
    moved = player.pose({3: -600}).local["skin"] - neutral
    assert moved[50] / unit == pytest.approx((600, 0, 0), abs=1e-4), "a negative interval is not turned round"
    moved = player.pose({3: 2000}).local["skin"] - neutral
    assert moved[50] / unit == pytest.approx((500 * 0.9 + 1500 * 1.5, 0, 6000), rel=1e-6), "the last interval goes on"


@given(BORDERS, st.integers(-5000, 5000))
def test_interval_weights_are_the_standards_sums(borders: list[int], value: int) -> None:
    slopes = [np.eye(3)[i % 3] * (i + 1) for i in range(len(borders) - 1)]
    found = interval_weights(np.array(borders), value) @ np.array(slopes)
    assert found == pytest.approx(displacement(borders, slopes, value), abs=1e-9)


@given(BORDERS.filter(lambda b: len(b) > 2))
def test_the_path_has_no_jumps(borders: list[int]) -> None:
    values = np.arange(min(borders) - 3, max(borders) + 4)
    steps = np.abs(np.diff(interval_weights(np.array(borders), values), axis=0)).sum(axis=1)
    assert np.all(steps == 1.0)


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 2**31),
    st.lists(BORDERS, min_size=1, max_size=4),
    st.dictionaries(st.sampled_from([3, 5, 19, 23, 25, 27, 29, 48, 49, 60]), st.integers(-2500, 2500)),
    st.tuples(st.sampled_from([0, 1, 10]), st.sampled_from([0, 1, 7, 10]), st.integers(0, 63)),
    st.tuples(st.sampled_from([0, 3, 6]), st.integers(0, 63), st.sampled_from([0, 3, 6]), st.integers(0, 63)),
)
def test_the_player_does_what_the_equations_say(
    seed: int, borders: list[list[int]], faps: dict[int, int], viseme: tuple, expression: tuple
) -> None:
    face = random_face(seed, borders)
    expected = play(face, faps, viseme, expression)
    size = np.abs(expected).max()
    pose = Player(face).pose(faps, viseme, expression)
    assert np.abs(pose.world() - expected).max() < 1e-12 * size
    stream = FapStream.build(
        25,
        3,
        {n: [0, v, v // 2] for n, v in faps.items()},
        [[0] * 4, [*viseme, 0], [0] * 4],
        [[0] * 6, [*expression, 0, 0], [0] * 6],
    )
    (batch,) = Player(face).world_frames(stream)
    assert np.abs(batch[1] - expected).max() < 1e-12 * size
    assert np.array_equal(batch[0], face.scene.world_neutral())
    for frame, pose in zip(batch, Player(face).frames(stream, batch=2), strict=True):
        assert np.abs(pose.world() - frame).max() < 1e-12 * size


def test_neutral_is_bit_identical() -> None:
    face = random_face(1, [[-500, 0, 800]])
    player = Player(face)
    zeros = dict.fromkeys((3, 5, 19, 23, 25, 27, 29, 48, 49), 0)
    for pose in (player.pose(), player.pose(zeros, (0, 0, 0), (3, 0, 6, 0))):
        assert pose.world().tobytes() == face.scene.world_neutral().tobytes()
        for shape in face.scene.shapes:
            assert pose.local[shape.name].tobytes() == shape.mesh.vertices.tobytes()


def test_single_precision_is_the_same_but_for_rounding() -> None:
    face = random_face(4, [[-500, 0, 800], [0, 100]])
    values = {n: [0, 300, -200, 900] for n in (3, 5, 19)}
    turns = {n: [0, 0, 20000, -9000] for n in (23, 48, 49)}
    stream = FapStream.build(25, 4, values | turns, [[0] * 4, [1, 10, 20, 0], [10, 0, 63, 0], [0] * 4])
    player = Player(face)
    (double,), (single,) = player.world_frames(stream), player.world_frames(stream, single=True)
    assert (double.dtype, single.dtype) == (np.float64, np.float32)
    assert np.array_equal(single[0], face.scene.world_neutral().astype(np.float32))
    assert np.abs(single - double).max() < 1e-6 * np.abs(double).max()
    assert (single[1:] != single[0]).any(axis=(1, 2)).all()
    parts = list(player.world_frames(stream, batch=3, single=True))
    assert [len(part) for part in parts] == [3, 1]
    assert np.abs(np.concatenate(parts) - single).max() < 1e-6 * np.abs(double).max()


def test_batches_take_as_much_memory_in_both_precisions() -> None:
    player = Player(face_of(FaceScene((strip("skin", 5, 0),))))
    stream = FapStream.build(25, 150, {})
    assert [len(part) for part in player.world_frames(stream)] == [64, 64, 22]
    assert [len(part) for part in player.world_frames(stream, single=True)] == [128, 22]


def test_high_level_values_are_those_of_the_frame() -> None:
    scene = FaceScene((strip("skin", 5, 0),))
    one = {k: np.eye(15)[k, :15].reshape(5, 1, 3) for k in range(1, 15)}
    tables = [FaceDefTable(1, k, (FaceDefMesh("skin", np.array([0, 63]), np.arange(5), one[k]),)) for k in range(1, 15)]
    tables += [FaceDefTable(2, k, (FaceDefMesh("skin", np.array([0, 63]), np.arange(5), one[k]),)) for k in range(1, 7)]
    rng = np.random.default_rng(0)
    visemes = np.stack(
        [rng.integers(0, 15, 50), rng.integers(0, 15, 50), rng.integers(0, 64, 50), rng.integers(0, 2, 50)]
    )
    expressions = np.stack([f(50) for f in (lambda n: rng.integers(0, 7, n), lambda n: rng.integers(0, 64, n)) * 2])
    expressions = np.concatenate([expressions, np.zeros((2, 50), int)])
    stream = FapStream.build(25, 50, {}, visemes.T, expressions.T)
    neutral = scene.world_neutral()
    for k, pose in enumerate(Player(face_of(scene, *tables)).frames(stream)):
        expected = np.zeros(15)
        for weights in (viseme_weights(*visemes[:3, k].tolist()), expression_weights(*expressions[:4, k].tolist())):
            for number, weight in weights.items():
                expected[number] += weight
        assert (pose.world() - neutral).ravel() == pytest.approx(expected, abs=1e-12)


def test_high_only_leaves_low_level_faps_out_of_frames_with_a_viseme_or_expression() -> None:
    face = random_face(2, [[-500, 0, 800]])
    stream = FapStream.build(25, 3, {3: [100, 100, 100]}, [[0, 0, 0, 0], [10, 0, 40, 0], [0, 0, 9, 0]])
    both = [p.world() for p in Player(face).frames(stream)]
    alone = [p.world() for p in Player(face, high_level="high_only").frames(stream)]
    assert np.array_equal(both[0], alone[0])
    assert np.array_equal(both[2], alone[2])
    assert alone[1] == pytest.approx(play(face, {}, (10, 0, 40)), abs=1e-12)
    assert both[1] == pytest.approx(play(face, {3: 100}, (10, 0, 40)), abs=1e-12)
    found = Player(face, high_level="high_only").pose({3: 100}, (10, 0, 40)).world()
    assert found == pytest.approx(alone[1], abs=1e-12)


def test_values_under_a_zero_mask_count_as_zero() -> None:
    face = random_face(3, [[0, 800]])
    stream = FapStream.build(25, 1, {3: [500]}, [[10, 0, 40, 0]])
    unmasked = dataclasses.replace(stream, mask=np.zeros_like(stream.mask))
    (pose,) = Player(face).frames(unmasked)
    assert np.array_equal(pose.world(), face.scene.world_neutral())


def test_shapes_of_one_common_vertex_list_keep_the_files_order() -> None:
    even, odd = np.arange(0, 20, 2), np.arange(1, 21, 2)
    shapes = (strip("a", 10, 0, vertex_ids=even), strip("b", 10, 1, vertex_ids=odd))
    scene = FaceScene((Transform("turn", shapes),))
    mesh = FaceDefMesh("b", np.array([0, 100]), np.array([3]), np.array([[[1.0, 2.0, 3.0]]]))
    turn = FaceDefTransform("turn", rotation_def=(0, 0, 1, 1))
    face = face_of(scene, FaceDefTable(3, 1, (mesh,)), FaceDefTable(50, 1, (), (turn,)))
    stream = FapStream.build(25, 3, {3: [0, 100, 100], 50: [0, 0, 20000]})
    (batch,) = Player(face).world_frames(stream)
    assert np.flatnonzero((batch[1] - batch[0]).any(axis=1)).tolist() == [7]
    assert batch[2] == pytest.approx(play(face, {3: 100, 50: 20000}), abs=1e-12)


def test_many_blocks_and_unused_columns() -> None:
    rng = np.random.default_rng(0)
    scene = FaceScene((Shape("skin", PolyMesh.from_faces(rng.normal(size=(1500, 3)), [[0, 1, 2]])),))
    tables = []
    for number in range(3, 20):
        index = np.arange(80 * (number - 3), 80 * (number - 3) + 200)
        slopes = rng.normal(size=(200, 2, 3))
        tables.append(FaceDefTable(number, 1, (FaceDefMesh("skin", np.array([-100, 0, 100]), index, slopes),)))
    face = face_of(scene, *tables)
    stream = FapStream.build(25, 5, {3: [0, 10, -20, 150, 0], 12: [5, 0, 0, -7, 0]})
    (batch,) = Player(face).world_frames(stream)
    for k, values in enumerate(({12: 5}, {3: 10}, {3: -20}, {3: 150, 12: -7}, {})):
        assert batch[k] == pytest.approx(play(face, values), abs=1e-12)


def test_a_transforms_rest_pose_is_the_neutral_face() -> None:
    scene = FaceScene((Transform("jaw", (strip("teeth", 4, 0),), rotation=(1, 0, 0, 0.3)),))
    turn = FaceDefTransform("jaw", rotation_def=(1, 0, 0, 1))
    player = Player(face_of(scene, FaceDefTable(3, 1, (), (turn,))))
    assert np.array_equal(player.pose({3: 0}).world(), scene.world_neutral())
    assert player.pose({3: 30000}).world() == pytest.approx(scene.world_neutral(), abs=1e-12), (
        "the field is overwritten"
    )


def test_bad_tables_are_refused() -> None:
    scene = FaceScene((strip("skin", 5, 0),))

    def mesh(shape: str = "skin", index: int = 0, slope: float = 1.0) -> FaceDefTable:
        return FaceDefTable(3, 1, (FaceDefMesh(shape, np.array([0, 1]), np.array([index]), np.full((1, 1, 3), slope)),))

    for table, words in (
        (mesh(shape="nose"), "no shape 'nose'"),
        (mesh(index=5), "'skin' has 5 vertices"),
        (mesh(index=-1), "'skin' has 5 vertices"),
        (mesh(slope=np.nan), "not finite"),
        (FaceDefTable(48, 1, (), (FaceDefTransform("neck"),)), "no Transform 'neck'"),
    ):
        with pytest.raises(FaceDefTablesError, match=words):
            Player(face_of(scene, table))


def test_bad_values_are_refused() -> None:
    player = Player(face_of(FaceScene((strip("skin", 5, 0),))))
    for values, words in (({1: 5}, "low-level FAP 1"), ({69: 5}, "FAP 69"), ({3: float("nan")}, "open_jaw")):
        with pytest.raises(FapStreamError, match=words):
            player.pose(values)
    assert np.array_equal(player.pose({3: 10}).world(), player.pose().world()), "a FAP without a table does nothing"
