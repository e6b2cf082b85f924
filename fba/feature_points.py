"""The 84 feature points of ISO/IEC 14496-2: their definitions, and where they lie on one face."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files

import numpy as np

from fba.arrays import Floats
from fba.errors import LandmarkError
from fba.scene import FaceScene

NECK_BASE = "7.2"
"""Base of the neck: not one of the standard's 84 points, an extension of Facial Motion Cloning."""


@dataclass(frozen=True, slots=True)
class FeaturePointDefinition:
    """What a feature point is: id ("9.3"), the point of the other side, the standard's constraint in words."""

    id: str
    counterpart: str | None
    location_constraint: str
    definition: str

    @property
    def group(self) -> int:
        return int(self.id.split(".")[0])

    @property
    def index(self) -> int:
        return int(self.id.split(".")[1])


@cache
def feature_point_definitions() -> dict[str, FeaturePointDefinition]:
    """All 84 points and 7.2, in ascending group and index.

    >>> feature_point_definitions()["9.3"].definition
    'tip of the nose'
    """
    text = (files("fba") / "data" / "feature_points.csv").read_text("utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    rows = [
        FeaturePointDefinition(r["id"], r["counterpart"] or None, r["location_constraint"], r["definition"])
        for r in csv.DictReader(lines)
    ]
    return {d.id: d for d in sorted(rows, key=lambda d: (d.group, d.index))}


@cache
def standard_feature_points() -> tuple[str, ...]:
    """The ids of the standard's 84 points in ascending group and index (the order of featurePointsCoord)."""
    return tuple(i for i in feature_point_definitions() if i != NECK_BASE)


@dataclass(frozen=True, slots=True)
class FeaturePoint:
    """One feature point on one face: a weighted sum of vertices of a shape, or a free point.

    Attributes
    ----------
    shape : name of the shape; None for a free point (7.1 has no surface below it).
    vertices : indices into the shape's mesh.
    weights : barycentric weights of these vertices; they add up to 1.
    point : world coordinates (inside axes) of a free point.
    source : "given", "detected", "clicked" or "derived".
    confidence : 0..1.
    """

    shape: str | None
    vertices: tuple[int, ...] = ()
    weights: tuple[float, ...] = ()
    point: tuple[float, float, float] | None = None
    source: str = "given"
    confidence: float = 1.0

    @classmethod
    def free(cls, point: Floats, source: str = "given", confidence: float = 1.0) -> FeaturePoint:
        x, y, z = (float(c) for c in point)
        return cls(None, point=(x, y, z), source=source, confidence=confidence)


@dataclass(frozen=True)
class FeaturePoints(Mapping[str, FeaturePoint]):
    """Feature points of one face, by id, in ascending group and index."""

    points: Mapping[str, FeaturePoint]

    def __post_init__(self) -> None:
        known = feature_point_definitions()
        for key in self.points:
            if key not in known:
                raise LandmarkError(f"there is no feature point '{key}': MPEG-4 numbers them 2.1 to 11.6")
        object.__setattr__(self, "points", {k: self.points[k] for k in known if k in self.points})

    def __getitem__(self, key: str) -> FeaturePoint:
        return self.points[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self.points)

    def __len__(self) -> int:
        return len(self.points)

    def require(self, *ids: str, purpose: str) -> None:
        """Raise LandmarkError naming every one of these points that is missing."""
        missing = [i for i in ids if i not in self.points]
        if missing:
            names = ", ".join(f"{i} ({feature_point_definitions()[i].definition})" for i in missing)
            raise LandmarkError(f"{purpose} needs feature points that are not given: {names}")

    def positions(self, scene: FaceScene, world_vertices: Mapping[str, Floats] | None = None) -> dict[str, Floats]:
        """World position (3,) of every point on the neutral scene, or on the given world vertices of its shapes."""
        cache: dict[str, Floats] = {} if world_vertices is None else dict(world_vertices)
        out: dict[str, Floats] = {}
        for key, p in self.points.items():
            if p.shape is None:
                out[key] = np.asarray(p.point, dtype=np.float64)
                continue
            if p.shape not in cache:
                cache[p.shape] = scene.world_vertices(p.shape)
            out[key] = np.asarray(p.weights) @ cache[p.shape][list(p.vertices)]
        return out

    def with_points(self, more: Mapping[str, FeaturePoint]) -> FeaturePoints:
        """Add or replace points."""
        return replace(self, points={**self.points, **more})
