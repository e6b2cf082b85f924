"""The images of a glTF file that is read: files beside it, or bytes inside it, which get file names here."""

from __future__ import annotations

import re
from urllib.parse import unquote

from formats.gltf.data import GltfData, Json
from formats.image_kinds import image_type
from formats.names import UniqueNames

_EXTENSIONS = {"image/png": ".png", "image/jpeg": ".jpg", "image/webp": ".webp"}


class Images:
    """Names images as materials do.

    Attributes
    ----------
    inside : name -> bytes of the images inside the file that were asked for.
    """

    def __init__(self, data: GltfData) -> None:
        self.inside: dict[str, bytes] = {}
        self._data = data
        self._labels = UniqueNames()
        self._names: dict[object, str | None] = {}

    def name(self, index: object) -> str | None:
        """The path of an image beside the file, or a name for one inside it; None for one that is nowhere."""
        image = self._data.item("images", index)  # Refuses what is no number.
        if index not in self._names:
            self._names[index] = self._find(image, index)
        return self._names[index]

    def _find(self, image: Json, index: object) -> str | None:
        uri = image.get("uri")
        if isinstance(uri, str) and not uri.startswith("data:"):
            return unquote(uri)
        if isinstance(uri, str):
            content = self._data.inline(uri, f"image {index}")
        elif "bufferView" in image:
            content = self._data.bytes_of(image["bufferView"])
        else:
            return None
        name = self._free(self._data.name(image) or f"image_{index}", _EXTENSIONS.get(image_type(content) or "", ""))
        self.inside[name] = content
        return name

    def _free(self, label: str, extension: str) -> str:
        """A file name that no other image has."""
        stem = re.sub(r"[^\w.-]+", "_", label).strip(".")[:80] or "image"
        stem = stem.removesuffix(extension) if extension else stem
        return self._labels.take(stem, extension)
