"""Which polygons of the skin are lips, and which line the mouth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fba.arrays import Bools, Floats, Ints
from fba.feature_points import FeaturePoint
from samples.build.contact import LOWER_LIP, UPPER_LIP
from samples.build.geodesic import distances
from samples.build.head import Head

SKIN, LIP, MOUTH = range(3)
"""Indices of the skin's materials."""

LIP_DEPTH = 0.8
"""How far the lips' colour goes into the mouth, in lip thicknesses."""

ROUNDED = 2.2
"""A lip's front is at most this many times as long, from contour to contour, as the straight way."""

OUTLINE = 0.004
"""How far beyond the contour, in ES0, a vertex still counts as on it: a quarter of a small edge."""

CONTOURS = {
    "upper": (("2.7", "2.2", "2.6"), ("8.6", "8.1", "8.5")),
    "lower": (("2.9", "2.3", "2.8"), ("8.8", "8.2", "8.7")),
}
"""Lip -> inner and outer contour points (right, middle, left)."""
CURVES = {
    "upper": (("2.5", "2.7", "2.2", "2.6", "2.4"), ("8.4", "8.6", "8.9", "8.1", "8.10", "8.5", "8.3")),
    "lower": (("2.5", "2.9", "2.3", "2.8", "2.4"), ("8.4", "8.8", "8.2", "8.7", "8.3")),
}
"""Lip -> all points along its inner and its outer contour, corners included."""


def skin_materials(head: Head) -> Ints:
    """Material (m,) of each polygon of the skin."""
    lips = Lips(head)
    mesh = head.scene.shape("skin").mesh
    lip = lips.lip("upper") | lips.lip("lower")
    lip &= np.abs(mesh.vertices[:, 0]) <= head.positions["8.3"][0] * 1.001
    starts = mesh.offsets[:-1]
    out = np.zeros(mesh.face_count, dtype=np.int32)
    out[np.logical_or.reduceat(_inside_mouth(head, lip)[mesh.indices], starts)] = MOUTH
    out[np.logical_and.reduceat(lip[mesh.indices], starts)] = LIP
    return out


@dataclass(frozen=True)
class Lips:
    """The skin of both lips, between their inner and outer contours."""

    head: Head

    def lip(self, name: str) -> Bools:
        """Vertices (n,) of one lip."""
        inner, outer = (self._contour_distance(name, keys) for keys in CURVES[name])
        p = self.head.positions
        width = [float(np.linalg.norm(p[a] - p[b])) for a, b in zip(*CONTOURS[name], strict=True)]
        x = [p["8.4"][0], *(p[k][0] for k in CONTOURS[name][0]), p["8.3"][0]]
        thick = np.interp(self._skin[:, 0], x, [0.3 * width[0], *width, 0.3 * width[2]])
        front = self._within_outline(name) & (inner + outer <= ROUNDED * thick)
        within = front | ((outer > inner) & (inner <= LIP_DEPTH * thick))
        lip: Bools = within & self._side(name)
        return lip

    def _within_outline(self, name: str) -> Bools:
        """Vertices (n,) on the mouth's side of the outer contour, as seen from the front."""
        curve = np.array([self.head.positions[k] for k in CURVES[name][1]])
        height = _through(np.clip(self._skin[:, 0], curve[0, 0], curve[-1, 0]), curve[:, 0], curve[:, 1])
        sign = 1.0 if name == "upper" else -1.0
        return np.asarray(sign * (self._skin[:, 1] - height) <= OUTLINE * self.head.fapu.es0)

    @property
    def _skin(self) -> Floats:
        return self.head.parts["skin"]

    def _side(self, name: str) -> Bools:
        """Vertices that are nearer to this lip's feature points than to the other's."""
        return self._upper if name == "upper" else ~self._upper

    @cached_property
    def _upper(self) -> Bools:
        upper: Bools = self._distance(UPPER_LIP) < self._distance(LOWER_LIP)
        return upper

    def _distance(self, keys: Sequence[str]) -> Floats:
        mesh = self.head.scene.shape("skin").mesh
        nearest: Floats = distances(mesh, [self.head.points[k] for k in keys]).min(axis=0)
        return nearest

    def _contour_distance(self, lip: str, keys: Sequence[str]) -> Floats:
        """Geodesic distance to the vertices next to the curve through contour points."""
        p = self.head.positions
        curve = np.array([p[k] for k in keys])
        x = np.linspace(curve[0, 0], curve[-1, 0], 41)
        line = np.column_stack([x, *(_through(x, curve[:, 0], curve[:, k]) for k in (1, 2))])
        ids = np.flatnonzero(self._side(lip))
        away = np.linalg.norm(self._skin[ids][None] - line[:, None], axis=2)
        seeds = [FeaturePoint("skin", (int(ids[k]),), (1.0,)) for k in np.unique(np.argmin(away, axis=1))]
        nearest: Floats = distances(self.head.scene.shape("skin").mesh, seeds).min(axis=0)
        return nearest


def _through(x: Floats, knots: Floats, values: Floats) -> Floats:
    """Smooth curve through knots."""
    from scipy.interpolate import PchipInterpolator

    curve: Floats = PchipInterpolator(knots, values)(x)
    return curve


def _inside_mouth(head: Head, lip: Bools) -> Bools:
    """Vertices that are cut off from the face by the ring of the lips."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    mesh = head.scene.shape("skin").mesh
    edges = mesh.edges[~lip[mesh.edges].any(axis=1)]
    n = mesh.vertex_count
    label = connected_components(coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(n, n)))[1]
    face = label[head.points["9.3"].vertices[0]]
    sizes = np.bincount(label)
    inside: Bools = (label != face) & ~lip & (sizes[label] > 1)
    return inside
