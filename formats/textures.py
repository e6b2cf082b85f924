"""The images that the materials of a scene name: where they are, and their bytes."""

from __future__ import annotations

from fba.errors import InputFileError
from fba.scene import FaceScene
from formats.files import read_bytes

_MOST_BYTES = 256 << 20


def texture_bytes(scene: FaceScene, name: str) -> bytes | None:
    """The bytes of an image that a material names; None where it cannot be had.

    An image inside the file that the scene was read from comes first, then one in that file's folder. Nothing
    outside that folder is ever opened, whatever the name says.
    """
    if name in scene.images:
        return scene.images[name]
    if scene.folder is None or not name or "\0" in name or ":" in name:
        return None
    try:
        folder = scene.folder.resolve()
        path = (folder / name.replace("\\", "/")).resolve()
        return read_bytes(path, _MOST_BYTES) if path.is_relative_to(folder) else None
    except (InputFileError, OSError, RuntimeError):
        # RuntimeError: links that lead in a circle.
        return None
