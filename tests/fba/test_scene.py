"""The scene graph: transforms, file order, frames."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np
import pytest

from fba import FaceScene, FeaturePoint, FeaturePoints, Frame, PolyMesh, Shape, Transform
from fba.errors import LandmarkError, MeshError
from fba.scene import rotation_matrix

TRIANGLE = PolyMesh.from_faces([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])


def test_rotation_follows_the_right_hand_rule() -> None:
    turn = rotation_matrix((0.0, 0.0, 2.0, np.pi / 2))[:3, :3]
    np.testing.assert_allclose(turn @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-15)


def test_transform_applies_scale_then_rotation_about_the_center_then_translation() -> None:
    node = Transform("t", (), (10.0, 0, 0), (0, 0, 1, np.pi / 2), (2.0, 1.0, 1.0), center=(1.0, 0, 0))
    point = node.matrix() @ [2.0, 0.0, 0.0, 1.0]
    # From the centre (1, 0, 0): offset 1 doubled to 2, turned to +Y, then moved by 10.
    np.testing.assert_allclose(point[:3], [11.0, 2.0, 0.0], atol=1e-14)


def test_world_vertices_follow_the_chain() -> None:
    inner = Transform("inner", (Shape("s", TRIANGLE),), translation=(0.0, 1.0, 0.0))
    scene = FaceScene((Transform("outer", (inner,), rotation=(0, 0, 1, np.pi / 2)),))
    np.testing.assert_allclose(scene.world_vertices("s")[0], [-1.0, 0.0, 0.0], atol=1e-15)
    assert [t.name for t in scene.parents("s")] == ["outer", "inner"]


def test_untouched_vertices_are_the_meshs_own() -> None:
    scene = FaceScene((Transform("t", (Shape("s", TRIANGLE),)),))
    assert scene.world_vertices("s") is TRIANGLE.vertices


def test_file_order_is_put_together_from_interleaved_shapes() -> None:
    one = Shape("one", TRIANGLE, vertex_ids=np.array([0, 2, 4]))
    two = Shape("two", TRIANGLE, vertex_ids=np.array([5, 3, 1]))
    scene = FaceScene((one, two))
    values = np.arange(18.0).reshape(6, 3)
    apart = scene.scatter(values)
    np.testing.assert_array_equal(apart["two"], values[[5, 3, 1]])
    np.testing.assert_array_equal(scene.gather(apart), values)
    clash = FaceScene((one, Shape("two", TRIANGLE, vertex_ids=np.array([0, 1, 3]))))
    with pytest.raises(MeshError):
        clash.file_order()


def test_every_frame_turns_there_and_back_exactly() -> None:
    points = np.random.default_rng(1).normal(size=(20, 3)) * 1e5
    for order in permutations(range(3)):
        for signs in product((-1.0, 1.0), repeat=3):
            axes = np.zeros((3, 3))
            axes[range(3), order] = signs
            frame = Frame(axes)
            inside = frame.from_file(points)
            np.testing.assert_allclose(inside, points @ axes.T)
            np.testing.assert_array_equal(frame.to_file(inside), points)
    with pytest.raises(MeshError):
        Frame(rotation_matrix((0, 0, 1, 0.3))[:3, :3])


def test_feature_points_follow_the_surface() -> None:
    scene = FaceScene((Shape("skin", TRIANGLE),))
    points = FeaturePoints({"9.3": FeaturePoint("skin", (1, 2), (0.5, 0.5)), "7.1": FeaturePoint.free(np.ones(3))})
    assert list(points) == ["7.1", "9.3"]
    np.testing.assert_array_equal(points.positions(scene)["9.3"], [0.5, 0.5, 0.0])
    moved = points.positions(scene, {"skin": TRIANGLE.vertices + 1.0})
    np.testing.assert_array_equal(moved["9.3"], [1.5, 1.5, 1.0])
    with pytest.raises(LandmarkError, match=r"12\.1"):
        FeaturePoints({"12.1": FeaturePoint.free(np.ones(3))})
    with pytest.raises(LandmarkError, match=r"8\.3 \(left end"):
        points.require("8.3", purpose="cloning")
