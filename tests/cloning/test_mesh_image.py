"""Mesh image and resampling: places of a target, found again through the cylinder."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cloning.mesh_image import AROUND, draw_mesh
from cloning.prepare import PreparedFace, prepare
from cloning.resampling import parameterised, resample, without_redundant
from fat import AnimatableFace
from fba import FaceScene, FeaturePoints
from fba.arrays import Bools, Floats, Ints

WIDTH = 2.0 * np.pi / AROUND


def tube(columns: int, rows: int, radius: float = 1.0) -> tuple[Floats, Floats, Ints]:
    """A closed tube from height 0 to 1: plane (n, 2), places (n, 3), triangles."""
    angle = -np.pi + 2.0 * np.pi * (np.arange(columns) + 0.3) / columns
    u, v = (a.ravel() for a in np.meshgrid(angle, np.linspace(0.0, 1.0, rows)))
    places = np.stack([radius * np.sin(u), v, radius * np.cos(u)], axis=1)
    corner = np.arange(rows * columns).reshape(rows, columns)
    right = np.roll(corner, -1, axis=1)
    cells = np.stack([corner[:-1], right[:-1], right[1:], corner[1:]], axis=-1).reshape(-1, 4)
    return np.stack([u, v], axis=1), places, np.concatenate([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])


def on_tube(plane: Floats, radius: float = 1.0) -> Floats:
    return np.stack([radius * np.sin(plane[:, 0]), plane[:, 1], radius * np.cos(plane[:, 0])], axis=1)


def test_every_place_around_is_found_again_also_across_the_seam() -> None:
    plane, places, triangles = tube(96, 9)
    image = draw_mesh(plane, np.full(len(plane), -1.0), triangles, places)
    assert image.depth.shape[1] == AROUND
    assert np.isfinite(image.depth).all(), "the seam leaves no gap"
    random = np.random.default_rng(0)
    wanted = np.stack([random.uniform(-np.pi, np.pi, 500), random.uniform(0.02, 0.98, 500)], axis=1)
    wanted[:40, 0] = np.pi * np.tile([1.0, -1.0], 20) + np.linspace(-0.02, 0.02, 40)
    found, inside = image.sample(wanted)
    assert inside.all()
    # Chords of the 96-gon sink below the circle by 1 - cos(pi / 96).
    assert np.abs(found - on_tube(wanted)).max() < 1.0 - np.cos(np.pi / 96.0) + WIDTH


def test_the_outermost_sheet_wins_and_sheets_are_not_mixed() -> None:
    plane, places, triangles = tube(96, 9)
    n = len(plane)
    patch = np.abs(plane[triangles][:, :, 0]).max(axis=1) < 0.5
    both = np.concatenate([plane, plane])
    space = np.concatenate([places, on_tube(plane, 1.5)])
    depth = np.concatenate([np.full(n, -1.0), np.full(n, -1.5)])
    image = draw_mesh(both, depth, np.concatenate([triangles, triangles[patch] + n]), space)
    edge = float(np.abs(plane[triangles[patch]][:, :, 0]).max())
    across = np.stack([np.linspace(edge - 3 * WIDTH, edge + 3 * WIDTH, 200), np.full(200, 0.5)], axis=1)
    found, inside = image.sample(across)
    assert inside.all()
    radius = np.hypot(found[:, 0], found[:, 2])
    assert ((np.abs(radius - 1.0) < 0.01) | (np.abs(radius - 1.5) < 0.01)).all()
    assert radius[0] > 1.4
    assert radius[-1] < 1.1


def test_places_are_exact_however_coarse_the_picture() -> None:
    plane, places, triangles = tube(96, 9)
    random = np.random.default_rng(2)
    shares = random.dirichlet(np.ones(3), 300)
    some = triangles[random.integers(0, len(triangles), 300)]
    some = some[np.ptp(plane[some][:, :, 0], axis=1) < 1.0]
    wanted, truth = (np.einsum("mk,mkd->md", shares[: len(some)], values[some]) for values in (plane, places))
    for columns in (32, 64, AROUND):
        found, inside = draw_mesh(plane, np.full(len(plane), -1.0), triangles, places, columns).sample(wanted)
        assert inside.all()
        assert np.allclose(found, truth, atol=1e-9), "triangles finer than a pixel too"


def test_skin_that_faces_inwards_is_not_seen() -> None:
    plane, places, triangles = tube(96, 9)
    image = draw_mesh(plane, np.full(len(plane), -1.0), triangles[:, ::-1], places)
    assert not np.isfinite(image.depth).any()
    assert not image.sample(plane)[1].any()


def test_the_picture_shows_places() -> None:
    plane, places, triangles = tube(96, 9)
    image = draw_mesh(plane, np.full(len(plane), -1.0), triangles, places, 128)
    rows, columns = image.depth.shape
    u = -np.pi + 2.0 * np.pi * (np.arange(columns) + 0.5) / columns
    assert image.places.shape == (rows, columns, 3)
    assert np.abs(np.hypot(*image.places[:, :, [0, 2]].transpose(2, 0, 1)) - 1.0).max() < 1e-3
    assert np.abs(np.arctan2(image.places[0, :, 0], image.places[0, :, 2]) - u).max() < 1e-2


def test_where_nothing_is_nothing_is_found() -> None:
    plane, places, triangles = tube(96, 9)
    open_front = triangles[np.abs(plane[triangles][:, :, 0]).max(axis=1) > 0.4]
    image = draw_mesh(plane, np.full(len(plane), -1.0), open_front, places)
    found, inside = image.sample(np.array([[0.0, 0.5], [1.0, 0.5], [1.0, 3.0], [1.0, -2.0]]))
    assert inside.tolist() == [False, True, False, False]
    assert not found[~inside].any()
    near = np.stack([np.linspace(0.2, 0.6, 300), np.full(300, 0.5)], axis=1)
    found, inside = image.sample(near)
    assert 0 < inside.sum() < 300
    assert np.abs(np.hypot(found[inside, 0], found[inside, 2]) - 1.0).max() < 0.01, "skin is not mixed with nothing"


def test_feature_points_go_to_each_other_and_what_is_between_follows() -> None:
    random = np.random.default_rng(1)
    mine = random.uniform(-1.0, 1.0, (20, 2))
    yours = mine * 1.1 + 0.02 * random.normal(size=(20, 2))
    box = np.array([[0.0, -1.5], [0.0, 1.5]])
    moved = parameterised(np.concatenate([mine, box]), 1.2 * box, mine, yours)
    assert np.allclose(moved[:20], yours, atol=1e-9)
    assert np.abs(moved[20:, 1]).max() < 1.8 + 1e-9
    seam = np.array([[np.pi - 0.01, 0.3], [0.2, 0.4], [-0.5, -0.8]])
    turned = seam - np.array([[2.0 * np.pi, 0.0], [0.0, 0.0], [0.0, 0.0]])
    assert np.allclose(parameterised(box, box, seam, turned), parameterised(box, box, seam, seam))


def test_redundant_vertices_take_their_polygons_along() -> None:
    polygons = np.array([0, 1, 2, 3, 2, 3, 4, 1, 2, 5, 6, 7], np.int32), np.array([0, 4, 7, 12], np.int32)
    kept = np.ones(8, bool)
    kept[4] = False
    indices, offsets = without_redundant(polygons, kept)
    assert indices.tolist() == [0, 1, 2, 3, 1, 2, 5, 6, 7]
    assert offsets.tolist() == [0, 4, 9]


@pytest.fixture(scope="module")
def faces(source: AnimatableFace, wide: tuple[FaceScene, FeaturePoints]) -> tuple[PreparedFace, PreparedFace]:
    return prepare(source.scene, source.feature_points, "source"), prepare(*wide, "target")


def test_a_face_finds_itself_exactly(faces: tuple[PreparedFace, PreparedFace]) -> None:
    skin = faces[0].skin
    found = resample(skin, skin)
    error = np.linalg.norm(found.vertices - skin.vertices, axis=1)[found.kept]
    assert found.kept.mean() > 0.7
    assert error.max() < 1e-6
    assert np.array_equal(np.unique(found.polygons[0]), np.flatnonzero(found.kept)), "every vertex left has a tent"


def test_the_throat_is_not_the_nape(faces: tuple[PreparedFace, PreparedFace]) -> None:
    mine, yours = faces
    skin = yours.skin
    # The target's neck ends higher than the source's at the back, so that the source's throat is all there is below.
    nape = (skin.vertices[:, 2] < skin.positions["7.1"][2]) & (skin.vertices[:, 1] < skin.positions["2.1"][1] + 0.5)
    short = replace(skin, triangles=skin.triangles[~nape[skin.triangles].any(axis=1)])
    found = resample(mine.skin, short)
    behind = mine.skin.vertices[:, 2] < mine.skin.positions["7.1"][2] - 0.1
    low = mine.skin.vertices[:, 1] < mine.skin.positions["2.1"][1] - 0.2
    assert (behind & low).sum() > 50
    places = found.vertices[found.kept & behind & low]
    assert (places[:, 2] < skin.positions["7.1"][2] + 0.3).all()


def in_front(face: PreparedFace) -> Bools:
    skin = face.skin
    front: Bools = (skin.normals[:, 2] > 0.5) & (np.linalg.norm(skin.vertices - skin.positions["9.3"], axis=1) < 1.0)
    return front


def test_another_face_is_found_near_its_true_places(faces: tuple[PreparedFace, PreparedFace]) -> None:
    mine, yours = faces
    found = resample(mine.skin, yours.skin)
    some = found.kept & in_front(mine)
    assert some.sum() > 500
    # The same mesh with other proportions, so that the truth is vertex by vertex.
    error = np.linalg.norm(found.vertices - yours.skin.vertices, axis=1)[some]
    assert np.median(error) < 0.03
    assert np.percentile(error, 95) < 0.12
