"""Rows of measures on faces whose answers are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fat import AnimatableFace, FaceDefTables, FaceMotion
from fat.build import build_tables
from fat.fap_quality import SLACK, FapQuality
from fba import FaceScene, Fapu, FeaturePoint, FeaturePoints, PolyMesh, Role, Shape, fap
from fba.arrays import Floats
from formats import read_face
from studio.fap_measuring import measure_faps

FAPU = Fapu(irisd0=0.2, es0=1.0, ens0=0.8, mns0=0.3, mw0=0.9)
UP = {value: value * FAPU.ens0 / 1024 for value in (-120, 200, 400)}


def grid(count: int, center: tuple[float, float, float] = (0, 0, 0), step: float = 1.0) -> PolyMesh:
    """A flat square of quads that faces +Z; vertex (i, j) has the number i * count + j."""
    axis = (np.arange(count) - (count - 1) / 2) * step
    x, y = np.meshgrid(axis, axis, indexing="ij")
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(count * count)], axis=1) + center
    quads = [
        [i * count + j, (i + 1) * count + j, (i + 1) * count + j + 1, i * count + j + 1]
        for i in range(count - 1)
        for j in range(count - 1)
    ]
    return PolyMesh.from_faces(vertices, quads)


def played(
    shapes: tuple[Shape, ...],
    motions: list[tuple[int, int, dict[str, Floats]]],
    points: dict[str, FeaturePoint] | None = None,
) -> list[FapQuality]:
    """Rows of a face with these motions: FAP, value, offsets."""
    scene = FaceScene(shapes)
    made = [FaceMotion(fap(number).name, number, 1, value, offsets) for number, value, offsets in motions]
    tables = build_tables(scene, FAPU, made)
    return measure_faps(AnimatableFace(scene, FeaturePoints(points or {}), tables, FAPU))


def test_a_vertex_pulled_over_its_neighbours_flips_two_of_six_triangles() -> None:
    mesh = grid(5)
    offsets = np.zeros((25, 3))
    offsets[12] = [1.5, 0, 0]
    far, less = played((Shape("skin", mesh, Role.SKIN),), [(31, 400, {"skin": offsets})])
    assert (far.value, far.limit) == (200, 400)
    assert far.flips == 0.0
    assert far.flips_at_limit == pytest.approx(100 * 2 / 6)
    assert (less.value, less.limit) == (-120, -120)
    assert [f.code for f in far.failures()] == ["fap-flips-at-limit"]


def test_own_motion_and_cross_talk_are_read_at_the_feature_points() -> None:
    mesh = grid(5)
    offsets = np.zeros((25, 3))
    offsets[12] = [0, UP[200], 0]
    offsets[14] = [0, 0.25 * UP[200], 0]
    points = {"4.1": FeaturePoint("skin", (12,), (1.0,)), "4.5": FeaturePoint("skin", (14,), (1.0,))}
    motions = [(31, 200, {"skin": offsets}), (33, 200, {"skin": offsets}), (35, 200, {"skin": offsets})]
    rows = {(r.fap_id, r.value): r for r in played((Shape("skin", mesh, Role.SKIN),), motions, points)}
    own = rows[31, 200]
    assert own.own is not None
    assert own.own.relative_error < 1e-6
    assert own.cross_talk == pytest.approx(0.25)
    assert own.cross_fap == 35
    assert rows[33, 200].own is None
    wrong = rows[35, 200]
    assert wrong.own is not None
    assert wrong.own.relative_error == pytest.approx(0.75)
    assert not wrong.passed


def sphere(
    center: tuple[float, float, float], radius: float, front: bool = False, size: tuple[int, int] = (9, 24)
) -> PolyMesh:
    """A sphere of quads, or its front half alone."""
    rows, columns = size
    down = np.linspace(0.01, 1.5 if front else np.pi - 0.01, rows)
    round_ = np.arange(columns) * 2 * np.pi / columns
    a, b = np.meshgrid(down, round_, indexing="ij")
    way = np.stack([np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)], axis=-1).reshape(-1, 3)
    quads = [
        [i * columns + j, (i + 1) * columns + j, (i + 1) * columns + (j + 1) % columns, i * columns + (j + 1) % columns]
        for i in range(rows - 1)
        for j in range(columns)
    ]
    return PolyMesh.from_faces(radius * way + center, quads)


@pytest.mark.parametrize(("around", "tears"), [(True, True), (False, False)])
def test_only_hidden_skin_tears(around: bool, tears: bool) -> None:
    offsets = np.zeros((9, 3))
    offsets[4] = [0, 0, 1.2]
    inner = Shape("inner", grid(3, step=0.2), Role.SKIN)
    shapes = (inner, Shape("outer", sphere((0, 0, 0), 1.0, size=(30, 72)), Role.SKIN)) if around else (inner,)
    row = played(shapes, [(31, 200, {"inner": offsets})])[0]
    longest = (np.hypot(0.2, 1.2) + SLACK) / (0.2 + SLACK)
    assert row.stretch == pytest.approx(longest if tears else 1.0)
    assert ("fap-tear" in [f.code for f in row.failures()]) is tears


def test_a_seam_that_opens_is_counted() -> None:
    left, right = grid(3, (-1.0, 0, 0)), grid(3, (1.0, 0, 0))
    vertices = np.concatenate([left.vertices, right.vertices])
    faces = [*left.triangles.tolist(), *(right.triangles + 9).tolist()]
    skin = Shape("skin", PolyMesh.from_faces(vertices, faces), Role.SKIN)
    offsets = np.zeros((18, 3))
    offsets[[6, 7, 9]] = [0, 0, 0.1]
    row = played((skin,), [(31, 200, {"skin": offsets})])[0]
    assert row.parted == 1  # 6 lies on 9 and goes along, 7 lies on 10, which stays


def eyes() -> tuple[tuple[Shape, ...], dict[str, FeaturePoint]]:
    shapes: list[Shape] = []
    points = {}
    lids = [sphere((x, 0, 0), 0.46, front=True) for x in (0.8, -0.8)]
    faces = [*lids[0].triangles.tolist(), *(lids[1].triangles + lids[0].vertex_count).tolist()]
    shapes.append(Shape("skin", PolyMesh.from_faces(np.concatenate([m.vertices for m in lids]), faces), Role.SKIN))
    for name, role, key, x in (("l", Role.EYE_LEFT, "3.5", 0.8), ("r", Role.EYE_RIGHT, "3.6", -0.8)):
        shapes.append(Shape(name, sphere((x, 0, 0), 0.4), role))
        points[key] = FeaturePoint(name, (0,), (1.0,))
    return tuple(shapes), points


def test_an_eyeball_pushed_forward_comes_through_the_lids() -> None:
    shapes, points = eyes()
    skin, ball = shapes[0].mesh.vertices, shapes[1].mesh.vertices
    thrust = 30 * FAPU.es0 / 1024
    push = 0.1
    offsets = np.tile([0, 0, push], (len(ball), 1))
    row = played(shapes, [(27, 30, {"l": offsets})], points)[0]
    clearance = np.linalg.norm(skin - [0.8, 0, push], axis=1) / 0.4 - 1
    front = (skin[:, 2] > 0) & (np.linalg.norm(skin - [0.8, 0, 0], axis=1) < 1.7 * 0.4)
    both = 2 * np.count_nonzero(front)
    assert np.count_nonzero(clearance[front] < -0.02) > 10
    assert row.penetration == pytest.approx(100 * np.count_nonzero(clearance[front] < -0.02) / both)
    assert push > thrust  # the own point goes too far as well
    assert row.own is not None
    assert not row.own.passed


def test_lids_that_stay_on_the_ball_are_clear_of_it() -> None:
    shapes, points = eyes()
    skin = shapes[0].mesh.vertices
    sideways = np.zeros_like(skin)
    left = skin[:, 0] > 0
    local = skin[left] - [0.8, 0, 0]
    turn = np.array([[1, 0, 0], [0, np.cos(0.2), np.sin(0.2)], [0, -np.sin(0.2), np.cos(0.2)]])
    sideways[left] = local @ turn - local
    row = played(shapes, [(19, 1024, {"skin": sideways})], points)[0]
    assert row.penetration == 0.0
    inwards = np.where(left[:, None], -0.3 * (skin - [0.8, 0, 0]), 0.0)
    assert played(shapes, [(19, 1024, {"skin": inwards})], points)[0].penetration == 50.0


def test_the_back_of_a_lid_may_sink_in_where_its_front_does_not() -> None:
    shapes, points = eyes()
    skin = shapes[0].mesh
    inner = PolyMesh.from_faces(
        np.concatenate([skin.vertices, sphere((0.8, 0, 0), 0.44, front=True).vertices]),
        [*skin.triangles.tolist(), *(sphere((0.8, 0, 0), 0.44, front=True).triangles + len(skin.vertices)).tolist()],
    )
    back = np.arange(inner.vertex_count) >= len(skin.vertices)
    inwards = -0.3 * (inner.vertices - [0.8, 0, 0]) * [1.0, 1.0, 1.0]
    lids = (Shape("skin", inner, Role.SKIN), *shapes[1:])
    only_back = np.where(back[:, None], inwards, 0.0)
    assert played(lids, [(19, 1024, {"skin": only_back})], points)[0].penetration == pytest.approx(0.0, abs=3.0)
    left = inner.vertices[:, 0] > 0
    both = np.where(left[:, None], inwards, 0.0)
    assert played(lids, [(19, 1024, {"skin": both})], points)[0].penetration > 30.0  # type: ignore[operator]


def test_a_turning_eye_takes_its_surface_along() -> None:
    shapes, points = eyes()
    ball = shapes[1].mesh.vertices - [0.8, 0, 0]
    angle = 0.3
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    row = played(shapes, [(23, 30000, {"l": ball @ turn.T - ball})], points)[0]
    assert row.own is not None
    assert row.own.passed
    assert row.penetration == 0.0


def test_the_two_sides_are_compared_on_a_symmetric_face() -> None:
    mesh = grid(5)
    left, right = np.zeros((25, 3)), np.zeros((25, 3))
    left[17], right[7] = [0, 0.11, 0.0], [0, 0.1, 0.0]
    motions = [(31, 200, {"skin": left}), (32, 200, {"skin": right}), (64, 80, {"skin": left})]
    rows = {(r.fap_id, r.value): r for r in played((Shape("skin", mesh, Role.SKIN),), motions)}
    assert rows[31, 200].asymmetry == pytest.approx(0.01 / 0.11)
    assert rows[32, 200].asymmetry == pytest.approx(0.01 / 0.1)
    # FAP 64 bends the nose: its own mirror image is the other direction; one vertex up on one side has none.
    assert rows[64, 80].asymmetry == pytest.approx(np.sqrt(2))
    crooked = PolyMesh.from_faces(mesh.vertices + np.outer(np.arange(25), [0.01, 0, 0]), mesh.triangles)
    assert played((Shape("skin", crooked, Role.SKIN),), motions)[0].asymmetry is None


def test_the_source_has_rows_for_every_table_and_direction() -> None:
    face = read_face("default")
    rows = measure_faps(face)
    keys = [r.key for r in rows]
    assert len(set(keys)) == len(keys)
    assert {(f, s) for f, s, _ in keys} == {t.key for t in face.tables}
    for row in rows:
        assert (row.own is None) == row.high_level
        assert row.asymmetry is not None
        assert row.parted == 0
    moved = FaceDefTables(tuple(t for t in face.tables if t.fap_id in (6, 48)))
    bare = measure_faps(replace(face, tables=moved, feature_points=FeaturePoints({})))
    assert [r.own for r in bare if r.fap_id == 6] == [None, None]
    assert [r.penetration for r in bare] == [None] * 4
    assert [r.asymmetry for r in bare if r.fap_id == 6] == [None, None]
    assert [r.asymmetry for r in bare if r.fap_id == 48] == pytest.approx([0.0, 0.0], abs=1e-4)
