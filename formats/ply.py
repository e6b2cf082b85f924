"""PLY, the Stanford polygon format: ASCII and binary, polygons of any arity, the file's own vertex order."""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fat.face import AnimatableFace
from fba.arrays import Floats
from fba.errors import InputFileError, UnsupportedFeatureError
from fba.scene import FaceScene
from formats.files import read_bytes, write_bytes
from formats.gathered import gather_mesh
from formats.mesh_document import scene_of_polygons

_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8",
}  # fmt: skip
_STRUCT = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "f4": "f", "f8": "d"}
_CORNER_LISTS = ("vertex_indices", "vertex_index")


@dataclass(frozen=True, slots=True)
class _Property:
    """A column. type : numpy type of the value (or of a list's items); count : of a list's length, else None."""

    name: str
    type: str
    count: str | None = None


@dataclass(frozen=True, slots=True)
class _Element:
    name: str
    rows: int
    properties: tuple[_Property, ...]

    @property
    def least_row(self) -> int:
        """Bytes that one row takes at least."""
        return sum(int((p.count or p.type)[1]) for p in self.properties)


_Corners = tuple[NDArray[np.int64], NDArray[np.int64]]
"""Corner indices of all polygons, number of corners of each."""


def read(path: Path) -> FaceScene:
    """Read a PLY file: positions and polygons; other properties and elements are skipped.

    Raises
    ------
    InputFileError
        If the file is missing, cut, damaged or holds no mesh.
    UnsupportedFeatureError
        If its polygons are triangle strips.
    MeshError
        For positions that are not finite and vertex numbers out of range.
    """
    path = Path(path)
    data = read_bytes(path)
    order, elements, start = _header(path, data)
    reader = _Ascii(path, data[start:]) if order == "" else _Binary(path, data, start, order)
    vertices: Floats | None = None
    corners: _Corners | None = None
    for element in elements:
        if element.name == "tristrips":
            raise UnsupportedFeatureError(f"{path} holds triangle strips; save it with plain polygons")
        names = [p.name for p in element.properties]
        if element.name == "vertex":
            if not {"x", "y", "z"} <= set(names):
                raise InputFileError(f"{path}: its vertices have no x, y and z")
            vertices = reader.scalars(element, ("x", "y", "z"))
        elif element.name == "face" and any(n in _CORNER_LISTS for n in names):
            corners = reader.lists(element, next(n for n in names if n in _CORNER_LISTS))
        else:
            reader.skip(element)
    if vertices is None or corners is None:
        raise InputFileError(f"{path} holds no mesh: it has no {'vertex' if vertices is None else 'face'} element")
    return scene_of_polygons(path, vertices, *corners)


def _header(path: Path, data: bytes) -> tuple[str, list[_Element], int]:
    """Byte order ("" for ASCII), elements and where the body begins."""
    end = re.search(rb"(?:^|[\r\n])end_header[ \t]*(\r\n|\n|\r)", data[: 1 << 20])
    if not data.startswith(b"ply") or end is None:
        raise InputFileError(f"{path} is not a PLY file: it has no header from 'ply' to 'end_header'")
    order = None
    elements: list[_Element] = []
    for line in re.split(r"[\r\n]+", data[: end.start()].decode("latin-1"))[1:]:
        words = line.split()
        try:
            if not words or words[0] in ("comment", "obj_info"):
                continue
            if words[0] == "format":
                order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[words[1]]
            elif words[0] == "element":
                elements.append(_Element(words[1], int(words[2]), ()))
                if elements[-1].rows < 0:
                    raise ValueError
            elif words[0] == "property":
                last = elements[-1]
                new = _property(words)
                elements[-1] = _Element(last.name, last.rows, (*last.properties, new))
            else:
                raise ValueError
        except (KeyError, IndexError, ValueError):
            raise InputFileError(
                f"{path}: the header line '{line.strip()[:60]}' makes no sense in a PLY file"
            ) from None
    if order is None:
        raise InputFileError(f"{path}: the header has no 'format' line")
    if not all(e.properties for e in elements):
        raise InputFileError(f"{path}: an element of the header has no properties")
    return order, elements, end.end()


def _property(words: list[str]) -> _Property:
    if words[1] == "list":
        count = _TYPES[words[2]]
        if count[0] == "f":
            raise ValueError
        return _Property(words[4], _TYPES[words[3]], count)
    return _Property(words[2], _TYPES[words[1]])


class _Ascii:
    """The body as words, read element by element."""

    def __init__(self, path: Path, body: bytes) -> None:
        self.path = path
        try:
            self.values = np.array(list(map(float, body.split())), dtype=np.float64)
        except ValueError as error:
            raise InputFileError(f"{path}: damaged text behind the header ({str(error)[:80]})") from None
        self.at = 0

    def _take(self, count: int) -> Floats:
        if count > self.values.size - self.at:
            raise InputFileError(f"{self.path} is cut: fewer numbers than its header promises")
        self.at += count
        return self.values[self.at - count : self.at]

    def scalars(self, element: _Element, names: tuple[str, ...]) -> Floats:
        if any(p.count for p in element.properties):
            raise UnsupportedFeatureError(f"{self.path}: its vertices have list properties; save it without them")
        own = [p.name for p in element.properties]
        table = self._take(element.rows * len(own)).reshape(-1, len(own))
        return table[:, [own.index(n) for n in names]].copy()

    def lists(self, element: _Element, name: str) -> _Corners:
        starts, counts = [], []
        left = self.values.size - self.at
        if element.rows * len(element.properties) > left:
            raise InputFileError(f"{self.path} is cut: fewer numbers than its header promises")
        for _ in range(element.rows):
            for p in element.properties:
                if p.count is None:
                    self._take(1)
                    continue
                length = float(self._take(1)[0])
                if not (length >= 0 and length.is_integer()):
                    raise InputFileError(f"{self.path}: a list has the length {length:g}")
                if p.name == name:
                    starts.append(self.at)
                    counts.append(int(length))
                self._take(int(length))
        return _gathered(self.values, np.array(starts, dtype=np.int64), np.array(counts, dtype=np.int64), self.path)

    def skip(self, element: _Element) -> None:
        if all(p.count is None for p in element.properties):
            self._take(element.rows * len(element.properties))
        else:
            self.lists(element, "")


class _Binary:
    """The body as bytes, read element by element."""

    def __init__(self, path: Path, data: bytes, start: int, order: str) -> None:
        self.path, self.data, self.at, self.order = path, data, start, order

    def _check(self, size: int) -> None:
        if size > len(self.data) - self.at:
            raise InputFileError(f"{self.path} is cut: it ends before what its header promises")

    def scalars(self, element: _Element, names: tuple[str, ...]) -> Floats:
        if any(p.count for p in element.properties):
            raise UnsupportedFeatureError(f"{self.path}: its vertices have list properties; save it without them")
        self._check(element.rows * element.least_row)
        row = np.dtype([(f"{i}", self.order + p.type) for i, p in enumerate(element.properties)])
        table = np.frombuffer(self.data, row, element.rows, self.at) if element.rows else np.zeros(0, row)
        self.at += element.rows * row.itemsize
        own = [p.name for p in element.properties]
        with np.errstate(invalid="ignore"):  # Signalling NaNs; refused later with all that is not finite.
            return np.stack([table[str(own.index(n))].astype(np.float64) for n in names], axis=1)

    def lists(self, element: _Element, name: str) -> _Corners:
        self._check(element.rows * element.least_row)
        wanted = [p for p in element.properties if p.name == name]
        readers = [
            (struct.Struct(self.order + _STRUCT[p.count]) if p.count else None, int(p.type[1]), p.name == name)
            for p in element.properties
        ]
        starts, counts = [], []
        at = self.at
        try:
            for _ in range(element.rows):
                for counter, width, keep in readers:
                    if counter is None:
                        at += width
                        continue
                    (length,) = counter.unpack_from(self.data, at)
                    if length < 0:
                        raise InputFileError(f"{self.path}: a list has the length {length}")
                    at += counter.size
                    if keep:
                        starts.append(at)
                        counts.append(length)
                    at += width * length
        except struct.error:
            at = len(self.data) + 1
        self._check(at - self.at)
        self.at = at
        if not wanted:
            return np.zeros(0, np.int64), np.zeros(0, np.int64)
        return self._items(np.array(starts, np.int64), np.array(counts, np.int64), wanted[0].type)

    def _items(self, starts: NDArray[np.int64], counts: NDArray[np.int64], kind: str) -> _Corners:
        width = int(kind[1])
        places = np.repeat(starts - width * (np.cumsum(counts) - counts), counts) + width * np.arange(counts.sum())
        raw = np.frombuffer(self.data, np.uint8)[places[:, None] + np.arange(width)]
        values = np.ascontiguousarray(raw).view(self.order + kind).ravel()
        return _gathered(values.astype(np.float64), np.cumsum(counts) - counts, counts, self.path)

    def skip(self, element: _Element) -> None:
        self.lists(element, "")


def _gathered(values: Floats, starts: NDArray[np.int64], counts: NDArray[np.int64], path: Path) -> _Corners:
    places = np.repeat(starts - (np.cumsum(counts) - counts), counts) + np.arange(counts.sum())
    corners = values[places]
    if corners.size and not (np.isfinite(corners).all() and np.abs(corners).max() < 2**31):
        raise InputFileError(f"{path}: a polygon has a corner that is no vertex number")
    return corners.astype(np.int64), counts


def write(face: FaceScene | AnimatableFace, path: Path) -> None:
    """Write a face's neutral mesh as binary little-endian PLY with double coordinates, in the file's own order.

    Raises
    ------
    OutputFileError
        If the file cannot be written.
    """
    mesh = gather_mesh(face.scene if isinstance(face, AnimatableFace) else face).mesh
    count = "uchar" if int(mesh.arities.max(initial=0)) < 256 else "int"
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {mesh.vertex_count}\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"element face {mesh.face_count}\nproperty list {count} int vertex_indices\nend_header\n"
    )
    width = 1 if count == "uchar" else 4
    body = np.zeros(mesh.face_count * width + mesh.indices.size * 4, dtype=np.uint8)
    is_count = np.zeros(body.size, dtype=bool)
    starts = mesh.offsets[:-1].astype(np.int64) * 4 + np.arange(mesh.face_count) * width
    is_count[(starts[:, None] + np.arange(width)).ravel()] = True
    body[is_count] = mesh.arities.astype("<u1" if width == 1 else "<i4").view(np.uint8)
    body[~is_count] = mesh.indices.astype("<i4").view(np.uint8)
    write_bytes(Path(path), header.encode() + mesh.vertices.astype("<f8").tobytes() + body.tobytes())
