"""Faces that are unlike the source: what is missing is said, what is there moves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from remade import bare

from cloning import clone_with_report
from cloning.closed_eyes import calm_lids
from cloning.openings import between_lids, covered_eyes, front
from cloning.prepare import prepare
from cloning.surface import build_surface
from fat import AnimatableFace
from fat.build import face_motions
from fba import FaceScene, FeaturePoint, FeaturePoints, PolyMesh, Role, Shape
from fba.arrays import Floats
from fba.errors import MeshError
from formats import read_scene
from formats.landmarks import read_landmarks
from samples import sample

JAW, BLINK, BROW = 3, 19, 31
FEW = (JAW, BLINK, BROW)
DATA = Path(__file__).resolve().parents[1] / "data"


@pytest.fixture(scope="module")
def head() -> tuple[FaceScene, FeaturePoints]:
    path = sample("faces/tri_head.obj")
    scene = read_scene(path)
    return scene, read_landmarks(path.with_name("tri_head.fps.json"), scene)


@pytest.fixture(scope="module")
def skin_motion(source: AnimatableFace, head: tuple[FaceScene, FeaturePoints]) -> dict[int, Floats]:
    return motions(clone_with_report(source, *head, faps=FEW, backend="fmc")[0])


def motions(face: AnimatableFace) -> dict[int, Floats]:
    """FAP -> (n, 3) offsets of the skin at its largest value."""
    skin = face.scene.with_role(Role.SKIN)[0]
    rest = np.zeros((skin.mesh.vertex_count, 3))
    found = {}
    for fap in FEW:
        rows = face_motions(face, [(fap, 1)])
        found[fap] = rows[-1].offsets.get(skin.name, rest) if rows else rest
    return found


def changed(scene: FaceScene, change: Callable[[PolyMesh], PolyMesh]) -> FaceScene:
    shapes = tuple(replace(s, mesh=change(s.mesh), vertex_ids=None) for s in scene.shapes)
    return replace(scene, roots=shapes)


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_vertices_that_are_nowhere_are_refused(
    source: AnimatableFace, head: tuple[FaceScene, FeaturePoints], wrong: float
) -> None:
    def broken(mesh: PolyMesh) -> PolyMesh:
        vertices = mesh.vertices.copy()
        vertices[3, 1] = wrong
        return mesh.with_vertices(vertices)

    for points in (head[1], None):
        with pytest.raises(MeshError, match="no finite coordinates"):
            clone_with_report(source, changed(head[0], broken), points, faps=FEW)


def test_a_head_that_is_wound_inside_out_moves_the_same(
    source: AnimatableFace, head: tuple[FaceScene, FeaturePoints], skin_motion: dict[int, Floats]
) -> None:
    face, report = clone_with_report(source, changed(head[0], PolyMesh.reversed), head[1], faps=FEW, backend="fmc")
    assert "inside-out" in {f.code for f in report.findings}
    for fap, offsets in motions(face).items():
        assert np.allclose(offsets, skin_motion[fap], atol=1e-3 * np.abs(skin_motion[fap]).max())


def test_seams_of_a_texture_do_not_tear(
    source: AnimatableFace, head: tuple[FaceScene, FeaturePoints], skin_motion: dict[int, Floats]
) -> None:
    """Every vertex in the middle of the face is there twice, as files with one index per corner have it."""
    scene, points = head
    skin = scene.shape("skin")
    mesh = skin.mesh
    place = points.positions(scene)
    lips = np.abs(mesh.vertices[:, 1] - place["2.2"][1]) < 0.3 * (place["9.15"][1] - place["2.2"][1])
    right = mesh.vertices[mesh.indices].reshape(-1, 3, 3)[:, :, 0].mean(axis=1) < 0.0
    corners = mesh.indices.reshape(-1, 3)
    both = np.intersect1d(corners[right], corners[~right])
    both = both[~lips[both]]
    number = np.arange(mesh.vertex_count)
    number[both] = mesh.vertex_count + np.arange(len(both))
    corners = np.where(right[:, None], number[corners], corners)
    cut = PolyMesh.from_faces(np.concatenate([mesh.vertices, mesh.vertices[both]]), corners.tolist())
    assert len(both) > 20
    shapes = tuple(replace(s, mesh=cut if s.name == "skin" else s.mesh, vertex_ids=None) for s in scene.shapes)
    face, _ = clone_with_report(source, replace(scene, roots=shapes), points, faps=FEW, backend="fmc")
    for fap, offsets in motions(face).items():
        assert np.allclose(offsets[both], offsets[mesh.vertex_count :], atol=1e-4 * face.fapu.es0)
        difference = offsets[: mesh.vertex_count] - skin_motion[fap]
        assert np.linalg.norm(difference) < 0.1 * np.linalg.norm(skin_motion[fap])


def test_many_loose_pieces_are_no_obstacle(
    source: AnimatableFace, head: tuple[FaceScene, FeaturePoints], skin_motion: dict[int, Floats]
) -> None:
    """Single triangles, lone vertices and far-off boxes beside the head."""
    scene, points = head
    skin = scene.shape("skin").mesh
    size = float(np.ptp(skin.vertices[:, 0]))
    random = np.random.default_rng(5)
    loose = [random.normal(size=(3, 3)) * 0.02 * size + random.normal(size=3) * size for _ in range(25)]
    more = PolyMesh.from_faces(np.concatenate([*loose, [[9.0 * size] * 3]]), np.arange(75).reshape(-1, 3).tolist())
    shapes = (*(replace(s, vertex_ids=None) for s in scene.shapes), Shape("dust", more))
    face, report = clone_with_report(source, replace(scene, roots=shapes), points, faps=FEW, backend="fmc")
    assert np.array_equal(face.scene.world_neutral()[-76:], more.vertices)
    assert sum(part.pieces for part in report.parts if part.shape == "dust") == 25
    for fap, offsets in motions(face).items():
        assert np.linalg.norm(offsets - skin_motion[fap]) < 0.02 * np.linalg.norm(skin_motion[fap])


def test_open_eyes_are_not_covered(source: AnimatableFace) -> None:
    scene, points = bare(source)
    face = prepare(scene, points, "target")
    assert covered_eyes(face.skin).filled == covered_eyes(face.skin).closed == ()
    place = points.positions(scene)
    front_of = front(face.skin, np.array([place["9.3"] / face.fapu.es0]))
    assert front_of == pytest.approx(place["9.3"][2] / face.fapu.es0, abs=0.02)


@pytest.mark.parametrize(("depth", "kind"), [(0.0, "filled"), (0.6, "closed")])
def test_skin_between_the_lids_is_told_from_a_crease(depth: float, kind: str) -> None:
    """A plane with the lids drawn on it, as it is and with a deep narrow groove along the lower lids."""
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, 41), np.linspace(-0.4, 0.4, 33), indexing="ij")
    z = np.where(np.abs(y + 0.05) < 0.01, -depth, 0.0)
    number = np.arange(x.size).reshape(x.shape)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    mesh = PolyMesh.from_faces(np.stack([x, y, z], axis=-1).reshape(-1, 3), quads.tolist())
    points = {}
    for side, lids in ((1.0, ("3.1", "3.3", "3.7", "3.11")), (-1.0, ("3.2", "3.4", "3.8", "3.12"))):
        for key, at in zip(lids, ((0.5, 0.1), (0.5, -0.1), (0.75, 0.0), (0.25, 0.0)), strict=True):
            vertex = int(np.argmin(np.hypot(mesh.vertices[:, 0] - side * at[0], mesh.vertices[:, 1] - at[1])))
            points[key] = FeaturePoint("wall", (vertex,), (1.0,))
    surface = build_surface(FaceScene((Shape("wall", mesh),)), FeaturePoints(points), ["wall"], 1.0)
    found = covered_eyes(surface)
    assert (found.filled, found.closed) == (((3, 5), ()) if kind == "filled" else ((), (3, 5)))
    inside = between_lids(surface, 3)
    assert inside.any()
    assert (np.abs(surface.vertices[inside, 0] - 0.5) < 0.25).all()


def test_lids_of_closed_eyes_rest_and_everything_else_moves() -> None:
    calm = np.array([0.0, 0.0, 0.5, 1.0])
    blink = np.array([[1.0, 0, 0], [0.8, 0, 0], [0.2, 0, 0], [0.0, 0, 0]])
    smile = np.array([[0.1, 0, 0], [0.1, 0, 0], [0.4, 0, 0], [1.0, 0, 0]])
    moved = np.stack([blink, smile], axis=1)
    calm_lids(moved, calm)
    assert not moved[:, 0].any()
    assert np.allclose(moved[:, 1, 0], [0.0, 0.0, 0.2, 1.0])


def test_a_mask_of_113_vertices_with_filled_eyes(shared: Path, source: AnimatableFace) -> None:
    """Candide-3: no eyes, a slit for a mouth."""
    scene = read_scene(shared / "faces" / "candide3" / "candide3.obj")
    face, report = clone_with_report(source, scene, read_landmarks(DATA / "candide3.fps.json", scene), faps=FEW)
    codes = {f.code for f in report.warnings()}
    assert {"sealed-left-eye", "sealed-right-eye", "no-eye-left", "no-lower-teeth"} <= codes
    assert "sealed-mouth" not in codes
    assert report.measures["fp_error_after"] < 0.005
    assert face.tables.get(JAW) is not None
