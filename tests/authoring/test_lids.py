"""Lids slide over the eyeball: feature points exact, closed on a line, never inside the ball, lashes with them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from authoring.construction import Offsets
from authoring.lids import CONSTRUCTIONS, LIDS, close_lid, findings, lid
from cloning.eyeballs import balls
from cloning.prepare import PreparedFace
from cloning.rims import eyes
from fat.fap_quality import FLIPS_MUST
from fat.quality import asymmetry, cross_talk, fap_values, feature_point_motion, flips, mirror_map
from fba.amplitudes import amplitudes
from fba.arrays import Floats

Shipped = Callable[[str], PreparedFace]
HEADS = ("source", "quad_head", "tri_head")
NEAR_MUST = 0.2
"""Percent of the skin near an eyeball that may enter it."""
DEEP = 0.02
"""Deeper than this, in radii, counts."""


def added(*all_offsets: Offsets) -> Offsets:
    total: Offsets = {}
    for offsets in all_offsets:
        for name, part in offsets.items():
            total[name] = total.get(name, 0.0) + part
    return total


def skin_of(face: PreparedFace, offsets: Offsets) -> Floats:
    return face.skin.join({k: v for k, v in offsets.items() if k in face.skin.shapes}) / face.fapu.es0


def penetration(face: PreparedFace, offsets: Offsets) -> float:
    """Percent of the vertices near the eyeballs that move into them, or deeper into them than they rest."""
    skin = skin_of(face, offsets) * face.fapu.es0
    worst = 0.0
    for ball in balls(face):
        rest = ball.rest - ball.center
        now = ball.clearance(rest + skin[ball.vertices])
        deeper = (now < np.minimum(ball.clearance(rest), 0.0) - DEEP) & skin[ball.vertices].any(axis=1)
        worst = max(worst, 100.0 * float(deeper.mean()))
    return worst


def left_open(face: PreparedFace, offsets: Offsets) -> float:
    """Largest gap between the left eye's rims as a share of its largest opening; the an eighth at each end,
    where a lid leaves room for the margin, left out."""
    eye = eyes(face)[0]
    assert eye is not None
    skin = skin_of(face, offsets)
    upper, lower = (part.rim(part.rest + skin[part.vertices])[0] for part in eye.lids)
    slices = np.flatnonzero(eye.open)
    end = len(slices) // 8
    return float(np.nanmax((upper - lower)[slices[end : len(slices) - end]]) / eye.opening.max())


@pytest.mark.parametrize("name", HEADS)
def test_each_lid_is_exact_alone_and_clear_of_the_ball(shipped: Shipped, name: str) -> None:
    face = shipped(name)
    for fap_id, made in CONSTRUCTIONS.items():
        for border in made.borders:
            offsets = made.make(face, border)
            found = fap_values(feature_point_motion(face.points, offsets), face.fapu)
            assert found[fap_id] == pytest.approx(border, rel=1e-6), (fap_id, border)
            assert cross_talk(found, fap_id)[0] < 1e-9, (fap_id, border)
            assert penetration(face, offsets) <= NEAR_MUST, (fap_id, border)


@pytest.mark.parametrize("name", HEADS)
def test_any_mixture_of_upper_and_lower_lid_closes_the_eye(shipped: Shipped, name: str) -> None:
    face = shipped(name)
    up, low = close_lid(face, 19, [256, 512, 768, 1024]), close_lid(face, 21, [256, 512])
    assert left_open(face, {}) > 0.9
    assert left_open(face, up[512]) > 0.3, "half-way the eye is open"
    for closed in (up[1024], added(up[512], low[512]), added(up[768], low[256])):
        assert left_open(face, closed) < 0.04


def test_dense_face_closes_and_stays_clear(ict: PreparedFace) -> None:
    for fap_id in (19, 21):
        for border, offsets in close_lid(ict, fap_id, CONSTRUCTIONS[fap_id].borders).items():
            found = fap_values(feature_point_motion(ict.points, offsets), ict.fapu)
            assert found[fap_id] == pytest.approx(border, rel=1e-6)
            assert penetration(ict, offsets) <= NEAR_MUST
    assert left_open(ict, close_lid(ict, 19, [1024])[1024]) < 0.03


@pytest.mark.parametrize("fap_id", LIDS)
def test_lids_of_the_source_fold_nothing_as_far_as_they_usually_go(shipped: Shipped, fap_id: int) -> None:
    face = shipped("source")
    values = amplitudes()[fap_id].values
    for value, offsets in close_lid(face, fap_id, values).items():
        assert flips(face.skin.vertices, face.skin.triangles, skin_of(face, offsets)) == 0.0, value


def test_closed_lids_of_the_source_fold_hardly_anything_at_their_limit(shipped: Shipped) -> None:
    face = shipped("source")
    for fap_id in (19, 21):
        border = CONSTRUCTIONS[fap_id].borders[-1]
        skin = skin_of(face, close_lid(face, fap_id, [border])[border])
        assert flips(face.skin.vertices, face.skin.triangles, skin) <= FLIPS_MUST


def test_rim_keeps_its_distance_from_the_middle_of_the_ball(shipped: Shipped) -> None:
    face = shipped("source")
    made = lid(face, 19)
    assert made is not None
    vertices = made.eye.lids[0].vertices
    place = face.skin.vertices[vertices] - made.middle
    moved = place + skin_of(face, close_lid(face, 19, [-512])[-512])[vertices]
    change = np.linalg.norm(moved, axis=1) / np.linalg.norm(place, axis=1) - 1.0
    assert np.abs(change).max() < 0.02, "an opening lid turns about the ball, it does not leave it"
    assert np.abs(moved - place)[:, 0].max() == 0.0


@pytest.mark.parametrize(("left", "right"), [(19, 20), (21, 22)])
def test_lids_of_both_eyes_are_mirror_images(shipped: Shipped, left: int, right: int) -> None:
    face = shipped("source")
    mirror = mirror_map(face.skin.vertices, 1e-3)
    for border in (CONSTRUCTIONS[left].borders[0], 512):
        one, two = (skin_of(face, CONSTRUCTIONS[k].make(face, border)) for k in (left, right))
        assert asymmetry(one, two, mirror) < 1e-4


def test_lashes_turn_with_the_lid(shipped: Shipped) -> None:
    face = shipped("source")
    moved = close_lid(face, 19, [768])[768]
    assert "lashes_left" in moved
    assert "lashes_right" not in moved
    lashes = face.scene.shape("lashes_left").mesh
    rest = face.scene.world_vertices("lashes_left")
    upper = np.linalg.norm(moved["lashes_left"], axis=1) > 0.5 * np.linalg.norm(moved["lashes_left"], axis=1).max()
    edges = lashes.edges[upper[lashes.edges].all(axis=1)]
    before, after = (
        np.linalg.norm(v[edges[:, 0]] - v[edges[:, 1]], axis=1) for v in (rest, rest + moved["lashes_left"])
    )
    assert len(edges) > 40
    assert abs(np.median(after / before) - 1.0) < 0.1
    tips = moved["lashes_left"][upper]
    assert tips[:, 1].max() < 0.0, "every upper lash goes down"


def test_spread_of_a_modelled_lid_is_taken(shipped: Shipped) -> None:
    face = shipped("source")
    unit = close_lid(face, 19, [512])[512]
    made = lid(face, 19)
    assert made is not None
    offsets = close_lid(face, 19, [1024], unit)[1024]
    taken, constructed = (skin_of(face, o) for o in (offsets, close_lid(face, 19, [1024])[1024]))
    size = np.linalg.norm(constructed, axis=1).max()
    inside = np.abs(face.skin.vertices[:, 0] - made.middle[0]) < 0.1
    assert np.linalg.norm(taken - constructed, axis=1)[inside].max() < 0.15 * size
    assert fap_values(feature_point_motion(face.points, offsets), face.fapu)[19] == pytest.approx(1024)
    assert left_open(face, offsets) < 0.03


def test_lids_that_are_grown_together_are_left_out(shipped: Shipped) -> None:
    face = shipped("closed_head")
    assert {f.code for f in findings(face)} == {"no-lids"}
    for fap_id in LIDS:
        assert close_lid(face, fap_id, [256]) == {}
        assert CONSTRUCTIONS[fap_id].make(face, 256) == {}
