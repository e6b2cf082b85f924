"""A flexible tongue: feature points exact, root held, middle still, length kept, rolled by the angle asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from authoring.jaw import jaw
from authoring.tongue import CONSTRUCTIONS, tongue
from cloning.bodies import body
from cloning.prepare import PreparedFace
from fat.build import build_tables
from fat.conformance import conformance
from fat.face import AnimatableFace
from fat.motion import FaceMotion
from fat.quality import cross_talk, fap_values, feature_point_motion, flips
from fba import Role
from fba.arrays import Floats

Shipped = Callable[[str], PreparedFace]
HEADS = ("source", "quad_head", "tri_head")


def moved(face: PreparedFace, fap_id: int, value: int) -> tuple[str, Floats, Floats]:
    """Name of the tongue, where it rests, and its offsets."""
    ((name, offsets),) = CONSTRUCTIONS[fap_id].make(face, value).items()
    return name, face.scene.world_vertices(name), offsets


def exact(face: PreparedFace) -> None:
    """All borders measured on a finished face, the roll included."""
    motions = [
        FaceMotion(str(k), k, 1, border, made.make(face, border))
        for k, made in CONSTRUCTIONS.items()
        for border in made.borders
    ]
    finished = AnimatableFace(face.scene, face.points, build_tables(face.scene, face.fapu, motions), face.fapu, {})
    found = conformance(finished)
    assert [f.fap_id for f in found] == sorted(CONSTRUCTIONS)
    assert all(f.relative_error < 1e-4 for f in found), found
    for motion in motions:
        values = fap_values(feature_point_motion(face.points, motion.offsets), face.fapu)
        if motion.fap_id == 47:
            values[47] = motion.value
        others = cross_talk(values, motion.fap_id or 0)
        assert others[0] <= 0.005, (motion.fap_id, motion.value, others)


@pytest.mark.parametrize("name", HEADS)
def test_points_are_exact_and_others_are_still(shipped: Shipped, name: str) -> None:
    exact(shipped(name))


@pytest.mark.parametrize("fap_id", sorted(CONSTRUCTIONS))
def test_root_is_held_and_nothing_folds(shipped: Shipped, fap_id: int) -> None:
    face = shipped("source")
    value = 60_000 if fap_id == 47 else 270
    for signed in (value, -value) if CONSTRUCTIONS[fap_id].borders[0] < 0 else (value,):
        name, rest, offsets = moved(face, fap_id, signed)
        back = rest[:, 2] <= rest[:, 2].min() + 1e-6
        assert np.abs(offsets[back]).max() < 1e-3 * np.abs(offsets).max()
        assert flips(rest, face.scene.shape(name).mesh.triangles, offsets) == 0.0


def test_bent_tongue_keeps_its_length(shipped: Shipped) -> None:
    face = shipped("source")
    found = tongue(face)
    assert found is not None
    _, rest, offsets = moved(face, 43, 540)
    middle = np.flatnonzero((np.abs(rest[:, 0]) < 1e-6) & (found.along <= 1.0))
    top = middle[rest[middle, 1] > np.interp(rest[middle, 2], *_mean_height(rest[middle]))]
    top = top[np.argsort(rest[top, 2])]
    before, after = (np.linalg.norm(np.diff(v[top], axis=0), axis=1).sum() for v in (rest, rest + offsets))
    pushed = np.hypot(before, np.linalg.norm(offsets[top[-1]]))
    assert len(top) > 8
    assert after == pytest.approx(before, rel=0.03)
    assert pushed > 1.05 * before, "pushed aside without bending it would be longer"


def _mean_height(places: Floats) -> tuple[Floats, Floats]:
    """Depths, rising, and the mean height of the places near them."""
    depths = np.linspace(places[:, 2].min(), places[:, 2].max(), 12)
    reach = depths[1] - depths[0]
    return depths, np.array([places[np.abs(places[:, 2] - z) <= reach, 1].mean() for z in depths])


@pytest.mark.parametrize("name", HEADS)
def test_lowered_tip_draws_back_behind_the_lower_teeth(shipped: Shipped, name: str) -> None:
    face = shipped(name)
    found, teeth = tongue(face), body(face, Role.LOWER_TEETH)
    assert found is not None
    assert teeth is not None
    es0, tip = face.fapu.es0, face.place("6.1")
    middle = np.abs(teeth.vertices[:, 0] - tip[0]) < 0.02 * es0
    for value in (-1080, -540):
        _, rest, offsets = moved(face, 44, value)
        lowered = (rest + offsets)[np.abs(rest[:, 0] - tip[0]) < 0.02 * es0]
        beside = teeth.vertices[middle & (teeth.vertices[:, 1] > lowered[np.argmax(lowered[:, 2]), 1])]
        assert len(beside)
        assert lowered[:, 2].max() < beside[:, 2].min(), value


def test_rolled_borders_turn_up_and_the_middle_rests(shipped: Shipped) -> None:
    face = shipped("source")
    _, _, offsets = moved(face, 47, 60_000)
    motion = feature_point_motion(face.points, CONSTRUCTIONS[47].make(face, 60_000))
    assert motion["6.3"][1] > 0.0
    assert motion["6.3"][0] < 0.0 < motion["6.4"][0], "the borders come nearer to each other"
    assert np.allclose(motion["6.3"] * [-1, 1, 1], motion["6.4"], atol=1e-9)
    assert np.linalg.norm(motion["6.2"]) < 1e-6 * np.abs(offsets).max()


def test_gums_of_one_mesh_with_the_tongue_rest_with_their_teeth(ict: PreparedFace) -> None:
    exact(ict)
    found = tongue(ict)
    assert found is not None
    high = found.surface.vertices[:, 1] > ict.skin.positions["6.2"][1] + 0.15
    assert found.free[high].max() == 0.0
    opened = jaw(ict).opened(1024)["face_tongue"]
    assert np.abs(opened[high]).max() < 0.05 * np.abs(opened).max(), "upper gums do not fall with the jaw"


def test_without_a_tongue_nothing_is_made(shipped: Shipped) -> None:
    face = shipped("source")
    kept = tuple(s for s in face.scene.roots if getattr(s, "role", None) is not Role.TONGUE)
    bare = replace(face, scene=replace(face.scene, roots=kept))
    if any(s.role is Role.TONGUE for s in bare.scene.shapes):
        bare = shipped("closed_head")
    assert all(made.make(bare, made.borders[-1]) == {} for made in CONSTRUCTIONS.values())
