"""The container of glTF 2.0: the JSON document, its buffers, and accessors as checked numpy arrays."""

from __future__ import annotations

import base64
import binascii
import json
import math
from functools import cached_property
from pathlib import Path
from typing import cast
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from fba.arrays import Floats
from fba.errors import InputFileError, UnsupportedFeatureError
from formats.files import read_bytes

Json = dict[str, object]

_COMPONENTS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_COMPRESSION = ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression")
_MOST_NUMBERS, _NUMBERS_A_BYTE = 1 << 26, 8
"""Numbers that the accessors of a file may hold together, as they are asked for: so many, and so many more for each of
its bytes. Accessors share bytes or, sparse, need none, so that a small file could fill any memory; 700 morph targets of
24,000 vertices are 50 million."""


class GltfData:
    """A parsed .gltf or .glb file.

    Every number that comes out of it has been checked against the size of what it points into.

    Raises
    ------
    InputFileError
        From every method, when the file contradicts itself.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        data = read_bytes(path)
        self._chunk: bytes | None = None
        text = self._unpack(data) if data.startswith(b"glTF") else data
        try:
            document = json.loads(text.decode("utf-8-sig"), parse_constant=self._no_constant)
        except (ValueError, RecursionError) as error:
            reason = "it is nested too deeply" if isinstance(error, RecursionError) else str(error)[:120]
            raise InputFileError(f"{path} is not a glTF file: {reason}") from None
        if not isinstance(document, dict) or not isinstance(document.get("asset"), dict):
            raise InputFileError(f"{path} is not a glTF file: it has no 'asset'")
        self.document: Json = document
        version = str(document["asset"].get("version", ""))
        if not version.startswith("2."):
            raise UnsupportedFeatureError(f"{path} is glTF {version[:10] or 'of no version'}; only version 2 is read")
        required = [str(e) for e in self.list(document, "extensionsRequired")]
        packed = [e for e in required if e in _COMPRESSION]
        if packed:
            raise UnsupportedFeatureError(f"{path} is compressed ({packed[0]}); save it without mesh compression")
        self._buffers: dict[int, bytes] = {}
        self._file_bytes = len(data)
        self._numbers = 0

    @staticmethod
    def _no_constant(name: str) -> float:
        raise ValueError(f"{name} is not a number")

    def _unpack(self, data: bytes) -> bytes:
        """The JSON chunk of a .glb; the binary chunk is kept."""
        if len(data) < 20 or int.from_bytes(data[4:8], "little") != 2:
            raise InputFileError(f"{self.path} is not a glTF 2.0 binary file, or cut")
        if int.from_bytes(data[8:12], "little") > len(data):
            raise InputFileError(f"{self.path} is cut: its header promises more bytes than there are")
        chunks: dict[bytes, bytes] = {}
        at = 12
        while at + 8 <= len(data):
            size = int.from_bytes(data[at : at + 4], "little")
            if size > len(data) - at - 8:
                raise InputFileError(f"{self.path} is cut: a chunk is longer than the file")
            chunks.setdefault(data[at + 4 : at + 8], data[at + 8 : at + 8 + size])
            at += 8 + size
        if b"JSON" not in chunks:
            raise InputFileError(f"{self.path} has no JSON chunk")
        self._chunk = chunks.get(b"BIN\0")
        return chunks[b"JSON"]

    def fail(self, message: str) -> InputFileError:
        """An error about this file."""
        return InputFileError(f"{self.path}: {message}")

    def list(self, owner: Json, key: str) -> list[object]:
        """A list field; empty when absent."""
        value = owner.get(key, [])
        if not isinstance(value, list):
            raise self.fail(f"'{key}' must be a list")
        return value

    def dict(self, owner: Json, key: str) -> Json:
        """An object field; empty when absent."""
        value = owner.get(key, {})
        if not isinstance(value, dict):
            raise self.fail(f"'{key}' must be an object")
        return value

    def integer(self, owner: Json, key: str, default: int | None = None) -> int:
        """A field that is a whole number from 0."""
        value = owner.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**53:
            raise self.fail(f"'{key}' must be a whole number from 0")
        return value

    def numbers(self, owner: Json, key: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """A field of as many finite numbers as the default has."""
        values = owner.get(key, default)
        good = isinstance(values, list | tuple) and len(values) == len(default)
        if good:
            good = all(isinstance(v, int | float) and not isinstance(v, bool) for v in cast("list[object]", values))
        try:
            out = tuple(float(v) for v in cast("list[float]", values)) if good else ()
        except OverflowError:
            out = ()
        if not out or not all(map(math.isfinite, out)):
            raise self.fail(f"'{key}' must be {len(default)} finite numbers")
        return out

    def name(self, owner: Json) -> str:
        """The name of an object, or ""."""
        value = owner.get("name", "")
        return value if isinstance(value, str) else ""

    def item(self, kind: str, index: object) -> Json:
        """The object with this number in a top-level list such as "nodes"."""
        items = self.list(self.document, kind)
        if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < len(items):
            raise self.fail(f"there is no entry {str(index)[:20]} in '{kind}' ({len(items)} entries)")
        entry = items[index]
        if not isinstance(entry, dict):
            raise self.fail(f"entry {index} of '{kind}' must be an object")
        return entry

    def _buffer(self, index: int) -> bytes:
        if index in self._buffers:
            return self._buffers[index]
        buffer = self.item("buffers", index)
        uri = buffer.get("uri")
        if uri is None:
            data = self._chunk if index == 0 and self._chunk is not None else None
            if data is None:
                raise self.fail(f"buffer {index} has no data")
        elif not isinstance(uri, str):
            raise self.fail(f"the uri of buffer {index} must be text")
        elif uri.startswith("data:"):
            data = self.inline(uri, f"buffer {index}")
        else:
            data = read_bytes(self._beside(uri))
        if len(data) < self.integer(buffer, "byteLength"):
            raise self.fail(f"buffer {index} is cut: {len(data)} bytes of {buffer['byteLength']}")
        self._buffers[index] = data
        return data

    def inline(self, uri: str, what: str) -> bytes:
        """The bytes of a data URI."""
        try:
            return base64.b64decode(uri.partition(",")[2], validate=True)
        except (binascii.Error, ValueError):
            raise self.fail(f"the data of {what} is not base64") from None

    def _beside(self, uri: str) -> Path:
        """A file inside the glTF file's own folder; nothing else is ever opened."""
        name = unquote(uri)
        folder = self.path.parent.resolve()
        if "\0" in name or ":" in name or Path(name).is_absolute():
            raise self.fail(f"the buffer '{uri[:60]}' is not a file in the mesh's folder")
        path = (folder / name).resolve()
        if not path.is_relative_to(folder):
            raise self.fail(f"the buffer '{uri[:60]}' lies outside the mesh's folder and is not opened")
        return path

    def accessor(self, index: object, type_name: str) -> Floats:
        """An accessor's values as (count, width) float64: integers normalized where it says so, sparse applied."""
        accessor = self.item("accessors", index)
        if accessor.get("type") != type_name:
            raise self.fail(f"accessor {index} must be of type {type_name}, not {str(accessor.get('type'))[:20]}")
        width, count = _WIDTHS[type_name], self.integer(accessor, "count")
        kind = self._component(accessor)
        if "bufferView" in accessor:
            with np.errstate(invalid="ignore"):  # Such values are refused below.
                view = self._view(accessor, kind, count, width)
                self._spend(view.size)
                values = view.astype(np.float64)
        else:
            if count > self._all_bytes:
                raise self.fail(f"accessor {index} has {count} elements but no data")
            self._spend(count * width)
            values = np.zeros((count, width))
        if "sparse" in accessor:
            self._apply_sparse(self.dict(accessor, "sparse"), values, kind, count, width)
        if accessor.get("normalized") is True and kind[-2] in "iu":
            values = np.maximum(values / np.iinfo(np.dtype(kind)).max, -1.0)
        if not np.isfinite(values).all():
            raise self.fail(f"accessor {index} holds values that are not finite numbers")
        return values

    @cached_property
    def _all_bytes(self) -> int:
        """Bytes of the file and of the buffers beside it."""
        count = len(self.list(self.document, "buffers"))
        return self._file_bytes + sum(len(self._buffer(k)) for k in range(count))

    def _spend(self, count: int) -> None:
        """Keep to a bounded amount of numbers, before memory is taken for them."""
        self._numbers += count
        if self._numbers > _MOST_NUMBERS and self._numbers > _MOST_NUMBERS + _NUMBERS_A_BYTE * self._all_bytes:
            raise self.fail(f"its accessors share bytes or have none, and hold over {self._numbers} numbers together")

    def indices(self, index: object) -> NDArray[np.int64]:
        """A scalar accessor as whole numbers."""
        if self._component(self.item("accessors", index))[-2] == "f":
            raise self.fail(f"accessor {index} must hold whole numbers")
        return self.accessor(index, "SCALAR").ravel().astype(np.int64)

    def _component(self, owner: Json) -> str:
        number = owner.get("componentType")
        if not isinstance(number, int) or number not in _COMPONENTS:
            raise self.fail(f"there is no component type {str(number)[:20]}")
        return _COMPONENTS[number]

    def bytes_of(self, index: object) -> bytes:
        """All bytes of a buffer view."""
        view = self.item("bufferViews", index)
        data = self._buffer(self.integer(view, "buffer"))
        begin, length = self.integer(view, "byteOffset", 0), self.integer(view, "byteLength")
        if begin + length > len(data):
            raise self.fail(f"buffer view {index} reaches beyond its buffer")
        return data[begin : begin + length]

    def _view(self, owner: Json, kind: str, count: int, width: int) -> NDArray[np.generic]:
        view = self.item("bufferViews", owner["bufferView"])
        data = self._buffer(self.integer(view, "buffer"))
        begin, length = self.integer(view, "byteOffset", 0), self.integer(view, "byteLength")
        if begin + length > len(data):
            raise self.fail(f"buffer view {owner['bufferView']} reaches beyond its buffer")
        dtype = np.dtype(kind)
        row = dtype.itemsize * width
        stride = self.integer(view, "byteStride", row)
        offset = self.integer(owner, "byteOffset", 0)
        if stride < row or (count and offset + stride * (count - 1) + row > length):
            raise self.fail(f"an accessor of {count} elements reaches beyond buffer view {owner['bufferView']}")
        if count == 0:
            return np.zeros((0, width), dtype)
        return np.ndarray((count, width), dtype, data, begin + offset, (stride, dtype.itemsize))

    def _apply_sparse(self, sparse: Json, values: Floats, kind: str, count: int, width: int) -> None:
        changed = self.integer(sparse, "count")
        places, new = self.dict(sparse, "indices"), self.dict(sparse, "values")
        if "bufferView" not in places or "bufferView" not in new:
            raise self.fail("a sparse accessor needs buffer views for its indices and values")
        rows = self._view(places, self._component(places), changed, 1).ravel().astype(np.float64)
        if rows.size and not (float(rows.max()) < count):
            raise self.fail(f"a sparse accessor changes element {int(rows.max())} of {count}")
        values[rows.astype(np.int64)] = self._view(new, kind, changed, width)
