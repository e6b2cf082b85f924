"""Photographs from files: pixels as they are seen, points given, beside them, or found."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from cloning.image import Picture
from cloning.image.color import UInt8
from fba.errors import InputFileError, LandmarkError
from formats.files import atomic_output
from formats.picture_points import points_beside, read_picture_points
from studio.picture_detector import detect_picture_points

SUFFIXES = (".png", ".jpg", ".jpeg", ".pgm", ".ppm", ".bmp", ".tif", ".tiff", ".webp")
LARGEST = 50_000_000
"""Pixels; more would not fit into the promised memory."""


def read_photo(path: Path) -> UInt8:
    """Read a picture as (h, w, 3) uint8, turned as its camera says; transparency is dropped.

    Raises
    ------
    InputFileError
        If it is missing or no picture that can be read.
    """
    from PIL import Image, ImageOps

    if not path.is_file():
        raise InputFileError(f"{path} does not exist or is no file; check the path")
    try:
        with Image.open(path) as opened:
            if opened.width * opened.height > LARGEST:
                raise InputFileError(f"{path} has {opened.width} x {opened.height} pixels; make it smaller first")
            if opened.mode.startswith(("I", "F")):
                raise InputFileError(f"{path} has more than 8 bits a channel; convert it to 8 bits first")
            return np.asarray(ImageOps.exif_transpose(opened).convert("RGB"))
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise InputFileError(f"{path} is no picture that can be read: {error}") from None


def write_photo(rgb: UInt8, path: Path) -> None:
    """Write a PNG.

    Raises
    ------
    OutputFileError
        If the file cannot be written.
    """
    from PIL import Image

    with atomic_output(path) as temporary:
        Image.fromarray(rgb).save(temporary, format="PNG")


def pictures_of(folder: Path) -> list[Path]:
    """The pictures of a folder, by name.

    Raises
    ------
    InputFileError
        If there is none.
    """
    found = sorted(p for p in folder.iterdir() if p.suffix.lower() in SUFFIXES and p.is_file())
    if not found:
        raise InputFileError(f"{folder} holds no pictures ({', '.join(SUFFIXES)})")
    return found


def known_points(
    paths: Sequence[Path], pixels: Sequence[UInt8], given: Path | None, detector: str | None
) -> list[dict[str, tuple[float, float]]]:
    """Points of pictures: from the given file, else beside each picture, else detected; empty where there are none.

    Raises
    ------
    LandmarkError
        If two pictures of one name share the given file, or a file is wrong.
    """
    sizes = {path.name: (p.shape[1], p.shape[0]) for path, p in zip(paths, pixels, strict=True)}
    if given is not None and len(sizes) < len({path.absolute() for path in paths}):
        raise LandmarkError(f"{given} cannot tell pictures of the same name apart; rename one, or use NAME.points.json")
    listed = {} if given is None else read_picture_points(given, sizes)
    out = []
    for path in paths:
        beside = points_beside(path)
        if path.name not in listed and beside.is_file():
            listed |= read_picture_points(beside, {path.name: sizes[path.name]})
            out.append(listed.pop(path.name, {}))
        else:
            out.append(listed.get(path.name, {}))
    bare = [i for i, points in enumerate(out) if not points]
    if detector is not None and bare:
        for i, points in zip(bare, detect_picture_points(detector, [paths[i] for i in bare]), strict=True):
            out[i] = points
    return out


def with_points(
    paths: Sequence[Path], pixels: Sequence[UInt8], points: Sequence[dict[str, tuple[float, float]]]
) -> list[Picture]:
    """Pictures with their points.

    Raises
    ------
    LandmarkError
        If one has none.
    """
    for path, found in zip(paths, points, strict=True):
        if not found:
            raise LandmarkError(
                f"{path} has no points: write them to {points_beside(path).name} or give --landmarks; "
                "--template POINTS.json makes a file to adjust, --detector finds them"
            )
    return [Picture(p, found) for p, found in zip(pixels, points, strict=True)]
