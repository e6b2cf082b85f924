"""OBJ: the file's own vertex order and polygons, exact round trips, errors that name the line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fba.errors import FbaError, InputFileError, MeshError, OutputFileError, TextSyntaxError
from fba.mesh import Material, PolyMesh
from fba.scene import FaceScene, Frame, Shape, Transform
from formats import gltf
from formats.obj import ObjDocument, read, write

SQUARE = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def parse(tmp_path: Path, text: bytes | str, name: str = "a.obj") -> FaceScene:
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read(path)


def counts(scene: FaceScene) -> tuple[int, int, int]:
    arities = np.concatenate([s.mesh.arities for s in scene.shapes])
    return scene.vertex_count, int((arities == 3).sum()), int((arities == 4).sum())


@pytest.mark.parametrize(
    ("file", "expected"),
    [
        ("makehuman/base.obj", (19158, 0, 18486)),
        ("soma/SOMA_wrap.obj", (18056, 0, 18054)),
        ("ict-facekit/generic_neutral_mesh.obj", (26719, 548, 25836)),
        ("candide3/candide3.obj", (113, 184, 0)),
        ("lee-perry-smith/lee_perry_smith.obj", (8838, 6, 8833)),
        ("mediapipe-canonical/canonical_face_model.obj", (468, 898, 0)),
        ("suzanne/suzanne.obj", (507, 32, 468)),
        ("ogre/ogre_head.obj", (30994, 61604, 0)),
        ("cheburashka/cheburashka.obj", (6669, 13334, 0)),
        ("walt-head/WaltHead.obj", (8146, 16160, 0)),
        ("rpm-brunette/neutral.obj", (2486, 4606, 0)),
        ("greta/greta_face.obj", (4631, 9138, 0)),
    ],
)
def test_real_faces_round_trip_bit_identical(
    shared: Path, tmp_path: Path, file: str, expected: tuple[int, int, int]
) -> None:
    scene = read(shared / "faces" / file)
    assert counts(scene) == expected
    write(scene, tmp_path / "out.obj")
    again = read(tmp_path / "out.obj")
    assert again.world_neutral().tobytes() == scene.world_neutral().tobytes()
    for one, two in zip(scene.shapes, again.shapes, strict=True):
        assert one.name == two.name
        assert_same_mesh(one.mesh, two.mesh)
        assert [m.name for m in one.materials] == [m.name for m in two.materials]


def assert_same_mesh(one: PolyMesh, two: PolyMesh) -> None:
    for name in ("indices", "offsets", "texcoord_indices", "normal_indices", "texcoords", "normals", "face_materials"):
        a, b = getattr(one, name), getattr(two, name)
        assert (a is None) == (b is None), name
        assert a is None or np.array_equal(a, b), name
    if one.face_groups is not None:
        assert two.face_groups is not None
        assert [one.group_names[i] for i in one.face_groups] == [two.group_names[i] for i in two.face_groups]


def test_groups_and_positions_of_makehuman_are_those_of_the_text(shared: Path) -> None:
    path = shared / "faces/makehuman/base.obj"
    scene = read(path)
    mesh = scene.shapes[0].mesh
    lines = path.read_text().splitlines()
    positions = [[float(x) for x in line.split()[1:]] for line in lines if line.startswith("v ")]
    assert np.array_equal(mesh.vertices, positions)
    group, number = "", 0
    for line in lines:
        if line.startswith("g "):
            group = line[2:].strip()
        if line.startswith("f "):
            assert mesh.face(number).tolist() == [int(c.split("/")[0]) - 1 for c in line.split()[1:]]
            assert mesh.group_names[mesh.face_groups[number]] == group
            number += 1
    assert number == 18486


def test_every_way_to_write_a_corner(tmp_path: Path) -> None:
    text = (
        SQUARE + b"vt .5 .25\nvt 1\nvn 0 0 1\nf 1 2 3 4\nf 1/1 2/2 3/1\nf 1//1 2//1 3//1\nf 1/1/1 2/2/1 3/1/1 4/2/1\n"
    )
    mesh = parse(tmp_path, text + b"f -4/-2/-1 -3/-1/-1 -2//-1\nf 1/ 2// 3\n").shapes[0].mesh
    assert [mesh.face(i).tolist() for i in range(6)] == [
        [0, 1, 2, 3], [0, 1, 2], [0, 1, 2], [0, 1, 2, 3], [0, 1, 2], [0, 1, 2],
    ]  # fmt: skip
    assert mesh.texcoord_indices.tolist() == [-1] * 4 + [0, 1, 0] + [-1] * 3 + [0, 1, 0, 1] + [0, 1, -1] + [-1] * 3
    assert mesh.normal_indices.tolist() == [-1] * 7 + [0] * 10 + [-1] * 3
    assert mesh.texcoords.tolist() == [[0.5, 0.25], [1.0, 0.0]]


def test_negative_indices_count_back_from_their_own_line(tmp_path: Path) -> None:
    scene = parse(tmp_path, SQUARE + b"f -4 -3 -2\nv 5 5 5\nf -1 -2 -3\n")
    assert scene.shapes[0].mesh.indices.tolist() == [0, 1, 2, 4, 3, 2]


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_line_ends_continuations_comments_colours_and_indents(tmp_path: Path, end: bytes) -> None:
    lines = [
        b"# a face # by hand", b"v 0 0 0 1 .5 0", b"\tv 1 0 0 1 .5 0   # corner", b"  v 1e0 1.0E+0 0 1 .5 1 ", b"",
        b"g Group #1 of 2", b"usemtl Skin #7", b"f 1 2 \\", b" 3", b"s off", b"vp 0.1", b"l 1 2", b"l 2 3", b"p 1",
    ]  # fmt: skip
    if end == b"\r":
        lines[7:9] = [b"f 1 2 3"]
    scene = parse(tmp_path, end.join(lines))
    mesh = scene.shapes[0].mesh
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0]]
    assert mesh.indices.tolist() == [0, 1, 2]
    assert mesh.group_names == ("Group #1 of 2",)
    assert scene.shapes[0].materials == (Material("Skin #7"),)
    document = scene.document
    assert isinstance(document, ObjDocument)
    assert document.colors.tolist() == [[1, 0.5, 0], [1, 0.5, 0], [1, 0.5, 1]]
    assert document.remarks == (
        "2 lines are skipped: only polygons are read",
        "1 points are skipped: only polygons are read",
    )
    write(scene, tmp_path / "b.obj")
    assert np.array_equal(read(tmp_path / "b.obj").document.colors, document.colors)


def test_objects_of_their_own_vertices_are_shapes(tmp_path: Path) -> None:
    text = (
        b"o skin\nv 0 0 0\nv 1 0 0\nv 1 1 0\no eye\nv 9 9 9\nv 0 0 1\nv 1 0 1\nv 1 1 1\n"
        b"usemtl white\nf 5 6 7\no skin\nusemtl pink\nf 1 2 3\no eye\ng back\nf 7 6 5\n"
    )
    scene = parse(tmp_path, text)
    assert [s.name for s in scene.shapes] == ["skin", "eye"]
    assert [s.vertex_ids.tolist() for s in scene.shapes] == [[0, 1, 2], [3, 4, 5, 6]]
    assert scene.world_neutral()[3].tolist() == [9, 9, 9]
    write(scene, tmp_path / "b.obj")
    again = read(tmp_path / "b.obj")
    assert [s.name for s in again.shapes] == ["skin", "eye"]
    assert [s.vertex_ids.tolist() for s in again.shapes] == [[0, 1, 2], [3, 4, 5, 6]]
    assert np.array_equal(again.world_neutral(), scene.world_neutral())
    assert again.document.indices.tolist() == [4, 5, 6, 0, 1, 2, 6, 5, 4]
    eye = again.shapes[1]
    assert [eye.mesh.group_names[i] for i in eye.mesh.face_groups] == ["default", "back"]
    assert [eye.materials[i].name for i in eye.mesh.face_materials] == ["white", "pink"]


def test_objects_that_share_vertices_stay_one_shape_with_groups(tmp_path: Path) -> None:
    scene = parse(tmp_path, SQUARE + b"o a\nf 1 2 3\no b\nf 1 3 4\n")
    assert [s.name for s in scene.shapes] == ["face"]
    assert scene.shapes[0].mesh.group_names == ("a", "b")


def test_a_split_turned_and_reversed_scene_goes_back_to_the_files_own_polygons(shared: Path, tmp_path: Path) -> None:
    source = read(shared / "faces/makehuman/base.obj")
    mesh = source.shapes[0].mesh
    axes = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])
    frame = Frame(axes, reversed_winding=True)
    mesh = replace(mesh, vertices=frame.from_file(mesh.vertices)).reversed()
    labels = mesh.components() % 3
    shapes = []
    for label in (2, 0, 1):
        part, ids = mesh.submesh(labels == label)
        shapes.append(Shape(f"part{label}", part, vertex_ids=ids))
    scene = replace(
        source, roots=(Transform("head", (shapes[0], shapes[1]), center=(1.0, 2.0, 3.0)), shapes[2]), frame=frame
    )
    write(scene, tmp_path / "out.obj")
    again = read(tmp_path / "out.obj")
    assert again.world_neutral().tobytes() == source.world_neutral().tobytes()
    assert_same_but_for_uv_order(again.shapes[0].mesh, source.shapes[0].mesh)
    assert [s.name for s in again.shapes] == ["face"]


def assert_same_but_for_uv_order(one: PolyMesh, two: PolyMesh) -> None:
    assert np.array_equal(one.indices, two.indices)
    assert np.array_equal(one.offsets, two.offsets)
    assert np.array_equal(one.texcoords[one.texcoord_indices], two.texcoords[two.texcoord_indices])
    assert [one.group_names[i] for i in one.face_groups] == [two.group_names[i] for i in two.face_groups]


def test_materials_come_from_the_library_beside_and_go_back(tmp_path: Path) -> None:
    (tmp_path / "skin.mtl").write_text(
        "newmtl skin\nKd 0.9 0.7 0.6\nKs .1 .2 .3\nKe 0 0 .5\nNs 64\nd 0.75\nmap_Kd -s 1 1 1 -clamp on my skin.png\n"
        "illum 2\nKd nonsense\nnewmtl unused\nTr 0.5\n"
    )
    text = b"mtllib ../elsewhere/skin.mtl\n" + SQUARE + b"f 1 2 3\nusemtl skin\nf 1 3 4\n"
    scene = parse(tmp_path, text)
    skin = Material("skin", (0.9, 0.7, 0.6), 0.2, (0.1, 0.2, 0.3), (0.0, 0.0, 0.5), 0.5, 0.25, "my skin.png")
    assert scene.shapes[0].materials == (skin,)
    assert scene.shapes[0].mesh.face_materials.tolist() == [-1, 0]
    write(scene, tmp_path / "out.obj")
    again = read(tmp_path / "out.obj")
    assert again.shapes[0].materials == (skin,)
    assert again.shapes[0].mesh.face_materials.tolist() == [-1, 0]


def test_a_library_stays_as_it_was_when_the_mesh_cannot_be_written(tmp_path: Path) -> None:
    mesh = PolyMesh.from_faces(np.eye(3), [[0, 1, 2]])
    mesh = replace(mesh, face_materials=np.zeros(1, dtype=np.int32))
    scene = FaceScene((Shape("face", mesh, materials=(Material("skin"),)),))
    (tmp_path / "head.obj").mkdir()
    (tmp_path / "head.mtl").write_text("precious")
    with pytest.raises(OutputFileError, match=r"head\.obj"):
        write(scene, tmp_path / "head.obj")
    assert (tmp_path / "head.mtl").read_text() == "precious"
    assert len(list(tmp_path.iterdir())) == 2


def test_several_shapes_of_another_format_become_objects(tmp_path: Path) -> None:
    tri = PolyMesh.from_faces(np.eye(3), [[0, 1, 2]])
    scene = FaceScene((Shape("left eye", tri), Transform("t", (Shape("right eye", tri),), translation=(1.0, 0.0, 0.0))))
    write(scene, tmp_path / "out.obj")
    again = read(tmp_path / "out.obj")
    assert [s.name for s in again.shapes] == ["left eye", "right eye"]
    assert np.array_equal(again.world_neutral(), scene.world_neutral())


@pytest.mark.parametrize(
    ("text", "error", "says"),
    [
        (b"", InputFileError, "empty"),
        (b"hello\nworld\n", InputFileError, "no vertex"),
        (SQUARE, InputFileError, "no polygon"),
        (b"\x00\x01\x02v 1 2 3\n", InputFileError, "binary"),
        (SQUARE + b"f 1 2 9\n", MeshError, "line 5.*9 is out of range: the file has 4"),
        (SQUARE + b"f 1 \\\n2 3\nf 1 0 3\n", MeshError, "line 7.*0 is out of range: indices count from 1"),
        (SQUARE + b"f -5 1 2\n", MeshError, "line 5.*-5 is out of range"),
        (SQUARE + b"f 1/1 2/1 3/1\n", MeshError, "line 5.*texture coordinate index 1"),
        (SQUARE + b"v 0 nan 0\nf 1 2 3\n", MeshError, "line 5.*finite"),
        (SQUARE + b"v 0 1e999 0\nf 1 2 3\n", MeshError, "line 5.*finite"),
        (SQUARE + b"v 0 1x 0\nf 1 2 3\n", TextSyntaxError, "line 5, column 5.*'1x'"),
        (SQUARE + b"v 0 1_0 0\nf 1 2 3\n", TextSyntaxError, "line 5, column 5.*'1_0'"),
        (SQUARE + b"v 0 1\nf 1 2 3\n", TextSyntaxError, "line 5.*at least 3"),
        (SQUARE + b"f 1 2 three\n", TextSyntaxError, "line 5, column 7.*'three'"),
        (SQUARE + b"f 1 2 3.5\n", TextSyntaxError, "line 5.*'3.5'"),
        (SQUARE + b"f 1/2/3/4 2 3\n", TextSyntaxError, "line 5.*corner"),
        (SQUARE + b"f /1 2 3\n", TextSyntaxError, "line 5.*corner"),
        (SQUARE + b"f 1 2 99999999999999999999999\n", TextSyntaxError, "line 5"),
        (SQUARE + b"f 1 2\n", InputFileError, "3 corners"),
    ],
)
def test_errors_say_what_and_where(tmp_path: Path, text: bytes, error: type[FbaError], says: str) -> None:
    with pytest.raises(error, match=says):
        parse(tmp_path, text)


def test_missing_file_and_folder(tmp_path: Path) -> None:
    for path in (tmp_path / "none.obj", tmp_path):
        with pytest.raises(InputFileError):
            read(path)


FINITE = st.floats(allow_nan=False, allow_infinity=False)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data(), count=st.integers(3, 12))
def test_any_mesh_round_trips_bit_identical(tmp_path: Path, data: st.DataObject, count: int) -> None:
    vertices = data.draw(st.lists(st.tuples(FINITE, FINITE, FINITE), min_size=count, max_size=count))
    faces = data.draw(st.lists(st.lists(st.integers(0, count - 1), min_size=3, max_size=6), min_size=1, max_size=6))
    mesh = PolyMesh.from_faces(vertices, faces)
    write(FaceScene((Shape("face", mesh),)), tmp_path / "m.obj")
    again = read(tmp_path / "m.obj").shapes[0].mesh
    assert again.vertices.tobytes() == mesh.vertices.tobytes()
    assert np.array_equal(again.indices, mesh.indices)
    assert np.array_equal(again.offsets, mesh.offsets)


GOOD = (
    b"mtllib x.mtl\no a\nv 0 0 0 1 1 1\nv 1 0 0 1 1 1\nv 1 1 0 0 0 0\nvt 0 0\nvn 0 0 1\ng one two\nusemtl m\n"
    b"f 1/1/1 2//1 3/1\ns 1\nf -3 -2 -1\n# end\n"
)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    start=st.integers(0, len(GOOD)),
    length=st.integers(0, 12),
    new=st.one_of(st.binary(max_size=12), st.text("vtnfo/ -.0123456789e\n\\#g_", max_size=12).map(str.encode)),
)
def test_damaged_text_never_fails_otherwise(tmp_path: Path, start: int, length: int, new: bytes) -> None:
    try:
        scene = parse(tmp_path, GOOD[:start] + new + GOOD[start + length :])
    except FbaError:
        return
    assert np.isfinite(scene.world_neutral()).all()


def test_vertex_colours_go_to_gltf_and_back(tmp_path: Path) -> None:
    colors = [[0.0, 0.02, 1.0], [0.5, 0.25, 0.75], [1.0, 0.9, 0.1]]
    points = ("0 0 0", "1 0 0", "0 1 0")
    rows = "".join(f"v {p} {' '.join(map(str, c))}\n" for p, c in zip(points, colors, strict=True))
    (tmp_path / "a.obj").write_text(rows + "f 1 2 3\n")
    scene = read(tmp_path / "a.obj")
    assert np.isclose(scene.vertex_attributes["color"][1, 0], 0.21404114)
    gltf.write(scene, tmp_path / "b.glb")
    write(gltf.read_foreign(tmp_path / "b.glb"), tmp_path / "c.obj")
    written = [line.split()[4:] for line in (tmp_path / "c.obj").read_text().splitlines() if line.startswith("v ")]
    assert np.allclose(np.array(written, float), colors, atol=1e-6)
    (tmp_path / "a.obj").write_text(rows.replace("0.9", "90") + "f 1 2 3\n")
    assert not read(tmp_path / "a.obj").vertex_attributes
