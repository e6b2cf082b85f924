"""Local correction of a motion at the feature points: exact at the FAP's own point, still at the others.

Gaussian kernels on geodesic distance, one small linear system for each axis; only the axes along which some FAP
moves a point take part.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fba.arrays import Floats
from fba.faps import LOW_LEVEL_FAPS, fap
from samples.build.geodesic import CUT, SIGMA, distances, kernel
from samples.build.head import Head

OWN_WEIGHT = 1e3
"""Of the FAP's own point against the others, which share triangles in places and then cannot all be met."""
RIDGE = 1e-3
"""Keeps the coefficients of points that lie close together small."""

PointAxis = tuple[str, int]


@dataclass(frozen=True)
class Correction:
    """The kernels of one head.

    head : whose neutral face measures the distances.
    """

    head: Head

    @cached_property
    def points(self) -> tuple[str, ...]:
        """Feature points on the skin that some FAP moves."""
        return tuple(sorted({key for key, _ in self.axes}, key=lambda k: tuple(map(int, k.split(".")))))

    @cached_property
    def axes(self) -> frozenset[PointAxis]:
        """(point, axis) pairs that FAPs measure."""
        found = set()
        for number in LOW_LEVEL_FAPS:
            entry = fap(number)
            for key in entry.feature_points if entry.direction is not None else ():
                if key in self.head.points and self.head.points[key].shape == "skin":
                    found.add((key, int(np.argmax(np.abs(np.asarray(entry.direction))))))
        return frozenset(found)

    @cached_property
    def kernels(self) -> dict[str, Floats]:
        """Point -> (n,) kernel over the skin."""
        es = self.head.fapu.es0
        mesh = self.head.scene.shape("skin").mesh
        away = distances(mesh, [self.head.points[k] for k in self.points], limit=CUT * es)
        return {k: kernel(row, SIGMA * es, CUT * es) for k, row in zip(self.points, away, strict=True)}

    def at(self, key: str, values: Floats) -> Floats:
        """Value of a per-vertex skin array at a feature point."""
        point = self.head.points[key]
        here: Floats = np.asarray(point.weights) @ values[list(point.vertices)]
        return here

    def correct(self, field: Floats, wanted: Mapping[PointAxis, float], free: Collection[PointAxis] = ()) -> Floats:
        """Return the skin offsets (n, 3) with `wanted` met, every other FAP axis at zero but for the free ones."""
        out = field.copy()
        for axis in range(3):
            keys = [k for k in self.points if (k, axis) in self.axes or (k, axis) in wanted]
            keys = [k for k in keys if (k, axis) in wanted or (k, axis) not in free]
            goal = np.array([wanted.get((k, axis), 0.0) for k in keys])
            now = np.array([self.at(k, field)[axis] for k in keys])
            weight = np.array([OWN_WEIGHT if (k, axis) in wanted else 1.0 for k in keys])
            response = np.array([[self.at(k, self.kernels[j]) for j in keys] for k in keys])
            rows = np.vstack([weight[:, None] * response, RIDGE * np.eye(len(keys))])
            target = np.concatenate([weight * (goal - now), np.zeros(len(keys))])
            share = np.linalg.lstsq(rows, target, rcond=None)[0]
            out[:, axis] += sum(c * self.kernels[k] for c, k in zip(share, keys, strict=True))
        return out
