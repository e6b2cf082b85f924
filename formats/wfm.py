"""A Candide-3 model (.wfm): the neutral mesh, and animation units, which are named offsets of some vertices.

Plain text in sections. ``# VERTEX LIST:`` and ``# FACE LIST:`` hold a number and as many lines: three coordinates, or
the vertices of a polygon. ``# ANIMATION UNITS LIST:`` holds the number of units; each has a comment with its name, the
number of its vertices, and a line ``vertex dx dy dz`` for each. (J. Ahlberg, "CANDIDE-3: an updated parameterised
face", LiTH-ISY-R-2326.)
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fba.arrays import Floats
from fba.errors import InputFileError, TextSyntaxError
from fba.scene import FaceScene
from formats.files import read_bytes
from formats.mesh_document import scene_of_polygons

VERTICES, FACES, UNITS = "VERTEX LIST", "FACE LIST", "ANIMATION UNITS LIST"


def read(path: Path) -> FaceScene:
    """Read the neutral mesh.

    Raises
    ------
    InputFileError
        If the file cannot be read, or a section is missing or empty.
    TextSyntaxError
        If a line is not what it should be; the message names it.
    """
    path = Path(path)
    lines = read_bytes(path).decode("latin-1").splitlines()
    rows = _Rows(path, lines, _section(path, lines, VERTICES, "vertices"))
    vertices = np.array([rows.position() for _ in range(rows.number(f"the number of vertices after '# {VERTICES}:'"))])
    rows = _Rows(path, lines, _section(path, lines, FACES, "mesh"))
    faces = [rows.polygon(len(vertices)) for _ in range(rows.number(f"the number of polygons after '# {FACES}:'"))]
    corners = np.array([vertex for face in faces for vertex in face], dtype=np.int64)
    return scene_of_polygons(path, vertices, corners, np.array([len(face) for face in faces], dtype=np.int64))


def read_animation_units(path: Path, count: int) -> list[tuple[str, Floats]]:
    """Read the animation units.

    Parameters
    ----------
    count : number of vertices of the neutral face.

    Returns
    -------
    Name and offsets (count, 3) of each unit.

    Raises
    ------
    InputFileError
        If the file cannot be read, or holds no animation units.
    TextSyntaxError
        If a line is not what it should be; the message names it.
    """
    lines = read_bytes(path).decode("latin-1").splitlines()
    rows = _Rows(path, lines, _section(path, lines, UNITS, "animation units"))
    found: list[tuple[str, Floats]] = []
    for _ in range(rows.number(f"the number of units after '# {UNITS}:'")):
        amount = rows.number("the number of vertices of an animation unit")
        name = rows.comment or f"unit {len(found) + 1}"
        offsets = np.zeros((count, 3))
        for _ in range(amount):
            vertex, offset = rows.move(count)
            offsets[vertex] += offset
        found.append((name, offsets))
    return found


def _section(path: Path, lines: list[str], name: str, what: str) -> int:
    """Number of the line after a section's heading."""
    start = next((k for k, line in enumerate(lines) if line.startswith("#") and name in line), None)
    if start is None:
        raise InputFileError(f"{path} has no section '# {name}:', so it holds no {what}")
    return start + 1


class _Rows:
    """The lines of a section, one after the other; empty ones are left out, comments remembered."""

    def __init__(self, path: Path, lines: list[str], start: int) -> None:
        self.path = path
        self.comment = ""
        self._rest = self._words(lines, start)
        self._line = start

    def _words(self, lines: list[str], start: int) -> Iterator[list[str]]:
        for number in range(start, len(lines)):
            self._line = number + 1
            text = lines[number].strip()
            if text.startswith("#"):
                self.comment = text.lstrip("# ").strip()
            elif text:
                yield text.split()

    def number(self, what: str) -> int:
        words = next(self._rest, [])
        if len(words) != 1 or not _is_number(words[0]):
            raise self._error(f"expected {what}")
        return int(words[0])

    def position(self) -> list[float]:
        words = next(self._rest, [])
        try:
            place = [float(word) for word in words]
        except ValueError:
            place = []
        if len(place) != 3 or not np.isfinite(place).all():
            raise self._error("expected three finite coordinates")
        return place

    def polygon(self, count: int) -> list[int]:
        words = next(self._rest, [])
        if len(words) < 3 or not all(_is_number(word) and int(word) < count for word in words):
            raise self._error(f"expected three or more vertices of a polygon (0 to {count - 1})")
        return [int(word) for word in words]

    def move(self, count: int) -> tuple[int, list[float]]:
        words = next(self._rest, [])
        try:
            vertex, offset = int(words[0]), [float(word) for word in words[1:]]
        except (IndexError, ValueError):
            raise self._error("expected a line 'vertex dx dy dz'") from None
        if len(offset) != 3 or not np.isfinite(offset).all() or not 0 <= vertex < count:
            raise self._error(f"expected a vertex of the neutral face (0 to {count - 1}) and three finite offsets")
        return vertex, offset

    def _error(self, message: str) -> TextSyntaxError:
        return TextSyntaxError(message, self._line, 1, str(self.path))


def _is_number(word: str) -> bool:
    """True for plain digits; other alphabets and numbers of very many digits cannot be converted."""
    return word.isascii() and word.isdigit() and len(word) < 10
