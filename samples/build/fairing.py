"""Smooth MakeHuman's face units on a finer skin: they are rounded to a thousandth and drawn for large polygons."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from fba.arrays import Floats
from fba.feature_points import FeaturePoint
from fba.mesh import PolyMesh
from samples.build.geodesic import distances

if TYPE_CHECKING:
    from scipy.sparse.linalg import SuperLU

AT_LIPS, AT_LIDS, BEYOND = 0.04, 0.06, 0.08
"""Detail smaller than about six times this (ES0) fades: at the lips and on the cheeks as wide as MakeHuman's polygons
are; at the lids wider, because they fold when the eye closes."""
NEAR, FAR = 0.05, 0.2
"""Distances from the rims (ES0) between which the first width becomes the second."""
STILL = 3e-4
"""Offsets below this length (ES0) are what the smoothing spreads far away; they become 0."""
STEEPEST = 10.0
"""Largest cotangent: slivers would hold their neighbours fast."""


@dataclass(frozen=True, eq=False)
class Fairing:
    """Least bending next to the given field: ``(M + L s^4 M^-1 L) smooth = M field`` with cotangent weights.

    mesh : the skin.
    lips, lids : feature points along them, near which the field keeps more detail.
    es0 : eye separation in the mesh's unit.
    """

    mesh: PolyMesh
    lips: tuple[FeaturePoint, ...]
    lids: tuple[FeaturePoint, ...]
    es0: float

    def spread(self, field: Floats) -> Floats:
        """The smooth field (n, 3), which fades far out."""
        solve, area = self._system
        out: Floats = solve.solve(area[:, None] * field)
        return out

    def smooth(self, field: Floats) -> Floats:
        """The smooth field (n, 3), with zeros where next to nothing is left."""
        out = self.spread(field)
        still = np.linalg.norm(out, axis=1) < STILL * self.es0
        return np.where(still[:, None], 0.0, out)

    @cached_property
    def _system(self) -> tuple[SuperLU, Floats]:
        from scipy.sparse import coo_array, csc_array, diags_array
        from scipy.sparse.linalg import splu

        n, triangles = self.mesh.vertex_count, self.mesh.triangles
        places = self.mesh.vertices / self.es0
        area, rows, columns, weights = np.zeros(n), [], [], []
        for k in range(3):
            a, b, c = (triangles[:, (k + j) % 3] for j in range(3))
            u, v = places[a] - places[c], places[b] - places[c]
            doubled = np.linalg.norm(np.cross(u, v), axis=1)
            cotangent = np.clip((u * v).sum(axis=1) / np.maximum(doubled, 1e-12), 0.0, STEEPEST)
            rows += [a, b]
            columns += [b, a]
            weights += [0.5 * cotangent, 0.5 * cotangent]
            area += np.bincount(a, doubled / 6.0, n)
        links = coo_array((np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns))), shape=(n, n))
        laplacian = diags_array(links.tocsr().sum(axis=1)) - links.tocsr()
        bending = laplacian @ diags_array(self._widths**4 / area) @ laplacian
        return splu(csc_array(diags_array(area) + bending)), area

    @cached_property
    def _widths(self) -> Floats:
        widths = np.full(self.mesh.vertex_count, BEYOND)
        for rim, least in ((self.lips, AT_LIPS), (self.lids, AT_LIDS)):
            away = distances(self.mesh, list(rim)).min(axis=0) / self.es0
            wide = least + (BEYOND - least) * np.clip((away - NEAR) / (FAR - NEAR), 0.0, 1.0)
            widths = np.minimum(widths, wide)
        return widths
