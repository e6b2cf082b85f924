"""Face kits that other people made: where they lie, their feature points, and their shapes under ARKit's names."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from authoring.names import unit_name
from fat.profiles import ARKIT
from fba.arrays import Floats
from fba.feature_points import FeaturePoint, FeaturePoints
from fba.scene import FaceScene
from samples.build.arkit_anatomy import mirror_shape

SHARED = Path(__file__).resolve().parents[2] / "shared"


def read_kit_points(path: Path, scene: FaceScene) -> FeaturePoints:
    """Feature points given as three vertices of the file and their weights."""
    order = scene.file_order()
    size = scene.vertex_count
    shape_of = np.empty(size, dtype=object)
    place_of = np.zeros(size, dtype=int)
    for name, ids in order.items():
        shape_of[ids] = name
        place_of[ids] = np.arange(len(ids))
    points = {}
    for key, row in json.loads(path.read_text()).items():
        if "face" in row:
            names = [shape_of[v] for v in row["face"]]
            points[key] = FeaturePoint(
                names[int(np.argmax(row["bary"]))], tuple(int(place_of[v]) for v in row["face"]), tuple(row["bary"])
            )
        else:
            points[key] = FeaturePoint.free(np.array(row["point"]))
    return FeaturePoints(points)


def arkit_shapes(names: tuple[str, ...], deltas: Floats) -> dict[str, Floats]:
    """The shapes under ARKit's names; halves of one shape are added."""
    total: dict[str, Floats] = {}
    for name, delta in zip(names, deltas, strict=True):
        unit = unit_name(name)
        if unit is not None:
            whole = unit if unit in ARKIT else unit.removesuffix("Left").removesuffix("Right")
            total[whole] = total.get(whole, 0.0) + delta
    return {name: total[name] for name in ARKIT if name in total and mirror_shape(name) in total}
