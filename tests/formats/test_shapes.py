"""Morph targets in folders, .npz and glTF: the same numbers in the file's own order, and clear refusals."""

from __future__ import annotations

import gzip
import io
import time
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fba.errors import FbaError, InputFileError, MeshError, OutputFileError, TextSyntaxError, UnknownFormatError
from fba.mesh import Material, PolyMesh
from fba.orientation import turn_scene
from fba.scene import FaceScene, Shape, Transform
from fba.shapes import ShapeSet
from formats import gltf, obj
from formats.shapes import read_shapes, write_shapes

MESH = PolyMesh.from_faces([[0, 0, 0], [1, 0, 0.1], [1, 1, 0.3], [0, 1, 0]], [[0, 1, 2, 3]])
SCENE = FaceScene((Shape("face", MESH, materials=(Material("skin"),)),))
RNG = np.random.default_rng(3)
SHAPES = ShapeSet(("smile", "jaw open"), MESH.vertices, RNG.normal(size=(2, 4, 3)))


def test_npz_is_exact_and_the_same_bytes_every_time(tmp_path: Path) -> None:
    write_shapes(SHAPES, SCENE, tmp_path / "a.npz")
    first = (tmp_path / "a.npz").read_bytes()
    time.sleep(0.01)
    write_shapes(SHAPES, SCENE, tmp_path / "a.npz")
    assert (tmp_path / "a.npz").read_bytes() == first
    back = read_shapes(tmp_path / "a.npz", SCENE)
    assert back.names == SHAPES.names
    assert back.deltas.tobytes() == SHAPES.deltas.tobytes()
    arrays = np.load(tmp_path / "a.npz")
    assert arrays["names"].tolist() == ["smile", "jaw open"]
    assert np.array_equal(arrays["neutral"], MESH.vertices)
    with zipfile.ZipFile(tmp_path / "a.npz") as archive:
        assert {e.date_time for e in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}


def test_folder_of_obj_goes_out_and_in(tmp_path: Path) -> None:
    folder = tmp_path / "shapes"
    write_shapes(SHAPES, SCENE, folder)
    assert sorted(p.name for p in folder.iterdir()) == ["jaw open.obj", "materials.mtl", "smile.obj"]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["shapes"]
    back = read_shapes(folder, SCENE)
    assert back.names == ("jaw open", "smile")
    assert np.abs(back.deltas[::-1] - SHAPES.deltas).max() < 1e-15
    one = obj.read(folder / "smile.obj")
    assert one.shapes[0].mesh.vertices.tobytes() == (SHAPES.neutral + SHAPES.deltas[0]).tobytes()
    assert one.shapes[0].mesh.indices.tolist() == [0, 1, 2, 3]
    assert one.shapes[0].materials[0].name == "skin"
    obj.write(SCENE, folder / "neutral.obj")
    write_shapes(SHAPES, SCENE, folder)
    assert read_shapes(folder, SCENE).names == ("jaw open", "smile")


def test_targets_stay_in_the_files_own_axes_and_order(shared: Path, tmp_path: Path) -> None:
    scene = obj.read(shared / "faces/ict-facekit/generic_neutral_mesh.obj")
    truth = np.load(shared / "faces/ict-facekit/expressions.npz")
    mesh = scene.shapes[0].mesh
    parts = [mesh.submesh(mesh.components() % 2 == k) for k in (1, 0)]
    materials = scene.shapes[0].materials
    shapes = tuple(Shape(f"s{k}", m, materials=materials, vertex_ids=i) for k, (m, i) in enumerate(parts))
    split = replace(scene, roots=(Transform("head", shapes, center=(1.0, 2.0, 3.0)),))
    turned = turn_scene(split, np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]), reverse=True)
    back = read_shapes(shared / "faces/ict-facekit/expressions.npz", turned)
    assert back.names == tuple(truth["names"].tolist())
    assert np.array_equal(back.deltas, truth["deltas"])
    assert back.neutral.tobytes() == mesh.vertices.tobytes()
    few = ShapeSet(back.names[:2], back.neutral, back.deltas[:2])
    write_shapes(few, turned, tmp_path / "out")
    one = obj.read(tmp_path / "out" / f"{few.names[0]}.obj")
    assert one.world_neutral().tobytes() == (few.neutral + few.deltas[0]).tobytes()
    assert np.array_equal(one.shapes[0].mesh.indices, mesh.indices)
    assert [m.name for m in one.shapes[0].materials] == [m.name for m in materials]


def test_folder_of_real_targets(shared: Path, tmp_path: Path) -> None:
    folder = shared / "faces/ict-facekit"
    scene = obj.read(folder / "generic_neutral_mesh.obj")
    shapes = read_shapes(folder, scene)
    assert shapes.names == ("eyeBlink_L", "jawOpen", "mouthSmile_L")
    truth = np.load(folder / "expressions.npz")
    for name, deltas in zip(shapes.names, shapes.deltas, strict=True):
        assert np.abs(deltas - truth["deltas"][truth["names"].tolist().index(name)]).max() < 1e-5


def test_makehuman_targets(shared: Path) -> None:
    folder = shared / "faces/makehuman"
    scene = obj.read(folder / "base.obj")
    shapes = read_shapes(folder / "expression_units/caucasian", scene)
    assert len(shapes.names) == 34
    assert "mouth-open" in shapes.names
    text = gzip.decompress((folder / "expression_units/caucasian/mouth-open.target.gz").read_bytes()).decode()
    rows = [line.split() for line in text.splitlines() if line and not line.startswith("#")]
    deltas = shapes.deltas[shapes.names.index("mouth-open")]
    assert np.count_nonzero(deltas.any(axis=1)) <= len(rows)
    for vertex, *offset in rows[::50]:
        assert deltas[int(vertex)].tolist() == [float(o) for o in offset]


def test_gltf_targets_fit_the_whole_file_and_the_meshes_that_carry_them(shared: Path) -> None:
    folder = shared / "faces/rpm-brunette"
    truth = np.load(folder / "expressions.npz")
    shapes = read_shapes(folder / "brunette-t.glb", obj.read(folder / "neutral.obj"))
    assert shapes.names == tuple(truth["names"].tolist())
    assert np.array_equal(shapes.deltas, truth["deltas"])
    whole = read_shapes(folder / "brunette-t.glb", gltf.read(folder / "brunette-t.glb"))
    assert np.array_equal(whole.deltas[:, :2486], truth["deltas"])
    assert not whole.deltas[:, 2486:].any()


def npz(**arrays: np.ndarray) -> bytes:
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


@pytest.mark.parametrize(
    ("data", "error", "says"),
    [
        (b"", InputFileError, "empty"),
        (b"PK\x03\x04 nonsense", InputFileError, "not a readable .npz"),
        (npz(names=np.array(["a"])), InputFileError, "no array 'deltas'"),
        (npz(names=np.array(["a", "b"]), deltas=np.zeros((1, 4, 3))), InputFileError, "2 names do not fit"),
        (npz(names=np.array([1]), deltas=np.zeros((1, 4, 3))), InputFileError, "text"),
        (npz(names=np.array(["a"], dtype=object), deltas=np.zeros((1, 4, 3))), InputFileError, "readable"),
        (npz(names=np.array(["a"]), deltas=np.zeros((1, 5, 3))), MeshError, "5 vertices, but the neutral face has 4"),
        (npz(names=np.array(["a"]), deltas=np.full((1, 4, 3), np.nan)), MeshError, "finite"),
        (npz(names=np.array(["a", "a"]), deltas=np.zeros((2, 4, 3))), MeshError, "same name"),
        (npz(names=np.zeros(0, dtype="U1"), deltas=np.zeros((0, 4, 3))), InputFileError, "no morph targets"),
    ],
)
def test_bad_npz_is_refused(tmp_path: Path, data: bytes, error: type[FbaError], says: str) -> None:
    (tmp_path / "a.npz").write_bytes(data)
    with pytest.raises(error, match=says):
        read_shapes(tmp_path / "a.npz", SCENE)


def test_bad_folders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputFileError, match="does not exist"):
        read_shapes(tmp_path / "none", SCENE)
    with pytest.raises(InputFileError, match="no morph targets"):
        read_shapes(tmp_path, SCENE)
    (tmp_path / "x.fbx").write_bytes(b"x")
    with pytest.raises(UnknownFormatError):
        read_shapes(tmp_path / "x.fbx", SCENE)
    (tmp_path / "smile.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(MeshError, match=r"smile\.obj has 3 vertices, but the neutral face has 4"):
        read_shapes(tmp_path, SCENE)
    (tmp_path / "smile.obj").unlink()
    for text, error in (("4 0 0 0\n", MeshError), ("1 0 0\n", TextSyntaxError), ("1 0 0 x\n", TextSyntaxError)):
        (tmp_path / "a.target").write_text("# a target\n0 1 2 3\n" + text)
        with pytest.raises(error, match=r"a\.target"):
            read_shapes(tmp_path, SCENE)


def test_writing_refuses_what_cannot_be(tmp_path: Path) -> None:
    bad = ShapeSet(("a/b",), MESH.vertices, np.zeros((1, 4, 3)))
    with pytest.raises(OutputFileError, match="a/b"):
        write_shapes(bad, SCENE, tmp_path / "out")
    with pytest.raises(UnknownFormatError):
        write_shapes(SHAPES, SCENE, tmp_path / "out.glb")
    with pytest.raises(OutputFileError):
        write_shapes(SHAPES, SCENE, tmp_path / "no" / "out")
    with pytest.raises(OutputFileError):
        write_shapes(SHAPES, SCENE, tmp_path / "no" / "out.npz")
    assert list(tmp_path.iterdir()) == []


GOOD = npz(names=np.array(["a"]), deltas=np.zeros((1, 4, 3)))


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(start=st.integers(0, len(GOOD)), length=st.integers(0, 8), new=st.binary(max_size=8))
def test_damaged_npz_is_read_or_refused(tmp_path: Path, start: int, length: int, new: bytes) -> None:
    (tmp_path / "a.npz").write_bytes(GOOD[:start] + new + GOOD[start + length :])
    try:
        shapes = read_shapes(tmp_path / "a.npz", SCENE)
    except FbaError:
        return
    assert np.isfinite(shapes.deltas).all()
