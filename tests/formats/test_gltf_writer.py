"""glTF that the toolkit writes: what is in the file agrees with the face, and reads back as it was."""

from __future__ import annotations

import base64
import hashlib
import json
import math
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from faces import assert_same_face, assert_same_scene, skin_mesh, small_face, small_scene
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fat import AnimatableFace, FaceDefMesh, FaceDefTable, FaceDefTables, Player
from fat.intervals import interval_weights
from fba import FaceScene, Frame, Material, PolyMesh, Role, Shape, Transform
from fba.errors import FapStreamError, FbaError, InputFileError, MeshError, UnsupportedFeatureError
from fba.scene import rotation_matrix, translation_matrix
from fba.shapes import ShapeSet
from fba.stream import FapStream
from formats import gltf, obj, read, read_face, write
from formats.colors import from_linear, to_linear
from formats.gltf.buffers import Buffer, to_single
from formats.gltf.data import GltfData
from formats.gltf.nodes import Nodes
from formats.gltf.own import Pack, Unpack
from formats.gltf.own_reader import CHANGED
from formats.gltf.primitives import split
from formats.node_motion import quaternion_of
from formats.shapes import read_shapes
from formats.targets import border_weights, table_borders, table_targets, target_weights
from formats.textures import place_textures, texture_bytes

PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)


def parts(path: Path) -> tuple[dict[str, Any], bytes]:
    """JSON and binary chunk of a .glb."""
    data = path.read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def save(path: Path, document: dict[str, Any], data: bytes) -> None:
    """The counterpart of `parts`."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I", len(text)) + b"JSON" + text + struct.pack("<I", len(data)) + b"BIN\0" + data
    path.write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body)


@pytest.mark.parametrize("borders", [[0, 500], [-500, 0], [-900, -300, 0, 200, 600], [0, 100, 900], [-900, -100, 0]])
def test_weights_of_the_borders_are_the_standards_intervals(borders: list[int]) -> None:
    random = np.random.default_rng(3)
    values = np.concatenate([np.linspace(-1500, 1500, 61), borders]).astype(float)
    slopes = random.normal(size=(len(borders) - 1, 3))
    at_borders = interval_weights(np.array(borders), borders) @ slopes
    faded = border_weights(np.array(borders), values) @ at_borders
    assert np.allclose(faded, interval_weights(np.array(borders), values) @ slopes, rtol=0, atol=1e-9)


def test_targets_and_weights_together_are_what_the_player_shows() -> None:
    """Also where a table has two meshes over one shape, with other borders and a vertex in both."""
    face = small_face()
    random = np.random.default_rng(5)
    more = tuple(
        FaceDefMesh("skin", np.array(borders), np.array(index), random.normal(size=(len(index), len(borders) - 1, 3)))
        for borders, index in (([0, 300, 900], [0, 4]), ([-700, 0], [4, 5]), ([-600, -100, 0, 900], [6]))
    )
    face = replace(face, tables=FaceDefTables((*face.tables, FaceDefTable(51, 1, more))))
    values = np.array([-1200, -400, -50, 0, 150, 299, 600, 2000])
    stream = FapStream.build(25.0, len(values), {3: values, 5: values[::-1], 51: values})
    player = Player(face, rules=())
    targets = table_targets(face)
    borders = {number: table_borders(table) for number, table in enumerate(face.tables)}
    for shape in face.scene.shapes:
        weights = target_weights(targets[shape.name], borders, player.table_values(stream))
        moved = np.tile(shape.mesh.vertices, (len(values), 1, 1))
        for column, target in enumerate(targets[shape.name]):
            moved[:, target.index] += weights[:, column, None, None] * target.offsets
        expected = [pose.local[shape.name] for pose in player.frames(stream)]
        assert np.allclose(moved, expected, rtol=0, atol=1e-9)
    names = [target.name for target in targets["skin"]]
    assert names[:2] == ["viseme_PP", "expression_surprise"]
    assert {"fap_03_open_jaw_400", "fap_05_raise_b_midlip_neg_1860", "fap_51_lower_t_midlip_o_neg_600"} <= set(names)
    assert len(set(names)) == len(names)


def test_nodes_without_centres_stand_where_the_transforms_do() -> None:
    random = np.random.default_rng(11)

    def transform(name: str, child: Shape | Transform) -> Transform:
        t, s, c = random.normal(size=(3, 3)).tolist()
        r, so = random.normal(size=(2, 4)).tolist()
        return Transform(name, (child,), t, r, s, so, c)  # type: ignore[arg-type]

    node: Shape | Transform = Shape("mesh", skin_mesh())
    plain = Transform("plain", (node,), rotation=(0.0, 0.0, 2.0, 0.4), center=(1.0, 2.0, 3.0))
    scene = FaceScene((transform("a", transform("b", plain)),))
    entries = Nodes(scene, lambda shape: 0).entries
    parents = {child: k for k, entry in enumerate(entries) for child in entry.get("children", ())}
    matrix = np.eye(4)
    at = next(k for k, entry in enumerate(entries) if "mesh" in entry)
    while at != 0:
        at = parents[at]
        entry = entries[at]
        x, y, z, w = entry.get("rotation", (0.0, 0.0, 0.0, 1.0))
        assert x * x + y * y + z * z + w * w == pytest.approx(1.0, abs=1e-12)
        turn = rotation_matrix((x, y, z, 2.0 * math.atan2(math.hypot(x, y, z), w)))
        scale = np.diag([*entry.get("scale", (1.0, 1.0, 1.0)), 1.0])
        matrix = translation_matrix(tuple(entry.get("translation", (0.0, 0.0, 0.0)))) @ turn @ scale @ matrix
    assert np.allclose(matrix, scene.world_matrix("mesh"), rtol=0, atol=1e-9)


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, -2, 3)])
@pytest.mark.parametrize("angle", [0.0, 1e-9, 1.0, math.pi, -2.5])
def test_a_quaternion_is_its_matrix(axis: tuple[int, int, int], angle: float) -> None:
    found = quaternion_of(rotation_matrix((*axis, angle))[:3, :3])
    length = math.sqrt(sum(a * a for a in axis))
    expected = np.array([*(math.sin(angle / 2) * a / length for a in axis), math.cos(angle / 2)])
    assert min(np.abs(found - expected).max(), np.abs(found + expected).max()) < 1e-7


def test_vertices_are_split_only_where_something_differs() -> None:
    mesh = skin_mesh()
    shape = small_scene().shape("skin")
    primitives = split(shape, mesh.vertex_normals())
    assert [p.material for p in primitives] == [0, 1]
    corners = [(int(v), int(t), int(mesh.face_materials[f]))  # type: ignore[index]
               for f in range(mesh.face_count)
               for v, t in zip(mesh.face(f), mesh.texcoord_indices[mesh.offsets[f]:mesh.offsets[f + 1]], strict=True)]  # type: ignore[index]  # fmt: skip
    assert sum(len(p.vertices) for p in primitives) == len(set(corners))
    triangles = np.concatenate([p.vertices[p.triangles] for p in primitives])
    assert sorted(map(tuple, triangles)) == sorted(map(tuple, mesh.triangles))
    bare = split(Shape("ball", small_scene().shape("teeth").mesh), np.zeros((6, 3)))
    assert [len(p.vertices) for p in bare] == [6]
    assert bare[0].material == -1
    assert np.array_equal(bare[0].normals, np.tile([0.0, 0.0, 1.0], (6, 1)))


def test_offsets_are_sparse_where_that_is_smaller() -> None:
    for changed, sparse in ((10, True), (850, True), (870, False), (1000, False)):
        buffer = Buffer()
        rows = np.arange(changed)
        values = to_single(np.random.default_rng(1).normal(size=(changed, 3)))
        first, second = buffer.offsets(1000, rows, [values, 2 * values])
        assert ("sparse" in buffer.accessors[first]) == sparse
        assert len(buffer.data()) <= 2 * 12_000
        assert buffer.accessors[second]["max"] == np.maximum(2 * values, 0 if changed < 1000 else -9).max(0).tolist()
    assert [buffer.zeros(5), buffer.zeros(5)] == [2, 2]


def test_other_programs_see_the_same_face(tmp_path: Path) -> None:
    """Read as a file of any origin, by the reader for those: positions, uv, colours, offsets, normals that turn."""
    face = small_face()
    path = tmp_path / "a.glb"
    write(face, path)
    scene = gltf.read_foreign(path)
    assert [s.name for s in scene.shapes] == [s.name for s in face.scene.shapes]
    document, _ = parts(path)
    data = GltfData(path)
    for mesh, shape in zip(document["meshes"], face.scene.shapes, strict=True):
        primitives = mesh["primitives"]
        ids = [data.accessor(p["attributes"]["_VERTEX"], "SCALAR").ravel().astype(int) for p in primitives]
        vertices = np.concatenate(ids)
        world = face.scene.world_vertices(shape.name)[vertices] * 0.1
        assert np.allclose(scene.world_vertices(shape.name), world, rtol=0, atol=1e-6)
        found = scene.shape(shape.name)
        assert np.allclose(found.materials[0].diffuse, shape.materials[0].diffuse, atol=1e-6)
        if shape.mesh.texcoords is not None:
            assert found.mesh.texcoords is not None
            assert np.allclose(np.unique(found.mesh.texcoords, axis=0), np.unique(shape.mesh.texcoords, axis=0))
        for target in table_targets(face)[shape.name]:
            assert isinstance(scene.document, gltf.GltfDocument)
            expected = np.zeros((shape.mesh.vertex_count, 3))
            expected[target.index] = target.offsets
            offsets = scene.document.targets[shape.name][target.name]
            assert np.allclose(offsets, expected[vertices], rtol=1e-6, atol=1e-9)
    teeth = document["meshes"][[s.name for s in face.scene.shapes].index("teeth")]
    target = teeth["primitives"][0]["targets"][teeth["extras"]["targetNames"].index("fap_03_open_jaw_1080")]
    rest = data.accessor(teeth["primitives"][0]["attributes"]["NORMAL"], "VEC3")
    turned = rest + data.accessor(target["NORMAL"], "VEC3")
    moved = Player(face, rules=()).pose({3: 1080}).local["teeth"]
    assert np.allclose(turned, face.scene.shape("teeth").mesh.vertex_normals(moved), atol=1e-6)


@pytest.mark.parametrize("axes", [np.eye(3), [[0, 1, 0], [0, 0, 1], [1, 0, 0]], [[-1, 0, 0], [0, 1, 0], [0, 0, 1]]])
@pytest.mark.parametrize("name", ["face.glb", "a face, 100%.gltf"])
def test_a_face_in_any_axes_reads_back_exactly(axes: object, name: str, tmp_path: Path) -> None:
    face = small_face(Frame(np.array(axes, dtype=float), True))
    write(face, tmp_path / name, FapStream.build(25.0, 3, {3: [0, 100, 200]}))
    assert_same_face(read_face(tmp_path / name), face)
    expected = [name] if name.endswith(".glb") else sorted([name, name.replace(".gltf", ".bin")])
    assert sorted(p.name for p in tmp_path.iterdir()) == expected


def test_a_node_goes_with_the_lower_teeth(tmp_path: Path) -> None:
    face = read_face("default")
    face = replace(face, tables=FaceDefTables(tuple(t for t in face.tables if t.fap_id in (3, 14, 15))))
    stream = FapStream.build(10.0, 3, {3: [0, 300, 900], 14: [0, 200, 0], 15: [0, 0, -300]})
    write(face, tmp_path / "a.glb", stream)
    document, _ = parts(tmp_path / "a.glb")
    number = next(k for k, node in enumerate(document["nodes"]) if node["name"] == "jaw")
    data = GltfData(tmp_path / "a.glb")
    (animation,) = document["animations"]
    keys = {}
    for channel in animation["channels"]:
        if channel["target"]["node"] == number:
            kind = {"translation": "VEC3", "rotation": "VEC4"}[channel["target"]["path"]]
            output = animation["samplers"][channel["sampler"]]["output"]
            keys[channel["target"]["path"]] = data.accessor(output, kind)
    (teeth,) = face.scene.with_role(Role.LOWER_TEETH)
    rest = teeth.mesh.vertices
    assert np.allclose(document["nodes"][number]["translation"], rest.mean(axis=0))
    for frame, pose in enumerate(Player(face).frames(stream)):
        x, y, z, w = keys["rotation"][frame]
        turn = rotation_matrix((x, y, z, 2 * np.arctan2(np.linalg.norm([x, y, z]), w)))[:3, :3]
        placed = (rest - rest.mean(axis=0)) @ turn.T + keys["translation"][frame]
        assert np.abs(placed - pose.local[teeth.name]).max() < 0.02 * face.fapu.mns0
    assert np.ptp(keys["translation"][:, 1]) > 0.2 * face.fapu.mns0


def test_a_plain_scene_keeps_its_polygons(tmp_path: Path) -> None:
    write(small_scene(), tmp_path / "a.glb")
    found = read(tmp_path / "a.glb")
    assert isinstance(found, FaceScene)
    assert_same_scene(found, small_scene())


def test_a_stream_becomes_an_animation(tmp_path: Path) -> None:
    face = small_face()
    values = [0, 300, 900]
    stream = FapStream.build(10.0, 3, {3: values, 23: [0, 20000, -20000]})
    write(face, tmp_path / "a.glb", replace(stream, frame_numbers=np.array([4, 5, 7])))
    document, _ = parts(tmp_path / "a.glb")
    data = GltfData(tmp_path / "a.glb")
    (animation,) = document["animations"]
    keys = {}
    for channel in animation["channels"]:
        sampler = animation["samplers"][channel["sampler"]]
        target = channel["target"]
        keys[document["nodes"][target["node"]]["name"], target["path"]] = sampler["output"]
        assert np.allclose(data.accessor(sampler["input"], "SCALAR").ravel(), [0.0, 0.1, 0.3])
    jaw = {("jaw", "translation"), ("jaw", "rotation")}
    assert set(keys) == {("skin", "weights"), ("teeth", "weights"), ("eye_left_yaw", "rotation")} | jaw
    weights = data.accessor(keys["teeth", "weights"], "SCALAR").reshape(3, -1)
    names = document["meshes"][-1]["extras"]["targetNames"]
    jaw = weights[:, [names.index(f"fap_03_open_jaw_{b}") for b in (400, 1080)]]
    assert np.allclose(jaw, [[0, 0], [0.75, 0], [180 / 680, 500 / 680]])
    turns = data.accessor(keys["eye_left_yaw", "rotation"], "VEC4")
    assert np.allclose(
        turns, [[0, 0, 0, 1], [0, math.sin(0.1), 0, math.cos(0.1)], [0, -math.sin(0.1), 0, math.cos(0.1)]]
    )


def test_streams_that_cannot_be_played_are_refused(tmp_path: Path) -> None:
    stream = FapStream.build(25.0, 2, {3: [0, 1]})
    with pytest.raises(UnsupportedFeatureError, match="no Facial Animation Tables"):
        write(small_scene(), tmp_path / "a.glb", stream)
    with pytest.raises(UnsupportedFeatureError, match="without animation"):
        write(small_face(), tmp_path / "a.obj", stream)
    with pytest.raises(FapStreamError, match="no frames"):
        write(small_face(), tmp_path / "a.glb", FapStream.build(25.0, 0))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 1e39])
def test_numbers_that_gltf_cannot_hold_are_refused(wrong: float, tmp_path: Path) -> None:
    mesh = PolyMesh.from_faces([[0, 0, wrong], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    with pytest.raises(FbaError):
        write(FaceScene((Shape("a", mesh),)), tmp_path / "a.glb")
    with pytest.raises(MeshError, match="no polygons"):
        write(FaceScene((Shape("a", PolyMesh.from_faces([[0, 0, 0]], [])),)), tmp_path / "a.glb")
    assert list(tmp_path.iterdir()) == []


def test_what_another_program_has_changed_is_read_as_it_is_now(tmp_path: Path) -> None:
    path = tmp_path / "a.glb"
    write(small_face(), path)
    document, data = parts(path)
    own = document["scenes"][0]["extras"]["fba"]
    view = document["bufferViews"][own["bufferView"]]
    first = document["accessors"][document["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]
    start = document["bufferViews"][first["bufferView"]]["byteOffset"]
    for at in (view["byteOffset"] + 5, start + 2):
        save(path, document, data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :])
        found = read(path)
        assert isinstance(found, FaceScene)
        assert isinstance(found.document, gltf.GltfDocument)
        assert CHANGED in found.document.remarks
        assert gltf.read_shape_set(path) is None
    own["format"] = "fba-gltf/99"
    save(path, document, data)
    with pytest.raises(InputFileError, match="fba-gltf/99"):
        read(path)


def test_arrays_are_small_exact_and_inside_their_bytes() -> None:
    pack, buffer = Pack(), Buffer()
    arrays = [np.arange(5), np.array([-1, 70000]), np.array([[0.1, 0.5]]), np.array([0.25, 3.0]), np.zeros((0, 3))]
    wheres = [pack.array(a) for a in arrays]
    assert [w["type"] for w in wheres] == ["<u1", "<i4", "<f8", "<f4", "<f4"]
    pack.write(buffer)
    unpack = Unpack(buffer.data())
    for where, array in zip(wheres, arrays, strict=True):
        assert np.array_equal(unpack.array(where, array.dtype.type), array)
    for wrong in ({"at": 40}, {"shape": [10**9, 10**9]}, {"shape": [-1]}, {"at": -8}, {"type": "O"}, {"shape": [1.5]}):
        with pytest.raises(InputFileError):
            unpack.array({**wheres[0], **wrong}, np.int32)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_damaged_face_is_refused_or_read(data: st.DataObject, tmp_path: Path) -> None:
    path = tmp_path / "a.glb"
    write(small_face(), path)
    document, binary = parts(path)
    owner: Any = document["scenes"][0]["extras"]["fba"]
    while True:
        keys = list(owner) if isinstance(owner, dict) else list(range(len(owner)))
        if not keys:
            return
        key = data.draw(st.sampled_from(keys))
        if not isinstance(owner[key], dict | list) or data.draw(st.booleans()):
            break
        owner = owner[key]
    if data.draw(st.booleans()):
        del owner[key]
    else:
        wrong = st.sampled_from(
            [None, -1, 10**12, 1e300, "x", [], {}, [[1]], True, {"at": 0, "type": "<f8", "shape": [9]}]
        )
        owner[key] = data.draw(wrong)
    save(path, document, binary)
    said = "a.glb"
    try:
        read(path)
    except FbaError as error:
        said = str(error)
    assert "a.glb" in said


def test_free_expressions_read_back(tmp_path: Path) -> None:
    scene = small_scene(Frame(np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])))
    random = np.random.default_rng(2)
    deltas = random.normal(size=(3, scene.vertex_count, 3))
    deltas[1] = 0.0
    shapes = ShapeSet(("smile", "nothing", "brow up"), scene.frame.to_file(scene.world_neutral()), deltas)
    gltf.write_shape_set(scene, shapes, tmp_path / "a.glb")
    found = read_shapes(tmp_path / "a.glb", scene)
    assert found.names == shapes.names
    assert np.allclose(found.deltas, deltas, rtol=0, atol=1e-6)
    assert np.array_equal(found.neutral, shapes.neutral)
    with pytest.raises(MeshError, match="do not fit"):
        gltf.write_shape_set(scene, ShapeSet(("a",), np.zeros((2, 3)), np.zeros((1, 2, 3))), tmp_path / "b.glb")


def test_colours_are_linear_light_in_the_file() -> None:
    assert np.allclose(to_linear([0.0, 0.5, 1.0]), [0.0, 0.21404114, 1.0])
    assert np.allclose(from_linear(to_linear([0.02, 0.3, 0.9])), [0.02, 0.3, 0.9], atol=1e-8)


def textured(folder: Path, name: str = "face.png") -> AnimatableFace:
    face = small_face()
    skin = face.scene.shape("skin")
    materials = (replace(skin.materials[0], texture=name), skin.materials[1])
    return replace(
        face, scene=replace(face.scene.map_shapes({"skin": replace(skin, materials=materials)}), folder=folder)
    )


def test_a_texture_travels_through_every_format_that_can_have_one(tmp_path: Path) -> None:
    for name in ("one", "two/maps", "three", "four", "five"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / "two/maps/face.png").write_bytes(PNG)
    face = textured(tmp_path / "two", "maps/face.png")
    write(face, tmp_path / "one/a.glb")
    document, _ = parts(tmp_path / "one/a.glb")
    assert document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] == {"index": 0}
    assert document["materials"][0]["alphaMode"] == "MASK"
    for kind in ("obj", "wrl", "usda"):
        folder = tmp_path / {"obj": "three", "wrl": "four", "usda": "five"}[kind]
        inside = read(tmp_path / "one/a.glb")
        write(inside, folder / f"a.{kind}")
        assert (folder / "maps/face.png").read_bytes() == PNG
        scene = read(folder / f"a.{kind}")
        scene = scene.scene if isinstance(scene, AnimatableFace) else scene
        assert "maps/face.png" in [m.texture for s in scene.shapes for m in s.materials]
        write(scene, tmp_path / f"again_{kind}.glb")
        assert_same_texture(tmp_path / f"again_{kind}.glb")
    foreign = gltf.read_foreign(tmp_path / "one/a.glb")
    assert foreign.images == {"maps_face.png": PNG}


def assert_same_texture(path: Path) -> None:
    document, data = parts(path)
    (image,) = document["images"]
    view = document["bufferViews"][image["bufferView"]]
    assert data[view["byteOffset"] :][: view["byteLength"]] == PNG


def test_images_of_a_real_avatar_are_kept(shared: Path, tmp_path: Path) -> None:
    scene = read(shared / "faces/rpm-brunette/brunette-t.glb")
    assert isinstance(scene, FaceScene)
    assert len(scene.images) == 17
    write(scene, tmp_path / "a.glb")
    again = read(tmp_path / "a.glb")
    assert isinstance(again, FaceScene)
    assert again.images == scene.images
    assert_same_scene(again, scene)
    write(scene, tmp_path / "a.obj")
    digests = {hashlib.sha256(p.read_bytes()).digest() for p in tmp_path.glob("*.[jp][pn]g")}
    assert digests == {hashlib.sha256(data).digest() for data in scene.images.values()}
    assert obj.read(tmp_path / "a.obj").vertex_count == scene.vertex_count


def test_images_outside_the_folder_are_neither_read_nor_written(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "out").mkdir()
    (tmp_path / "secret.png").write_bytes(PNG)
    (tmp_path / "in/link.png").symlink_to(tmp_path / "secret.png")
    (tmp_path / "in/run.sh").write_bytes(PNG)
    (tmp_path / "in/there.png").write_bytes(PNG)
    (tmp_path / "out/there.png").write_bytes(b"mine")
    absolute = str(tmp_path / "secret.png")
    for name in (
        "../secret.png",
        "..\\secret.png",
        absolute,
        "link.png",
        "http://a/b.png",
        "no\0ne.png",
        "none.png",
        "",
    ):
        scene = textured(tmp_path / "in", name).scene
        assert texture_bytes(scene, name) is None
    for name in ("../evil.png", "run.sh", "there.png"):
        scene = textured(tmp_path / "in", name).scene
        place_textures(replace(scene, images={"../evil.png": PNG}), tmp_path / "out").write()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["in", "out", "secret.png"]
    written = {p.name: p.read_bytes() for p in (tmp_path / "out").iterdir()}
    assert written == {"there.png": b"mine", "there_2.png": PNG, "evil.png": PNG}


def test_a_texture_on_a_surface_without_coordinates_is_kept_but_not_shown(tmp_path: Path) -> None:
    mesh = PolyMesh.from_faces([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    material = Material("skin", (0.5, 0.4, 0.3), texture="a.png")
    write(FaceScene((Shape("a", mesh, materials=(material,)),), images={"a.png": PNG}), tmp_path / "a.glb")
    document, _ = parts(tmp_path / "a.glb")
    assert len(document["materials"]) == 1
    assert "baseColorTexture" not in document["materials"][0]["pbrMetallicRoughness"]
    assert read(tmp_path / "a.glb").images == {"a.png": PNG}
    assert document["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"][:3] == to_linear((0.5, 0.4, 0.3))
