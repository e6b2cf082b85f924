"""What a scene or face is, exactly, as JSON and one view of bytes: the part of a file that other programs pass over.

Arrays lie one after the other in the view; the JSON says where, of which type and shape. A checksum tells whether
another program has written the file anew.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fat.face import AnimatableFace
from fat.tables import FaceDefMesh, FaceDefTable, FaceDefTables, FaceDefTransform, TransformField
from fba.errors import FbaError, InputFileError
from fba.faps import FAP_COUNT
from fba.fapu import Fapu
from fba.feature_points import FeaturePoint, FeaturePoints
from fba.mesh import PolyMesh
from fba.scene import FaceScene, Frame, Node, Role, Shape, Transform
from formats.gltf.buffers import Buffer, Json
from formats.material_json import material_json, read_material
from formats.targets import table_borders, target_name

FORMAT = "fba-gltf/1"
KEY = "fba"
"""Name of the object in the scene's extras."""

_INTEGERS = ("<u1", "<u2", "<i4")
_KINDS = (*_INTEGERS, "<f4", "<f8")
_MESH_ARRAYS = (
    "vertices", "indices", "offsets", "texcoords", "texcoord_indices", "normals", "normal_indices", "face_groups",
    "face_materials",
)  # fmt: skip
_TRANSFORM_FIELDS = {"translation": 3, "rotation": 4, "scale": 3, "scale_orientation": 4, "center": 3}


class Pack:
    """Puts arrays into bytes, in the smallest type that holds them exactly."""

    def __init__(self) -> None:
        self._chunks: list[bytes] = []
        self._size = 0

    def array(self, values: NDArray[Any]) -> Json:
        """Add an array; return where it is."""
        kind = _exact_kind(values)
        data = np.ascontiguousarray(values, dtype=kind).tobytes()
        where = {"at": self._size, "type": kind, "shape": list(values.shape)}
        data += b"\0" * (-len(data) % 8)
        self._chunks.append(data)
        self._size += len(data)
        return where

    def write(self, buffer: Buffer) -> Json:
        """Add the bytes to a buffer; return their view and checksum."""
        data = b"".join(self._chunks)
        return {"bufferView": buffer.view(data), "sha256": hashlib.sha256(data).hexdigest()}


def _exact_kind(values: NDArray[Any]) -> str:
    if values.dtype.kind == "f":
        single = values.dtype == np.float32 or np.array_equal(values.astype(np.float32), values, equal_nan=True)
        return "<f4" if single else "<f8"
    low, high = int(values.min(initial=0)), int(values.max(initial=0))
    return next(kind for kind in _INTEGERS if np.iinfo(kind).min <= low and high <= np.iinfo(kind).max)


class Unpack:
    """Takes arrays out of bytes; refuses what lies outside."""

    def __init__(self, data: bytes) -> None:
        self._data = data

    def array(self, where: Any, dtype: type[np.generic]) -> NDArray[Any]:
        """An array that `Pack.array` put there."""
        kind, shape, at = str(where["type"]), tuple(where["shape"]), where["at"]
        sizes = (at, *shape)
        if kind not in _KINDS or any(type(n) is not int or n < 0 for n in sizes):
            raise InputFileError("an array of this toolkit has no type or shape")
        count = 1
        for length in shape:
            count *= length
        if at + count * np.dtype(kind).itemsize > len(self._data):
            raise InputFileError("an array of this toolkit reaches beyond its bytes")
        return np.frombuffer(self._data, kind, count, at).reshape(shape).astype(dtype)


def scene_json(scene: FaceScene, pack: Pack) -> Json:
    """A scene, exactly."""
    return {
        "name": scene.name,
        "axes": scene.frame.axes.astype(int).tolist(),
        "reversedWinding": scene.frame.reversed_winding,
        "metersPerUnit": scene.meters_per_unit,
        "roots": [_node_json(node, pack) for node in scene.roots],
        "vertexAttributes": {name: pack.array(values) for name, values in scene.vertex_attributes.items()},
    }


def _node_json(node: Node, pack: Pack) -> Json:
    if isinstance(node, Transform):
        fields = {name: list(getattr(node, name)) for name in _TRANSFORM_FIELDS}
        return {"transform": node.name, **fields, "children": [_node_json(child, pack) for child in node.children]}
    mesh = node.mesh
    arrays = {name: getattr(mesh, name) for name in _MESH_ARRAYS}
    return {
        "shape": node.name,
        "role": node.role.value,
        "mesh": {name: pack.array(values) for name, values in arrays.items() if values is not None},
        "groupNames": list(mesh.group_names),
        "materials": [material_json(material) for material in node.materials],
        "vertexIds": None if node.vertex_ids is None else pack.array(node.vertex_ids),
    }


def face_json(face: AnimatableFace, pack: Pack, nodes: Mapping[str, int]) -> Json:
    """FAPUs, notes, feature points and tables, exactly.

    nodes : name of a transform -> the glTF node that its tables drive. For other programs, as are a table's "targets".
    """
    points = {key: asdict(point) for key, point in face.feature_points.items()}
    return {
        "fapu": asdict(face.fapu),
        "notes": dict(face.notes),
        "featurePoints": points,
        "tables": [_table_json(table, pack, nodes) for table in face.tables],
    }


def _table_json(table: FaceDefTable, pack: Pack, nodes: Mapping[str, int]) -> Json:
    borders = table_borders(table).tolist()
    targets = [{"value": b, "target": target_name(table, b, borders[-1])} for b in borders if b]
    entry: Json = {
        "fapID": table.fap_id,
        "highLevelSelect": table.high_level_select,
        "name": table.name,
        "targets": targets,
        "faceDefMesh": [_mesh_json(mesh, pack) for mesh in table.meshes],
    }
    if table.transforms:
        entry["faceDefTransform"] = [
            {
                "transform": turn.transform,
                "node": nodes.get(turn.transform),
                "fieldId": int(turn.field),
                "rotationDef": list(turn.rotation_def),
                "scaleDef": list(turn.scale_def),
                "translationDef": list(turn.translation_def),
            }
            for turn in table.transforms
        ]
    return entry


def _mesh_json(mesh: FaceDefMesh, pack: Pack) -> Json:
    return {
        "shape": mesh.shape,
        "intervalBorders": mesh.interval_borders.tolist(),
        "coordIndex": pack.array(mesh.coord_index),
        "displacements": pack.array(mesh.displacements),
    }


def read_own(own: Any, data: bytes) -> FaceScene | AnimatableFace:
    """The scene or face that `scene_json` and `face_json` wrote.

    Raises
    ------
    InputFileError
        If the JSON or the bytes are damaged.
    """
    unpack = Unpack(data)
    try:
        scene = _read_scene(own["scene"], unpack)
        if "tables" not in own:
            return scene
        points = {key: _read_point(point) for key, point in own["featurePoints"].items()}
        fapu = Fapu(**{key: float(value) for key, value in own["fapu"].items()})
        tables = FaceDefTables(tuple(_read_table(table, unpack) for table in own["tables"]))
        notes = {str(key): str(value) for key, value in own["notes"].items()}
        return AnimatableFace(scene, FeaturePoints(points), tables, fapu, notes)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError, RecursionError, FbaError) as error:
        raise InputFileError(f"the face in this file is damaged: {str(error)[:120]}") from None


def _read_scene(own: Any, unpack: Unpack) -> FaceScene:
    frame = Frame(np.array(own["axes"], dtype=np.float64), bool(own["reversedWinding"]))
    meters = own["metersPerUnit"]
    roots = tuple(_read_node(node, unpack) for node in own["roots"])
    attributes = {str(k): unpack.array(where, np.float64) for k, where in own.get("vertexAttributes", {}).items()}
    scene = FaceScene(roots, frame, None if meters is None else float(meters), str(own["name"]))
    if any(values.ndim != 2 or len(values) != scene.vertex_count for values in attributes.values()):
        raise InputFileError("a vertex attribute has another number of values than there are vertices")
    return replace(scene, vertex_attributes=attributes)


def _read_node(own: Any, unpack: Unpack) -> Node:
    if "transform" in own:
        children = tuple(_read_node(child, unpack) for child in own["children"])
        fields = {name: _floats(own[name], count) for name, count in _TRANSFORM_FIELDS.items()}
        return Transform(str(own["transform"]), children, **fields)
    arrays = {
        name: unpack.array(own["mesh"][name], np.float64 if name in ("vertices", "texcoords", "normals") else np.int32)
        for name in _MESH_ARRAYS
        if name in own["mesh"]
    }
    mesh = PolyMesh(group_names=tuple(str(name) for name in own["groupNames"]), **arrays)
    ids = own["vertexIds"]
    materials = tuple(read_material(material) for material in own["materials"])
    vertex_ids = None if ids is None else unpack.array(ids, np.int32)
    return Shape(str(own["shape"]), mesh, Role(own["role"]), materials, vertex_ids)


def _floats(values: Any, count: int) -> Any:
    if len(values) != count:
        raise InputFileError(f"{count} numbers are needed, not {len(values)}")
    return tuple(float(value) for value in values)


def _read_point(own: Any) -> FeaturePoint:
    return FeaturePoint(
        None if own["shape"] is None else str(own["shape"]),
        tuple(int(vertex) for vertex in own["vertices"]),
        tuple(float(weight) for weight in own["weights"]),
        None if own["point"] is None else _floats(own["point"], 3),
        str(own["source"]),
        float(own["confidence"]),
    )


def _read_table(own: Any, unpack: Unpack) -> FaceDefTable:
    fap_id = int(own["fapID"])
    if not 1 <= fap_id <= FAP_COUNT:
        raise InputFileError(f"there is a table of FAP {fap_id}; FAPs are numbered 1 to {FAP_COUNT}")
    meshes = tuple(
        FaceDefMesh(
            str(mesh["shape"]),
            np.array(mesh["intervalBorders"], dtype=np.int32),
            unpack.array(mesh["coordIndex"], np.int32),
            unpack.array(mesh["displacements"], np.float32),
        )
        for mesh in own["faceDefMesh"]
    )
    turns = tuple(
        FaceDefTransform(
            str(turn["transform"]),
            TransformField(turn["fieldId"]),
            _floats(turn["rotationDef"], 4),
            _floats(turn["scaleDef"], 3),
            _floats(turn["translationDef"], 3),
        )
        for turn in own.get("faceDefTransform", ())
    )
    return FaceDefTable(fap_id, int(own["highLevelSelect"]), meshes, turns)
