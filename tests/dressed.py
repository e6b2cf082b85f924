"""A face whose skin has all that a glTF surface can have."""

from __future__ import annotations

import base64
from dataclasses import replace

import numpy as np
from faces import small_face

from fba import FaceScene, Material
from fba.shading import Shading, TextureMap

PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
FULL = Shading(
    base=TextureMap("base.png", 0, ("clamp", "mirror"), "nearest", "linear", (0.25, 0.5), 0.5, (2.0, 0.5)),
    metallic=0.25,
    roughness=0.75,
    metallic_roughness=TextureMap("rough.png", 1),
    normal=TextureMap("normal.png", magnify="linear", minify="linear_mipmap_linear"),
    normal_scale=0.5,
    occlusion=TextureMap("rough.png", 1),
    occlusion_strength=0.5,
    emissive=TextureMap("glow.png"),
    glow=3.0,
    opacity=0.5,
    alpha_mode="mask",
    alpha_cutoff=0.25,
    double_sided=False,
)
IMAGES = {f"{name}.png": PNG for name in ("base", "rough", "normal", "glow")}
SKIN = Material("skin", (1.0, 0.5, 0.25), emissive=(0.5, 1.0, 0.0), shininess=0.25, texture="base.png", shading=FULL)


def dressed(material: Material = SKIN) -> FaceScene:
    """The small face's scene with one material, colours and a second set of texture coordinates on its skin."""
    scene = small_face().scene
    skin = scene.shape("skin")
    count = skin.mesh.vertex_count
    values = {name: np.full((scene.vertex_count, width), np.nan) for name, width in (("color", 4), ("texcoord_1", 2))}
    values["color"][:count] = np.linspace(0.0, 1.0, 4 * count, dtype=np.float32).reshape(-1, 4)
    values["texcoord_1"][:count] = np.linspace(0.5, 1.0, 2 * count, dtype=np.float32).reshape(-1, 2)
    scene = scene.map_shapes({"skin": replace(skin, materials=(material, material))})
    return replace(scene, images=IMAGES, vertex_attributes=values)
