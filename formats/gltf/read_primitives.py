"""The primitives of a glTF mesh that is read, and all of them as one polygon mesh."""

from __future__ import annotations

from typing import cast

import numpy as np
from numpy.typing import NDArray

from fba.arrays import Floats, Ints
from fba.mesh import Material, PolyMesh
from formats.gltf.data import GltfData, Json
from formats.gltf.surfaces import Surfaces

TRIANGLES, _STRIP, _FAN = 4, 5, 6
MODES = (TRIANGLES, _STRIP, _FAN)
_TEXCOORD_SETS = 8
"""Sets of texture coordinates beyond these are left out; clients know two."""


class ReadPrimitive:
    """One primitive: positions, triangles and what hangs on them."""

    def __init__(self, data: GltfData, primitive: Json) -> None:
        self.data = data
        attributes = data.dict(primitive, "attributes")
        if "POSITION" not in attributes:
            raise data.fail("a primitive has no POSITION")
        self.positions = data.accessor(attributes["POSITION"], "VEC3")
        count = len(self.positions)
        order = data.indices(primitive["indices"]) if "indices" in primitive else np.arange(count)
        if order.size and int(order.max()) >= count:
            raise data.fail(f"a triangle uses vertex {int(order.max())} of {count}")
        self.triangles = _triangles(order, data.integer(primitive, "mode", TRIANGLES))
        self.normals = self._optional(attributes, "NORMAL", "VEC3")
        self.texcoords = self._optional(attributes, "TEXCOORD_0", "VEC2")
        self.extra = self._extra(attributes)
        self.material = primitive.get("material")
        self.targets = data.list(primitive, "targets")

    def _optional(self, attributes: Json, name: str, type_name: str) -> Floats | None:
        if name not in attributes:
            return None
        values = self.data.accessor(attributes[name], type_name)
        if len(values) != len(self.positions):
            raise self.data.fail(f"{name} has {len(values)} values for {len(self.positions)} vertices")
        return values

    def _extra(self, attributes: Json) -> dict[str, Floats]:
        """Vertex colours and the texture coordinates behind the first."""
        found: dict[str, Floats] = {}
        for number in range(1, _TEXCOORD_SETS):
            values = self._optional(attributes, f"TEXCOORD_{number}", "VEC2")
            if values is not None:
                found[f"texcoord_{number}"] = np.stack([values[:, 0], 1.0 - values[:, 1]], axis=1)
        if "COLOR_0" in attributes:
            kind = str(self.data.item("accessors", attributes["COLOR_0"]).get("type"))
            colors = self._optional(attributes, "COLOR_0", "VEC4" if kind == "VEC4" else "VEC3")
            if colors is not None:
                found["color"] = colors
        return found

    def target(self, number: int) -> Floats:
        """(n, 3) position offsets of a morph target; zeros where it has none."""
        target = self.targets[number] if number < len(self.targets) else {}
        if not isinstance(target, dict):
            raise self.data.fail("a morph target must be an object")
        offsets = self._optional(target, "POSITION", "VEC3")
        return np.zeros_like(self.positions) if offsets is None else offsets


def _triangles(order: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    """(t, 3) vertex numbers of triangles, a strip or a fan."""
    if mode == TRIANGLES:
        return order[: order.size // 3 * 3].reshape(-1, 3)
    count = max(order.size - 2, 0)
    step = np.arange(count)
    if mode == _FAN:
        return np.stack([np.broadcast_to(order[:1], count) if count else step, order[1 : count + 1], order[2:]], axis=1)
    odd = step % 2
    return np.stack([order[step], order[step + 1 + odd], order[step + 2 - odd]], axis=1)


def joined(data: GltfData, parts: list[ReadPrimitive], surfaces: Surfaces) -> tuple[PolyMesh, tuple[Material, ...]]:
    """All primitives of a mesh as one, vertices one primitive after the other."""
    starts = np.cumsum([0, *(len(p.positions) for p in parts)])
    corners = np.concatenate([p.triangles + s for p, s in zip(parts, starts[:-1], strict=True)]).astype(np.int32)
    indices = corners.ravel()
    used: dict[int, int] = {}
    for p in parts:
        if p.material is not None:
            data.item("materials", p.material)
            used.setdefault(cast("int", p.material), len(used))
    numbers = [-1 if p.material is None else used[cast("int", p.material)] for p in parts]
    texcoords, texcoord_indices = _column([p.texcoords for p in parts], parts, indices)
    normals, normal_indices = _column([p.normals for p in parts], parts, indices)
    if texcoords is not None:
        # glTF counts v from the top of the image.
        texcoords = np.stack([texcoords[:, 0], 1.0 - texcoords[:, 1]], axis=1)
    mesh = PolyMesh(
        np.concatenate([p.positions for p in parts]),
        indices,
        np.arange(0, indices.size + 1, 3, dtype=np.int32),
        texcoords,
        texcoord_indices,
        normals,
        normal_indices,
        face_materials=np.repeat(np.array(numbers, dtype=np.int32), [len(p.triangles) for p in parts])
        if used
        else None,
    )
    return mesh, tuple(surfaces.material(i) for i in used)


def joined_attributes(parts: list[ReadPrimitive]) -> dict[str, Floats]:
    """The further attributes of all primitives of a mesh, one after the other; NaN where one has none."""
    found: dict[str, Floats] = {}
    for name in dict.fromkeys(name for part in parts for name in part.extra):
        width = max(part.extra[name].shape[1] for part in parts if name in part.extra)
        rows = []
        for part in parts:
            values = part.extra.get(name)
            row = np.full((len(part.positions), width), np.nan if values is None else 1.0)
            if values is not None:
                row[:, : values.shape[1]] = values
            rows.append(row)
        found[name] = np.concatenate(rows)
    return found


def _column(
    values: list[Floats | None], parts: list[ReadPrimitive], indices: Ints
) -> tuple[Floats | None, Ints | None]:
    """The values of all vertices and the corners' places in them; -1 where a primitive has none."""
    width = next((v.shape[1] for v in values if v is not None), None)
    if width is None:
        return None, None
    rows = [np.zeros((len(p.positions), width)) if v is None else v for v, p in zip(values, parts, strict=True)]
    known = np.repeat([v is not None for v in values], [p.triangles.size for p in parts])
    return np.concatenate(rows), np.where(known, indices, -1).astype(np.int32)
