"""What a face is besides geometry: FAPUs, feature points, notes; as own attributes of a stage."""

from __future__ import annotations

import numpy as np
from pxr import Gf, Sdf, Usd

from fat.face import AnimatableFace
from fba.fapu import Fapu
from fba.feature_points import FeaturePoint, FeaturePoints
from formats.usd.axes import StageAxes
from formats.usd.names import name_of
from formats.usd.properties import (
    get,
    ints,
    need,
    put,
    put_array,
    put_string,
    put_targets,
    target,
)

FAPU_FIELDS = ("irisd0", "es0", "ens0", "mns0", "mw0")


def write_facts(root: Usd.Prim, face: AnimatableFace, paths: dict[str, Sdf.Path], axes: StageAxes) -> None:
    """Author FAPUs, notes and feature points."""
    for name in FAPU_FIELDS:
        put(root, f"fapu:{name}", Sdf.ValueTypeNames.Double, getattr(face.fapu, name))
    put(root, "notes:keys", Sdf.ValueTypeNames.StringArray, list(face.notes))
    put(root, "notes:values", Sdf.ValueTypeNames.StringArray, list(face.notes.values()))
    stage = root.GetStage()
    scope = stage.DefinePrim(root.GetPath().AppendChild("FeaturePoints"))
    put_targets(root, "featurePoints", [scope.GetPath()])
    for key, point in face.feature_points.items():
        prim = stage.DefinePrim(scope.GetPath().AppendChild(f"fp_{key.replace('.', '_')}"))
        put_string(prim, "id", key)
        put_string(prim, "source", point.source)
        put(prim, "confidence", Sdf.ValueTypeNames.Double, point.confidence)
        if point.point is not None:
            put(prim, "point", Sdf.ValueTypeNames.Double3, Gf.Vec3d(*axes.vector(point.point)))
        if point.shape is not None:
            put_targets(prim, "shape", [paths[point.shape]])
            put_array(prim, "vertices", np.array(point.vertices, dtype=np.int32))
            put_array(prim, "weights", np.array(point.weights, dtype=np.float64))


def read_fapu(root: Usd.Prim) -> Fapu:
    """Read the FAPUs."""
    return Fapu(*(float(need(root, f"fapu:{name}")) for name in FAPU_FIELDS))


def read_notes(root: Usd.Prim) -> dict[str, str]:
    """Read the notes."""
    keys, values = get(root, "notes:keys") or (), get(root, "notes:values") or ()
    return {str(key): str(value) for key, value in zip(keys, values, strict=False)}


def read_feature_points(root: Usd.Prim, axes: StageAxes) -> FeaturePoints:
    """Read the feature points."""
    scope = target(root, "featurePoints")
    points: dict[str, FeaturePoint] = {}
    for prim in scope.GetChildren() if scope else ():
        shape = target(prim, "shape")
        place = get(prim, "point")
        points[str(need(prim, "id"))] = FeaturePoint(
            None if shape is None else name_of(shape),
            () if shape is None else tuple(ints(need(prim, "vertices")).tolist()),
            () if shape is None else tuple(np.array(need(prim, "weights"), dtype=np.float64).tolist()),
            None if place is None else axes.back((place[0], place[1], place[2])),
            str(need(prim, "source")),
            float(need(prim, "confidence")),
        )
    return FeaturePoints(points)
