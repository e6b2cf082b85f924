"""Reading glTF 2.0 (.gltf, .glb): the neutral meshes, their nodes, materials and morph targets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

import numpy as np
from numpy.typing import NDArray

from fba.arrays import Floats
from fba.errors import MeshError
from fba.mesh import Material, PolyMesh
from fba.scene import FaceScene, Node, Shape, Transform
from formats.gltf.colors import from_linear
from formats.gltf.data import GltfData, Json
from formats.gltf.images import Images
from formats.matrices import transform_fields

_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_DEEPEST = 200


@dataclass(frozen=True, eq=False)
class GltfDocument:
    """What a glTF file held besides the shapes.

    Attributes
    ----------
    targets : shape name -> target name -> (n, 3) offsets in the shape's local coordinates, file axes.
    remarks : what was skipped, in plain words.
    """

    targets: Mapping[str, Mapping[str, Floats]]
    remarks: tuple[str, ...] = ()


def read_foreign(path: Path) -> FaceScene:
    """Read a glTF file's default scene: one shape for each mesh in it, all its primitives together.

    A file of this toolkit's own writer is read like any other.

    The vertices keep the order of the file: mesh by mesh as the node tree is walked, primitive by primitive.
    Skinned meshes are taken in their bind pose, without the transforms above them, as the standard has it.
    Nodes without meshes below them (bones, cameras) are left out.

    Raises
    ------
    InputFileError
        If the file is missing, cut, or contradicts itself.
    UnsupportedFeatureError
        For other versions and for compressed meshes.
    MeshError
        If it has no triangles.
    """
    return read_data(GltfData(Path(path)))


def read_data(data: GltfData) -> FaceScene:
    """Read a parsed file; see `read_foreign`."""
    return _Reader(data).scene()


class _Reader:
    def __init__(self, data: GltfData) -> None:
        self.data = data
        self.names: set[str] = set()
        self.visited: set[int] = set()
        self.targets: dict[str, dict[str, Floats]] = {}
        self.skinned: list[Node] = []
        self.remarks: list[str] = []
        self.images = Images(data)

    def scene(self) -> FaceScene:
        roots: list[Node] = []
        for index in self._root_nodes():
            roots += self._node(index, 0)
        roots += self.skinned
        if self.skinned:
            self.remarks.append(f"{len(self.skinned)} skinned meshes are taken in their bind pose")
        scene = FaceScene(tuple(roots), meters_per_unit=1.0, name=self.data.path.stem)
        if not any(s.mesh.face_count for s in scene.shapes):
            raise MeshError(f"{self.data.path} holds no triangles in its default scene")
        document = GltfDocument(self.targets, tuple(dict.fromkeys(self.remarks)))
        return replace(scene, document=document, images=self.images.inside)

    def _root_nodes(self) -> list[object]:
        data = self.data
        if data.list(data.document, "scenes"):
            return data.list(data.item("scenes", data.document.get("scene", 0)), "nodes")
        count = len(data.list(data.document, "nodes"))
        children = {c for i in range(count) for c in data.list(data.item("nodes", i), "children") if isinstance(c, int)}
        return [i for i in range(count) if i not in children]

    def _node(self, index: object, depth: int) -> list[Node]:
        """What a node becomes: nothing, its mesh, or a transform with its children."""
        node = self.data.item("nodes", index)
        if index in self.visited or depth > _DEEPEST:
            raise self.data.fail(f"node {index} hangs below itself, below two parents, or too deep")
        self.visited.add(cast("int", index))
        inside: list[Node] = []
        if "mesh" in node:
            shape = self._shape(node)
            if shape is not None and "skin" in node:
                self.skinned.append(shape)
            elif shape is not None:
                inside.append(shape)
        for child in self.data.list(node, "children"):
            inside += self._node(child, depth + 1)
        fields = self._fields(node)
        if not inside or not fields:
            return inside
        label = self.data.name(node) or "node"
        name = self._unique(f"{label}_transform" if "mesh" in node else label)
        return [Transform(name, tuple(inside), **fields)]  # type: ignore[arg-type]

    def _unique(self, name: str) -> str:
        label, number = name, 1
        while label in self.names:
            number += 1
            label = f"{name}_{number}"
        self.names.add(label)
        return label

    def _fields(self, node: Json) -> dict[str, tuple[float, ...]]:
        """The transform's fields that are not neutral."""
        if "matrix" in node:
            matrix = np.array(self.data.numbers(node, "matrix", (0.0,) * 16)).reshape(4, 4).T
            return transform_fields(matrix)
        x, y, z, w = self.data.numbers(node, "rotation", (0.0, 0.0, 0.0, 1.0))
        length = float(np.linalg.norm((x, y, z)))
        fields: dict[str, tuple[float, ...]] = {
            "translation": self.data.numbers(node, "translation", (0.0, 0.0, 0.0)),
            "scale": self.data.numbers(node, "scale", (1.0, 1.0, 1.0)),
        }
        if length > 0.0:
            fields["rotation"] = (x / length, y / length, z / length, 2.0 * float(np.arctan2(length, w)))
        neutral = {"translation": (0.0, 0.0, 0.0), "scale": (1.0, 1.0, 1.0)}
        return {k: v for k, v in fields.items() if v != neutral.get(k)}

    def _shape(self, node: Json) -> Shape | None:
        data = self.data
        mesh = data.item("meshes", node["mesh"])
        names = self._target_names(mesh)
        parts = []
        for entry in data.list(mesh, "primitives"):
            if not isinstance(entry, dict):
                raise data.fail("a primitive must be an object")
            if data.integer(entry, "mode", _TRIANGLES) not in (_TRIANGLES, _STRIP, _FAN):
                self.remarks.append("points and lines are skipped: only triangles are read")
                continue
            parts.append(_Primitive(data, entry))
        if not parts:
            return None
        name = self._unique(data.name(node) or data.name(mesh) or "mesh")
        joined, materials = _joined(data, parts, self.images)
        self.targets[name] = self._targets(parts, names)
        return Shape(name, joined, materials=materials)

    def _target_names(self, mesh: Json) -> list[str]:
        extras = mesh.get("extras")
        names = extras.get("targetNames") if isinstance(extras, dict) else None
        return [str(n) for n in names] if isinstance(names, list) else []

    def _targets(self, parts: list[_Primitive], names: list[str]) -> dict[str, Floats]:
        count = max((len(p.targets) for p in parts), default=0)
        labels = [names[k] if k < len(names) else f"target_{k}" for k in range(count)]
        out: dict[str, Floats] = {}
        for k, label in enumerate(labels):
            offsets = [p.target(k) for p in parts]
            if label in out:
                raise self.data.fail(f"two morph targets of a mesh have the name '{label[:60]}'")
            out[label] = np.concatenate(offsets)
        return out


class _Primitive:
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
        self.triangles = _triangles(order, data.integer(primitive, "mode", _TRIANGLES))
        self.normals = self._optional(attributes, "NORMAL", "VEC3")
        self.texcoords = self._optional(attributes, "TEXCOORD_0", "VEC2")
        self.material = primitive.get("material")
        self.targets = data.list(primitive, "targets")

    def _optional(self, attributes: Json, name: str, type_name: str) -> Floats | None:
        if name not in attributes:
            return None
        values = self.data.accessor(attributes[name], type_name)
        if len(values) != len(self.positions):
            raise self.data.fail(f"{name} has {len(values)} values for {len(self.positions)} vertices")
        return values

    def target(self, number: int) -> Floats:
        """(n, 3) position offsets of a morph target; zeros where it has none."""
        target = self.targets[number] if number < len(self.targets) else {}
        if not isinstance(target, dict):
            raise self.data.fail("a morph target must be an object")
        offsets = self._optional(target, "POSITION", "VEC3")
        return np.zeros_like(self.positions) if offsets is None else offsets


def _triangles(order: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    """(t, 3) vertex numbers of triangles, a strip or a fan."""
    if mode == _TRIANGLES:
        return order[: order.size // 3 * 3].reshape(-1, 3)
    count = max(order.size - 2, 0)
    step = np.arange(count)
    if mode == _FAN:
        return np.stack([np.broadcast_to(order[:1], count) if count else step, order[1 : count + 1], order[2:]], axis=1)
    odd = step % 2
    return np.stack([order[step], order[step + 1 + odd], order[step + 2 - odd]], axis=1)


def _joined(data: GltfData, parts: list[_Primitive], images: Images) -> tuple[PolyMesh, tuple[Material, ...]]:
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
    texcoords = _column([p.texcoords for p in parts], parts, 2)
    normals = _column([p.normals for p in parts], parts, 3)
    if texcoords is not None:
        # glTF counts v from the top of the image.
        texcoords = np.stack([texcoords[:, 0], 1.0 - texcoords[:, 1]], axis=1)
    mesh = PolyMesh(
        np.concatenate([p.positions for p in parts]),
        indices,
        np.arange(0, indices.size + 1, 3, dtype=np.int32),
        texcoords,
        None if texcoords is None else indices,
        normals,
        None if normals is None else indices,
        face_materials=np.repeat(np.array(numbers, dtype=np.int32), [len(p.triangles) for p in parts])
        if used
        else None,
    )
    return mesh, tuple(_material(data, i, images) for i in used)


def _column(values: list[Floats | None], parts: list[_Primitive], width: int) -> Floats | None:
    if any(v is None for v in values):
        return None
    column: Floats = np.concatenate([v for v in values if v is not None]) if parts else np.zeros((0, width))
    return column


def _material(data: GltfData, index: int, images: Images) -> Material:
    entry = data.item("materials", index)
    surface = data.dict(entry, "pbrMetallicRoughness")
    *color, alpha = data.numbers(surface, "baseColorFactor", (1.0, 1.0, 1.0, 1.0))
    return Material(
        data.name(entry) or f"material_{index}",
        diffuse=from_linear(color),
        emissive=from_linear(data.numbers(entry, "emissiveFactor", (0.0, 0.0, 0.0))),
        transparency=1.0 - alpha if entry.get("alphaMode") == "BLEND" else 0.0,
        texture=_texture(data, surface, images),
    )


def _texture(data: GltfData, surface: Json, images: Images) -> str | None:
    """The name of the base colour image."""
    reference = data.dict(surface, "baseColorTexture")
    if "index" not in reference:
        return None
    source = data.item("textures", reference["index"]).get("source")
    return None if source is None else images.name(source)
