"""USDZ: a zip file, without compression, of one binary stage and the images that its materials name."""

from __future__ import annotations

import io
import posixpath
import struct
import tempfile
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from pxr import Sdf, UsdUtils

from fba.errors import InputFileError
from fba.scene import FaceScene
from formats.textures import texture_bytes, texture_names
from formats.usd.crate import impossible_count

MAGIC = b"PK\x03\x04"
_ALIGNMENT = 64
_PADDING = 0x1986
"""The extra field whose length brings the data of an entry to a multiple of 64 bytes, as the format wants it."""
_LAYERS = (".usd", ".usda", ".usdc")
_IMAGES = {".png": b"\x89PNG", ".jpg": b"\xff\xd8\xff", ".jpeg": b"\xff\xd8\xff"}
"""Images that every program opens; others are turned into PNG."""
_PASSIVE = (
    *_IMAGES, ".exr", ".avif", ".hdr", ".tif", ".tiff", ".bmp", ".tga", ".webp", ".gif", ".dds", ".m4a", ".mp3", ".wav"
)  # fmt: skip
"""What OpenUSD never opens while it puts a stage together; these may be missing."""
_MOST_ENTRIES = 10_000


def entries(data: bytes, path: Path) -> dict[str, bytes]:
    """The files in a package, the default layer first, each checked before anything is made of it.

    Raises
    ------
    InputFileError
        If the package is damaged, compressed or encrypted, holds names that lead out of it, or layers that are
        damaged.
    """
    found: dict[str, bytes] = {}
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as package:
            listed = package.infolist()
            if len(listed) > _MOST_ENTRIES:
                raise InputFileError(f"{path} holds {len(listed)} files; more than {_MOST_ENTRIES} are not read")
            total = sum(entry.file_size for entry in listed)
            if total > len(data):
                raise InputFileError(f"{path} is damaged: it claims {total} bytes of files in {len(data)} of its own")
            for entry in sorted(listed, key=lambda e: e.header_offset):
                _check_entry(entry, data, found, path)
                found[entry.filename] = package.read(entry)
    except (zipfile.BadZipFile, struct.error, EOFError, NotImplementedError, UnicodeDecodeError, ValueError) as error:
        raise InputFileError(f"{path} is not a readable USDZ package: {error}") from error
    if not found or not next(iter(found)).lower().endswith(_LAYERS):
        raise InputFileError(f"{path} is not a USDZ package: its first file is not a USD layer")
    for name, content in found.items():
        impossible = impossible_count(content) if name.lower().endswith(_LAYERS) else None
        if impossible:
            raise InputFileError(f"{path} is damaged: in {name} {impossible}")
    return found


def _check_entry(entry: zipfile.ZipInfo, data: bytes, found: Mapping[str, bytes], path: Path) -> None:
    """Refuse what could grow, hide or lead elsewhere; the two headers of an entry must say the same."""
    name = entry.filename
    if entry.compress_type != zipfile.ZIP_STORED or entry.compress_size != entry.file_size or entry.flag_bits & 0x9:
        raise InputFileError(f"{path}: '{name}' is compressed or encrypted, which USDZ does not allow; pack it anew")
    if name in found or not _inside(name):
        raise InputFileError(f"{path}: there is a file '{name[:80]}' twice, or its name leads out of the package")
    if name.lower().endswith(".usdz"):
        raise InputFileError(f"{path}: there is a package '{name}' in the package; unpack it first")
    head = struct.unpack_from("<4s5H3L2H", data, entry.header_offset)
    start = entry.header_offset + 30
    same_name = data[start : start + head[9]] == entry.orig_filename.encode("utf-8")
    if head[0] != MAGIC or head[3] != 0 or head[7:9] != (entry.file_size,) * 2 or not same_name:
        raise InputFileError(f"{path} is damaged: the headers of '{name}' contradict each other")


def _inside(name: str) -> bool:
    """Is this a plain relative path that stays where it is?"""
    return bool(name) and not name.startswith("/") and not set(name) & set("\\:\0[]") and ".." not in name.split("/")


def check_references(found: Mapping[str, bytes], path: Path) -> None:
    """Refuse layers that want anything from outside their package. Call it inside `formats.usd.stages.reading`.

    Raises
    ------
    InputFileError
        If there is such a reference.
    """
    for name in found:
        if not name.lower().endswith(_LAYERS):
            continue
        sublayers, references, payloads = UsdUtils.ExtractExternalReferences(f"{path.absolute()}[{name}]")
        for wanted in (*sublayers, *references, *payloads):
            place = posixpath.normpath(posixpath.join(posixpath.dirname(name), wanted))
            if place not in found and not wanted.lower().endswith(_PASSIVE):
                raise InputFileError(f"{path}: {name} refers to '{wanted}', which is not in the package")


@dataclass(frozen=True, eq=False)
class Packed:
    """A scene whose materials name the images as they lie in a package, and these images."""

    scene: FaceScene
    images: dict[str, bytes]


def packed_images(scene: FaceScene) -> Packed:
    """Choose the images of a package and their names. Those that cannot be had or opened are left out."""
    names: dict[str, str] = {}
    content: dict[str, bytes] = {}
    for texture in texture_names(scene):
        image = _image(texture, texture_bytes(scene, texture))
        if image is not None:
            names[texture] = _free_name(texture, image[1], content)
            content[names[texture]] = image[0]
    shapes = {s.name: replace(s, materials=tuple(m.renamed(names) for m in s.materials)) for s in scene.shapes}
    return Packed(scene.map_shapes(shapes), content)


def package_of(layer: Sdf.Layer, stem: str, images: Mapping[str, bytes]) -> bytes:
    """A package of a stage and its images. Where the layer names others, their paths are taken out of it."""
    UsdUtils.ModifyAssetPaths(layer, lambda asset: asset if asset in images else "")
    with tempfile.TemporaryDirectory() as folder:
        stage = Path(folder) / "stage.usdc"
        layer.Export(str(stage), args={"format": "usdc"})
        files = {f"{stem}.usdc": stage.read_bytes(), **images}
    return _zip(files)


def _image(name: str, data: bytes | None) -> tuple[bytes, str] | None:
    """The bytes of an image and the ending of its name; None where it cannot be opened."""
    if data is None:
        return None
    ending = posixpath.splitext(name.lower())[1]
    if data.startswith(_IMAGES.get(ending, b"\0none")):
        return data, ending
    for kind, magic in _IMAGES.items():
        if data.startswith(magic):
            return data, kind
    from PIL import Image

    out = io.BytesIO()
    try:
        with Image.open(io.BytesIO(data)) as image:
            image.convert("RGBA" if "A" in image.getbands() else "RGB").save(out, "PNG")
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None
    return out.getvalue(), ".png"


def _free_name(texture: str, ending: str, taken: Mapping[str, bytes]) -> str:
    """The name of an image in the package: its own, where that may stand there."""
    name = texture.removeprefix("./")
    if _inside(name) and name.isascii() and name.lower().endswith(ending) and name not in taken:
        return name
    stem = posixpath.splitext(posixpath.basename(texture.replace("\\", "/")))[0]
    stem = "".join(c if c.isascii() and (c.isalnum() or c in "-_") else "_" for c in stem)[:64] or "image"
    number, name = 1, f"textures/{stem}{ending}"
    while name in taken:
        number += 1
        name = f"textures/{stem}_{number}{ending}"
    return name


def _zip(files: Mapping[str, bytes]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_STORED) as package:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name)
            entry.create_system = 3
            start = out.tell() + 30 + len(name.encode()) + 4
            gap = -start % _ALIGNMENT
            entry.extra = struct.pack("<HH", _PADDING, gap) + b"\0" * gap
            package.writestr(entry, data)
    return out.getvalue()
