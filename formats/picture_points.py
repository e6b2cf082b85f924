"""Feature points of photographs (JSON): one file for one picture or for many.

``{"format": "fba-picture-points/1", "pictures": {"face.png": {"size": [311, 419], "points": {"8.3": [180, 290]}}}}``.
Pictures go by their file names. Points carry MPEG-4 numbers (other names may be added); places are pixels, x to the
right, y down, [0, 0] the middle of the upper left pixel of the picture as it is seen. ``size`` (width, height) is
optional and guards against points of another copy of the picture.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from fba.errors import InputFileError, LandmarkError
from formats.files import read_bytes, write_bytes

FORMAT = "fba-picture-points/1"

PointsOfPictures = dict[str, dict[str, tuple[float, float]]]


def points_beside(picture: Path) -> Path:
    """Where the points of a picture are looked for: NAME.points.json beside NAME.png."""
    return picture.with_name(picture.stem + ".points.json")


def read_picture_points(path: Path, sizes: Mapping[str, tuple[int, int]]) -> PointsOfPictures:
    """Read the points of some pictures.

    Parameters
    ----------
    path : the file.
    sizes : file name of each picture -> (width, height); other pictures of the file are not looked at.

    Raises
    ------
    InputFileError
        If the file is missing, empty or no JSON.
    LandmarkError
        If it has another format, or a point is no place in its picture; the message names it.
    """
    try:
        document = json.loads(read_bytes(path, 256 << 20).decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise InputFileError(f"{path} is no file of picture points: {str(error)[:200]}") from None
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise LandmarkError(f'{path}: this reads {{"format": "{FORMAT}", "pictures": ...}}')
    pictures = document.get("pictures")
    if not isinstance(pictures, dict):
        raise LandmarkError(f"{path}: 'pictures' must be an object with one entry for each picture's file name")
    return {name: _points(pictures[name], size, f"{path}: {name}") for name, size in sizes.items() if name in pictures}


def write_picture_points(path: Path, points: PointsOfPictures, sizes: Mapping[str, tuple[int, int]]) -> None:
    """Write points of pictures, places rounded to a hundredth of a pixel.

    Raises
    ------
    OutputFileError
        If the file cannot be written.
    """
    blocks = []
    for name, places in points.items():
        rows = ",\n".join(f"      {json.dumps(k)}: [{x:.2f}, {y:.2f}]" for k, (x, y) in places.items())
        size = json.dumps(list(sizes[name]))
        blocks.append(f'    {json.dumps(name)}: {{"size": {size}, "points": {{\n{rows}\n    }}}}')
    text = ",\n".join(blocks)
    write_bytes(path, f'{{\n  "format": "{FORMAT}",\n  "pictures": {{\n{text}\n  }}\n}}\n'.encode())


def _points(entry: object, size: tuple[int, int], where: str) -> dict[str, tuple[float, float]]:
    if not isinstance(entry, dict) or not isinstance(entry.get("points"), dict):
        raise LandmarkError(f"{where} must be an object with 'points'")
    if entry.get("size", list(size)) != list(size):
        raise LandmarkError(
            f"{where}: the points are for a picture of {entry['size']} pixels, but this one has {list(size)}; "
            "place them on this copy"
        )
    return {str(name): _place(place, size, f"{where}, point {name}") for name, place in entry["points"].items()}


def _place(place: object, size: tuple[int, int], where: str) -> tuple[float, float]:
    values = place if isinstance(place, list) else []
    numbers = [float(v) for v in values if isinstance(v, int | float) and not isinstance(v, bool) and abs(v) < 1e9]
    if len(values) != 2 or len(numbers) != 2:
        raise LandmarkError(f"{where} must be two numbers, [x, y] in pixels")
    x, y = numbers
    if not (-0.5 <= x <= size[0] - 0.5 and -0.5 <= y <= size[1] - 0.5):
        raise LandmarkError(f"{where} lies outside its picture of {size[0]} x {size[1]} pixels: [{x:g}, {y:g}]")
    return x, y
