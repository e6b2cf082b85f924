"""glTF: a real avatar, every accessor form, and files that contradict themselves."""

from __future__ import annotations

import base64
import copy
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fba.errors import FbaError, InputFileError, MeshError, UnsupportedFeatureError
from fba.scene import FaceScene, Transform
from formats import obj
from formats.gltf import GltfDocument, read
from formats.matrices import transform_fields

POSITIONS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype="<f4")


class Builder:
    """A small glTF document in the making."""

    def __init__(self) -> None:
        self.blob = b""
        self.document: dict[str, Any] = {"asset": {"version": "2.0"}, "accessors": [], "bufferViews": []}

    def view(self, data: bytes, stride: int | None = None) -> int:
        self.blob += b"\0" * (-len(self.blob) % 4)
        view = {"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(data)}
        if stride:
            view["byteStride"] = stride
        self.blob += data
        self.document["bufferViews"].append(view)
        return len(self.document["bufferViews"]) - 1

    def accessor(self, values: np.ndarray, type_: str, **more: Any) -> int:
        component = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}[values.dtype.str[1:]]
        entry = {
            "bufferView": self.view(values.tobytes()),
            "componentType": component,
            "count": len(values),
            "type": type_,
        }
        self.document["accessors"].append({**entry, **more})
        return len(self.document["accessors"]) - 1

    def with_mesh(self, primitive: dict[str, Any], node: dict[str, Any] | None = None) -> Builder:
        self.document["meshes"] = [{"name": "head", "primitives": [primitive]}]
        self.document["nodes"] = [{"mesh": 0, **(node or {})}]
        self.document["scenes"] = [{"nodes": [0]}]
        return self

    def glb(self) -> bytes:
        document = {**self.document, "buffers": [{"byteLength": len(self.blob)}]}
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        blob = self.blob + b"\0" * (-len(self.blob) % 4)
        body = struct.pack("<I", len(text)) + b"JSON" + text + struct.pack("<I", len(blob)) + b"BIN\0" + blob
        return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body

    def read(self, tmp_path: Path) -> FaceScene:
        path = tmp_path / "a.glb"
        path.write_bytes(self.glb())
        return read(path)


def square(**more: Any) -> Builder:
    b = Builder()
    primitive = {
        "attributes": {"POSITION": b.accessor(POSITIONS, "VEC3")},
        "indices": b.accessor(np.array([0, 1, 2, 0, 2, 3], dtype="<u2"), "SCALAR"),
        **more,
    }
    return b.with_mesh(primitive)


def test_real_avatar(shared: Path) -> None:
    folder = shared / "faces/rpm-brunette"
    scene = read(folder / "brunette-t.glb")
    assert isinstance(scene.document, GltfDocument)
    targets = scene.document.targets
    carriers = [s for s in scene.shapes if targets[s.name]]
    assert [(s.name, s.mesh.vertex_count, s.mesh.face_count) for s in carriers] == [
        ("EyeLeft", 120, 206), ("EyeRight", 120, 206), ("Wolf3D_Head", 2162, 4094), ("Wolf3D_Teeth", 84, 100),
    ]  # fmt: skip
    assert len(scene.shapes) == 10
    neutral = obj.read(folder / "neutral.obj")
    assert np.abs(np.concatenate([s.mesh.vertices for s in carriers]) - neutral.world_neutral()).max() < 1e-8
    truth = np.load(folder / "expressions.npz")
    assert list(targets["Wolf3D_Head"]) == truth["names"].tolist()
    for k, name in enumerate(truth["names"].tolist()):
        assert np.array_equal(np.concatenate([targets[s.name][name] for s in carriers]), truth["deltas"][k])
    assert carriers[2].materials[0].name == "Wolf3D_Skin"
    assert carriers[2].mesh.texcoords is not None


def test_nodes_become_transforms(tmp_path: Path) -> None:
    b = square()
    half = float(np.sqrt(0.5))
    b.document["nodes"] = [
        {"name": "root", "translation": [1, 2, 3], "children": [1, 2, 3]},
        {"name": "eye", "mesh": 0, "rotation": [0, 0, half, half], "scale": [2, 3, 4]},
        {"name": "bone", "children": [4]},
        {"name": "eye", "mesh": 0, "matrix": [0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, 7, 8, 9, 1]},
        {"name": "tip"},
    ]
    scene = b.read(tmp_path)
    root = scene.roots[0]
    assert isinstance(root, Transform)
    assert [t.name for t in scene.transforms] == ["root", "eye_transform", "eye_transform_2"]
    assert [s.name for s in scene.shapes] == ["eye", "eye_2"]
    x, y, z = POSITIONS.T.astype(float)
    assert np.allclose(scene.world_vertices("eye"), np.stack([1 - 3 * y, 2 + 2 * x, 3 + 4 * z], axis=1))
    assert np.allclose(scene.world_vertices("eye_2"), np.stack([8 - 2 * y, 10 + 2 * x, 12 + 2 * z], axis=1))
    assert scene.meters_per_unit == 1.0


@pytest.mark.parametrize("seed", range(12))
def test_any_matrix_becomes_transform_fields(seed: int) -> None:
    rng = np.random.default_rng(seed)
    matrix = np.eye(4)
    matrix[:3] = rng.normal(size=(3, 4))
    if seed == 0:
        matrix[:3, :3] = -np.eye(3)
    if seed == 1:
        matrix[:3, :3] = [[-1, 0, 0], [0, 0, 1], [0, 1, 0]]
    if seed == 2:
        matrix[:3, :3] = 5 * np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    if seed == 3:
        matrix[:3, :3] = np.outer([1, 2, 3], [1, 1, 1])
    fields: Any = transform_fields(matrix)
    assert np.allclose(Transform("t", **fields).matrix(), matrix, atol=1e-12)


def test_accessor_forms(tmp_path: Path) -> None:
    """Strides, offsets, normalized integers, sparse with and without a base, all giving the same square."""
    b = Builder()
    wide = np.zeros(4, dtype=[("pad", "<f4"), ("p", "<f4", 3), ("n", "<f4", 3)])
    wide["p"] = POSITIONS
    view = b.view(wide.tobytes(), wide.dtype.itemsize)
    acc = b.document["accessors"]
    acc.append({"bufferView": view, "byteOffset": 4, "componentType": 5126, "count": 4, "type": "VEC3"})
    small = b.accessor((POSITIONS * 127).astype("i1"), "VEC3", normalized=True)
    plain = b.accessor(POSITIONS.astype("<u2"), "VEC3")
    rows = b.view(np.array([1, 2, 3], dtype="u1").tobytes())
    values = b.view(POSITIONS[1:].tobytes())
    sparse = {"count": 3, "indices": {"bufferView": rows, "componentType": 5121}, "values": {"bufferView": values}}
    acc.append({"componentType": 5126, "count": 4, "type": "VEC3", "sparse": sparse})
    spoilt = b.accessor(np.array([[0, 0, 0], [9, 9, 9], [9, 9, 9], [9, 9, 9]], dtype="<f4"), "VEC3", sparse=sparse)
    for number in (0, small, plain, 3, spoilt):
        b.with_mesh({"attributes": {"POSITION": number}})
        assert b.read(tmp_path).shapes[0].mesh.vertices.tolist() == POSITIONS.tolist(), number


@pytest.mark.parametrize(
    ("mode", "triangles"),
    [(4, [[0, 1, 2]]), (5, [[0, 1, 2], [1, 3, 2]]), (6, [[0, 1, 2], [0, 2, 3]])],
)
def test_strips_and_fans(tmp_path: Path, mode: int, triangles: list[list[int]]) -> None:
    b = Builder()
    b.with_mesh({"attributes": {"POSITION": b.accessor(POSITIONS, "VEC3")}, "mode": mode})
    assert b.read(tmp_path).shapes[0].mesh.triangles.tolist() == triangles


def test_primitives_of_a_mesh_are_one_shape_with_their_materials(tmp_path: Path) -> None:
    b = square()
    uv = b.accessor(np.array([[0, 0], [1, 0], [1, 0.25], [0, 1]], dtype="<f4"), "VEC2")
    shift = b.accessor(np.ones((4, 3), dtype="<f4"), "VEC3")
    one = {**b.document["meshes"][0]["primitives"][0], "material": 1, "targets": [{"POSITION": shift}]}
    one["attributes"] = {**one["attributes"], "TEXCOORD_0": uv}
    two = {**copy.deepcopy(one), "material": 0, "targets": [{}]}
    b.document["meshes"][0] = {"primitives": [one, two], "extras": {"targetNames": ["up"]}}
    b.document["materials"] = [
        {"name": "lips", "alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 0, 0.75]}},
        {"emissiveFactor": [0, 1, 0], "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}},
    ]
    b.document["textures"], b.document["images"] = [{"source": 0}], [{"uri": "skin.png"}]
    scene = b.read(tmp_path)
    (shape,) = scene.shapes
    assert shape.mesh.vertex_count == 8
    assert [shape.materials[i].name for i in shape.mesh.face_materials] == ["material_1"] * 2 + ["lips"] * 2
    assert (shape.materials[0].texture, shape.materials[0].emissive) == ("skin.png", (0.0, 1.0, 0.0))
    assert shape.materials[1].transparency == 0.25
    # Linear light in the file, what a screen shows inside (IEC 61966-2-1).
    assert np.allclose(shape.materials[1].diffuse, (188 / 255, 137 / 255, 0.0), atol=0.5 / 255)
    assert shape.mesh.texcoords[:4].tolist() == [[0, 1], [1, 1], [1, 0.75], [0, 0]]
    assert scene.document.targets[shape.name]["up"].tolist() == [[1, 1, 1]] * 4 + [[0, 0, 0]] * 4


def test_text_file_with_data_uri_and_with_a_file_beside(tmp_path: Path) -> None:
    b = square()
    uri = "data:application/octet-stream;base64," + base64.b64encode(b.blob).decode()
    (tmp_path / "my data.bin").write_bytes(b.blob)
    for where in (uri, "my%20data.bin"):
        document = {**b.document, "buffers": [{"byteLength": len(b.blob), "uri": where}]}
        (tmp_path / "a.gltf").write_text(json.dumps(document))
        assert read(tmp_path / "a.gltf").shapes[0].mesh.face_count == 2


@pytest.mark.parametrize(
    "uri", ["../secret.bin", "/etc/passwd", "file:///etc/passwd", "%2e%2e/secret.bin", "http://x/y"]
)
def test_nothing_outside_the_folder_is_opened(tmp_path: Path, uri: str) -> None:
    b = square()
    (tmp_path / "secret.bin").write_bytes(b.blob)
    (tmp_path / "in").mkdir()
    document = {**b.document, "buffers": [{"byteLength": len(b.blob), "uri": uri}]}
    (tmp_path / "in/a.gltf").write_text(json.dumps(document))
    with pytest.raises(InputFileError, match="folder"):
        read(tmp_path / "in/a.gltf")


def change(path: str, value: object) -> Builder:
    b = square()
    owner: Any = b.document
    keys = [int(k) if k.isdecimal() else k for k in path.split("/")]
    for key in keys[:-1]:
        owner = owner[key]
    owner[keys[-1]] = value
    return b


@pytest.mark.parametrize(
    ("path", "value", "error", "says"),
    [
        ("asset/version", "1.0", UnsupportedFeatureError, "glTF 1.0"),
        ("extensionsRequired", ["KHR_draco_mesh_compression"], UnsupportedFeatureError, "draco"),
        ("accessors/0/count", 10**12, InputFileError, "reaches beyond buffer view 0"),
        ("accessors/0/count", -1, InputFileError, "'count' must be a whole number"),
        ("accessors/0/count", True, InputFileError, "'count' must be a whole number"),
        ("accessors/0/type", "VEC4", InputFileError, "must be of type VEC3"),
        ("accessors/0/componentType", 9, InputFileError, "component type"),
        ("accessors/0/bufferView", 7, InputFileError, "no entry 7 in 'bufferViews'"),
        ("accessors/0", {"componentType": 5126, "count": 10**9, "type": "VEC3"}, InputFileError, "no data"),
        ("accessors/1/componentType", 5126, InputFileError, "beyond|whole numbers"),
        ("bufferViews/0/byteLength", 10**9, InputFileError, "beyond its buffer"),
        ("bufferViews/0/byteStride", 4, InputFileError, "beyond buffer view"),
        ("meshes/0/primitives/0/attributes", {}, InputFileError, "no POSITION"),
        ("meshes/0/primitives/0/mode", 1, MeshError, "no triangles"),
        ("meshes/0/primitives/0/targets", [{"POSITION": 9}], InputFileError, "no entry 9"),
        ("nodes/0/children", [0], InputFileError, "below itself"),
        ("nodes/0/mesh", "x", InputFileError, "no entry x in 'meshes'"),
        ("nodes/0/rotation", [0, 0, 1], InputFileError, "4 finite numbers"),
        ("nodes/0/matrix", [10**400] * 16, InputFileError, "16 finite numbers"),
        ("scenes", [], None, ""),
        ("scenes/0/nodes", [], MeshError, "no triangles"),
        ("scenes", 5, InputFileError, "must be a list"),
    ],
)
def test_contradictions_are_named(
    tmp_path: Path, path: str, value: object, error: type[FbaError] | None, says: str
) -> None:
    b = change(path, value)
    if error is None:
        assert b.read(tmp_path).vertex_count == 4
        return
    with pytest.raises(error, match=says):
        b.read(tmp_path)


def test_index_out_of_range_and_values_not_finite(tmp_path: Path) -> None:
    b = square()
    b.blob = b.blob[:-2] + struct.pack("<H", 4)
    with pytest.raises(InputFileError, match="vertex 4 of 4"):
        b.read(tmp_path)
    b = square()
    b.blob = struct.pack("<f", np.nan) + b.blob[4:]
    with pytest.raises(InputFileError, match="finite"):
        b.read(tmp_path)


@pytest.mark.parametrize("data", [b"", b"glTF", b"{", b"[]", b"{}", square().glb()[:-30], square().glb()[:40]])
def test_cut_and_foreign_files(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "a.glb").write_bytes(data)
    with pytest.raises(FbaError):
        read(tmp_path / "a.glb")


GOOD = square(targets=[{"POSITION": 0}]).glb()
VALUES = st.none() | st.booleans() | st.integers(-2, 9) | st.floats() | st.text(max_size=3) | st.just([]) | st.just({})
PATHS = (
    "scene", "scenes/0", "scenes/0/nodes/0", "nodes/0", "nodes/0/mesh", "nodes/0/children", "nodes/0/scale",
    "nodes/0/skin",
    "meshes/0", "meshes/0/primitives", "meshes/0/primitives/0", "meshes/0/primitives/0/indices", "meshes/0/extras",
    "meshes/0/primitives/0/attributes", "meshes/0/primitives/0/attributes/POSITION", "meshes/0/primitives/0/mode",
    "meshes/0/primitives/0/material", "meshes/0/primitives/0/targets", "accessors", "accessors/0", "accessors/0/count",
    "accessors/0/byteOffset", "accessors/0/normalized", "accessors/0/sparse", "accessors/1/componentType",
    "bufferViews",
    "bufferViews/0", "bufferViews/0/buffer", "bufferViews/0/byteOffset", "bufferViews/0/byteStride", "buffers", "asset",
)  # fmt: skip


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(path=st.sampled_from(PATHS), value=VALUES)
def test_any_wrong_field_is_read_or_refused(tmp_path: Path, path: str, value: object) -> None:
    try:
        scene = change(path, value).read(tmp_path)
    except FbaError:
        return
    assert np.isfinite(scene.world_neutral()).all()


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(start=st.integers(0, len(GOOD)), length=st.integers(0, 8), new=st.binary(max_size=8))
def test_damaged_bytes_are_read_or_refused(tmp_path: Path, start: int, length: int, new: bytes) -> None:
    (tmp_path / "a.glb").write_bytes(GOOD[:start] + new + GOOD[start + length :])
    try:
        scene = read(tmp_path / "a.glb")
    except FbaError:
        return
    assert np.isfinite(scene.shapes[0].mesh.vertices).all()


@pytest.mark.parametrize("source", [[], {}, "0", 1, True, -1])
def test_a_texture_of_no_image_is_refused(tmp_path: Path, source: object) -> None:
    b = square(material=0)
    b.document["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    b.document["textures"], b.document["images"] = [{"source": source}], [{"uri": "skin.png"}]
    with pytest.raises(InputFileError, match="'images'"):
        b.read(tmp_path)
