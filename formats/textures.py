"""The images that the materials of a scene name: where they are, their bytes, and their way into another folder."""

from __future__ import annotations

from pathlib import Path

from fba.errors import InputFileError, OutputFileError
from fba.scene import FaceScene
from formats.files import read_bytes, write_bytes

_MOST_BYTES = 256 << 20
_ENDINGS = (".png", ".jpg", ".jpeg", ".gif", ".bmp", ".tga", ".tif", ".tiff", ".webp", ".hdr", ".exr", ".dds")
"""Names of other kinds are never written: they come out of files of any origin."""


def texture_names(scene: FaceScene) -> list[str]:
    """The images that the materials name, each once."""
    named = [m.texture for shape in scene.shapes for m in shape.materials if m.texture]
    return list(dict.fromkeys(named))


def texture_bytes(scene: FaceScene, name: str) -> bytes | None:
    """The bytes of an image that a material names; None where it cannot be had.

    An image inside the file that the scene was read from comes first, then one in that file's folder. Nothing
    outside that folder is ever opened, whatever the name says.
    """
    if name in scene.images:
        return scene.images[name]
    path = None if scene.folder is None else _inside(scene.folder, name)
    try:
        return None if path is None else read_bytes(path, _MOST_BYTES)
    except InputFileError:
        return None


def place_textures(scene: FaceScene, folder: Path) -> None:
    """Put the images that materials name into another folder, under the same names.

    What is there already stays. Images that cannot be had, and names that lead out of the folder, are passed over.

    Raises
    ------
    OutputFileError
        If an image cannot be written.
    """
    for name in texture_names(scene):
        path = _inside(folder, name)
        if path is None or path.exists() or path.suffix.lower() not in _ENDINGS:
            continue
        data = texture_bytes(scene, name)
        if data is None:
            continue
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputFileError(f"cannot write {path}: {error.strerror or error}") from error
        write_bytes(path, data)


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
