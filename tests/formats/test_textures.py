"""Materials, texture coordinates and images of every input in every output that can hold them."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pytest

from fba import FaceScene, Material, PolyMesh, Shape
from formats import formats, read_scene, write
from formats.textures import missing_textures, place_textures, texture_bytes

PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
OTHER = PNG + b"\0"
NAMES = ("face.png", "maps/my face.png", "Gesicht_ä_顔.png")
UV = np.array([[0.0, 0.0], [0.5, 0.0], [0.25, 0.75], [1.0, 1.0]])
HOLD_IMAGES = [
    extension
    for entry in formats()
    if entry.writes and (entry.names_images or entry.carries_tables)
    for extension in entry.extensions[:1]
]


def square(name: str) -> FaceScene:
    """Two triangles with texture coordinates and an image."""
    mesh = PolyMesh.from_faces([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    mesh = replace(mesh, texcoords=UV, texcoord_indices=mesh.indices)
    return FaceScene((Shape("face", mesh, materials=(Material("skin", (1.0, 1.0, 1.0), texture=name),)),))


def obj_file(folder: Path, name: str) -> Path:
    points = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n" + "".join(f"vt {u} {v}\n" for u, v in UV)
    (folder / "a.obj").write_text(f"mtllib a.mtl\n{points}usemtl skin\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n", "utf-8")
    (folder / "a.mtl").write_text(f"newmtl skin\nKd 1 1 1\nmap_Kd {name}\n", "utf-8")
    return folder / "a.obj"


def vrml_file(folder: Path, name: str) -> Path:
    uv = ", ".join(f"{u} {v}" for u, v in UV)
    (folder / "a.wrl").write_text(
        f'#VRML V2.0 utf8\nShape {{ appearance Appearance {{ texture ImageTexture {{ url "{quote(name)}" }} }} '
        "geometry IndexedFaceSet { coord Coordinate { point [ 0 0 0, 1 0 0, 1 1 0, 0 1 0 ] } "
        "coordIndex [ 0 1 2 -1 0 2 3 ] "
        f"texCoord TextureCoordinate {{ point [ {uv} ] }} }} }}\n",
        "utf-8",
    )
    return folder / "a.wrl"


def gltf_file(folder: Path, name: str) -> Path:
    """A glTF file of another program's making, its image beside it."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "<f4")
    uv = np.stack([UV[:, 0], 1.0 - UV[:, 1]], axis=1).astype("<f4")
    data = points.tobytes() + uv.tobytes() + np.array([0, 1, 2, 0, 2, 3], "<u2").tobytes()
    views = [(0, 48), (48, 32), (80, 12)]
    document = {
        "asset": {"version": "2.0"},
        "nodes": [{"mesh": 0}],
        "meshes": [
            {
                "name": "face",
                "primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}],
            }
        ],
        "materials": [{"name": "skin", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"uri": quote(name)}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteOffset": at, "byteLength": size} for at, size in views],
        "buffers": [
            {"byteLength": len(data), "uri": "data:application/gltf-buffer;base64," + base64.b64encode(data).decode()}
        ],
    }
    (folder / "a.gltf").write_text(json.dumps(document))
    return folder / "a.gltf"


def usd_file(folder: Path, name: str) -> Path:
    write(replace(square(name), folder=folder), folder / "a.usda")
    return folder / "a.usda"


INPUTS = {"obj": obj_file, "vrml": vrml_file, "gltf": gltf_file, "usd": usd_file}


@pytest.mark.parametrize("extension", HOLD_IMAGES)
@pytest.mark.parametrize("make", INPUTS.values(), ids=INPUTS)
def test_uv_and_image_of_every_input_are_in_every_output(
    make: Callable[[Path, str], Path], extension: str, tmp_path: Path
) -> None:
    for number, name in enumerate(NAMES):
        home, away = tmp_path / f"in{number}", tmp_path / f"out{number}"
        (home / name).parent.mkdir(parents=True)
        away.mkdir()
        (home / name).write_bytes(PNG)
        scene = read_scene(make(home, name))
        assert missing_textures(scene) == []
        write(scene, away / f"b{extension}")
        for path in sorted(home.rglob("*"), reverse=True):  # What was written stands on its own.
            path.rmdir() if path.is_dir() else path.unlink()
        found = read_scene(away / f"b{extension}")
        (shape,) = found.shapes
        (material,) = {shape.materials[k] for k in used_materials(shape)}
        assert texture_bytes(found, material.texture or "") == PNG
        assert missing_textures(found) == []
        mesh = shape.mesh
        assert mesh.texcoords is not None
        assert mesh.texcoord_indices is not None
        corner = np.column_stack([mesh.vertices[mesh.indices], mesh.texcoords[mesh.texcoord_indices]])
        wanted = np.column_stack([square("").shapes[0].mesh.vertices, UV])
        assert np.abs(np.unique(corner.round(6), axis=0) - np.unique(wanted, axis=0)).max() < 1e-6


def used_materials(shape: Shape) -> list[int]:
    numbers = shape.mesh.face_materials
    return [0] if numbers is None else sorted(set(numbers.tolist()))


def test_an_image_of_another_content_gets_another_name(tmp_path: Path) -> None:
    folders = [tmp_path / name for name in ("one", "two", "out")]
    for folder, data in zip(folders, (PNG, OTHER, None), strict=True):
        folder.mkdir()
        if data is not None:
            (folder / "face.png").write_bytes(data)
    for _ in range(2):  # Written again, nothing is added.
        for name, folder, data in zip("ab", folders, (PNG, OTHER), strict=False):
            write(replace(square("face.png"), folder=folder), tmp_path / f"out/{name}.obj")
            again = read_scene(tmp_path / f"out/{name}.obj")
            assert texture_bytes(again, again.shapes[0].materials[0].texture or "") == data
    assert sorted(p.name for p in folders[2].iterdir()) == [
        "a.mtl",
        "a.obj",
        "b.mtl",
        "b.obj",
        "face.png",
        "face_2.png",
    ]


def test_names_that_differ_in_case_only_are_two_files(tmp_path: Path) -> None:
    one, two = square("Face.png").shapes[0], replace(square("face.png").shapes[0], name="b")
    scene = FaceScene((one, two), images={"Face.png": PNG, "face.png": OTHER})
    placed = place_textures(scene, tmp_path)
    assert {p.name: data for p, data in placed.files.items()} == {"Face.png": PNG, "face_2.png": OTHER}
    assert [s.materials[0].texture for s in placed.scene.shapes] == ["Face.png", "face_2.png"]


@pytest.mark.parametrize(
    ("name", "there", "written"),
    [
        ("C:\\work\\textures\\skin.png", "skin.png", "skin.png"),
        ("/home/me/skin.png", "skin.png", "skin.png"),
        ("../textures/skin.png", "skin.png", "skin.png"),
        ("textures\\skin.png", "textures/skin.png", "textures/skin.png"),
        ("my%20skin.png", "my skin.png", "my skin.png"),
        ("100%#1?.png", "100%#1?.png", "100__1_.png"),
    ],
)
def test_images_are_found_where_they_lie_now(name: str, there: str, written: str, tmp_path: Path) -> None:
    home, away = tmp_path / "home", tmp_path / "away"
    (home / there).parent.mkdir(parents=True)
    (home / there).write_bytes(PNG)
    away.mkdir()
    scene = replace(square(name), folder=home)
    assert texture_bytes(scene, name) == PNG
    placed = place_textures(scene, away)
    assert [p.relative_to(away).as_posix() for p in placed.files] == [written]
    assert placed.scene.shapes[0].materials[0].texture == written


@pytest.mark.parametrize("extension", HOLD_IMAGES)
def test_a_missing_image_stops_nothing(extension: str, tmp_path: Path) -> None:
    scene = replace(square("lost.png"), folder=tmp_path)
    assert missing_textures(scene) == ["lost.png"]
    write(scene, tmp_path / f"a{extension}")
    assert read_scene(tmp_path / f"a{extension}").vertex_count == 4
