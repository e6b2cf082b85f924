"""The lines along which lips and lids meet, and feature points on them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fba.arrays import Bools, Floats, Ints
from fba.fapu import Fapu
from fba.feature_points import FeaturePoint, FeaturePoints
from fba.scene import FaceScene
from samples.build.geodesic import distances
from samples.build.head import Head


class PointedHead(Protocol):
    """A head with feature points, whose skin is the shape "skin"."""

    @property
    def scene(self) -> FaceScene: ...

    @property
    def points(self) -> FeaturePoints: ...

    @property
    def positions(self) -> dict[str, Floats]: ...

    @property
    def fapu(self) -> Fapu: ...


@dataclass(frozen=True)
class Edge:
    """One of two skin sides that meet: a lip or a lid.

    seeds : feature points that belong to this side.
    rivals : feature points of the other side.
    guide : feature points along the edge by rising x, corners included.
    sign : 1 if the edge is the lowest line of its side, -1 if it is the highest.
    reach : how far from the guide the edge may lie, in ES0.
    extent : how far (geodesic, ES0) the side goes.
    """

    seeds: tuple[str, ...]
    rivals: tuple[str, ...]
    guide: tuple[str, ...]
    sign: int
    reach: float
    extent: float


UPPER_LIP = ("2.2", "2.6", "2.7", "8.1", "8.5", "8.6", "8.9", "8.10")
LOWER_LIP = ("2.3", "2.8", "2.9", "8.2", "8.7", "8.8")
LIPS = {
    "upper": Edge(UPPER_LIP, LOWER_LIP, ("2.5", "2.7", "2.2", "2.6", "2.4"), 1, 0.12, 0.6),
    "lower": Edge(LOWER_LIP, UPPER_LIP, ("2.5", "2.9", "2.3", "2.8", "2.4"), -1, 0.12, 0.6),
}
_L, _R = (("3.1", "3.13"), ("3.3", "3.9")), (("3.2", "3.14"), ("3.4", "3.10"))
LIDS = {
    ("left", "upper"): Edge(_L[0], _L[1], ("3.11", "3.1", "3.7"), 1, 0.08, 0.35),
    ("left", "lower"): Edge(_L[1], _L[0], ("3.11", "3.3", "3.7"), -1, 0.08, 0.35),
    ("right", "upper"): Edge(_R[0], _R[1], ("3.12", "3.2", "3.8"), 1, 0.08, 0.35),
    ("right", "lower"): Edge(_R[1], _R[0], ("3.12", "3.4", "3.8"), -1, 0.08, 0.35),
}


@dataclass(frozen=True)
class Line:
    """Points of an edge in slices of constant x.

    points : (s, 3).
    edges : (s, 2) the skin vertices between which each point lies.
    shares : (s,) the weight of the second one.
    """

    points: Floats
    edges: Ints
    shares: Floats

    def feature_point(self, row: int) -> FeaturePoint:
        """One slice's point, fixed to the surface."""
        a, b = self.edges[row].tolist()
        weights = ((a, 1.0 - float(self.shares[row])), (b, float(self.shares[row])))
        kept = [(v, w) for v, w in weights if w > 1e-9]
        return FeaturePoint("skin", tuple(v for v, _ in kept), tuple(w for _, w in kept))


def side_mask(head: PointedHead, edge: Edge) -> Bools:
    """Skin vertices that belong to the edge's side: nearer along the surface to its own feature points."""
    mesh = head.scene.shape("skin").mesh
    own, other = (distances(mesh, [head.points[k] for k in keys]).min(axis=0) for keys in (edge.seeds, edge.rivals))
    mask: Bools = (own < edge.extent * head.fapu.es0) & (own <= other)
    return mask


def edge_line(head: Head, edge: Edge, mask: Bools, span: Floats) -> Line:
    """Find an edge in the slices x = span[i] of the skin of a head; mask (n,) of `side_mask`."""
    triangles = head.scene.shape("skin").mesh.triangles
    guide = np.array([head.positions[key] for key in edge.guide])
    return surface_edge(head.parts["skin"], triangles[mask[triangles].all(axis=1)], guide, span, edge, head.fapu.es0)


def surface_edge(skin: Floats, triangles: Ints, guide: Floats, span: Floats, edge: Edge, es0: float) -> Line:
    """Find an edge among triangles of one side of any skin; see `edge_line`."""
    tails, heads = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    points, shares = np.zeros((span.size, 3)), np.zeros(span.size)
    edges = np.zeros((span.size, 2), dtype=np.int32)
    for row, x in enumerate(span):
        crossing = (skin[tails, 0] - x) * (skin[heads, 0] - x) <= 0.0
        crossing &= skin[tails, 0] != skin[heads, 0]
        a, b = tails[crossing], heads[crossing]
        share = (x - skin[a, 0]) / (skin[b, 0] - skin[a, 0])
        cut = skin[a] + (skin[b] - skin[a]) * share[:, None]
        near = np.array([np.interp(x, guide[:, 0], guide[:, k]) for k in (1, 2)])
        close = np.linalg.norm(cut[:, 1:] - near, axis=1) < edge.reach * es0
        best = int(np.argmin(np.where(close, edge.sign * cut[:, 1], np.inf)))
        points[row], edges[row], shares[row] = cut[best], (a[best], b[best]), share[best]
    return Line(points, edges, shares)
