"""The benchmark of vertex tents measures what it says."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.deformation import errors
from benchmarks.vtc import COUNT, by_solvers, dense, skin_motions
from cloning.prepare import PreparedFace, prepare
from fba.arrays import Floats
from formats import read_face


@pytest.fixture(scope="module")
def shipped() -> tuple[PreparedFace, Floats]:
    source = read_face("default")
    face = prepare(source.scene, source.feature_points, "source")
    return face, skin_motions(source, face)


def test_solvers_give_a_face_its_own_motion_again(
    shipped: tuple[PreparedFace, Floats],
) -> None:
    face, motions = shipped
    some = motions[:, ::30]
    for mapped in by_solvers(face, some):
        row = errors(mapped.found[mapped.kept], some[mapped.kept])
        assert row["below 0.1%"] == 1.0
        assert row["largest"] < 1e-6


def test_the_dense_skin_is_the_same_surface_with_the_same_motion(shipped: tuple[PreparedFace, Floats]) -> None:
    face, motions = shipped
    skin, moved = dense(face.skin, motions[:, :2])
    n = face.skin.vertex_count
    assert 18_000 < skin.vertex_count < 20_000
    assert np.array_equal(skin.vertices[:n], face.skin.vertices)
    assert np.array_equal(moved[:n], motions[:, :2])
    first = face.skin.polygons[0][face.skin.polygons[1][0] : face.skin.polygons[1][1]]
    assert np.allclose(skin.vertices[n], face.skin.vertices[first].mean(axis=0))
    assert np.allclose(moved[n], motions[first, :2].mean(axis=0))
    more = dense(face.skin, None, COUNT)[0]
    assert more.vertex_count == COUNT
    corners = more.vertices[more.triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    corners = skin.vertices[skin.triangles]
    assert np.isclose(
        np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum(), area
    )
