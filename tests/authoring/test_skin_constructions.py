"""Lips, chin, brows, cheeks, nose and ears made from feature points: exact, separate, symmetric, and not folded."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from authoring import brows, cheeks, chin, ears, lips, nose
from authoring.clearance import before_eyeballs
from authoring.construction import Construction, Offsets
from authoring.contact import Lips
from cloning.eyeballs import balls
from cloning.prepare import PreparedFace, prepare
from cloning.visibility import visible
from fat.quality import asymmetry, cross_talk, fap_values, feature_point_motion, flips, mirror_map
from fba.arrays import Floats
from fba.closest import TriangleSearch
from fba.faps import fap
from formats import read_face, read_scene
from formats.landmarks import read_landmarks
from samples import sample

ALL: Mapping[int, Construction] = {
    k: c for m in (lips, chin, brows, cheeks, nose, ears) for k, c in m.CONSTRUCTIONS.items()
}
ONE_SIDE = sorted(k for k in ALL if (fap(k).mirror or k) >= k)
HARDLY = 0.2
"""Percent of triangles that may turn at an everyday amplitude: hidden ones in the narrow parts of the nostrils."""


@cache
def source() -> PreparedFace:
    """The shipped source, at rest."""
    face = read_face("default")
    return prepare(face.scene, face.feature_points, "source")


@cache
def head(name: str) -> PreparedFace:
    """A shipped plain head."""
    scene = read_scene(sample(f"faces/{name}.obj"))
    return prepare(scene, read_landmarks(sample(f"faces/{name}.fps.json"), scene), "source")


def ends(construction: Construction) -> tuple[int, int]:
    return construction.borders[0], construction.borders[-1]


def everyday(construction: Construction) -> list[int]:
    """The borders nearest to 0 on both sides."""
    below = [b for b in construction.borders if b < 0][-1:]
    return below + [b for b in construction.borders if b > 0][:1]


def skin_motion(face: PreparedFace, offsets: Offsets) -> Floats:
    """The skin's part, in eye separations."""
    return face.skin.join({k: v for k, v in offsets.items() if k in face.skin.shapes}) / face.fapu.es0


def check_points(face: PreparedFace, fap_id: int, value: int) -> None:
    values = fap_values(feature_point_motion(face.points, ALL[fap_id].make(face, value)), face.fapu)
    assert values[fap_id] == pytest.approx(value, abs=1e-3)
    talk, other = cross_talk(values, fap_id)
    assert talk <= 0.02, other


def test_every_skin_fap_is_there_with_its_range() -> None:
    assert set(ALL) == {*range(4, 14), 16, 17, 18, *range(31, 43), *range(51, 69)}
    for k, construction in ALL.items():
        assert construction.fap_id == k
        assert list(construction.borders) == sorted(set(construction.borders) - {0})
        assert (construction.borders[0] < 0) == fap(k).bidirectional


@pytest.mark.parametrize("fap_id", sorted(ALL))
def test_own_points_are_exact_and_others_still(fap_id: int) -> None:
    for value in ALL[fap_id].borders:
        check_points(head("tri_head"), fap_id, value)


@pytest.mark.parametrize("fap_id", ONE_SIDE)
def test_nothing_folds_at_everyday_amplitudes(fap_id: int) -> None:
    face = source()
    for value in everyday(ALL[fap_id]):
        moved = skin_motion(face, ALL[fap_id].make(face, value))
        assert flips(face.skin.vertices, face.skin.triangles, moved) <= HARDLY


@pytest.mark.parametrize("fap_id", [6, 8, 16, 31, 37, 41, 61, 64, 67])
def test_sides_mirror_each_other(fap_id: int) -> None:
    face, twin = source(), fap(fap_id).mirror or fap_id
    mirror = mirror_map(face.skin.vertices, 1e-3)
    same_way = fap(fap_id).mirror is not None or not fap(fap_id).direction[0]  # type: ignore[index]
    for value in ends(ALL[fap_id]):
        one = skin_motion(face, ALL[fap_id].make(face, value))
        other = skin_motion(face, ALL[twin].make(face, value if same_way or fap_id != twin else -value))
        assert asymmetry(one, other, mirror) < 5e-3


@pytest.mark.parametrize("fap_id", [4, 5, 51, 52])
def test_a_lip_leaves_the_other_lip_alone(fap_id: int) -> None:
    face = source()
    upper = fap_id in (4, 51)
    moved = skin_motion(face, ALL[fap_id].make(face, 300))
    assert not moved[face.labels.values == (2 if upper else 1)].any()


@pytest.mark.parametrize(("fap_id", "value"), [(6, 300), (12, 300), (12, -300), (18, 420), (51, -300), (57, 300)])
def test_lips_that_touch_stay_together(fap_id: int, value: int) -> None:
    """Along the whole line of contact no gap opens that a tooth could shine through: 0.15 mm on a human face."""
    face, lips = source(), Lips(source())
    edges = []
    for lip, rest in enumerate(lips.edges_at_rest):
        search = TriangleSearch(face.skin.vertices, face.skin.triangles)
        moved = skin_motion(face, ALL[fap_id].make(face, value))
        found = [search.closest(spot) for spot in rest[4:-4:6]]
        edges.append(np.array([w @ moved[face.skin.triangles[t]] for t, w, _ in found]))
        assert (face.labels.values[face.skin.triangles[[t for t, _, _ in found]]] == lip + 1).any(axis=1).all()
    assert np.abs(edges[0]).max() < 0.25
    assert (edges[0] - edges[1])[:, 1].max() < 2.5e-3


@pytest.mark.parametrize("value", [120, -80])
def test_a_cheek_is_puffed_and_sucked_in_as_a_broad_dome(value: int) -> None:
    """Half as high still 0.3 eye separations behind its middle, and nothing at the corner of the mouth."""
    face = source()
    made = ALL[39].make(face, 300 if value > 0 else -300)
    moved = np.linalg.norm(skin_motion(face, made), axis=1)
    at, seen = face.skin.positions, visible(face.skin)
    top, corner = at["5.1"], at["8.3"]
    spot = top + 0.3 * (top - corner) / np.linalg.norm(top - corner)
    behind = np.linalg.norm(face.skin.vertices - spot, axis=1) < 0.12
    near = np.linalg.norm(face.skin.vertices - top, axis=1) < 0.06
    assert moved[seen & behind].min() > 0.5 * moved[seen & near].max()
    assert moved[seen & (np.linalg.norm(face.skin.vertices - corner, axis=1) < 0.02)].max() < 0.2 * moved.max()


@pytest.mark.parametrize(("inner", "outer"), [(6, 53), (7, 54), (12, 59), (13, 60)])
def test_lip_corners_move_as_one(inner: int, outer: int) -> None:
    face = head("tri_head")
    a, b = (ALL[k].make(face, 300) for k in (inner, outer))
    assert a.keys() == b.keys()
    assert all(np.array_equal(a[k], b[k]) for k in a)


def test_motion_is_local() -> None:
    """Lips do not move the brows, brows not the mouth, an ear not the other side."""
    face = source()
    at = face.skin.positions
    for fap_id, value, still in ((51, 600, "4.1"), (31, 900, "8.1"), (65, 900, "9.3"), (18, 420, "9.3")):
        moved = skin_motion(face, ALL[fap_id].make(face, value))
        near = np.linalg.norm(face.skin.vertices - at[still], axis=1) < 0.1
        assert near.any()
        assert np.abs(moved[near]).max() < 1e-3


@pytest.mark.parametrize(("fap_id", "value"), [(31, -300), (33, -300), (41, 300)])
def test_skin_stays_off_the_eyeballs(fap_id: int, value: int) -> None:
    face = source()
    moved = skin_motion(face, ALL[fap_id].make(face, value))
    for ball in balls(face):
        local = ball.rest - ball.center
        front = (ball.clearance(local) > 0.0) & (local[:, 2] > 0.0)
        after = ball.clearance(local[front] + face.fapu.es0 * moved[ball.vertices[front]])
        assert (after < -1e-6).mean() <= 0.002


def test_skin_that_would_sink_into_an_eyeball_is_pushed_forward_only() -> None:
    face = source()
    field = np.zeros_like(face.skin.vertices)
    lid = np.linalg.norm(face.skin.vertices - face.skin.positions["3.13"], axis=1) < 0.05
    field[lid] = [0.0, -0.15, -0.1]
    pushed = before_eyeballs(face, field)
    assert np.array_equal(pushed[:, :2], field[:, :2])
    assert (pushed[lid, 2] > field[lid, 2]).any()
    assert np.array_equal(pushed[~lid], field[~lid])


def test_the_lining_of_a_cheek_follows_it() -> None:
    """Skin hidden behind a cheek that is sucked in does not stay where it was, or the cheek would run through it."""
    face = source()
    moved = skin_motion(face, ALL[39].make(face, -300))
    away = np.linalg.norm(face.skin.vertices - face.skin.positions["5.1"], axis=1)
    lining = np.flatnonzero(face.skin.normals[:, 0] < -0.5)
    nearest = lining[np.argsort(away[lining])[:5]]
    assert away[nearest].max() < 0.6
    assert moved[nearest, 0].mean() < 0.3 * moved[:, 0].min()


def test_a_pulled_ear_keeps_its_shape() -> None:
    """The pinna turns as a whole: distances between points of its rim hardly change."""
    face = source()
    rest = face.skin.positions
    moved = feature_point_motion(face.points, ALL[67].make(face, 300))
    after = {k: rest[k] + moved[k] / face.fapu.es0 for k in ("10.1", "10.3", "10.5")}
    for a, b in (("10.1", "10.3"), ("10.3", "10.5")):
        before = np.linalg.norm(rest[a] - rest[b])
        assert np.linalg.norm(after[a] - after[b]) == pytest.approx(before, rel=0.1)


@pytest.mark.parametrize("fap_id", [5, 12, 18, 31, 39, 61, 66])
def test_a_real_head_of_another_kind(shared: Path, fap_id: int) -> None:
    face = ict(shared)
    for value in everyday(ALL[fap_id]):
        check_points(face, fap_id, value)
        moved = skin_motion(face, ALL[fap_id].make(face, value))
        assert flips(face.skin.vertices, face.skin.triangles, moved) < 0.5


@cache
def ict(shared: Path) -> PreparedFace:
    scene = read_scene(shared / "faces" / "ict-facekit" / "generic_neutral_mesh.obj")
    return prepare(scene, read_landmarks(shared / "landmarks" / "ict.json", scene), "source")


@pytest.mark.parametrize("fap_id", [5, 6, 33, 41, 52])
def test_a_head_with_sealed_mouth_and_eyes_still_moves(fap_id: int) -> None:
    face = head("closed_head")
    check_points(face, fap_id, ALL[fap_id].borders[-1])
