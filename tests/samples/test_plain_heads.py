"""The shipped plain heads are what they say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fba.closest import closest_on_triangles
from fba.fapu import Fapu
from fba.mesh import PolyMesh
from fba.scene import FaceScene
from formats import read_face, read_scene
from formats.landmarks import landmarks_beside, read_landmarks
from samples import default_source, sample

HEADS = ("quad_head", "tri_head", "closed_head")


def scene(name: str) -> FaceScene:
    return read_scene(sample(f"faces/{name}.obj"))


def edge_uses(mesh: PolyMesh) -> np.ndarray:
    following = np.arange(mesh.indices.size) + 1
    following[mesh.offsets[1:] - 1] = mesh.offsets[:-1]
    pairs = np.sort(np.stack([mesh.indices, mesh.indices[following]], axis=1), axis=1)
    return np.unique(pairs, axis=0, return_counts=True)[1]


@pytest.mark.parametrize("name", HEADS)
def test_points_lie_on_the_surface_and_give_fapus(name: str) -> None:
    head = scene(name)
    beside = landmarks_beside(sample(f"faces/{name}.obj"))
    assert beside is not None
    points = read_landmarks(beside, head)
    at = points.positions(head)
    fapu = Fapu.from_feature_points(at)
    assert 0.12 < fapu.irisd0 / fapu.es0 < 0.2
    assert 0.65 < fapu.mw0 / fapu.es0 < 1.05
    for key, point in points.items():
        if point.shape is not None:
            mesh = head.shape(point.shape).mesh
            _, squared = closest_on_triangles(mesh.vertices[mesh.triangles], at[key])
            assert np.sqrt(squared.min()) < 1e-4 * fapu.es0, key


@pytest.mark.parametrize("name", HEADS)
def test_left_is_the_subjects_left(name: str) -> None:
    head = scene(name)
    at = read_landmarks(sample(f"faces/{name}.fps.json"), head).positions(head)
    for left, right in (("3.5", "3.6"), ("8.3", "8.4"), ("10.1", "10.2"), ("4.5", "4.6")):
        assert at[left][0] > at[right][0]
    assert at["9.3"][2] > at["11.6"][2]
    assert at["2.2"][1] >= at["2.3"][1]


def test_closed_head_is_watertight_and_one_piece() -> None:
    head = scene("closed_head")
    assert len(head.shapes) == 1
    mesh = head.shapes[0].mesh
    assert set(edge_uses(mesh)) == {2}
    assert int(mesh.components().max()) == 0
    corners = mesh.vertices[mesh.triangles]
    assert float(np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum()) > 0.0


def test_quad_head_has_quads_and_all_parts() -> None:
    head = scene("quad_head")
    names = {s.name for s in head.shapes}
    assert names >= {"skin", "eye_left", "eye_right", "upper_teeth", "lower_teeth", "tongue"}
    for shape in head.shapes:
        assert set(shape.mesh.arities) == {4}
    assert 15_000 < head.vertex_count < 22_000


def test_tri_head_has_few_triangles() -> None:
    head = scene("tri_head")
    for shape in head.shapes:
        assert set(shape.mesh.arities) == {3}
    assert 2_300 < head.vertex_count < 3_100


def test_topologies_differ() -> None:
    skins = {name: max(scene(name).shapes, key=lambda s: s.mesh.vertex_count).mesh for name in HEADS}
    skins["source"] = read_face(default_source()).scene.shape("skin").mesh
    counts = {(mesh.vertex_count, mesh.face_count) for mesh in skins.values()}
    assert len(counts) == 4


@pytest.mark.parametrize("name", ["faces/PROVENANCE.md", "faces/LICENSE-CC0-1.0.md", "faces/LICENSE-APACHE-2.0.txt"])
def test_licences_travel_along(name: str) -> None:
    assert sample(name).stat().st_size > 1000


def test_provenance_names_every_face() -> None:
    text = sample("faces/PROVENANCE.md").read_text("utf-8")
    folder: Path = sample("faces/PROVENANCE.md").parent
    for path in folder.glob("*.obj"):
        assert path.name in text
    assert "source.wrl.gz" in text
