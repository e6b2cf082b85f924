"""The shipped source face: what it promises in PROVENANCE.md, measured on the file."""

from __future__ import annotations

import time
from functools import cache

import numpy as np
import pytest

from fat.build import face_motions
from fat.evaluate import Player
from fat.face import AnimatableFace
from fat.motion import FaceMotion
from fat.quality import mirror_map
from fat.validate import validate
from fba.arrays import Floats, Ints
from fba.faps import fap
from fba.fapu import Fapu
from fba.neutral import check_neutral
from fba.scene import Role
from fba.sphere import fit_sphere
from formats import read_face
from samples import default_source

ABSENT = {18, 29, 30, 39, 40, *range(43, 48), *range(61, 69)}
JAW_CARRIES = {"2.1", "2.10", "2.3", "2.8", "2.9", "8.2", "8.7", "8.8", "2.4", "2.5", "8.3", "8.4", "5.1", "5.2"}
TIED = {6: 53, 7: 54, 12: 59, 13: 60, 53: 6, 54: 7, 59: 12, 60: 13}
PUSHES_INTO_OTHER_LIP = {4, 5, 8, 9, 10, 11}


@cache
def source() -> AnimatableFace:
    return read_face(default_source())


@cache
def motions() -> dict[tuple[int, int, int], FaceMotion]:
    return {(int(m.fap_id or 0), m.select, m.value): m for m in face_motions(source())}


def moved(motion: FaceMotion, key: str) -> Floats:
    """How a feature point moves, (3,)."""
    point = source().feature_points[key]
    if point.shape is None or point.shape not in motion.offsets:
        return np.zeros(3)
    return np.asarray(point.weights) @ motion.offsets[point.shape][list(point.vertices)]


def low_level() -> list[tuple[int, int, int]]:
    return [k for k in motions() if k[0] >= 3 and fap(k[0]).direction is not None]


def test_loads_fast_and_small() -> None:
    start = time.perf_counter()
    read_face(default_source())
    assert time.perf_counter() - start < 2.0
    assert default_source().stat().st_size < 6 << 20


def test_is_valid_and_neutral() -> None:
    face = source()
    assert [f for f in validate(face) if f.severity != "info"] == []
    found = check_neutral(face.scene, face.feature_points, face.fapu)
    assert [f for f in found if f.severity != "info"] == []


def test_has_every_promised_table() -> None:
    keys = {t.key for t in source().tables}
    assert {k for k, _ in keys if k > 2} == set(range(3, 69)) - ABSENT
    assert {s for k, s in keys if k == 1} == set(range(1, 15))
    assert {s for k, s in keys if k == 2} == set(range(1, 7))


def test_has_all_parts_and_points() -> None:
    face = source()
    roles = {s.role for s in face.scene.shapes}
    assert roles == set(Role)
    assert len(face.feature_points) == 84
    assert "11.5" not in face.feature_points
    assert "7.2" in face.feature_points
    assert face.notes["open_jaw"] == "practical"


def test_fapus_are_those_of_its_points() -> None:
    face = source()
    measured = Fapu.from_feature_points(face.feature_points.positions(face.scene))
    for name in ("irisd0", "es0", "ens0", "mns0", "mw0"):
        assert getattr(measured, name) == pytest.approx(getattr(face.fapu, name), rel=1e-6)


@pytest.mark.parametrize("key", low_level())
def test_own_point_moves_its_amount(key: tuple[int, int, int]) -> None:
    entry = fap(key[0])
    amount = key[2] * source().fapu.unit(entry.unit)
    for point in entry.feature_points:
        if source().feature_points[point].shape == "skin":
            along = float(moved(motions()[key], point) @ np.asarray(entry.direction))
            assert along == pytest.approx(amount, rel=5e-3)


@pytest.mark.parametrize("key", [k for k in low_level() if k[0] not in (3, 14, 15)])
def test_other_points_stay(key: tuple[int, int, int]) -> None:
    """Cross-talk below 5 %; but tied corners take each other and the cheek along, a cheek the lid above it."""
    own = abs(key[2]) * source().fapu.unit(fap(key[0]).unit)
    for number in range(3, 69):
        other = fap(number)
        if other.direction is None or number in (key[0], TIED.get(key[0])) or other.feature_points[0][:2] == "6.":
            continue
        if key[0] in (19, 20, 41, 42) and number in (21, 22):
            continue
        if key[0] in TIED and number in (39, 40):
            continue
        along = float(moved(motions()[key], other.feature_points[0]) @ np.asarray(other.direction))
        assert abs(along) <= 0.05 * own, other.name


def test_open_jaw_carries_teeth_and_tongue_but_no_upper_lip() -> None:
    jaw = motions()[3, 1, 1024]
    drop = -moved(jaw, "2.1")[1]
    assert -jaw.offsets["lower_teeth"][:, 1].mean() > 0.4 * drop
    assert -jaw.offsets["tongue"][:, 1].mean() > 0.2 * drop
    assert "upper_teeth" not in jaw.offsets
    for key in ("2.2", "2.6", "2.7", "8.1", "8.5", "8.6"):
        assert abs(moved(jaw, key)[1]) < 0.01 * drop


@pytest.mark.parametrize("select", range(3, 15))
def test_visemes_that_open_the_jaw_carry_the_lower_teeth(select: int) -> None:
    pose = motions()[1, select, 63]
    assert moved(pose, "9.11")[1] < 0.0


@pytest.mark.parametrize("value", [1024, 512])
def test_lids_meet(value: int) -> None:
    """FAP 19 + 21 = 1024 brings the rims of the lids together at the pupil, on both sides."""
    face = source()
    pose = Player(face).pose({19: value, 21: 1024 - value, 20: value, 22: 1024 - value})
    at = face.feature_points.positions(face.scene, pose.world_shapes())
    for upper, lower in (("3.1", "3.3"), ("3.2", "3.4")):
        assert abs(at[upper][1] - at[lower][1]) < 0.02 * face.fapu.irisd0


def test_skin_stays_off_the_eyeballs() -> None:
    face = source()
    skin = face.scene.world_vertices("skin")
    for eye in ("eye_left", "eye_right"):
        center, radius, _ = fit_sphere(face.scene.world_vertices(eye))
        away = np.linalg.norm(skin - center, axis=1) / radius
        covers = (away >= 0.99) & (skin[:, 2] > center[2])
        for motion in motions().values():
            if "skin" in motion.offsets:
                now = np.linalg.norm(skin + motion.offsets["skin"] - center, axis=1) / radius
                assert now[covers].min() > 0.98, motion.name


@pytest.mark.parametrize("key", [k for k in motions() if k[0] not in PUSHES_INTO_OTHER_LIP])
def test_lips_do_not_cross(key: tuple[int, int, int]) -> None:
    face = source()
    p = face.feature_points.positions(face.scene)
    limit = 0.08 * face.fapu.mns0
    for upper, lower in (("2.2", "2.3"), ("2.6", "2.8"), ("2.7", "2.9")):
        gap = (p[upper] + moved(motions()[key], upper))[1] - (p[lower] + moved(motions()[key], lower))[1]
        assert gap > -limit


def test_bilabial_closes_the_lips() -> None:
    face = source()
    p = face.feature_points.positions(face.scene)
    for upper, lower in (("2.2", "2.3"), ("2.6", "2.8"), ("2.7", "2.9")):
        gap = (p[upper] + moved(motions()[1, 1, 63], upper))[1] - (p[lower] + moved(motions()[1, 1, 63], lower))[1]
        assert gap < 0.05 * face.fapu.mns0


def test_sides_mirror() -> None:
    """The head is symmetric to the last vertex and triangle; a left FAP is its right partner's mirror image."""
    face = source()
    mesh = face.scene.shape("skin").mesh
    mirror = mirror_map(mesh.vertices, 1e-5 * face.fapu.es0)
    assert np.array_equal(_sorted(mirror[mesh.triangles]), _sorted(mesh.triangles))
    for (number, select, value), motion in motions().items():
        partner = fap(number).mirror
        if number < 3 or partner is None or "skin" not in motion.offsets:
            continue
        other = motions()[partner, select, value].offsets["skin"][mirror] * [-1.0, 1.0, 1.0]
        assert np.abs(motion.offsets["skin"] - other).max() < 1e-5 * face.fapu.es0, motion.name


def _sorted(triangles: Ints) -> Ints:
    rows = np.sort(triangles, axis=1)
    return rows[np.lexsort(rows.T)]


def test_few_triangles_turn_over() -> None:
    mesh = source().scene.shape("skin").mesh
    before = _areas(mesh.vertices, mesh.triangles)
    shares = []
    for motion in motions().values():
        if "skin" not in motion.offsets:
            continue
        after = _areas(mesh.vertices + motion.offsets["skin"], mesh.triangles)
        moving = np.linalg.norm(motion.offsets["skin"], axis=1)[mesh.triangles].max(axis=1) > 0.0
        shares.append(float(((before * after).sum(axis=1) < 0)[moving].mean()))
    assert max(shares) < 0.05
    assert float(np.mean(shares)) < 0.004


def _areas(vertices: Floats, triangles: Floats) -> Floats:
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def test_head_turns_yaw_outermost_about_the_top_of_the_spine() -> None:
    face = source()
    names = [t.name for t in face.scene.parents("skin")]
    assert names == ["head_yaw", "head_pitch", "head_roll"]
    pivot = face.feature_points.positions(face.scene)["7.1"]
    assert np.allclose(face.scene.parents("skin")[0].center, pivot, atol=1e-5)


def test_neck_ring_is_clean() -> None:
    """One border, on which every vertex has two border neighbours and the ring rises smoothly."""
    mesh = source().scene.shape("skin").mesh
    following = np.arange(mesh.indices.size) + 1
    following[mesh.offsets[1:] - 1] = mesh.offsets[:-1]
    pairs = np.sort(np.stack([mesh.indices, mesh.indices[following]], axis=1), axis=1)
    edges, uses = np.unique(pairs, axis=0, return_counts=True)
    border = edges[uses == 1]
    assert set(np.bincount(border.reshape(-1))) == {0, 2}
    assert len(border) == 42
    assert int(uses.max()) == 2
    for motion in motions().values():
        if "skin" in motion.offsets:
            assert not motion.offsets["skin"][np.unique(border)].any()
