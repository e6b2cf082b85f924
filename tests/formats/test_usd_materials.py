"""Materials, texture coordinates and colours in USD."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faces import small_scene
from PIL import Image
from pxr import Usd, UsdGeom, UsdShade

from fba import FaceScene
from fba.errors import InputFileError
from fba.shading import Shading, TextureMap
from formats import read_scene, write
from formats.usd.validate import validate_stage

PNG = io.BytesIO()
Image.new("RGBA", (2, 2), (90, 120, 200, 128)).save(PNG, "PNG")

FULL = Shading(
    base=TextureMap("face.png", wrap=("clamp", "mirror"), offset=(0.25, 0.5), rotation=0.3, scale=(2.0, 0.5)),
    metallic=0.1,
    roughness=0.7,
    metallic_roughness=TextureMap("surface.png", 1),
    normal=TextureMap("bumps.png"),
    normal_scale=0.5,
    occlusion=TextureMap("surface.png"),
    occlusion_strength=0.25,
    emissive=TextureMap("glow.png"),
    alpha_mode="mask",
    alpha_cutoff=0.3,
)


def _scene() -> FaceScene:
    """The small scene with all that a material can have, vertex colours on the skin and a second set of uv."""
    scene = small_scene()
    skin = scene.shape("skin")
    face = replace(skin.materials[0], emissive=(0.2, 0.3, 0.4), shininess=0.3, shading=FULL)
    scene = scene.map_shapes({"skin": replace(skin, materials=(face, skin.materials[1]))})
    color = np.full((scene.vertex_count, 4), np.nan)
    color[scene.file_order()["skin"]] = np.linspace(0.0, 1.0, 32).reshape(8, 4)
    uv = np.random.default_rng(4).uniform(size=(scene.vertex_count, 2))
    images = {name: PNG.getvalue() for name in ("face.png", "surface.png", "bumps.png", "glow.png")}
    return replace(scene, vertex_attributes={"color": color, "texcoord_1": uv}, images=images)


@pytest.mark.parametrize("extension", ["usda", "usdc", "usdz"])
def test_all_of_a_material_reads_back(extension: str, tmp_path: Path) -> None:
    scene, path = _scene(), tmp_path / f"face.{extension}"
    write(scene, path)
    found = read_scene(path)
    for shape in scene.shapes:
        assert found.shape(shape.name).materials == shape.materials
    assert set(found.vertex_attributes) == {"color", "texcoord_1"}
    for name, values in scene.vertex_attributes.items():
        np.testing.assert_array_equal(found.vertex_attributes[name], values)
    assert validate_stage(path) == []
    beside = {p.name: p.read_bytes() for p in tmp_path.iterdir() if p != path}
    assert beside == ({} if extension == "usdz" else scene.images)
    assert found.images == (scene.images if extension == "usdz" else {})


def _shader(stage: Usd.Stage, name: str) -> UsdShade.Shader:
    return UsdShade.Shader(stage.GetPrimAtPath(f"/small/Materials/face/{name}"))


def test_the_preview_surface_has_every_map(tmp_path: Path) -> None:
    path = tmp_path / "face.usda"
    write(_scene(), path)
    stage = Usd.Stage.Open(str(path))
    surface = _shader(stage, "Surface")
    wired = {
        name: (source.source.GetPrim().GetName(), str(source.sourceName))
        for name in ("diffuseColor", "opacity", "metallic", "roughness", "normal", "occlusion", "emissiveColor")
        for source in surface.GetInput(name).GetConnectedSources()[0]
    }
    assert wired == {
        "diffuseColor": ("Texture", "rgb"), "opacity": ("Texture", "a"), "metallic": ("MetallicRoughness", "b"),
        "roughness": ("MetallicRoughness", "g"), "normal": ("Normal", "rgb"), "occlusion": ("Occlusion", "r"),
        "emissiveColor": ("Emissive", "rgb"),
    }  # fmt: skip
    assert surface.GetInput("useSpecularWorkflow").Get() == 0
    assert np.isclose(surface.GetInput("opacityThreshold").Get(), 0.3)
    image = _shader(stage, "Texture")
    assert (image.GetInput("wrapS").Get(), image.GetInput("wrapT").Get()) == ("clamp", "mirror")
    assert _shader(stage, "MetallicRoughnessCoordinates").GetInput("varname").Get() == "st1"
    assert _shader(stage, "Normal").GetInput("sourceColorSpace").Get() == "raw"


def test_a_transformed_image_lies_where_gltf_has_it(tmp_path: Path) -> None:
    path = tmp_path / "face.usda"
    write(_scene(), path)
    stage = Usd.Stage.Open(str(path))
    node = _shader(stage, "TextureTransform")
    turn, scale, move = (node.GetInput(name).Get() for name in ("rotation", "scale", "translation"))
    lay = FULL.base
    assert lay is not None
    for u, v in ((0.0, 0.0), (1.0, 0.0), (0.3, 0.8)):
        # three.js and Blender: scaled, turned clockwise in an image whose v runs down, moved.
        a, b = u * lay.scale[0], v * lay.scale[1]
        sine, cosine = np.sin(lay.rotation), np.cos(lay.rotation)
        wanted = (cosine * a + sine * b + lay.offset[0], -sine * a + cosine * b + lay.offset[1])
        x, y = np.array([u, 1.0 - v]) * scale
        sine, cosine = np.sin(np.radians(turn)), np.cos(np.radians(turn))
        found = (cosine * x - sine * y + move[0], sine * x + cosine * y + move[1])
        assert np.allclose((found[0], 1.0 - found[1]), wanted, atol=1e-6)


def test_colours_are_linear_light(tmp_path: Path) -> None:
    path = tmp_path / "face.usda"
    write(_scene(), path)
    stage = Usd.Stage.Open(str(path))
    found = UsdShade.Shader(stage.GetPrimAtPath("/small/Materials/lips/Surface")).GetInput("diffuseColor").Get()
    assert np.allclose(found, (0.4479884, 0.0732390, 0.0732390), atol=1e-6)  # sRGB .7, .3, .3 by IEC 61966-2-1.
    colors = np.array(UsdGeom.Mesh(stage.GetPrimAtPath("/small/skin")).GetDisplayColorAttr().Get())
    assert np.allclose(colors, np.linspace(0.0, 1.0, 32).reshape(8, 4)[:, :3], atol=1e-6)


@pytest.mark.parametrize("text", ["", "[]", "{}", "7", '{"name": 3}'])
def test_a_damaged_material_is_said(text: str, tmp_path: Path) -> None:
    path = tmp_path / "face.usda"
    write(_scene(), path)
    stage = Usd.Stage.Open(str(path))
    stage.GetPrimAtPath("/small/Materials/face").GetAttribute("fba:shading").Set(text)
    stage.GetRootLayer().Save()
    del stage
    with pytest.raises(InputFileError, match="damaged"):
        read_scene(path)


def test_a_surface_that_another_program_changed_loses_the_kept_shading(tmp_path: Path) -> None:
    path = tmp_path / "face.usda"
    write(_scene(), path)
    stage = Usd.Stage.Open(str(path))
    surface = _shader(stage, "Surface")
    surface.GetInput("metallic").Set(0.9)
    stage.GetRootLayer().Save()
    del stage, surface
    (material, _) = read_scene(path).shape("skin").materials
    assert material.shading is None
    assert material.texture == "face.png"
