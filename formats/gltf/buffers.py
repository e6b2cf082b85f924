"""The binary side of a glTF file in the making: one buffer, its views and accessors."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fba.arrays import Floats32
from fba.errors import MeshError

Json = dict[str, Any]

Rows = NDArray[np.intp]

FLOAT, USHORT, UINT = 5126, 5123, 5125
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
_ROW = 4
"""Every view starts at a multiple of this many bytes."""


def to_single(values: NDArray[Any]) -> Floats32:
    """Numbers in 32 bits.

    Raises
    ------
    MeshError
        If one is not finite, or too large.
    """
    with np.errstate(over="ignore"):
        single: Floats32 = np.asarray(values).astype(np.float32)
    if not np.isfinite(single).all():
        raise MeshError("glTF holds finite 32-bit numbers; this face has one that is not")
    return single + np.float32(0.0)  # no negative zeros


class Buffer:
    """Collects bytes; hands out the numbers of views and accessors."""

    def __init__(self) -> None:
        self.views: list[Json] = []
        self.accessors: list[Json] = []
        self._chunks: list[bytes] = []
        self._size = 0
        self._zeros: dict[int, int] = {}

    def view(self, data: bytes, target: int | None = None) -> int:
        """Add a view of its own with these bytes."""
        view: Json = {"buffer": 0, "byteOffset": self._size, "byteLength": len(data)}
        if target is not None:
            view["target"] = target
        self.views.append(view)
        padded = data + b"\0" * (-len(data) % _ROW)
        self._chunks.append(padded)
        self._size += len(padded)
        return len(self.views) - 1

    def data(self) -> bytes:
        """All bytes so far."""
        return b"".join(self._chunks)

    def indices(self, values: NDArray[np.integer[Any]]) -> int:
        """An accessor of vertex numbers, in 16 bits where they fit."""
        kind = _index_kind(int(values.max(initial=0)))
        view = self.view(values.astype(kind).tobytes(), ELEMENT_ARRAY_BUFFER)
        return self._accessor({"bufferView": view, **_described(kind), "count": values.size, "type": "SCALAR"})

    def attribute(self, values: Floats32, *, bounds: bool = False) -> int:
        """A vertex attribute (n,) or (n, w)."""
        return self._accessor(self._dense(values, ARRAY_BUFFER) | (_bounds(values) if bounds else {}))

    def keys(self, values: Floats32, *, bounds: bool = False) -> int:
        """Times (n,), or values (n,) or (n, w), of an animation; sparse where that is smaller."""
        rows = np.flatnonzero(values.reshape(len(values), -1).any(axis=1))
        limits = _bounds(values) if bounds else {}
        if not bounds and _sparse_is_smaller(rows.size, len(values), values.size // len(values)) and rows.size:
            sparse = SparseRows(self, rows, len(values))
            return self._accessor({**_shape(values), **sparse.accessor(values[rows])})
        return self._accessor(self._dense(values, None) | limits)

    def zeros(self, count: int) -> int:
        """An accessor of `count` zero vectors, which needs no bytes."""
        if count not in self._zeros:
            zero = [0.0, 0.0, 0.0]
            entry = {"componentType": FLOAT, "count": count, "type": "VEC3", "min": zero, "max": zero}
            self._zeros[count] = self._accessor(entry)
        return self._zeros[count]

    def offsets(self, count: int, rows: NDArray[np.intp], values: list[Floats32]) -> list[int]:
        """Accessors of `count` vectors that are zero but for `rows` (k,), one for each of the values (k, 3)."""
        if not rows.size:
            return [self.zeros(count)] * len(values)
        if not _sparse_is_smaller(rows.size, count, 3):
            return [self.attribute(_spread(v, rows, count), bounds=True) for v in values]
        sparse = SparseRows(self, rows, count)
        out = []
        for value in values:
            reached = value if rows.size == count else np.concatenate([value, np.zeros((1, 3), np.float32)])
            entry = {"componentType": FLOAT, "count": count, "type": "VEC3", **_bounds(reached)}
            out.append(self._accessor({**entry, **sparse.accessor(value)}))
        return out

    def _dense(self, values: Floats32, target: int | None) -> Json:
        return {"bufferView": self.view(np.ascontiguousarray(values).tobytes(), target), **_shape(values)}

    def _accessor(self, entry: Json) -> int:
        self.accessors.append(entry)
        return len(self.accessors) - 1


class SparseRows:
    """Rows that several sparse accessors change; they are written once."""

    def __init__(self, buffer: Buffer, rows: NDArray[np.intp], count: int) -> None:
        self._buffer = buffer
        kind = _index_kind(count - 1)
        self._indices = {"bufferView": buffer.view(rows.astype(kind).tobytes()), **_described(kind)}
        self._count = int(rows.size)

    def accessor(self, values: Floats32) -> Json:
        """What an accessor says of new values of these rows."""
        view = self._buffer.view(np.ascontiguousarray(values).tobytes())
        return {"sparse": {"count": self._count, "indices": self._indices, "values": {"bufferView": view}}}


def _sparse_is_smaller(changed: int, count: int, width: int) -> bool:
    return changed * (4 * width + np.dtype(_index_kind(count - 1)).itemsize) < count * 4 * width


def _index_kind(largest: int) -> str:
    # The highest number of a type means "restart" to graphics hardware and must not be used.
    return "<u2" if largest < 0xFFFF else "<u4"


def _described(kind: str) -> Json:
    return {"componentType": USHORT if kind == "<u2" else UINT}


def _shape(values: Floats32) -> Json:
    width = 1 if values.ndim == 1 else values.shape[1]
    return {"componentType": FLOAT, "count": len(values), "type": _TYPES[width]}


def _bounds(values: Floats32) -> Json:
    rows = values.reshape(len(values), -1)
    return {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}


def _spread(values: Floats32, rows: NDArray[np.intp], count: int) -> Floats32:
    full = np.zeros((count, 3), np.float32)
    full[rows] = values
    return full
