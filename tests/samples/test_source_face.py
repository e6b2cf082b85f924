"""The shipped source face: what it promises in PROVENANCE.md, measured on the file."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from fat.build import face_motions
from fat.evaluate import Player
from fat.face import AnimatableFace
from fat.fap_quality import FapQuality
from fat.motion import FaceMotion
from fat.quality import mirror_map
from fat.validate import validate
from fba.amplitudes import amplitudes
from fba.arrays import Floats, Ints
from fba.faps import fap
from fba.fapu import Fapu
from fba.neutral import check_neutral
from fba.scene import Role
from fba.sphere import fit_sphere
from formats import read_face
from samples import default_source
from studio.fap_measuring import measure_faps

LIPS = (("2.2", "2.3"), ("2.6", "2.8"), ("2.7", "2.9"))
PUSHES_INTO_OTHER_LIP = {4, 5, 8, 9, 10, 11, 12, 13, 18, 59, 60}
UNEVEN = 0.005
"""Eye separations, a third of a millimetre, by which two sides may differ: a few hidden vertices on the midline do."""


@cache
def source() -> AnimatableFace:
    return read_face(default_source())


@cache
def motions() -> dict[tuple[int, int, int], FaceMotion]:
    return {(int(m.fap_id or 0), m.select, m.value): m for m in face_motions(source())}


@cache
def measured() -> list[FapQuality]:
    return measure_faps(source())


@cache
def player() -> Player:
    return Player(source())


def offsets(faps: dict[int, float], viseme: int = 0) -> dict[str, Floats]:
    """What moves at FAP values, or in a full viseme: shape -> (n, 3)."""
    rest = player().pose().world_shapes()
    moved = player().pose(faps, (viseme, 0, 63) if viseme else None).world_shapes()
    return {name: moved[name] - rest[name] for name in rest}


def at(key: str, moved: dict[str, Floats]) -> Floats:
    """Where a feature point is in these offsets, (3,)."""
    point = source().feature_points[key]
    assert point.shape is not None
    rest = source().scene.world_vertices(point.shape)
    return np.asarray(point.weights) @ (rest + moved[point.shape])[list(point.vertices)]


def gaps(moved: dict[str, Floats]) -> list[float]:
    """Opening of the lips at three places, in MNS."""
    return [float(at(a, moved)[1] - at(b, moved)[1]) / source().fapu.mns0 for a, b in LIPS]


def test_is_small() -> None:
    assert default_source().stat().st_size < 6 << 20


def test_is_valid_and_neutral() -> None:
    face = source()
    assert [f for f in validate(face) if f.severity != "info"] == []
    found = check_neutral(face.scene, face.feature_points, face.fapu)
    assert [f for f in found if f.severity != "info"] == []


def test_has_every_table() -> None:
    keys = {t.key for t in source().tables}
    assert {k for k, _ in keys if k > 2} == set(range(3, 69))
    assert {s for k, s in keys if k == 1} == set(range(1, 15))
    assert {s for k, s in keys if k == 2} == set(range(1, 7))


def test_bidirectional_faps_go_both_ways() -> None:
    borders: dict[int, set[int]] = {}
    for table in source().tables:
        for mesh in table.meshes:
            borders.setdefault(table.fap_id, set()).update(mesh.interval_borders.tolist())
    for number, found in borders.items():
        if number > 2 and fap(number).bidirectional and len(found) > 2:
            assert min(found) < 0 < max(found), fap(number).name


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


def test_every_fap_keeps_its_limits() -> None:
    """Own motion, cross-talk, flips, torn linings, seams, eyeballs; see `fat.fap_quality`."""
    assert [f.message for row in measured() for f in row.failures()] == []
    assert [row.where for row in measured() if not row.passed] == []


@pytest.mark.parametrize("number", [n for n in range(3, 69) if fap(n).direction is not None])
def test_own_point_moves_its_amount(number: int) -> None:
    entry = fap(number)
    for value in amplitudes()[number].values:
        moved = offsets({number: value})
        for point in entry.feature_points:
            way = at(point, moved) - source().feature_points.positions(source().scene)[point]
            amount = value * source().fapu.unit(entry.unit)
            assert float(way @ np.asarray(entry.direction)) == pytest.approx(amount, rel=5e-3)


def test_open_jaw_carries_teeth_and_tongue_but_no_upper_lip() -> None:
    """The middle of the upper lip stays; beside it the corners, which go along, draw it down a little."""
    moved = offsets({3: 1024})
    rest = source().feature_points.positions(source().scene)
    drop = rest["2.1"][1] - at("2.1", moved)[1]
    assert -moved["lower_teeth"][:, 1].mean() > 0.4 * drop
    assert -moved["tongue"][:, 1].mean() > 0.2 * drop
    assert not moved["upper_teeth"].any()
    sunk = {key: (rest[key][1] - at(key, moved)[1]) / drop for key in ("2.2", "2.6", "2.7", "8.1", "8.5", "8.6")}
    assert sunk["2.2"] == pytest.approx(0.0, abs=0.01)
    assert max(sunk.values()) < 0.3


def test_open_jaw_turns_the_lower_teeth_as_one_piece() -> None:
    teeth = source().scene.world_vertices("lower_teeth")
    pairs = [(a, b) for a in range(0, len(teeth), 7) for b in range(a)]
    for value in (200, 640, 1024):
        moved = teeth + offsets({3: value})["lower_teeth"]
        for a, b in pairs:
            before, after = np.linalg.norm(teeth[a] - teeth[b]), np.linalg.norm(moved[a] - moved[b])
            assert after == pytest.approx(before, abs=0.01 * source().fapu.es0)


@pytest.mark.parametrize("select", [4, 5, 8, 9, 10, 11, 12, 13, 14])
def test_visemes_that_open_the_jaw_carry_the_lower_teeth(select: int) -> None:
    assert motions()[1, select, 63].offsets["lower_teeth"][:, 1].max() < 0.0


@pytest.mark.parametrize("value", [1024, 512])
def test_lids_meet(value: int) -> None:
    """FAP 19 + 21 = 1024 brings the rims of the lids together at the pupil, on both sides."""
    moved = offsets({19: value, 21: 1024 - value, 20: value, 22: 1024 - value})
    for upper, lower in (("3.1", "3.3"), ("3.2", "3.4")):
        assert abs(at(upper, moved)[1] - at(lower, moved)[1]) < 0.02 * source().fapu.irisd0


def test_eyeballs_are_round_and_have_rings_for_iris_and_pupil() -> None:
    for name, key in (("eye_left", 29), ("eye_right", 30)):
        vertices = source().scene.world_vertices(name)
        _, radius, error = fit_sphere(vertices)
        assert error < 1e-4 * radius
        wide = offsets({key: 500})[name]
        assert np.linalg.norm(wide, axis=1).max() > 0.05 * radius
        still = ~wide.any(axis=1)
        assert still.sum() > 0.7 * len(vertices)


@pytest.mark.parametrize("number", [n for n in range(3, 69) if n not in PUSHES_INTO_OTHER_LIP])
def test_lips_do_not_cross(number: int) -> None:
    for value in amplitudes()[number].values:
        assert min(gaps(offsets({number: value}))) > -0.08, value


def test_bilabial_closes_the_lips() -> None:
    assert max(gaps(offsets({}, viseme=1))) < 0.05


def test_labiodental_brings_the_lower_lip_to_the_upper_teeth() -> None:
    moved = offsets({}, viseme=2)
    lip, teeth = at("2.3", moved), at("9.10", moved)
    assert abs(lip[1] - teeth[1]) < 0.2 * source().fapu.mns0


def test_sides_mirror() -> None:
    """The head is symmetric to the last vertex and triangle; a left FAP is its right partner's mirror image."""
    face = source()
    mesh = face.scene.shape("skin").mesh
    mirror = mirror_map(mesh.vertices, 1e-5 * face.fapu.es0)
    assert np.array_equal(_sorted(mirror[mesh.triangles]), _sorted(mesh.triangles))
    for (number, select, value), motion in motions().items():
        partner = number if number < 3 else fap(number).mirror
        if partner is None or "skin" not in motion.offsets:
            continue
        other = motions()[partner, select, value].offsets["skin"][mirror] * [-1.0, 1.0, 1.0]
        assert np.abs(motion.offsets["skin"] - other).max() < UNEVEN * face.fapu.es0, motion.name


def _sorted(triangles: Ints) -> Ints:
    rows = np.sort(triangles, axis=1)
    return rows[np.lexsort(rows.T)]


def test_head_turns_yaw_outermost_about_the_top_of_the_spine() -> None:
    face = source()
    names = [t.name for t in face.scene.parents("skin")]
    assert names == ["head_yaw", "head_pitch", "head_roll"]
    pivot = face.feature_points.positions(face.scene)["7.1"]
    assert np.allclose(face.scene.parents("skin")[0].center, pivot, atol=1e-5)


def test_skin_is_closed_but_for_the_neck() -> None:
    """One border, on which every vertex has two border neighbours and nothing moves."""
    face = source()
    mesh = face.scene.shape("skin").mesh
    border = mesh.edges[mesh.edge_uses == 1]
    assert set(np.bincount(border.reshape(-1)).tolist()) == {0, 2}
    assert len(border) == 42
    assert int(mesh.edge_uses.max()) == 2
    for motion in motions().values():
        if "skin" in motion.offsets:
            moved = np.linalg.norm(motion.offsets["skin"][np.unique(border)], axis=1)
            assert moved.max() < 5e-4 * face.fapu.es0, motion.name


def test_no_triangle_is_degenerate() -> None:
    """Lashes may meet where they grow."""
    for shape in (s for s in source().scene.shapes if s.role is not Role.OTHER):
        a, b, c = (shape.mesh.vertices[shape.mesh.triangles[:, k]] for k in range(3))
        assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 0.0, shape.name
