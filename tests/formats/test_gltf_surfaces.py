"""All that a glTF surface has comes through: maps, factors, samplers, transforms, uv sets, colours, tangents."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from dressed import FULL, IMAGES, SKIN, dressed
from faces import small_face

from fat import AnimatableFace
from fba import FaceScene, Material, PolyMesh, Shape
from fba.errors import InputFileError
from fba.shading import Shading, TextureMap
from formats import gltf, read, read_face, read_scene, write
from formats.gltf.tangents import tangents
from formats.material_json import material_json, read_material


def document_of(path: Path) -> dict[str, Any]:
    data = path.read_bytes()
    found: dict[str, Any] = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    return found


def test_what_another_program_reads_is_all_there(tmp_path: Path) -> None:
    write(dressed(), tmp_path / "a.glb")
    found = gltf.read_foreign(tmp_path / "a.glb")
    skin = found.shape("skin")
    (material,) = set(skin.materials)
    assert material.shading == FULL
    assert np.allclose([*material.diffuse, *material.emissive], [*SKIN.diffuse, *SKIN.emissive], atol=1e-8)
    assert found.images == IMAGES
    document = document_of(tmp_path / "a.glb")
    assert document["extensionsUsed"] == ["KHR_materials_emissive_strength", "KHR_texture_transform"]
    assert len(document["images"]) == 4
    # The mesh is split at seams: each vertex has the colour and coordinates of the one that it was.
    own = dressed().shape("skin").mesh
    place = {tuple(np.float32(v)): k for k, v in enumerate(own.vertices)}
    assert len(place) == own.vertex_count
    rows = [place[tuple(np.float32(v))] for v in skin.mesh.vertices]
    names = found.file_order()["skin"]
    for name, values in dressed().vertex_attributes.items():
        assert np.allclose(found.vertex_attributes[name][names], values[rows], atol=1e-7), name
    others = [ids for shape, ids in found.file_order().items() if shape != "skin"]
    assert np.isnan(found.vertex_attributes["color"][np.concatenate(others)]).all()


def test_an_unlit_surface_stays_one(tmp_path: Path) -> None:
    flat = Shading(base=TextureMap("base.png"), alpha_mode="opaque", unlit=True)
    write(dressed(replace(SKIN, shading=flat)), tmp_path / "a.glb")
    (material,) = set(gltf.read_foreign(tmp_path / "a.glb").shape("skin").materials)
    assert material.shading == flat
    assert document_of(tmp_path / "a.glb")["extensionsUsed"] == ["KHR_materials_unlit"]


def test_from_file_to_face_to_file_nothing_is_lost(tmp_path: Path) -> None:
    face = replace(small_face(), scene=dressed())
    write(face, tmp_path / "a.glb")
    again = read_face(tmp_path / "a.glb")
    assert again.scene.shape("skin").materials == face.scene.shape("skin").materials
    assert again.scene.vertex_attributes.keys() == face.scene.vertex_attributes.keys()
    for name, values in face.scene.vertex_attributes.items():
        assert np.array_equal(again.scene.vertex_attributes[name], values, equal_nan=True)
    write(again, tmp_path / "b.glb")
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()
    foreign = gltf.read_foreign(tmp_path / "a.glb")
    write(foreign, tmp_path / "c.glb")
    once = gltf.read_foreign(tmp_path / "c.glb")
    assert [s.materials for s in once.shapes] == [s.materials for s in foreign.shapes]
    for name, values in foreign.vertex_attributes.items():
        assert np.allclose(once.vertex_attributes[name], values, atol=1e-7, equal_nan=True)


@pytest.mark.parametrize("kind", ["wrl", "bt", "xmt", "usda"])
def test_a_face_keeps_its_surfaces_in_every_format_with_tables(kind: str, tmp_path: Path) -> None:
    face = replace(small_face(), scene=dressed())
    write(face, tmp_path / f"a.{kind}")
    found = read(tmp_path / f"a.{kind}")
    assert isinstance(found, AnimatableFace)
    assert found.scene.shape("skin").materials == face.scene.shape("skin").materials
    assert {p.name for p in tmp_path.glob("*.png")} == set(IMAGES)


def test_obj_keeps_what_its_library_can_say(tmp_path: Path) -> None:
    write(dressed(), tmp_path / "a.obj")
    found = read_scene(tmp_path / "a.obj")
    (material,) = {m for s in found.shapes for m in s.materials if m.name == "skin"}
    shading = material.shading
    assert shading is not None
    assert (shading.metallic, shading.roughness) == (0.25, 0.75)
    assert material.images == ("base.png", "rough.png", "normal.png", "glow.png")
    assert {p.name for p in tmp_path.glob("*.png")} == set(IMAGES)
    write(found, tmp_path / "b.glb")
    entry = next(m for m in document_of(tmp_path / "b.glb")["materials"] if m["name"] == "skin")
    assert {"normalTexture", "emissiveTexture"} <= set(entry)
    assert {"baseColorTexture", "metallicRoughnessTexture"} <= set(entry["pbrMetallicRoughness"])


def test_maps_without_their_texture_coordinates_are_left_out(tmp_path: Path) -> None:
    scene = dressed(replace(SKIN, shading=replace(FULL, base=replace(FULL.base or TextureMap(""), texcoord=3))))
    write(replace(scene, vertex_attributes={}), tmp_path / "a.glb")
    entry = document_of(tmp_path / "a.glb")["materials"][0]
    assert "baseColorTexture" not in entry["pbrMetallicRoughness"]
    assert "metallicRoughnessTexture" not in entry["pbrMetallicRoughness"]
    assert "occlusionTexture" not in entry
    assert "normalTexture" in entry


def test_a_primitive_without_uv_does_not_cost_the_others_theirs(tmp_path: Path) -> None:
    write(dressed(), tmp_path / "a.gltf")
    document = json.loads((tmp_path / "a.gltf").read_text())
    del document["scenes"][0]["extras"]
    first, *others = document["meshes"][0]["primitives"]
    for name in ("TEXCOORD_0", "TEXCOORD_1", "TANGENT"):
        del first["attributes"][name]
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    mesh = read_scene(tmp_path / "a.gltf").shape("skin").mesh
    count = document["accessors"][first["indices"]]["count"]
    assert mesh.texcoord_indices is not None
    assert (mesh.texcoord_indices[:count] == -1).all()
    assert (mesh.texcoord_indices[count:] >= 0).all()
    assert others
    assert mesh.texcoord_indices.size > count


def test_specular_glossiness_gives_its_colour_and_roughness(tmp_path: Path) -> None:
    write(dressed(), tmp_path / "a.gltf")
    document = json.loads((tmp_path / "a.gltf").read_text())
    del document["scenes"][0]["extras"]
    glossy = {"diffuseFactor": [1, 0, 0, 1], "diffuseTexture": {"index": 0}, "glossinessFactor": 0.25}
    document["materials"][0] = {"extensions": {"KHR_materials_pbrSpecularGlossiness": glossy, "KHR_materials_ior": {}}}
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    scene = read_scene(tmp_path / "a.gltf")
    material = scene.shape("skin").materials[0]
    assert (material.diffuse, material.texture) == ((1.0, 0.0, 0.0), "base.png")
    assert material.shading is not None
    assert (material.shading.metallic, material.shading.roughness) == (0.0, 0.75)
    assert any("KHR_materials_ior is not kept" in r for r in getattr(scene.document, "remarks", ()))


@pytest.mark.parametrize(
    ("key", "value"),
    [("alphaMode", "HOLES"), ("normalTexture", {"index": 0, "texCoord": -1}), ("alphaCutoff", "x"), ("alphaMode", 7)],
)
def test_surfaces_that_make_no_sense_are_refused(key: str, value: object, tmp_path: Path) -> None:
    write(dressed(), tmp_path / "a.gltf")
    document = json.loads((tmp_path / "a.gltf").read_text())
    del document["scenes"][0]["extras"]
    document["materials"][0][key] = value
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    with pytest.raises(InputFileError, match=r"a\.gltf"):
        read(tmp_path / "a.gltf")


def test_materials_as_json_are_exact_and_checked() -> None:
    row = json.loads(json.dumps(material_json(SKIN)))
    assert read_material(row) == SKIN
    assert read_material(json.loads(json.dumps(material_json(Material("a"))))) == Material("a")
    for wrong in (
        {"shading": {**row["shading"], "alpha_mode": "x"}},
        {"shading": {**row["shading"], "metallic": None}},
        {"shading": {**row["shading"], "base": {**row["shading"]["base"], "wrap": ["repeat", "x"]}}},
        {"shading": {**row["shading"], "base": {**row["shading"]["base"], "texcoord": -1}}},
        {"diffuse": [1, 2]},
        {"texture": 5},
        {"name": None},
    ):
        with pytest.raises((TypeError, ValueError)):
            read_material({**row, **wrong})


def test_tangents_follow_u_and_stay_on_their_side() -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    up = np.tile([0.0, 0.0, 1.0], (4, 1))
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    upright = np.stack([points[:, 0], 1.0 - points[:, 1]], axis=1)
    assert np.allclose(tangents(points, up, upright, triangles), [1, 0, 0, 1])
    mirrored = upright * (-1.0, 1.0)
    assert np.allclose(tangents(points, up, mirrored, triangles), [-1, 0, 0, -1])
    swapped = upright[:, ::-1]  # u grows downwards, the image's own top is on the left
    assert np.allclose(tangents(points, up, swapped, triangles), [0, -1, 0, -1])
    nowhere = tangents(points, up, np.zeros((4, 2)), triangles)
    assert np.allclose(np.linalg.norm(nowhere[:, :3], axis=1), 1.0)
    assert np.allclose(nowhere[:, 2], 0.0)


def test_a_mirrored_image_splits_the_vertices_of_its_axis(tmp_path: Path) -> None:
    mesh = PolyMesh.from_faces(
        [[-1, 0, 0], [0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [-1, 1, 0]], [[0, 1, 4, 5], [1, 2, 3, 4]]
    )
    uv = np.stack([np.abs(mesh.vertices[:, 0]), mesh.vertices[:, 1]], axis=1)
    mesh = replace(mesh, texcoords=uv, texcoord_indices=mesh.indices)
    plain = Material("skin", texture="base.png")
    bent = replace(plain, shading=Shading(base=TextureMap("base.png"), normal=TextureMap("normal.png")))
    for material, count in ((plain, 6), (bent, 8)):
        scene = FaceScene((Shape("a", mesh, materials=(material,)),), images=IMAGES)
        write(scene, tmp_path / "a.glb")
        document = document_of(tmp_path / "a.glb")
        attributes = document["meshes"][0]["primitives"][0]["attributes"]
        assert document["accessors"][attributes["POSITION"]]["count"] == count
        assert ("TANGENT" in attributes) == (material is bent)
        assert isinstance(read(tmp_path / "a.glb"), FaceScene)
