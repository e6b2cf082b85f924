"""Reading glTF 2.0 (.gltf, .glb): the neutral meshes, their nodes, materials and morph targets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

import numpy as np

from fba.arrays import Floats
from fba.errors import MeshError
from fba.scene import FaceScene, Node, Shape, Transform
from formats.gltf.data import GltfData, Json
from formats.gltf.images import Images
from formats.gltf.read_primitives import MODES, TRIANGLES, ReadPrimitive, joined, joined_attributes
from formats.gltf.surfaces import Surfaces
from formats.matrices import transform_fields
from formats.names import UniqueNames

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
        self.names = UniqueNames()
        self.visited: set[int] = set()
        self.targets: dict[str, dict[str, Floats]] = {}
        self.skinned: list[Node] = []
        self.remarks: list[str] = []
        self.images = Images(data)
        self.surfaces = Surfaces(data, self.images)
        self.attributes: dict[str, dict[str, Floats]] = {}

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
        document = GltfDocument(self.targets, tuple(dict.fromkeys(self.remarks + self.surfaces.remarks)))
        extra = self._vertex_attributes(scene)
        return replace(scene, document=document, images=self.images.inside, vertex_attributes=extra)

    def _vertex_attributes(self, scene: FaceScene) -> dict[str, Floats]:
        """Colours and further texture coordinates of all vertices; NaN where a mesh has none."""
        widths: dict[str, int] = {}
        for own in self.attributes.values():
            for name, values in own.items():
                widths[name] = max(widths.get(name, 0), values.shape[1])
        found = {name: np.full((scene.vertex_count, width), np.nan) for name, width in sorted(widths.items())}
        for shape, places in scene.file_order().items():
            for name, values in self.attributes[shape].items():
                found[name][places, : values.shape[1]] = values
                found[name][places, values.shape[1] :] = 1.0  # Colours without alpha are opaque.
        return found

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
        name = self.names.take(f"{label}_transform" if "mesh" in node else label)
        return [Transform(name, tuple(inside), **fields)]  # type: ignore[arg-type]

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
            if data.integer(entry, "mode", TRIANGLES) not in MODES:
                self.remarks.append("points and lines are skipped: only triangles are read")
                continue
            parts.append(ReadPrimitive(data, entry))
        if not parts:
            return None
        name = self.names.take(data.name(node) or data.name(mesh) or "mesh")
        mesh_of_all, materials = joined(data, parts, self.surfaces)
        self.attributes[name] = joined_attributes(parts)
        self.targets[name] = self._targets(parts, names)
        return Shape(name, mesh_of_all, materials=materials)

    def _target_names(self, mesh: Json) -> list[str]:
        extras = mesh.get("extras")
        names = extras.get("targetNames") if isinstance(extras, dict) else None
        return [str(n) for n in names] if isinstance(names, list) else []

    def _targets(self, parts: list[ReadPrimitive], names: list[str]) -> dict[str, Floats]:
        count = max((len(p.targets) for p in parts), default=0)
        labels = [names[k] if k < len(names) else f"target_{k}" for k in range(count)]
        out: dict[str, Floats] = {}
        for k, label in enumerate(labels):
            offsets = [p.target(k) for p in parts]
            if label in out:
                raise self.data.fail(f"two morph targets of a mesh have the name '{label[:60]}'")
            out[label] = np.concatenate(offsets)
        return out
