"""The materials of a glTF file that is read."""

from __future__ import annotations

from typing import cast

from fba.mesh import Material
from fba.shading import ALPHA_MODES, Shading, TextureMap
from formats.colors import from_linear
from formats.gltf.data import GltfData, Json
from formats.gltf.images import Images

FILTERS = {
    9728: "nearest", 9729: "linear", 9984: "nearest_mipmap_nearest", 9985: "linear_mipmap_nearest",
    9986: "nearest_mipmap_linear", 9987: "linear_mipmap_linear",
}  # fmt: skip
WRAP_MODES = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
TEXTURE_TRANSFORM = "KHR_texture_transform"
UNLIT = "KHR_materials_unlit"
EMISSIVE_STRENGTH = "KHR_materials_emissive_strength"
_GLOSSY = "KHR_materials_pbrSpecularGlossiness"
_KNOWN = (UNLIT, EMISSIVE_STRENGTH, _GLOSSY)
_SOURCES = ("EXT_texture_webp", "KHR_texture_basisu", "EXT_texture_avif", "MSFT_texture_dds")


class Surfaces:
    """Reads materials; says what of them is not kept.

    Attributes
    ----------
    remarks : in plain words.
    """

    def __init__(self, data: GltfData, images: Images) -> None:
        self.remarks: list[str] = []
        self._data = data
        self._images = images

    def material(self, index: int) -> Material:
        """One material of the file."""
        data = self._data
        entry = data.item("materials", index)
        extensions = data.dict(entry, "extensions")
        for name in extensions:
            if name not in _KNOWN:
                self.remarks.append(f"the material extension {name[:60]} is not kept")
        if _GLOSSY in extensions and "pbrMetallicRoughness" not in entry:
            surface = self._from_glossy(data.dict(extensions, _GLOSSY))
        else:
            surface = data.dict(entry, "pbrMetallicRoughness")
        *color, alpha = data.numbers(surface, "baseColorFactor", (1.0, 1.0, 1.0, 1.0))
        shading = self._shading(entry, surface, extensions, alpha)
        return Material(
            data.name(entry) or f"material_{index}",
            diffuse=from_linear(color),
            emissive=from_linear(data.numbers(entry, "emissiveFactor", (0.0, 0.0, 0.0))),
            shininess=1.0 - shading.roughness,
            transparency=1.0 - alpha if shading.alpha_mode == "blend" else 0.0,
            texture=None if shading.base is None else shading.base.image,
            shading=shading,
        )

    def _shading(self, entry: Json, surface: Json, extensions: Json, alpha: float) -> Shading:
        normal, occlusion = self._data.dict(entry, "normalTexture"), self._data.dict(entry, "occlusionTexture")
        mode = str(entry.get("alphaMode", "OPAQUE")).lower()
        if mode not in ALPHA_MODES:
            raise self._data.fail(f"the alphaMode '{mode[:20]}' of a material is none of glTF's")
        return Shading(
            base=self._map(surface, "baseColorTexture"),
            metallic=self._number(surface, "metallicFactor", 1.0),
            roughness=min(max(self._number(surface, "roughnessFactor", 1.0), 0.0), 1.0),
            metallic_roughness=self._map(surface, "metallicRoughnessTexture"),
            normal=self._map(entry, "normalTexture"),
            normal_scale=self._number(normal, "scale", 1.0),
            occlusion=self._map(entry, "occlusionTexture"),
            occlusion_strength=self._number(occlusion, "strength", 1.0),
            emissive=self._map(entry, "emissiveTexture"),
            glow=self._number(self._data.dict(extensions, EMISSIVE_STRENGTH), "emissiveStrength", 1.0),
            opacity=alpha,
            alpha_mode=mode,
            alpha_cutoff=self._number(entry, "alphaCutoff", 0.5),
            double_sided=entry.get("doubleSided") is True,
            unlit=UNLIT in extensions,
        )

    def _from_glossy(self, glossy: Json) -> Json:
        """What a specular-glossiness surface is without metal; its specular map is not kept."""
        gloss = self._number(glossy, "glossinessFactor", 1.0)
        surface: Json = {"metallicFactor": 0.0, "roughnessFactor": 1.0 - gloss}
        names = {"diffuseFactor": "baseColorFactor", "diffuseTexture": "baseColorTexture"}
        surface |= {new: glossy[old] for old, new in names.items() if old in glossy}
        if "specularGlossinessTexture" in glossy:
            self.remarks.append("a specular-glossiness map is not kept")
        return surface

    def _number(self, owner: Json, key: str, default: float) -> float:
        if key not in owner:
            return default
        return self._data.numbers({key: [owner[key]]}, key, (default,))[0]

    def _map(self, owner: Json, key: str) -> TextureMap | None:
        data = self._data
        reference = data.dict(owner, key)
        if "index" not in reference:
            return None
        texture = data.item("textures", reference["index"])
        source = texture.get("source")
        for name in _SOURCES:
            other = data.dict(data.dict(texture, "extensions"), name).get("source")
            source = other if source is None else source
        image = None if source is None else self._images.name(source)
        if image is None:
            return None
        sampler = data.item("samplers", texture["sampler"]) if "sampler" in texture else {}
        lay = data.dict(data.dict(reference, "extensions"), TEXTURE_TRANSFORM)
        texcoord = data.integer(lay, "texCoord", data.integer(reference, "texCoord", 0))
        return TextureMap(
            image,
            texcoord,
            (self._wrap(sampler, "wrapS"), self._wrap(sampler, "wrapT")),
            self._filter(sampler, "magFilter"),
            self._filter(sampler, "minFilter"),
            cast("tuple[float, float]", data.numbers(lay, "offset", (0.0, 0.0))),
            self._number(lay, "rotation", 0.0),
            cast("tuple[float, float]", data.numbers(lay, "scale", (1.0, 1.0))),
        )

    def _wrap(self, sampler: Json, key: str) -> str:
        return WRAP_MODES.get(self._data.integer(sampler, key, 10497), "repeat")

    def _filter(self, sampler: Json, key: str) -> str:
        name = FILTERS.get(self._data.integer(sampler, key, 0), "")
        return "" if key == "magFilter" and name not in ("linear", "nearest") else name
