"""PLY, STL and OFF: exact round trips, foreign variants, damaged files."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fba.errors import FbaError, InputFileError, MeshError, TextSyntaxError, UnsupportedFeatureError
from fba.mesh import PolyMesh
from fba.scene import FaceScene, Frame, Shape
from formats import obj, off, ply, stl

REAL = ("makehuman/base.obj", "ict-facekit/generic_neutral_mesh.obj", "suzanne/suzanne.obj", "greta/greta_face.obj")


def parse(module: ModuleType, tmp_path: Path, data: bytes) -> FaceScene:
    path = tmp_path / f"a.{module.__name__.rsplit('.', 1)[-1]}"
    path.write_bytes(data)
    scene: FaceScene = module.read(path)
    return scene


@pytest.mark.parametrize("module", [ply, off])
@pytest.mark.parametrize("file", REAL)
def test_real_faces_round_trip(shared: Path, tmp_path: Path, module: ModuleType, file: str) -> None:
    scene = obj.read(shared / "faces" / file)
    path = tmp_path / "a.x"
    module.write(scene, path)
    again = module.read(path)
    assert again.world_neutral().tobytes() == scene.world_neutral().tobytes()
    assert np.array_equal(again.shapes[0].mesh.indices, scene.shapes[0].mesh.indices)
    assert np.array_equal(again.shapes[0].mesh.offsets, scene.shapes[0].mesh.offsets)


@pytest.mark.parametrize("module", [ply, off, stl, obj])
def test_writers_give_back_axes_and_winding_of_the_file(tmp_path: Path, module: ModuleType) -> None:
    mesh = PolyMesh.from_faces([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 4]], [[0, 2, 1], [0, 1, 3]])
    frame = Frame(np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]]), reversed_winding=True)
    inside = replace(mesh, vertices=frame.from_file(mesh.vertices)).reversed()
    scene = FaceScene((Shape("face", inside),), frame=frame)
    module.write(scene, tmp_path / "a.x")
    again = module.read(tmp_path / "a.x").shapes[0].mesh
    assert np.array_equal(again.vertices[again.triangles], mesh.vertices[mesh.triangles])


def test_stl_merges_equal_corners_and_says_so(shared: Path, tmp_path: Path) -> None:
    scene = obj.read(shared / "faces/rpm-brunette/neutral.obj")
    stl.write(scene, tmp_path / "a.stl")
    again = stl.read(tmp_path / "a.stl")
    mesh = scene.shapes[0].mesh
    assert again.vertex_count == len(np.unique(mesh.vertices.astype(np.float32), axis=0)) == 2347
    single = mesh.vertices.astype(np.float32).astype(np.float64)
    assert np.array_equal(again.shapes[0].mesh.vertices[again.shapes[0].mesh.triangles], single[mesh.triangles])
    assert "13818 corners of equal position were merged into 2347" in again.document.remarks[0]
    text = ["solid my face"]
    for corners in single[mesh.triangles][:500]:
        rows = "\n".join(f"   VERTEX {x!r} {y!r} {z!r}" for x, y, z in corners.tolist())
        text.append(f" facet normal 0 0 0\n  outer loop\n{rows}\n  endloop\n endfacet")
    ascii_ = parse(stl, tmp_path, "\n".join([*text, "endsolid my face"]).encode()).shapes[0].mesh
    assert np.array_equal(ascii_.vertices[ascii_.triangles], single[mesh.triangles[:500]])


PLY_ASCII = (
    b"ply\nformat ascii 1.0\ncomment by hand\nelement extra 1\nproperty list uchar int what\nproperty float f\n"
    b"element vertex 5\nproperty uchar red\nproperty float x\nproperty float y\nproperty double z\n"
    b"element face 3\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nelement edge 1\n"
    b"property int vertex1\nproperty int vertex2\nend_header\n2 8 8 0.5\n"
    b"255 0 0 0\n255 1 0 0\n255 1 1 0.1\n255 0 1 0\n1 9 9 9\n4 0 1 2 3 0\n3 0 1 2 2 0.5 0.5\n2 0 1 0\n0 1\n"
)


def binary_ply(order: str) -> bytes:
    name = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    head, _ = PLY_ASCII.split(b"end_header\n")
    body = struct.pack(order + "Bii f", 2, 8, 8, 0.5)
    for red, x, y, z in ((255, 0, 0, 0), (255, 1, 0, 0), (255, 1, 1, 0.1), (255, 0, 1, 0), (1, 9, 9, 9)):
        body += struct.pack(order + "Bffd", red, x, y, z)
    body += struct.pack(order + "B4iB", 4, 0, 1, 2, 3, 0) + struct.pack(order + "B3iB2f", 3, 0, 1, 2, 2, 0.5, 0.5)
    body += struct.pack(order + "B2iB", 2, 0, 1, 0) + struct.pack(order + "ii", 0, 1)
    return head.replace(b"ascii", name.encode()) + b"end_header\n" + body


@pytest.mark.parametrize("data", [PLY_ASCII, PLY_ASCII.replace(b"\n", b"\r\n"), binary_ply("<"), binary_ply(">")])
def test_ply_variants(tmp_path: Path, data: bytes) -> None:
    scene = parse(ply, tmp_path, data)
    mesh = scene.shapes[0].mesh
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0.1], [0, 1, 0], [9, 9, 9]]
    assert [mesh.face(i).tolist() for i in range(mesh.face_count)] == [[0, 1, 2, 3], [0, 1, 2]]
    assert "1 polygons with fewer than 3 corners" in scene.document.remarks[0]


def test_ply_of_huge_polygons_round_trips(tmp_path: Path) -> None:
    angle = np.linspace(0, 6, 300)
    ring = PolyMesh.from_faces(np.stack([np.cos(angle), np.sin(angle), angle], axis=1), [list(range(300)), [0, 1, 2]])
    ply.write(FaceScene((Shape("face", ring),)), tmp_path / "a.ply")
    again = ply.read(tmp_path / "a.ply").shapes[0].mesh
    assert np.array_equal(again.indices, ring.indices)
    assert again.vertices.tobytes() == ring.vertices.tobytes()


@pytest.mark.parametrize(
    "text",
    [
        b"OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n3 0 1 2\n",
        b"# c\nOFF # here\n\n# there\n4 2 5\n0 0 0\n\n1 0 0 # x\n1 1 0\n0 1 0\n4 0 1 2 3 0.5 0.5 0.5\n3 0 1 2 7\n# end",
        b"COFF\r\n4 2 0\r\n0 0 0 255 0 0 1\r\n1 0 0 0 0 0 1\r\n1 1 0 9 9 9 9\r\n0 1 0 0 0 0 0\r\n4 0 1 2 3\r\n3 0 1 2",
        b"NOFF 4 2 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n1 1 0 0 0 1\n0 1 0 0 0 1\n4 0 1 2 3\n3 0 1 2\n",
    ],
)
def test_off_variants(tmp_path: Path, text: bytes) -> None:
    mesh = parse(off, tmp_path, text).shapes[0].mesh
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert [mesh.face(i).tolist() for i in range(2)] == [[0, 1, 2, 3], [0, 1, 2]]


BINARY_STL = b"solid no".ljust(80) + struct.pack("<I", 1) + struct.pack("<12fH", *[0.0] * 6, 1.0, 0, 0, 0, 1.0, 0, 0)


@pytest.mark.parametrize(
    ("module", "data", "error", "says"),
    [
        (ply, b"", InputFileError, "empty"),
        (ply, b"hello", InputFileError, "not a PLY"),
        (ply, PLY_ASCII.replace(b"element face 3", b"element face x"), InputFileError, "'element face x'"),
        (ply, PLY_ASCII.replace(b"format ascii 1.0\n", b""), InputFileError, "format"),
        (ply, PLY_ASCII.replace(b"vertex 5", b"vertex 99999999999"), InputFileError, "cut"),
        (ply, binary_ply("<").replace(b"vertex 5", b"vertex 99999999999"), InputFileError, "cut"),
        (ply, binary_ply(">")[:-9], InputFileError, "cut"),
        (ply, PLY_ASCII.replace(b"3 0 1 2 2", b"3 0 1 8 2"), MeshError, "polygon 1 .* uses vertex 8; the file has 5"),
        (ply, PLY_ASCII.replace(b"255 1 1 0.1", b"255 1 inf 0.1"), MeshError, "vertex 2"),
        (ply, PLY_ASCII.replace(b"0.5 0.5", b"0.5 x"), InputFileError, "damaged"),
        (ply, PLY_ASCII.replace(b"element face", b"element faces"), InputFileError, "no face element"),
        (ply, PLY_ASCII.replace(b"property float x", b"property float u"), InputFileError, "no x, y and z"),
        (ply, PLY_ASCII.replace(b"element edge", b"element tristrips"), UnsupportedFeatureError, "strips"),
        (stl, b"\x00\x01", InputFileError, "not an STL"),
        (stl, BINARY_STL[:-1], InputFileError, "not an STL file, or cut|cut|no triangles"),
        (stl, b"solid x\nfacet\nvertex 0 0 0\nendsolid", InputFileError, "is cut: 1 triangles need 3 corners"),
        (stl, b"solid x\nfacet\nvertex 0 0 0\nvertex 1 0 y\nvertex 0 1 0\nendsolid", TextSyntaxError, "line 4.*'y'"),
        (stl, b"solid x\nfacet\nvertex 0 0\nvertex 1 0 0\nvertex 0 1 0\nendsolid", TextSyntaxError, "three numbers"),
        (stl, b"solid empty\nendsolid empty\n", InputFileError, "no triangles"),
        (stl, BINARY_STL.replace(struct.pack("<f", 1.0), struct.pack("<f", np.nan)), MeshError, "finite"),
        (off, b"4 2 0\n", InputFileError, "does not begin with 'OFF'"),
        (off, b"OFF BINARY\n", UnsupportedFeatureError, "binary"),
        (off, b"4OFF\n", UnsupportedFeatureError, "four"),
        (off, b"OFF\n", InputFileError, "numbers of vertices"),
        (off, b"OFF\n3 1 0\n0 0 0\n1 0 0\n", InputFileError, "cut"),
        (off, b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", MeshError, "uses vertex 3"),
        (off, b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 x 0\n3 0 1 2\n", TextSyntaxError, "line 5, column 3"),
        (off, b"OFF\n3 1 0\n0 0 0\n1 0\n0 1 0\n3 0 1 2\n", TextSyntaxError, "line 4.*three numbers"),
        (off, b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n9 0 1 2\n", TextSyntaxError, "line 6.*number of corners"),
        (off, b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 1.5\n", TextSyntaxError, "line 6.*vertex number"),
        (off, b"OFF\n0 0 0\n", InputFileError, "no mesh"),
    ],
)
def test_errors_say_what_and_where(
    tmp_path: Path, module: ModuleType, data: bytes, error: type[FbaError], says: str
) -> None:
    with pytest.raises(error, match=says):
        parse(module, tmp_path, data)


def test_stl_refuses_what_single_precision_cannot_hold(tmp_path: Path) -> None:
    mesh = PolyMesh.from_faces(np.eye(3) * 1e39, [[0, 1, 2]])
    with pytest.raises(UnsupportedFeatureError, match="single-precision"):
        stl.write(FaceScene((Shape("face", mesh),)), tmp_path / "a.stl")
    assert list(tmp_path.iterdir()) == []


OFF_TEXT = b"COFF\n4 2 0\n0 0 0 1\n1 0 0 1\n1 1 0 1\n0 1 0 1\n4 0 1 2 3\n3 0 1 2\n"
STL_TEXT = (
    b"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n"
)
GOOD = (
    (ply, PLY_ASCII),
    (ply, binary_ply("<")),
    (ply, binary_ply(">")),
    (off, OFF_TEXT),
    (stl, STL_TEXT),
    (stl, BINARY_STL),
)


@settings(max_examples=250, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    good=st.sampled_from(GOOD),
    where=st.floats(0, 1),
    length=st.integers(0, 10),
    new=st.one_of(st.binary(max_size=10), st.text("0123456789.- \ninfa_e", max_size=10).map(str.encode)),
)
def test_damaged_files_are_read_or_refused(
    tmp_path: Path, good: tuple[ModuleType, bytes], where: float, length: int, new: bytes
) -> None:
    module, data = good
    start = int(where * len(data))
    try:
        scene = parse(module, tmp_path, data[:start] + new + data[start + length :])
    except FbaError:
        return
    assert np.isfinite(scene.world_neutral()).all()
