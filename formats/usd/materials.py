"""Materials as UsdPreviewSurface networks, and back. USD's colours are linear light, a `Material`'s are sRGB."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pxr import Ar, Gf, Sdf, Usd, UsdShade

from fba.mesh import Material
from fba.shading import TextureMap
from formats.colors import from_linear, to_linear
from formats.usd.names import Namer, name_of, put_name
from formats.usd.properties import get, put, put_string
from formats.usd.surfaces import keep_shading, kept_shading, write_shading, write_texture

Color = tuple[float, float, float]
_DEFAULT_ROUGHNESS = 0.5
_DEFAULT_DIFFUSE: Color = (0.18, 0.18, 0.18)
"""UsdPreviewSurface's own values for inputs that are not authored."""


class MaterialLibrary:
    """Writes every different material of a stage once."""

    def __init__(self, stage: Usd.Stage, scope: Sdf.Path) -> None:
        self._stage = stage
        self._scope = scope
        self._namer = Namer()
        self._paths: dict[tuple[Material, int], Sdf.Path] = {}

    def paths(self, materials: tuple[Material, ...]) -> list[Sdf.Path]:
        """Prims of a shape's materials; one that the shape lists twice gets two prims."""
        found = []
        for place, material in enumerate(materials):
            key = (material, materials[:place].count(material))
            if key not in self._paths:
                self._paths[key] = self._write(material)
            found.append(self._paths[key])
        return found

    def _write(self, material: Material) -> Sdf.Path:
        if not self._paths:
            self._stage.DefinePrim(self._scope, "Scope")
        path = self._scope.AppendChild(self._namer.name(material.name or "material"))
        prim = UsdShade.Material.Define(self._stage, path)
        put_name(prim.GetPrim(), material.name)
        surface = UsdShade.Shader.Define(self._stage, path.AppendChild("Surface"))
        surface.CreateIdAttr("UsdPreviewSurface")
        for name, color in _colors(material).items():
            surface.CreateInput(name, Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*to_linear(color)))
        for name, number in _numbers(material).items():
            surface.CreateInput(name, Sdf.ValueTypeNames.Float).Set(number)
        shading = material.shading
        surface.CreateInput("useSpecularWorkflow", Sdf.ValueTypeNames.Int).Set(1 if shading is None else 0)
        prim.CreateSurfaceOutput().ConnectToSource(surface.ConnectableAPI(), "surface")
        if material.texture:
            lay = (shading.base if shading else None) or TextureMap(material.texture)
            outputs = [("rgb", surface.GetInput("diffuseColor"))]
            if shading is not None and shading.alpha_mode in ("mask", "blend"):
                outputs.append(("a", surface.GetInput("opacity")))
            write_texture(self._stage, path, "Texture", lay, outputs)
        if shading is not None:
            write_shading(self._stage, path, surface, shading)
        _write_exact(prim.GetPrim(), material)
        return path


def _colors(material: Material) -> dict[str, Color]:
    return {
        "diffuseColor": material.diffuse,
        "specularColor": material.specular,
        "emissiveColor": material.emissive,
    }


def _numbers(material: Material) -> dict[str, float]:
    return {"roughness": 1.0 - material.shininess, "opacity": 1.0 - material.transparency}


def _write_exact(prim: Usd.Prim, material: Material) -> None:
    for name, color in _colors(material).items():
        put(prim, name, Sdf.ValueTypeNames.Double3, Gf.Vec3d(*color))
    for name in ("ambient_intensity", "shininess", "transparency"):
        put(prim, name, Sdf.ValueTypeNames.Double, getattr(material, name))
    if material.texture is not None:
        put_string(prim, "texture", material.texture)
    keep_shading(prim, material)


def read_material(prim: Usd.Prim) -> Material:
    """Read a material's preview surface; the exact values of an own material as long as they still agree."""
    shader = _surface(prim)
    diffuse = _color(prim, shader, "diffuseColor", _DEFAULT_DIFFUSE)
    specular = _color(prim, shader, "specularColor", (0.0, 0.0, 0.0))
    emissive = _color(prim, shader, "emissiveColor", (0.0, 0.0, 0.0))
    material = Material(name_of(prim), diffuse, specular=specular, emissive=emissive, texture=_texture(prim, shader))
    ambient = get(prim, "ambient_intensity")
    if ambient is not None:
        material = replace(material, ambient_intensity=float(ambient))
    shading = kept_shading(prim, _input(shader, "metallic"), _input(shader, "roughness"))
    if shading is not None and shading.base is not None:
        shading = replace(shading, base=replace(shading.base, image=material.texture or shading.base.image))
    return replace(
        material,
        shading=shading,
        shininess=_number(prim, shader, "roughness", "shininess", _DEFAULT_ROUGHNESS),
        transparency=_number(prim, shader, "opacity", "transparency", 1.0),
    )


def _surface(prim: Usd.Prim) -> UsdShade.Shader | None:
    source = UsdShade.Material(prim).ComputeSurfaceSource()
    return source[0] if source and source[0] else None


def _input(shader: UsdShade.Shader | None, name: str) -> object:
    wanted = shader.GetInput(name) if shader else None
    return wanted.GetAttr().Get() if wanted else None


def _color(prim: Usd.Prim, shader: UsdShade.Shader | None, name: str, default: Color) -> Color:
    found = _input(shader, name)
    single = np.array(default if found is None else found, dtype=np.float32)
    exact = get(prim, name)
    if exact is not None and np.array_equal(np.array(to_linear(exact), dtype=np.float32), single):
        red, green, blue = (float(value) for value in exact)
        return red, green, blue
    return from_linear(float(value) for value in single)


def _number(prim: Usd.Prim, shader: UsdShade.Shader | None, name: str, own: str, default: float) -> float:
    """One minus a shader input; the own exact value if that still agrees."""
    found = _input(shader, name)
    single = np.float32(default if found is None else found)  # type: ignore[arg-type]
    exact = get(prim, own)
    if exact is not None and np.float32(1.0 - exact) == single:
        return float(exact)
    return 1.0 - float(single)


def _image_name(asset: Sdf.AssetPath) -> str:
    """The path as the file has it; of an image in a package, that from the package's top."""
    if Ar.IsPackageRelativePath(asset.resolvedPath):
        return str(Ar.SplitPackageRelativePathInner(asset.resolvedPath)[1])
    return str(asset.path)


def _texture(prim: Usd.Prim, shader: UsdShade.Shader | None) -> str | None:
    own = get(prim, "texture")
    color = shader.GetInput("diffuseColor") if shader else None
    sources = color.GetConnectedSources()[0] if color else []
    if sources:
        image = UsdShade.Shader(sources[0].source.GetPrim())
        asset = _input(image, "file")
        if asset is not None:
            return _image_name(asset)
    return None if own is None else str(own)
