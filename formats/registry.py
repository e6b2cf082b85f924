"""Which module reads and writes which file name. A format module is imported when a file needs it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Protocol, cast

import numpy as np

from fat.face import AnimatableFace
from fba.errors import FbaError, LandmarkError, UnknownFormatError, UnsupportedFeatureError
from fba.scene import FaceScene
from fba.stream import FapStream
from formats.extent import require_near
from formats.textures import place_textures


class FormatModule(Protocol):
    """What a format module offers; a module may lack either function."""

    def read(self, path: Path) -> FaceScene | AnimatableFace:
        """Read a file; an AnimatableFace when it carries tables."""
        ...

    def write(self, face: FaceScene | AnimatableFace, path: Path) -> None:
        """Write a file atomically."""
        ...


@dataclass(frozen=True, slots=True)
class Format:
    """A file format.

    module : import path of its FormatModule.
    carries_tables : a face written to it reads back with its Facial Animation Tables.
    names_images : its files name the images of materials, which then lie beside them.
    carries_streams : its writer takes a FAP stream as third argument and makes it the file's animation.
    portable : its module also has ``write_portable(face, path, stream)``, for clients that know no MPEG-4 nodes; the
        stream may be None.
    """

    name: str
    extensions: tuple[str, ...]
    module: str
    reads: bool = True
    writes: bool = True
    carries_tables: bool = False
    names_images: bool = False
    carries_streams: bool = False
    portable: bool = False


_FORMATS: list[Format] = []


def register(entry: Format) -> None:
    """Add a format; a later one wins over an earlier one with the same extension."""
    _FORMATS.append(entry)


def formats() -> tuple[Format, ...]:
    """All registered formats."""
    return tuple(_FORMATS)


def format_of(path: Path, *, writing: bool = False) -> Format:
    """Find the format by the file's extension (compound extensions such as .wrl.gz included).

    Raises
    ------
    UnknownFormatError
        If no format reads (writes) such a name.
    """
    name = path.name.lower()
    for entry in reversed(_FORMATS):
        if any(name.endswith(e) for e in entry.extensions) and (entry.writes if writing else entry.reads):
            return entry
    known = sorted({e for f in _FORMATS if (f.writes if writing else f.reads) for e in f.extensions})
    verb = "written" if writing else "read"
    raise UnknownFormatError(f"{path}: files of this kind cannot be {verb}; known extensions: {', '.join(known)}")


def _load(entry: Format, function: str) -> Callable[..., object]:
    return cast("Callable[..., object]", getattr(import_module(entry.module), function))


def read(path: str | Path) -> FaceScene | AnimatableFace:
    """Read a scene or, when the file carries tables, an animatable face; "default" is the shipped source."""
    if str(path) == "default":
        from samples import default_source

        path = default_source()
    path = Path(path)
    try:
        found = cast("FaceScene | AnimatableFace", _load(format_of(path), "read")(path))
        scene = found.scene if isinstance(found, AnimatableFace) else found
        with np.errstate(over="ignore", invalid="ignore"):
            require_near([scene.world_neutral()])
    except FbaError as error:
        if path.name not in str(error):
            error.args = (f"{path}: {error}", *error.args[1:])
        raise
    scene = replace(scene, folder=path.parent)
    return replace(found, scene=scene) if isinstance(found, AnimatableFace) else scene


def read_scene(path: str | Path) -> FaceScene:
    """Read a file and return its scene, whether or not it carries tables."""
    found = read(path)
    return found.scene if isinstance(found, AnimatableFace) else found


def read_face(path: str | Path) -> AnimatableFace:
    """Read an animatable face.

    Raises
    ------
    LandmarkError
        If the file has no Facial Animation Tables.
    """
    found = read(path)
    if isinstance(found, AnimatableFace):
        return found
    raise LandmarkError(
        f"{path} holds no Facial Animation Tables, so it cannot move yet. Make it animatable with: "
        f"fba clone {path} -o OUT.wrl --landmarks POINTS.json"
    )


def write(
    face: FaceScene | AnimatableFace, path: str | Path, stream: FapStream | None = None, *, portable: bool = False
) -> None:
    """Write a face; the extension chooses the format. The file is written whole or not at all.

    Images that materials name are put beside it, where the format does not hold them and they are not there yet; one
    whose name another image there has gets a new name, in the file too.

    stream : becomes the file's animation.
    portable : for clients of the format that know no MPEG-4 nodes.

    Raises
    ------
    UnsupportedFeatureError
        If there is a stream, but the format has no animation, or the face no tables; if the format has no portable
        form.
    """
    path = Path(path)
    entry = format_of(path, writing=True)
    scene = face.scene if isinstance(face, AnimatableFace) else face
    if portable and not entry.portable:
        raise UnsupportedFeatureError(
            f"{path}: {entry.name} has no portable form; choose one of {_extensions(lambda f: f.portable)}"
        )
    if stream is not None and not (entry.carries_streams or portable):
        known = _extensions(lambda f: f.carries_streams)
        raise UnsupportedFeatureError(f"{path}: {entry.name} is written without animation; choose one of {known}")
    if stream is not None and scene is face:
        raise UnsupportedFeatureError(f"'{scene.name}' has no Facial Animation Tables, so a FAP stream cannot move it")
    placed = place_textures(scene, path.parent) if entry.names_images else None
    if placed is not None and placed.scene is not scene:
        face = replace(face, scene=placed.scene) if isinstance(face, AnimatableFace) else placed.scene
    if portable:
        _load(entry, "write_portable")(face, path, stream)
    else:
        _load(entry, "write")(*((face, path) if stream is None else (face, path, stream)))
    if placed is not None:
        placed.write()


def _extensions(of: Callable[[Format], bool]) -> str:
    return ", ".join(e for f in _FORMATS if of(f) for e in f.extensions)
