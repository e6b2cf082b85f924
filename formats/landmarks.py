"""Landmark files: where the feature points lie on one mesh (JSON).

``{"format": "fba-landmarks/1", "points": {"9.3": PLACE, ...}}``, a PLACE being one of

- ``{"face": 1201, "barycentric": [...]}``: polygon number, one weight for each of its corners (three weights
  on a larger polygon belong to its first three corners);
- ``{"vertices": [a, b, c], "barycentric": [...]}``;
- ``{"vertex": 17}``;
- ``{"position": [x, y, z]}``, in the file's own axes and units, taken to the nearest surface.

With ``"shape": NAME`` the numbers count inside that shape, without it in the file's own order. Optional:
``"source"`` and ``"confidence"``. A plain object of points without ``"format"`` is read as well: ``"face"``
are then three vertices with weights ``"bary"``, ``"point"`` is a free point and ``"pos"`` a position.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np

from fba.arrays import Floats, Ints
from fba.errors import InputFileError, LandmarkError
from fba.feature_points import NECK_BASE, FeaturePoint, FeaturePoints, feature_point_definitions
from fba.scene import FaceScene
from formats.files import read_bytes, write_bytes
from formats.landmark_places import Surfaces

FORMAT = "fba-landmarks/1"

FREE_POINTS = ("7.1", NECK_BASE, "11.5")
"""Points with no surface at them: inside the neck, and above the skull by the thickness of the hair."""

_WEIGHT_TOLERANCE = 1e-3
"""How far weights may be from adding up to 1, or below 0: the rounding of a file with three decimals."""


def landmarks_beside(path: str | Path) -> Path | None:
    """Return NAME.fps.json beside NAME.obj (NAME.wrl.gz, ...) when it exists."""
    path = Path(path)
    name = path.name[:-3] if path.name.lower().endswith(".gz") else path.name
    beside = path.with_name(Path(name).stem + ".fps.json")
    return beside if beside.is_file() else None


def read_landmarks(path: str | Path, scene: FaceScene) -> FeaturePoints:
    """Read a landmark file for a scene.

    Raises
    ------
    InputFileError
        If the file is missing, empty or no JSON.
    LandmarkError
        If a point is unknown, does not fit the mesh, or lies off the surface; the message names it.
    """
    path = Path(path)
    entries, plain = _entries(path)
    surfaces = Surfaces(scene)
    points: dict[str, FeaturePoint] = {}
    known = feature_point_definitions()
    for key, entry in entries.items():
        where = f"{path}: feature point {key}"
        if key not in known:
            raise LandmarkError(f"{path}: there is no feature point '{key[:20]}'; MPEG-4 numbers them 2.1 to 11.6")
        if not isinstance(entry, dict):
            raise LandmarkError(f"{where} must be an object such as {{'vertex': 17}}")
        place = _plain_place(entry) if plain else entry
        points[key] = _about(_point(key, place, surfaces, where), entry, where)
    if not points:
        raise LandmarkError(f"{path} holds no feature points")
    return FeaturePoints(points)


def write_landmarks(points: FeaturePoints, scene: FaceScene, path: str | Path) -> None:
    """Write feature points; what is written reads back as the same places on the same file's mesh.

    Raises
    ------
    OutputFileError
        If the file cannot be written.
    """
    surfaces = Surfaces(scene)
    rows = []
    for key, point in points.items():
        entry: dict[str, object] = surfaces.entry(point)
        if point.source != "given":
            entry["source"] = point.source
        if point.confidence != 1.0:
            entry["confidence"] = point.confidence
        rows.append(f"    {json.dumps(key)}: {json.dumps(entry)}")
    text = ",\n".join(rows)
    write_bytes(Path(path), f'{{\n  "format": "{FORMAT}",\n  "points": {{\n{text}\n  }}\n}}\n'.encode())


def _entries(path: Path) -> tuple[dict[str, object], bool]:
    """The points of a file as JSON values, and whether it is the plain format."""
    data = read_bytes(path, 64 << 20)
    try:
        document = json.loads(data.decode("utf-8-sig"), object_pairs_hook=_no_repeats, parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        reason = "it is nested too deeply" if isinstance(error, RecursionError) else str(error)[:200]
        raise InputFileError(f"{path} is not a landmark file: {reason}") from None
    if not isinstance(document, dict):
        raise InputFileError(f'{path} is not a landmark file: it must be an object {{"format": "{FORMAT}", ...}}')
    if "format" not in document and "points" not in document:
        return document, True
    if document.get("format") != FORMAT:
        raise LandmarkError(f"{path}: the format is {str(document.get('format'))[:40]!r}; this reads {FORMAT!r}")
    points = document.get("points")
    if not isinstance(points, dict):
        raise LandmarkError(f"{path}: 'points' must be an object with one entry for each feature point")
    return points, False


def _no_repeats(pairs: list[tuple[str, object]]) -> dict[str, object]:
    out = dict(pairs)
    if len(out) != len(pairs):
        keys = [k for k, _ in pairs]
        twice = next(k for k in keys if keys.count(k) > 1)
        raise ValueError(f"'{twice[:40]}' is given twice")
    return out


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is not a number")


def _plain_place(entry: dict[str, object]) -> dict[str, object]:
    """Translate a point of the plain format; its surface place counts more than its rounded position."""
    if "face" in entry and "bary" in entry:
        return {"vertices": entry["face"], "barycentric": entry["bary"]}
    if "vertex" in entry:
        return {"vertex": entry["vertex"]}
    for name in ("point", "pos"):
        if name in entry:
            return {"position": entry[name]}
    return entry


def _about(point: FeaturePoint, entry: dict[str, object], where: str) -> FeaturePoint:
    """Add who placed the point, and how sure that is."""
    source = entry.get("source", "given")
    confidence = entry.get("confidence", 1.0)
    if not isinstance(source, str):
        raise LandmarkError(f"{where}: 'source' must be a word such as 'given', 'detected' or 'clicked'")
    if not _is_number(confidence) or not 0.0 <= cast("float", confidence) <= 1.0:
        raise LandmarkError(f"{where}: 'confidence' must be a number from 0 to 1")
    return replace(point, source=source, confidence=float(cast("float", confidence)))


def _point(key: str, place: dict[str, object], surfaces: Surfaces, where: str) -> FeaturePoint:
    forms = [f for f in ("face", "vertices", "vertex", "position") if f in place]
    if len(forms) != 1:
        found = " and ".join(forms) or "none of them"
        raise LandmarkError(f"{where} needs one of face, vertices, vertex or position; it has {found}")
    shape = surfaces.shape_name(place.get("shape"), where)
    if forms == ["position"]:
        position = surfaces.scene.frame.from_file(_numbers(place["position"], 3, "position", where))
        if key in FREE_POINTS:
            return FeaturePoint.free(position)
        return surfaces.snap(key, position, shape, where)
    if forms == ["vertex"]:
        corners = _indices([place["vertex"]], "vertex", where)
        name, local = surfaces.locate(corners, shape, where)
        return FeaturePoint(name, tuple(local.tolist()), (1.0,))
    if forms == ["vertices"]:
        corners = _indices(place["vertices"], "vertices", where)
        name, local = surfaces.locate(corners, shape, where)
    else:
        name, local = surfaces.polygon(int(_indices([place["face"]], "face", where)[0]), shape, where)
    weights = _weights(place.get("barycentric"), len(local), forms == ["face"], where)
    local = local[: len(weights)]
    return FeaturePoint(name, tuple(local.tolist()), tuple(weights.tolist()))


def _is_number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def _numbers(values: object, count: int | None, name: str, where: str) -> Floats:
    if not isinstance(values, list) or not all(map(_is_number, values)) or count not in (None, len(values)):
        size = "numbers" if count is None else f"{count} finite numbers"
        raise LandmarkError(f"{where}: '{name}' must be a list of {size}")
    return np.array([float(v) for v in values], dtype=np.float64)


def _indices(values: object, name: str, where: str) -> Ints:
    good = isinstance(values, list) and values and all(isinstance(v, int) and not isinstance(v, bool) for v in values)
    if not good or not all(0 <= v < 2**31 for v in cast("list[int]", values)):
        raise LandmarkError(f"{where}: '{name}' must hold whole numbers from 0")
    return np.array(values, dtype=np.int32)


def _weights(values: object, corners: int, three_will_do: bool, where: str) -> Floats:
    if values is None:
        raise LandmarkError(f"{where} has no 'barycentric' weights")
    weights = _numbers(values, None, "barycentric", where)
    if len(weights) != corners and not (three_will_do and len(weights) == 3 <= corners):
        raise LandmarkError(f"{where}: {len(weights)} barycentric weights for {corners} corners")
    total = float(weights.sum())
    if abs(total - 1.0) > _WEIGHT_TOLERANCE:
        raise LandmarkError(f"{where}: the barycentric weights add up to {total:.6g}, not to 1")
    if float(weights.min()) < -_WEIGHT_TOLERANCE:
        raise LandmarkError(f"{where}: a barycentric weight is negative ({float(weights.min()):.6g})")
    weights = np.maximum(weights, 0.0)
    total = float(weights.sum())
    return weights if total == 1.0 else weights / total
