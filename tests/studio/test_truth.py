"""A face beside the truth on its own mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fat import AnimatableFace, FaceDefTables
from fba import FaceScene, PolyMesh, Shape
from fba.errors import MeshError
from formats import read_face
from studio.checked_skin import CheckedSkin, check_skin
from studio.truth import beside_truth, require_same_mesh


@pytest.fixture(scope="module")
def face() -> AnimatableFace:
    source = read_face("default")
    return replace(source, tables=FaceDefTables(tuple(t for t in source.tables if t.fap_id in (3, 31))))


@pytest.fixture(scope="module")
def skin(face: AnimatableFace) -> CheckedSkin:
    found = check_skin(face)
    assert found is not None
    return found


def times(face: AnimatableFace, factor: float, fap_id: int) -> AnimatableFace:
    """The face with one FAP's displacements multiplied."""
    tables = []
    for table in face.tables:
        meshes = tuple(replace(m, displacements=m.displacements * np.float32(factor)) for m in table.meshes)
        tables.append(replace(table, meshes=meshes) if table.fap_id == fap_id else table)
    return replace(face, tables=FaceDefTables(tuple(tables)))


def test_the_distance_from_the_truth_is_relative_to_the_true_motion(face: AnimatableFace, skin: CheckedSkin) -> None:
    assert {v.code: v.value for v in beside_truth(face, face, skin)} == {"truth": 0.0, "truth-hidden": 0.0}
    found = {v.code: v for v in beside_truth(times(face, 3.0, 31), face, skin)}
    # Twice too far in both directions of one FAP, right in the one of the jaw.
    motions = 3
    assert found["truth"].value == pytest.approx(2 * 2.0 / motions)
    assert (found["truth"].word, found["truth"].limit) == ("FAIL", 0.35)
    assert found["truth"].where.startswith("raise_l_i_eyebrow at ")
    finding = found["truth"].finding()
    assert (finding.severity, finding.code) == ("warning", "truth")


def test_another_mesh_is_no_truth(face: AnimatableFace) -> None:
    other = face.scene.shapes[0]
    assert other.name == "skin"

    def with_skin(mesh: PolyMesh, name: str) -> AnimatableFace:
        shape = Shape(name, mesh, other.role)
        return replace(face, scene=FaceScene((shape, *face.scene.shapes[1:])), tables=FaceDefTables(()))

    more = PolyMesh.from_faces(np.concatenate([other.mesh.vertices, [[0.0, 0, 0]]]), other.mesh.triangles)
    wider = PolyMesh.from_faces(other.mesh.vertices * [1.1, 1.0, 1.0], other.mesh.triangles)
    for mesh, name, text in (
        (other.mesh, "head", "has no skin 'skin', only \\['head'\\]"),
        (more, "skin", f"has {other.mesh.vertex_count} vertices, the truth's has {more.vertex_count}"),
        (wider, "skin", "differ from the truth's by up to .* eye separations: the truth needs the checked face's own"),
    ):
        with pytest.raises(MeshError, match=text):
            require_same_mesh(face, with_skin(mesh, name))
