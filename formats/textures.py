"""The images that the materials of a scene name: where they are, their bytes, and their way into another folder."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

from fba.errors import InputFileError, OutputFileError
from fba.scene import FaceScene
from formats.files import read_bytes, write_bytes

_MOST_BYTES = 256 << 20
_ENDINGS = (".png", ".jpg", ".jpeg", ".gif", ".bmp", ".tga", ".tif", ".tiff", ".webp", ".hdr", ".exr", ".dds")
"""Names of other kinds are never written: they come out of files of any origin."""

_NO_URI = re.compile(r'[#?%"<>|*\x00-\x1f\x7f]')
"""Characters that mean something else in a URI or in a shell; no file is written under a name with one of them."""


def texture_names(scene: FaceScene) -> list[str]:
    """The images that the materials name, each once."""
    named = [name for shape in scene.shapes for m in shape.materials for name in m.images]
    return list(dict.fromkeys(named))


def texture_bytes(scene: FaceScene, name: str) -> bytes | None:
    """The bytes of an image that a material names; None where it cannot be had.

    An image inside the file that the scene was read from comes first, then one in that file's folder: under the name
    itself, then with a URI's escapes taken back, then under the last part of its path, since files name images where
    they lay on another machine. Nothing outside that folder is ever opened, whatever the name says.
    """
    return _find(scene, name)[1]


def missing_textures(scene: FaceScene) -> list[str]:
    """Images that the materials name, but that cannot be had; those on the net are not looked for."""
    return [name for name in texture_names(scene) if ":/" not in name and texture_bytes(scene, name) is None]


def left_out(scene: FaceScene) -> list[str]:
    """Images that can be had, but are of a kind that is never written beside a file."""
    found = {name: _find(scene, name) for name in texture_names(scene)}
    return [name for name, (own, data) in found.items() if data is not None and _safe_name(own) is None]


def _find(scene: FaceScene, name: str) -> tuple[str, bytes | None]:
    """The name under which an image is found, and its bytes."""
    if name in scene.images:
        return name, scene.images[name]
    for candidate in _candidates(name) if scene.folder is not None else ():
        path = _inside(scene.folder, candidate) if scene.folder is not None else None
        try:
            if path is not None and path.is_file():
                return candidate, read_bytes(path, _MOST_BYTES)
        except (InputFileError, OSError):
            continue
    return name, None


def _candidates(name: str) -> Iterator[str]:
    if "://" in name:
        return
    plain = name.replace("\\", "/")
    names = [name, unquote(name), PurePosixPath(plain).name, PurePosixPath(unquote(plain)).name]
    yield from dict.fromkeys(names)


@dataclass(frozen=True, eq=False)
class PlacedTextures:
    """Where the images of a scene go in a folder.

    Attributes
    ----------
    scene : the scene, its materials naming the images as they will lie there.
    files : what is to be written.
    """

    scene: FaceScene
    files: dict[Path, bytes]

    def write(self) -> None:
        """Write the images.

        Raises
        ------
        OutputFileError
            If one cannot be written.
        """
        for path, data in self.files.items():
            try:
                path.parent.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise OutputFileError(f"cannot write {path}: {error.strerror or error}") from error
            write_bytes(path, data)


def place_textures(scene: FaceScene, folder: Path) -> PlacedTextures:
    """Choose a place in a folder for each image that materials name, under its own name where that can be.

    What is there already stays: an image whose name another one has gets a number behind it. Images that cannot be
    had or are of kinds that are never written keep their names and are passed over.
    """
    names: dict[str, str] = {}
    files: dict[Path, bytes] = {}
    taken: dict[str, bytes] = {}
    for name in texture_names(scene):
        own, data = _find(scene, name)
        wanted = None if data is None else _safe_name(own)
        if data is None or wanted is None:
            continue
        for candidate in _numbered(wanted):
            path = _inside(folder, candidate)
            if path is None or taken.setdefault(candidate.casefold(), data) != data:
                continue
            there = _content(path)
            if there in (None, data):
                names[name] = candidate
                if there is None:
                    files[path] = data
                break
    changed = {
        shape.name: replace(shape, materials=tuple(m.renamed(names) for m in shape.materials))
        for shape in scene.shapes
        if any(names.get(n, n) != n for m in shape.materials for n in m.images)
    }
    images = {names.get(name, name): data for name, data in scene.images.items()}
    return PlacedTextures(replace(scene.map_shapes(changed), images=images) if changed else scene, files)


def _safe_name(name: str) -> str | None:
    """A relative path that leads down only and is a plain URI; None for kinds that are never written."""
    parts = PurePosixPath(name.replace("\\", "/")).parts
    if name.startswith(("/", "\\")) or ":" in name or ".." in parts:
        parts = parts[-1:]
    cleaned = [_NO_URI.sub("_", part).replace(":", "_") for part in parts]
    joined = "/".join(part for part in cleaned if part.strip(". "))
    return joined if joined.lower().endswith(_ENDINGS) else None


def _numbered(name: str) -> Iterator[str]:
    yield name
    stem, dot, ending = name.rpartition(".")
    for number in range(2, 1000):
        yield f"{stem}_{number}{dot}{ending}"


def _content(path: Path) -> bytes | None:
    """What stands there; None for nothing, no bytes for what is no file or cannot be read."""
    if not path.exists():
        return None
    try:
        return read_bytes(path, _MOST_BYTES)
    except InputFileError:
        return b""


def _inside(folder: Path, name: str) -> Path | None:
    """The file of this name in the folder; None for names that are no path or lead out of it."""
    if not name or "\0" in name or ":" in name:
        return None
    try:
        top = folder.resolve()
        path = (top / name.replace("\\", "/")).resolve()
    except (OSError, RuntimeError):
        # RuntimeError: links that lead in a circle.
        return None
    return path if path.is_relative_to(top) else None
