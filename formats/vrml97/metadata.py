"""What a face needs to read back identically and the standard's nodes cannot say: strings of one WorldInfo.

Each string is ``key: JSON``. A file without them is a full MPEG-4 face; with them it reads back exactly.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from fat.face import AnimatableFace
from fba.arrays import Ints
from fba.errors import FbaError
from fba.fapu import Fapu
from fba.feature_points import FeaturePoint, FeaturePoints
from fba.findings import Finding
from fba.mesh import PolyMesh
from fba.scene import FaceScene, Frame, Role, Shape
from formats.material_json import material_json, read_material
from formats.vrml97.document import METADATA_DEF
from formats.vrml97.names import unescape
from formats.vrml97.tree import Strings, VrmlNode, node

VERSION = "fba-toolkit/1"


@dataclass(frozen=True, eq=False)
class Metadata:
    """The strings, parsed; None where a string is missing."""

    frame: Frame = field(default_factory=Frame)
    meters_per_unit: float | None = None
    name: str | None = None
    names: Mapping[str, str] = field(default_factory=dict)
    shapes: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    fapu: Fapu | None = None
    points: FeaturePoints | None = None
    notes: Mapping[str, str] = field(default_factory=dict)


def metadata_node(face: FaceScene | AnimatableFace, def_names: Mapping[str, str]) -> VrmlNode:
    """The WorldInfo for a scene or face."""
    scene = face.scene if isinstance(face, AnimatableFace) else face
    rows: list[tuple[str, Any]] = [("format", VERSION), ("name", scene.name)]
    frame = scene.frame
    rows.append(("frame", {"axes": frame.axes.astype(int).tolist(), "reversed_winding": frame.reversed_winding}))
    if scene.meters_per_unit is not None:
        rows.append(("meters_per_unit", scene.meters_per_unit))
    names = {d: n for n, d in def_names.items() if unescape(d) != n}
    if names:
        rows.append(("names", names))
    rows.extend(("shape", _shape_row(s)) for s in scene.shapes)
    if isinstance(face, AnimatableFace):
        rows.append(("fapu", asdict(face.fapu)))
        rows.append(("feature_points", {i: _point_row(p, frame) for i, p in face.feature_points.items()}))
        rows.append(("notes", dict(face.notes)))
    strings = tuple(f"{key}: {json.dumps(value, separators=(',', ':'), ensure_ascii=False)}" for key, value in rows)
    return node("WorldInfo", METADATA_DEF, title=Strings((scene.name,)), info=Strings(strings, True))


def _runs(values: Ints) -> list[list[int]]:
    """Run lengths: [value, count] pairs."""
    if not values.size:
        return []
    starts = np.flatnonzero(np.concatenate([[True], np.diff(values) != 0]))
    counts = np.diff(np.append(starts, values.size))
    return [[int(values[s]), int(c)] for s, c in zip(starts, counts, strict=True)]


def _steps(values: Ints) -> list[list[int]]:
    """Stretches of consecutive numbers: [first, count] pairs."""
    starts = np.flatnonzero(np.concatenate([[True], np.diff(values) != 1])) if values.size else np.zeros(0, int)
    counts = np.diff(np.append(starts, values.size))
    return [[int(values[s]), int(c)] for s, c in zip(starts, counts, strict=True)]


def _shape_row(shape: Shape) -> dict[str, Any]:
    mesh = shape.mesh
    row: dict[str, Any] = {"name": shape.name, "role": shape.role.value}
    row["materials"] = [material_json(m) for m in shape.materials]
    if shape.vertex_ids is not None:
        row["vertex_ids"] = _steps(shape.vertex_ids)
    if mesh.group_names:
        row["group_names"] = list(mesh.group_names)
    if mesh.face_groups is not None:
        row["face_groups"] = _runs(mesh.face_groups)
    if mesh.face_materials is not None:
        row["face_materials"] = _runs(mesh.face_materials)
    for name in ("texcoord", "normal"):
        values, indices = getattr(mesh, f"{name}s"), getattr(mesh, f"{name}_indices")
        if values is not None and indices is not None and indices.size and int(indices.min()) < 0:
            row[f"{name}_none"] = len(values)
    return row


def _point_row(point: FeaturePoint, frame: Frame) -> dict[str, Any]:
    row: dict[str, Any] = {}
    if point.shape is not None:
        row = {"shape": point.shape, "vertices": list(point.vertices), "weights": list(point.weights)}
    if point.point is not None:
        row["point"] = [float(c) for c in frame.to_file(np.asarray(point.point, dtype=np.float64))]
    row["source"] = point.source
    row["confidence"] = point.confidence
    return row


def read_metadata(strings: tuple[str, ...], findings: list[Finding]) -> Metadata:
    """Parse the strings; what is damaged or unknown is left out and said."""
    rows: dict[str, Any] = {}
    shapes: dict[str, Mapping[str, Any]] = {}
    for text in strings:
        key, _, body = text.partition(": ")
        try:
            value = json.loads(body)
            if key == "shape":
                shapes[str(value["name"])] = value
            else:
                rows[key] = _PARSERS[key](value) if key in _PARSERS else value
        except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError, FbaError):
            findings.append(Finding("warning", "metadata", f"the entry '{key[:40]}' is damaged; ignored", METADATA_DEF))
    frame = rows.get("frame", Frame())
    points = rows.get("feature_points")
    if points is not None:
        points = FeaturePoints({i: _turned(p, frame) for i, p in points.items()})
    return Metadata(
        frame,
        rows.get("meters_per_unit"),
        rows.get("name"),
        rows.get("names", {}),
        shapes,
        rows.get("fapu"),
        points,
        rows.get("notes", {}),
    )


def _turned(point: FeaturePoint, frame: Frame) -> FeaturePoint:
    if point.point is None:
        return point
    free = frame.from_file(np.asarray(point.point, dtype=np.float64))
    return FeaturePoint(
        point.shape,
        point.vertices,
        point.weights,
        (float(free[0]), float(free[1]), float(free[2])),
        point.source,
        point.confidence,
    )


def _frame(value: Any) -> Frame:
    return Frame(np.array(value["axes"], dtype=np.float64), bool(value["reversed_winding"]))


def _positive(value: Any) -> float:
    number = float(value)
    if not 0.0 < number < float("inf"):
        raise ValueError("not a positive number")
    return number


def _fapu(value: Any) -> Fapu:
    return Fapu(**{k: _positive(v) for k, v in value.items()})


def _texts(value: Any) -> dict[str, str]:
    return {str(k): str(v) for k, v in value.items()}


def _finite(values: Any) -> tuple[float, ...]:
    found = tuple(float(v) for v in values)
    if not np.all(np.isfinite(found)):
        raise ValueError("not a finite number")
    return found


def _points(value: Any) -> FeaturePoints:
    found = {}
    for key, row in value.items():
        vertices = tuple(int(v) for v in row.get("vertices", ()))
        weights = _finite(row.get("weights", ()))
        point: tuple[float, float, float] | None = None
        if "point" in row:
            x, y, z = _finite(row["point"])
            point = (x, y, z)
        shape = row.get("shape")
        if (shape is None) != (not vertices) or len(vertices) != len(weights) or (shape is None and point is None):
            raise ValueError("a feature point is neither on a surface nor free")
        source, confidence = str(row["source"]), float(row["confidence"])
        found[key] = FeaturePoint(None if shape is None else str(shape), vertices, weights, point, source, confidence)
    return FeaturePoints(found)


_PARSERS: dict[str, Callable[[Any], Any]] = {
    "frame": _frame,
    "meters_per_unit": _positive,
    "name": str,
    "names": _texts,
    "fapu": _fapu,
    "feature_points": _points,
    "notes": _texts,
}


def apply_to_shape(shape: Shape, row: Mapping[str, Any], findings: list[Finding]) -> Shape:
    """Give a shape its role, vertex ids, groups and materials back; a row that no longer fits is left out and said."""
    try:
        mesh = shape.mesh
        changes: dict[str, Any] = {}
        materials = tuple(read_material(m) for m in row["materials"])
        groups = changes["group_names"] = tuple(str(n) for n in row.get("group_names", ()))
        ends = {"face_groups": (0, len(groups) or mesh.face_count), "face_materials": (-1, len(materials))}
        for name, (low, count) in ends.items():
            if name in row:
                changes[name] = _unrun(row[name], mesh.face_count, low, count)
        for name in ("texcoord", "normal"):
            if f"{name}_none" in row:
                count = int(row[f"{name}_none"])
                indices = getattr(mesh, f"{name}_indices")
                changes[f"{name}s"] = getattr(mesh, f"{name}s")[:count]
                changes[f"{name}_indices"] = np.where(indices >= count, -1, indices)
        ids = None
        if "vertex_ids" in row:
            ids = _unstep(row["vertex_ids"], mesh.vertex_count)
        fields = {f: getattr(mesh, f) for f in PolyMesh.__dataclass_fields__}
        return Shape(shape.name, PolyMesh(**{**fields, **changes}), Role(row["role"]), materials, ids)
    except (ValueError, TypeError, KeyError, OverflowError, FbaError):
        message = "what the file notes about this shape does not fit it any more; ignored"
        findings.append(Finding("warning", "metadata", message, shape.name))
        return shape


def _checked(pairs: Any, count: int, low: int) -> list[tuple[int, int]]:
    rows = [(int(a), int(b)) for a, b in pairs]
    if any(a < low or b < 0 for a, b in rows) or sum(b for _, b in rows) != count:
        raise ValueError("wrong count")
    return rows


def _unrun(pairs: Any, count: int, low: int, end: int) -> Ints:
    rows = _checked(pairs, count, low)
    if any(a >= end for a, _ in rows):
        raise ValueError("no such group or material")
    return np.repeat(np.array([a for a, _ in rows], np.int32), [b for _, b in rows])


def _unstep(pairs: Any, count: int) -> Ints:
    rows = _checked(pairs, count, 0)
    parts = [np.arange(a, a + b, dtype=np.int32) for a, b in rows]
    return np.concatenate(parts) if parts else np.zeros(0, np.int32)
