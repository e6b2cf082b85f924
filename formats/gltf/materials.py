"""Materials and their images: metallic-roughness surfaces without metal."""

from __future__ import annotations

import struct

from fba.mesh import Material
from fba.scene import FaceScene
from formats.gltf.buffers import Buffer, Json
from formats.gltf.colors import to_linear
from formats.textures import texture_bytes, texture_names

_PNG, _JPEG = b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff"
_REPEAT = 10497
_LINEAR, _LINEAR_MIPMAP_LINEAR = 9729, 9987
CUTOFF = 0.5
"""Opacity below which a texture with holes (hair, lashes) is not drawn."""


class Materials:
    """Writes every different material and image of a scene once."""

    def __init__(self, buffer: Buffer, scene: FaceScene) -> None:
        self.entries: list[Json] = []
        self.images: list[Json] = []
        self._buffer = buffer
        self._scene = scene
        self._numbers: dict[tuple[Material, bool], int] = {}
        self._textures: dict[str, tuple[int, bool] | None] = {}

    def number(self, material: Material, mapped: bool) -> int:
        """Number of a material in the file.

        mapped : it lies on a surface with texture coordinates; without them it cannot have its texture.
        """
        key = (material, mapped and material.texture is not None)
        if key not in self._numbers:
            self._numbers[key] = len(self.entries)
            self.entries.append(self._entry(*key))
        return self._numbers[key]

    def _entry(self, material: Material, textured: bool) -> Json:
        opacity = 1.0 - min(max(material.transparency, 0.0), 1.0)
        image = self._texture(material.texture)  # Kept in the file even where nothing shows it.
        texture = image if textured else None
        color = to_linear(material.diffuse) if texture is None else [1.0, 1.0, 1.0]
        surface: Json = {
            "baseColorFactor": [*color, opacity],
            "metallicFactor": 0.0,
            "roughnessFactor": 1.0 - min(max(material.shininess, 0.0), 1.0),
        }
        entry: Json = {"pbrMetallicRoughness": surface, "doubleSided": True}
        if material.name:
            entry["name"] = material.name
        if any(material.emissive):
            entry["emissiveFactor"] = to_linear(material.emissive)
        if texture is not None:
            surface["baseColorTexture"] = {"index": texture[0]}
        if opacity < 1.0:
            entry["alphaMode"] = "BLEND"
        elif texture is not None and texture[1]:
            entry |= {"alphaMode": "MASK", "alphaCutoff": CUTOFF}
        return entry

    def _texture(self, name: str | None) -> tuple[int, bool] | None:
        """Number of a texture and whether it has an alpha channel; None where there is no PNG or JPEG to be had."""
        if name is None:
            return None
        if name not in self._textures:
            self._textures[name] = None
            data = texture_bytes(self._scene, name)
            kind = None if data is None else image_type(data)
            if data is not None and kind is not None:
                self.images.append({"name": name, "mimeType": kind, "bufferView": self._buffer.view(data)})
                self._textures[name] = (len(self.images) - 1, _has_alpha(data))
        return self._textures[name]

    def write(self, document: Json) -> None:
        """Put materials, textures and images into the document."""
        if self.entries:
            document["materials"] = self.entries
        if self.images:
            sides = {"wrapS": _REPEAT, "wrapT": _REPEAT}
            document["samplers"] = [{"magFilter": _LINEAR, "minFilter": _LINEAR_MIPMAP_LINEAR, **sides}]
            document["textures"] = [{"sampler": 0, "source": k} for k in range(len(self.images))]
            document["images"] = self.images


def left_out(scene: FaceScene) -> list[str]:
    """Images that the materials name, but that do not get into a glTF file: other kinds, and what cannot be had."""
    found = [(name, texture_bytes(scene, name)) for name in texture_names(scene)]
    return [name for name, data in found if data is None or image_type(data) is None]


def image_type(data: bytes) -> str | None:
    """The media type of an image that glTF can hold, else None."""
    if data.startswith(_PNG):
        return "image/png"
    return "image/jpeg" if data.startswith(_JPEG) else None


def _has_alpha(data: bytes) -> bool:
    """True for a PNG with an alpha channel or a transparent colour."""
    if not data.startswith(_PNG) or len(data) < 33:
        return False
    if data[25] in (4, 6):
        return True
    at = 8
    while at + 8 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        if kind in (b"tRNS", b"IDAT"):
            return bool(kind == b"tRNS")
        at += 12 + length
    return False
