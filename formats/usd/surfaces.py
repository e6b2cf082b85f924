"""Physically based materials (`fba.shading`) as the inputs and texture nodes of a UsdPreviewSurface."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence

from pxr import Gf, Sdf, Tf, Usd, UsdShade

from fba.errors import InputFileError
from fba.mesh import Material
from fba.shading import Shading, TextureMap
from formats.material_json import material_json, read_material
from formats.usd.properties import get, put_string

UV_PRIMVAR = "st"
"""The first set of texture coordinates; those behind it have their number: st1, st2."""
_TYPES = {"rgb": Sdf.ValueTypeNames.Float3}


def uv_primvar(texcoord: int) -> str:
    """The primvar of a set of texture coordinates."""
    return UV_PRIMVAR if texcoord == 0 else f"{UV_PRIMVAR}{texcoord}"


def write_texture(
    stage: Usd.Stage, material: Sdf.Path, name: str, lay: TextureMap, outputs: Sequence[tuple[str, UsdShade.Input]]
) -> UsdShade.Shader | None:
    """Author the nodes of one image and connect its channels (``rgb``, ``r``, ``g``, ``b``, ``a``).

    Returns
    -------
    The node of the image; None for a name that no asset path can hold.
    """
    try:
        asset = Sdf.AssetPath(lay.image)
    except Tf.ErrorException:
        # Control characters have no place in an asset path; the name stays in the own attribute.
        return None
    reader = UsdShade.Shader.Define(stage, material.AppendChild(f"{name}Coordinates"))
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set(uv_primvar(lay.texcoord))
    uv = reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
    if lay.transformed:
        uv = _transform(stage, material.AppendChild(f"{name}Transform"), lay, uv)
    image = UsdShade.Shader.Define(stage, material.AppendChild(name))
    image.CreateIdAttr("UsdUVTexture")
    image.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(asset)
    for side, wrap in zip(("wrapS", "wrapT"), lay.wrap, strict=True):
        image.CreateInput(side, Sdf.ValueTypeNames.Token).Set(wrap)
    image.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(uv)
    for channel, wanted in outputs:
        wanted.ConnectToSource(image.CreateOutput(channel, _TYPES.get(channel, Sdf.ValueTypeNames.Float)))
    return image


def _transform(stage: Usd.Stage, path: Sdf.Path, lay: TextureMap, uv: UsdShade.Output) -> UsdShade.Output:
    """A UsdTransform2d with the meaning of glTF's transform, whose v runs down: (u, 1 - v) is scaled, turned, moved."""
    (a, b), (x, y), turn = lay.scale, lay.offset, lay.rotation
    # With v up, the turn has the other sense, and the corner (0, 1) stays where (0, 0) was.
    move = (x + b * math.sin(turn), 1.0 - y - b * math.cos(turn))
    node = UsdShade.Shader.Define(stage, path)
    node.CreateIdAttr("UsdTransform2d")
    node.CreateInput("in", Sdf.ValueTypeNames.Float2).ConnectToSource(uv)
    node.CreateInput("scale", Sdf.ValueTypeNames.Float2).Set(Gf.Vec2f(a, b))
    node.CreateInput("rotation", Sdf.ValueTypeNames.Float).Set(math.degrees(turn))
    node.CreateInput("translation", Sdf.ValueTypeNames.Float2).Set(Gf.Vec2f(*move))
    return node.CreateOutput("result", Sdf.ValueTypeNames.Float2)


def write_shading(stage: Usd.Stage, path: Sdf.Path, surface: UsdShade.Shader, shading: Shading) -> None:
    """Author what a physically based material has beyond its colours; maps win over their factors."""
    floats = Sdf.ValueTypeNames.Float
    metallic, roughness = surface.CreateInput("metallic", floats), surface.CreateInput("roughness", floats)
    metallic.Set(shading.metallic)
    roughness.Set(shading.roughness)
    if shading.metallic_roughness:
        lay = shading.metallic_roughness
        image = write_texture(stage, path, "MetallicRoughness", lay, (("b", metallic), ("g", roughness)))
        _linear(image, (1.0, shading.roughness, shading.metallic, 1.0))
    if shading.occlusion:
        strength = shading.occlusion_strength
        wanted = surface.CreateInput("occlusion", floats)
        image = write_texture(stage, path, "Occlusion", shading.occlusion, (("r", wanted),))
        _linear(image, (strength,) * 4, (1.0 - strength,) * 4)
    if shading.normal:
        wanted = surface.CreateInput("normal", Sdf.ValueTypeNames.Normal3f)
        image = write_texture(stage, path, "Normal", shading.normal, (("rgb", wanted),))
        # The one scale that UsdPreviewSurface allows here; how strong the bumps are is kept, but not shown.
        _linear(image, (2.0, 2.0, 2.0, 1.0), (-1.0, -1.0, -1.0, 0.0))
    if shading.emissive:
        write_texture(stage, path, "Emissive", shading.emissive, (("rgb", surface.GetInput("emissiveColor")),))
    if shading.alpha_mode == "mask":
        surface.CreateInput("opacityThreshold", floats).Set(shading.alpha_cutoff)


def _linear(image: UsdShade.Shader | None, scale: tuple[float, ...], bias: tuple[float, ...] = (0.0,) * 4) -> None:
    """Let an image hold numbers instead of colours: ``value * scale + bias``."""
    if image is None:
        return
    image.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set("raw")
    image.CreateInput("scale", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(*scale))
    image.CreateInput("bias", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(*bias))


def keep_shading(prim: Usd.Prim, material: Material) -> None:
    """Keep the shading of a material exactly."""
    if material.shading is not None:
        put_string(prim, "shading", json.dumps(material_json(material), sort_keys=True))


def kept_shading(prim: Usd.Prim, metallic: object, roughness: object) -> Shading | None:
    """The shading that `keep_shading` kept, as long as the surface's own numbers still agree with it.

    Raises
    ------
    InputFileError
        If it is damaged.
    """
    text = get(prim, "shading")
    if text is None:
        return None
    try:
        shading = read_material(json.loads(str(text))).shading
    except (KeyError, TypeError, ValueError) as error:
        raise InputFileError(f"{prim.GetPath()} is damaged: its fba:shading is no material ({error})") from error
    same = shading is not None and (metallic, roughness) == (
        Gf.Vec2f(shading.metallic, shading.roughness)[0],
        Gf.Vec2f(shading.metallic, shading.roughness)[1],
    )
    return shading if same else None
