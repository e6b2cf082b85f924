"""Polygon meshes: derived quantities, parts, winding."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fba import PolyMesh
from fba.errors import MeshError

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def volume(mesh: PolyMesh) -> float:
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


@st.composite
def meshes(draw: st.DrawFn) -> PolyMesh:
    count = draw(st.integers(3, 12))
    faces = draw(st.lists(st.lists(st.integers(0, count - 1), min_size=3, max_size=6), min_size=1, max_size=8))
    rng = np.random.default_rng(draw(st.integers(0, 99)))
    mesh = PolyMesh.from_faces(rng.normal(size=(count, 3)), faces)
    corners = mesh.indices.size
    return PolyMesh(
        mesh.vertices,
        mesh.indices,
        mesh.offsets,
        rng.random((5, 2)),
        rng.integers(-1, 5, corners),
        rng.normal(size=(4, 3)),
        rng.integers(-1, 4, corners),
        rng.integers(0, 2, mesh.face_count),
        ("a", "b"),
        rng.integers(-1, 3, mesh.face_count),
    )


def test_cube() -> None:
    cube = PolyMesh.from_faces(CUBE, SIDES)
    assert abs(volume(cube)) == pytest.approx(1.0)
    assert volume(cube.reversed()) == pytest.approx(-volume(cube))
    assert len(cube.edges) == 12
    assert set(cube.edge_uses) == {2}
    assert np.unique(cube.components()).size == 1
    outward = cube.vertices - 0.5
    sign = np.sign(volume(cube))
    assert np.all(sign * np.einsum("ij,ij->i", cube.vertex_normals(), outward) > 0)


def test_fan_triangulation_of_a_pentagon() -> None:
    mesh = PolyMesh.from_faces(np.zeros((7, 3)), [[0, 1, 2], [2, 3, 4, 5, 6]])
    np.testing.assert_array_equal(mesh.triangles, [[0, 1, 2], [2, 3, 4], [2, 4, 5], [2, 5, 6]])
    np.testing.assert_array_equal(mesh.triangle_faces, [0, 1, 1, 1])


@settings(max_examples=50, deadline=None)
@given(meshes())
def test_reversing_twice_gives_the_same_mesh(mesh: PolyMesh) -> None:
    twice = mesh.reversed().reversed()
    for name in ("vertices", "indices", "offsets", "texcoord_indices", "normals", "normal_indices", "face_materials"):
        np.testing.assert_array_equal(getattr(twice, name), getattr(mesh, name))


@settings(max_examples=50, deadline=None)
@given(meshes(), st.integers(0, 2**12 - 1))
def test_a_part_keeps_its_polygons_and_what_hangs_on_them(mesh: PolyMesh, bits: int) -> None:
    mask = np.array([bits >> k & 1 for k in range(mesh.vertex_count)], dtype=bool)
    part, ids = mesh.submesh(mask)
    np.testing.assert_array_equal(ids, np.flatnonzero(mask))
    np.testing.assert_array_equal(part.vertices, mesh.vertices[mask])
    inside = [f for f in range(mesh.face_count) if mask[mesh.face(f)].all()]
    assert part.face_count == len(inside)
    for new, old in enumerate(inside):
        np.testing.assert_array_equal(ids[part.face(new)], mesh.face(old))
        corners = slice(mesh.offsets[old], mesh.offsets[old + 1])
        for k, place in enumerate(range(part.offsets[new], part.offsets[new + 1])):
            was = int(mesh.texcoord_indices[corners][k])
            now = int(part.texcoord_indices[place])
            assert (was < 0) == (now < 0)
            if was >= 0:
                np.testing.assert_array_equal(part.texcoords[now], mesh.texcoords[was])


@pytest.mark.parametrize(
    ("faces", "offsets"),
    [([0, 1, 9], [0, 3]), ([0, 1, -1], [0, 3]), ([0, 1], [0, 2]), ([0, 1, 2], [0, 2]), ([0, 1, 2], [1, 3])],
)
def test_impossible_polygons_are_refused(faces: list[int], offsets: list[int]) -> None:
    with pytest.raises(MeshError):
        PolyMesh(np.zeros((3, 3)), np.array(faces, dtype=np.int32), np.array(offsets, dtype=np.int32))


def test_arrays_are_read_only_and_not_the_callers() -> None:
    mine = CUBE.copy()
    cube = PolyMesh.from_faces(mine, SIDES)
    mine[0] = 7.0
    assert cube.vertices[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        cube.vertices[0] = 1.0
