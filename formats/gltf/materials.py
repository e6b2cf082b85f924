"""Materials and their images: metallic-roughness surfaces, without metal where the face does not say."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from fba.mesh import Material
from fba.scene import FaceScene
from fba.shading import Shading, TextureMap
from formats.colors import to_linear
from formats.gltf.buffers import Buffer, Json
from formats.gltf.surfaces import EMISSIVE_STRENGTH, FILTERS, TEXTURE_TRANSFORM, UNLIT, WRAP_MODES
from formats.image_kinds import has_alpha, image_type
from formats.textures import texture_bytes, texture_names

CUTOFF = 0.5
"""Opacity below which a texture with holes (hair, lashes) is not drawn."""

_WEBP = "EXT_texture_webp"
_FILTER_NUMBERS = {name: number for number, name in FILTERS.items()}
_WRAP_NUMBERS = {name: number for number, name in WRAP_MODES.items()}


class Materials:
    """Writes every different material, texture, sampler and image of a scene once."""

    def __init__(self, buffer: Buffer, scene: FaceScene) -> None:
        self._buffer = buffer
        self._scene = scene
        self._entries: list[Json] = []
        self._images: list[Json] = []
        self._samplers: list[Json] = []
        self._textures: list[Json] = []
        self._extensions: set[str] = set()
        self._numbers: dict[tuple[Material, int], int] = {}
        self._image_numbers: dict[str, int | None] = {}
        self._holes: set[str] = set()

    def number(self, material: Material, texcoords: int) -> int:
        """Number of a material in the file.

        texcoords : sets of texture coordinates that its surface has; maps on other sets are left out.
        """
        for name in material.images:
            self._image(name)  # Kept in the file even where nothing shows it.
        maps = () if material.shading is None else material.shading.maps
        key = (material, min(texcoords, max((m.texcoord + 1 for m in maps), default=1)))
        if key not in self._numbers:
            self._numbers[key] = len(self._entries)
            self._entries.append(self._entry(*key))
        return self._numbers[key]

    def _entry(self, material: Material, texcoords: int) -> Json:
        def reference(found: TextureMap | None) -> Json | None:
            if found is None or found.texcoord >= texcoords or self._image(found.image) is None:
                return None
            return self._reference(found)

        plain = self._plain(material)
        shading = material.shading or plain
        base = shading.base
        if material.texture is not None and (base is None or base.image != material.texture):
            base = _trilinear(material.texture)
        texture = reference(base if material.texture is not None else None)
        # Files that do not say how colour and image go together show the image alone.
        white = texture is not None and (material.shading is None or material.shading.base is None)
        surface: Json = {
            "baseColorFactor": [*([1.0, 1.0, 1.0] if white else to_linear(material.diffuse)), _share(shading.opacity)],
            "metallicFactor": _share(shading.metallic),
            "roughnessFactor": _share(shading.roughness),
        }
        entry: Json = {"pbrMetallicRoughness": surface}
        if shading.double_sided:
            entry["doubleSided"] = True
        if material.name:
            entry["name"] = material.name
        if any(material.emissive):
            entry["emissiveFactor"] = to_linear(material.emissive)
        if texture is not None:
            surface["baseColorTexture"] = texture
        self._put_maps(entry, shading, reference)
        mode = shading.alpha_mode or plain.alpha_mode
        if mode == "mask" and (texture is not None or shading.alpha_mode != plain.alpha_mode):
            entry |= {"alphaMode": "MASK", "alphaCutoff": max(shading.alpha_cutoff, 0.0)}
        elif mode == "blend":
            entry["alphaMode"] = "BLEND"
        return entry

    def _plain(self, material: Material) -> Shading:
        """The surface of a material that says nothing of it."""
        opacity = _share(1.0 - material.transparency)
        mode = "blend" if opacity < 1.0 else "mask" if material.texture in self._holes else "opaque"
        rough = 1.0 - material.shininess
        return Shading(roughness=rough, opacity=opacity, alpha_mode=mode, alpha_cutoff=CUTOFF)

    def _put_maps(self, entry: Json, shading: Shading, reference: Callable[[TextureMap | None], Json | None]) -> None:
        """The maps beside the base colour, and the extensions."""
        rough = reference(shading.metallic_roughness)
        if rough is not None:
            entry["pbrMetallicRoughness"]["metallicRoughnessTexture"] = rough
        for key, found, factor, amount in (
            ("normalTexture", shading.normal, "scale", shading.normal_scale),
            ("occlusionTexture", shading.occlusion, "strength", _share(shading.occlusion_strength)),
            ("emissiveTexture", shading.emissive, "", 1.0),
        ):
            texture = reference(found)
            if texture is not None:
                entry[key] = texture if amount == 1.0 else texture | {factor: amount}
        extensions: Json = {}
        if shading.unlit:
            extensions[UNLIT] = {}  # Such a surface does not glow.
        elif shading.glow != 1.0:
            extensions[EMISSIVE_STRENGTH] = {"emissiveStrength": max(shading.glow, 0.0)}
        if extensions:
            entry["extensions"] = extensions
            self._extensions |= extensions.keys()

    def _reference(self, found: TextureMap) -> Json:
        """How a material names a texture."""
        sampler: Json = {}
        if found.magnify:
            sampler["magFilter"] = _FILTER_NUMBERS[found.magnify]
        if found.minify:
            sampler["minFilter"] = _FILTER_NUMBERS[found.minify]
        sampler |= {"wrapS": _WRAP_NUMBERS[found.wrap[0]], "wrapT": _WRAP_NUMBERS[found.wrap[1]]}
        image = self._image_numbers[found.image]
        texture: Json = {"sampler": _place(self._samplers, sampler)}
        if self._images[image or 0]["mimeType"] == "image/webp":
            texture["extensions"] = {_WEBP: {"source": image}}
            self._extensions.add(_WEBP)
        else:
            texture["source"] = image
        reference: Json = {"index": _place(self._textures, texture)}
        if found.texcoord:
            reference["texCoord"] = found.texcoord
        if found.transformed:
            lay = {"offset": list(found.offset), "rotation": found.rotation, "scale": list(found.scale)}
            reference["extensions"] = {TEXTURE_TRANSFORM: lay}
            self._extensions.add(TEXTURE_TRANSFORM)
        return reference

    def _image(self, name: str) -> int | None:
        """Number of an image; None where there is none that glTF can hold."""
        if name not in self._image_numbers:
            self._image_numbers[name] = None
            data = texture_bytes(self._scene, name)
            kind = None if data is None else image_type(data)
            if data is not None and kind is not None:
                self._images.append({"name": name, "mimeType": kind, "bufferView": self._buffer.view(data)})
                self._image_numbers[name] = len(self._images) - 1
                if has_alpha(data):
                    self._holes.add(name)
        return self._image_numbers[name]

    def write(self, document: Json) -> None:
        """Put materials, textures, samplers, images and the extensions that they need into the document."""
        lists = {
            "materials": self._entries, "samplers": self._samplers, "textures": self._textures, "images": self._images,
        }  # fmt: skip
        document |= {key: values for key, values in lists.items() if values}
        if self._extensions:
            document["extensionsUsed"] = sorted(self._extensions)
        if _WEBP in self._extensions:
            document["extensionsRequired"] = [_WEBP]


def left_out(scene: FaceScene) -> list[str]:
    """Images that the materials name, but that do not get into a glTF file: other kinds, and what cannot be had."""
    found = [(name, texture_bytes(scene, name)) for name in texture_names(scene)]
    return [name for name, data in found if data is None or image_type(data) is None]


def _trilinear(image: str) -> TextureMap:
    return replace(TextureMap(image), magnify="linear", minify="linear_mipmap_linear")


def _share(value: float) -> float:
    return min(max(value, 0.0), 1.0)


def _place(entries: list[Json], entry: Json) -> int:
    """Where an entry is in a list; it is added if it is not there yet."""
    if entry not in entries:
        entries.append(entry)
    return entries.index(entry)
