"""Rotations of eyes and head by inserted transforms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fat import AnimatableFace, FaceDefTable, FaceDefTables
from fat.rig import rig_eye, rig_head, unrig
from fba import FaceScene, Fapu, FeaturePoints, PolyMesh, Shape, Transform
from fba.scene import rotation_matrix

TRIANGLE = PolyMesh.from_faces([[0, 0, 1.0], [1, 0, 1], [0, 1, 1]], [[0, 1, 2]])


def _scene() -> FaceScene:
    holder = Transform("holder", (Shape("eye", TRIANGLE),), translation=(1.0, 2.0, 3.0), rotation=(0, 1, 0, 0.5))
    return FaceScene((Shape("skin", TRIANGLE), holder))


def _turn(scene: FaceScene, name: str, angle: float, axis: tuple[float, float, float]) -> FaceScene:
    def visit(node: object) -> object:
        if isinstance(node, Transform):
            children = tuple(visit(c) for c in node.children)
            if node.name == name:
                return replace(node, children=children, rotation=(*axis, angle))
            return replace(node, children=children)
        return node

    return replace(scene, roots=tuple(visit(r) for r in scene.roots))


def test_inserted_nodes_change_nothing_at_rest() -> None:
    scene = _scene()
    rigged, _ = rig_eye(scene, "left", ["eye"], np.array([1.0, 2.0, 4.0]))
    rigged, _ = rig_head(rigged, np.array([0.0, -1.0, 0.0]))
    for name in ("skin", "eye"):
        np.testing.assert_allclose(rigged.world_vertices(name), scene.world_vertices(name), atol=1e-15)
    assert [s.name for s in rigged.shapes] == ["skin", "eye"]
    assert [t.name for t in rigged.transforms][:3] == ["head_yaw", "head_pitch", "head_roll"]


def test_eye_turns_about_the_world_axis_through_its_centre_although_its_parent_is_turned() -> None:
    scene = _scene()
    center = np.array([1.2, 2.1, 3.5])
    rigged, tables = rig_eye(scene, "left", ["eye"], center)
    (table,) = tables[23, 1]
    *axis, theta = table.rotation_def
    posed = _turn(rigged, table.transform, theta * 0.3, tuple(axis))
    turn = rotation_matrix((0.0, 1.0, 0.0, 0.3))[:3, :3]
    expected = (scene.world_vertices("eye") - center) @ turn.T + center
    np.testing.assert_allclose(posed.world_vertices("eye"), expected, atol=1e-12)


def test_head_rotations_nest_as_yaw_pitch_roll_about_the_pivot() -> None:
    scene = _scene()
    pivot = np.array([0.0, -1.0, 0.5])
    posed, tables = rig_head(scene, pivot)
    angles = {49: 0.4, 48: -0.2, 50: 0.1}
    for number, angle in angles.items():
        (table,) = tables[number, 1]
        *axis, theta = table.rotation_def
        posed = _turn(posed, table.transform, theta * angle, tuple(axis))
    turn = (rotation_matrix((0, 1, 0, 0.4)) @ rotation_matrix((1, 0, 0, -0.2)) @ rotation_matrix((0, 0, 1, 0.1)))[
        :3, :3
    ]
    expected = (scene.world_vertices("skin") - pivot) @ turn.T + pivot
    np.testing.assert_allclose(posed.world_vertices("skin"), expected, atol=1e-12)


def test_names_that_are_taken_are_not_used_twice() -> None:
    scene = FaceScene((Transform("head_yaw", (Shape("skin", TRIANGLE),)),))
    rigged, tables = rig_head(scene, np.zeros(3))
    assert tables[49, 1][0].transform == "head_yaw_2"
    assert len({t.name for t in rigged.transforms}) == 4


def test_unrigging_takes_out_what_rigging_put_in_and_nothing_else() -> None:
    scene = FaceScene((Transform("mine", _scene().roots),))
    rigged, eyes = rig_eye(scene, "left", ["eye"], np.array([1.0, 2.0, 4.0]))
    rigged, head = rig_head(rigged, np.array([0.0, -1.0, 0.0]))
    idle = FaceDefTable(25, 1, (), (replace(eyes[25, 1][0], transform="mine"),))
    driven = [FaceDefTable(*key, (), entries) for key, entries in {**eyes, **head}.items() if key != (25, 1)]
    turning = replace(idle, transforms=(*idle.transforms, *eyes[25, 1]))
    face = AnimatableFace(rigged, FeaturePoints({}), FaceDefTables((*driven, turning)), Fapu(1, 1, 1, 1, 1))
    assert [t.name for t in unrig(face).transforms] == ["mine", "holder"]
    assert unrig(replace(face, tables=FaceDefTables())).transforms == rigged.transforms
