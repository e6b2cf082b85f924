"""How far each table moves feature points: small enough to ask at every frame of a stream."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fat.face import AnimatableFace
from fat.intervals import IntervalRule, interval_rule
from fba.arrays import Floats, Ints
from fba.faps import fap
from fba.feature_points import FeaturePoints

Probe = Mapping[str, tuple[float, float, float]]
"""Feature point -> direction (3,): a probe measures the sum of the points' motions along these directions."""


class Response:
    """What the tables of a face do to some probes, exactly as in evaluation and without its vertices.

    Parameters
    ----------
    face : animatable face; FaceDefTransforms are left out, as they turn whole parts.
    probes : P sums of feature point motions; points that are not on a surface count as still.

    Notes
    -----
    A feature point is a weighted sum of vertices, so that its motion is piecewise linear in every FAP like theirs.
    """

    def __init__(self, face: AnimatableFace, probes: Sequence[Probe]) -> None:
        self._count = len(probes)
        effects = _effects(face, probes)
        rules: list[IntervalRule] = []
        table_of: list[int] = []
        self._rows: list[slice] = []
        slopes: list[Floats] = []
        self.borders: list[Floats] = []
        """For each table the finite FAP values at which its response may bend."""
        for number, table in enumerate(face.tables):
            bends: set[float] = set()
            start = len(table_of)
            for mesh in table.meshes:
                if mesh.shape not in effects:
                    continue
                row_of, effect = effects[mesh.shape]
                rows = row_of[mesh.coord_index]
                seen = rows >= 0
                moved = np.einsum("kjc,kcp->jp", mesh.displacements[seen], effect[rows[seen]])
                if not moved.any():
                    continue
                rules.append(interval_rule(mesh.interval_borders))
                slopes.append(moved * face.fapu.unit(fap(table.fap_id).unit))
                table_of += [number] * len(moved)
                bends.update(mesh.interval_borders.tolist())
            self._rows.append(slice(start, len(table_of)))
            self.borders.append(np.array(sorted(bends), dtype=np.float64))
        self._table_of: Ints = np.array(table_of, dtype=np.int32)
        self._low, self._high, self._origin, self._sign = (
            np.concatenate([np.zeros(0), *(getattr(r, part) for r in rules)])
            for part in ("low", "high", "origin", "sign")
        )
        self._slopes: Floats = np.concatenate([np.zeros((0, self._count)), *slopes])

    def __call__(self, values: Floats) -> Floats:
        """Return the probes (f, P), in units of the mesh, at table values (f, tables)."""
        clipped = np.clip(values[:, self._table_of], self._low, self._high)
        moved: Floats = (self._sign * (clipped - self._origin)) @ self._slopes
        return moved

    def of(self, table: int, values: Floats) -> Floats:
        """Return the probes (..., P) that one table moves at values (...)."""
        own = self._rows[table]
        clipped = np.clip(values[..., None], self._low[own], self._high[own])
        moved: Floats = (self._sign[own] * (clipped - self._origin[own])) @ self._slopes[own]
        return moved


def points_on_surface(face: AnimatableFace) -> FeaturePoints:
    """The feature points that name vertices of the scene; free points and those of another mesh are left out."""
    counts = {s.name: s.mesh.vertex_count for s in face.scene.shapes}
    return FeaturePoints(
        {
            key: point
            for key, point in face.feature_points.items()
            if point.shape is not None and all(0 <= v < counts.get(point.shape, 0) for v in point.vertices)
        }
    )


def _effects(face: AnimatableFace, probes: Sequence[Probe]) -> dict[str, tuple[Ints, Floats]]:
    """How much each probe grows when a vertex moves by one unit of its local axes.

    Returns
    -------
    Shape -> (n,) row of each vertex, -1 where no probe looks at it, and the rows (r, 3, P).
    """
    points = points_on_surface(face)
    used: dict[str, set[int]] = {}
    for key in {key for probe in probes for key in probe} & points.keys():
        used.setdefault(str(points[key].shape), set()).update(points[key].vertices)
    found = {}
    for name in sorted(used):
        vertices = np.array(sorted(used[name]), dtype=np.int32)
        row_of = np.full(face.scene.shape(name).mesh.vertex_count, -1, dtype=np.int32)
        row_of[vertices] = np.arange(vertices.size)
        linear = face.scene.world_matrix(name)[:3, :3]
        effect = np.zeros((vertices.size, 3, len(probes)))
        for number, probe in enumerate(probes):
            for key, direction in probe.items():
                if key in points and points[key].shape == name:
                    weights = np.outer(points[key].weights, np.asarray(direction) @ linear)
                    np.add.at(effect[:, :, number], row_of[list(points[key].vertices)], weights)
        found[name] = (row_of, effect)
    return found
