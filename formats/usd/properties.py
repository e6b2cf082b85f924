"""The toolkit's own attributes (namespace ``fba:``), and exact twins of what USD holds in 32 bits.

A twin is an own attribute with the 64-bit values behind a 32-bit USD attribute. It is written only where 32 bits
lose something, and believed only as long as it still rounds to what USD holds: when another program changed the
USD attribute, that change wins.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, Vt

from fba.arrays import Floats, Ints
from fba.errors import InputFileError

PREFIX = "fba:"
_ARRAYS = {
    ("f", 4, 3): (Vt.Vec3fArray, Sdf.ValueTypeNames.Float3Array),
    ("f", 4, 2): (Vt.Vec2fArray, Sdf.ValueTypeNames.Float2Array),
    ("f", 8, 3): (Vt.Vec3dArray, Sdf.ValueTypeNames.Double3Array),
    ("f", 8, 2): (Vt.Vec2dArray, Sdf.ValueTypeNames.Double2Array),
    ("f", 8, 1): (Vt.DoubleArray, Sdf.ValueTypeNames.DoubleArray),
    ("i", 4, 1): (Vt.IntArray, Sdf.ValueTypeNames.IntArray),
}


def vt(values: NDArray[Any]) -> Any:
    """A USD array of (n, 2) or (n, 3) float32 or float64, (n,) float64 or (n,) int32 values."""
    return _ARRAYS[_kind(values)][0].FromNumpy(np.ascontiguousarray(values))


def _kind(values: NDArray[Any]) -> tuple[str, int, int]:
    return values.dtype.kind, values.dtype.itemsize, values.shape[1] if values.ndim == 2 else 1


def put(prim: Usd.Prim, name: str, kind: Sdf.ValueTypeName, value: Any) -> None:
    """Author one own attribute."""
    prim.CreateAttribute(PREFIX + name, kind, True, Sdf.VariabilityUniform).Set(value)


def put_array(prim: Usd.Prim, name: str, values: NDArray[Any]) -> None:
    """Author one own attribute that is an array; for the types see `vt`."""
    put(prim, name, _ARRAYS[_kind(values)][1], vt(values))


def put_string(prim: Usd.Prim, name: str, value: str) -> None:
    """Author one own attribute that is text."""
    put(prim, name, Sdf.ValueTypeNames.String, value)


def get(prim: Usd.Prim, name: str) -> Any:
    """The value of an own attribute, or None."""
    attribute = prim.GetAttribute(PREFIX + name)
    return attribute.Get() if attribute else None


def need(prim: Usd.Prim, name: str) -> Any:
    """The value of an own attribute; InputFileError if it is not there."""
    value = get(prim, name)
    if value is None:
        raise InputFileError(f"{prim.GetPath()} has lost its attribute {PREFIX}{name}; write the face again")
    return value


def ints(value: Any) -> Ints:
    """A USD int array as (n,) int32."""
    return np.array(value, dtype=np.int32).reshape(-1)


def rows(value: Any, width: int) -> NDArray[Any]:
    """A USD array of vectors as (n, width) of its own precision; None and empty arrays give (0, width)."""
    return np.array(value).reshape(-1, width) if value is not None and len(value) else np.zeros((0, width), np.float32)


def put_twin(prim: Usd.Prim, name: str, values: Floats) -> None:
    """Author the 64-bit values of a USD attribute if 32 bits lose something."""
    if not np.array_equal(to_single(values).astype(np.float64), values):
        put_array(prim, name, values)


def get_twin(prim: Usd.Prim, name: str, single: NDArray[Any]) -> Floats:
    """The 64-bit values behind a USD attribute, if they still agree with it; else the attribute's own."""
    twin = get(prim, name)
    if twin is not None:
        exact: Floats = np.array(twin, dtype=np.float64)
        if np.array_equal(to_single(exact), single):
            return exact
    return single.astype(np.float64)


def to_single(values: Floats) -> NDArray[np.float32]:
    """Round to 32 bits; what is too large becomes infinite without a warning."""
    with np.errstate(over="ignore"):
        single: NDArray[np.float32] = np.asarray(values).astype(np.float32)
    return single


def target(prim: Usd.Prim, name: str) -> Usd.Prim | None:
    """The one prim that an own relationship leads to, or None."""
    found = targets(prim, name)
    return found[0] if found else None


def targets(prim: Usd.Prim, name: str) -> list[Usd.Prim]:
    """The prims that an own relationship leads to, in order; InputFileError if one is gone."""
    relationship = prim.GetRelationship(PREFIX + name)
    prims = []
    for path in relationship.GetTargets() if relationship else []:
        found = prim.GetStage().GetPrimAtPath(path)
        if not found:
            raise InputFileError(f"{prim.GetPath()}: {PREFIX}{name} leads to {path}, but there is no such prim")
        prims.append(found)
    return prims


def put_targets(prim: Usd.Prim, name: str, paths: list[Sdf.Path]) -> None:
    """Author one own relationship."""
    prim.CreateRelationship(PREFIX + name, True).SetTargets(paths)
