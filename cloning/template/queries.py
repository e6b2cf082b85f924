"""What the search for closest points is given: triangles, and points that ask."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cloning.labels import OPPOSITE
from cloning.locate import Places
from fba.arrays import Bools, Floats, Ints


@dataclass(frozen=True, eq=False)
class Triangles:
    """Triangles that can be found.

    Attributes
    ----------
    corners : (t, 3, 3).
    normals : (t, 3), unit; zero for triangles of no area.
    bits : (t,) labels that each touches, one bit each.
    usable : indices of those that may be found, ascending.
    """

    corners: Floats
    normals: Floats
    bits: Ints
    usable: Ints

    @classmethod
    def of(cls, vertices: Floats, triangles: Ints, labels: Ints | None, usable: Bools | None) -> Triangles:
        """Triangles (t, 3) of (n, 3) vertices with (n,) labels, of which (t,) are usable."""
        corners = vertices[triangles]
        a, b, c = (corners[:, k] for k in range(3))
        cross = np.cross(b - a, c - a)
        length = np.linalg.norm(cross, axis=1, keepdims=True)
        normals = np.divide(cross, length, out=np.zeros_like(cross), where=length > 0.0)
        bits = np.zeros(len(triangles), np.int32)
        if labels is not None:
            bits = np.bitwise_or.reduce(1 << labels[triangles].astype(np.int32), axis=1)
        some = np.arange(len(triangles)) if usable is None else np.flatnonzero(usable)
        return cls(corners, normals, bits, some.astype(np.int32))


@dataclass(frozen=True, eq=False)
class Queries:
    """Points that ask for their closest triangles.

    Attributes
    ----------
    points : (m, 3).
    normals : (m, 3) unit normals, or None.
    least_facing : a triangle must face at least so far the same way, as a cosine.
    refused : (m,) bits of labels that a triangle must not touch.
    limits : (m,) nothing farther is found.
    """

    points: Floats
    normals: Floats | None
    least_facing: float
    refused: Ints
    limits: Floats

    @classmethod
    def of(
        cls, points: Floats, normals: Floats | None, least_facing: float, labels: Ints | None, reach: float | Floats
    ) -> Queries:
        """Queries of points with (m,) labels, or None."""
        refused = np.zeros(len(points), np.int32)
        if labels is not None:
            opposite = OPPOSITE[labels]
            refused = np.where(opposite >= 0, 1 << np.maximum(opposite, 0), 0).astype(np.int32)
        limits = np.array(np.broadcast_to(reach, len(points)), np.float64)
        return cls(points, normals, least_facing, refused, limits)

    def __len__(self) -> int:
        return len(self.points)

    def part(self, some: slice) -> Queries:
        """Some of them."""
        normals = None if self.normals is None else self.normals[some]
        return Queries(self.points[some], normals, self.least_facing, self.refused[some], self.limits[some])


def nowhere(count: int) -> Places:
    """Places of points that have found nothing."""
    return Places(np.full(count, -1, np.int32), np.zeros((count, 3)), np.full(count, np.inf), np.full(count, -1.0))
