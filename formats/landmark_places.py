"""From the numbers of a landmark file to places on a scene's shapes, and back."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fba.arrays import Floats, Ints
from fba.closest import TriangleSearch
from fba.errors import LandmarkError, MeshError
from fba.feature_points import FeaturePoint
from fba.scene import FaceScene, Role
from formats.mesh_document import MeshDocument

SNAP_LIMIT = 0.02
"""A position farther from every surface than this part of the scene's diagonal belongs to another mesh."""

_INNER_POINTS = ("3.5", "3.6", "6.1", "6.2", "6.3", "6.4", "9.8", "9.9", "9.10", "9.11")
"""Points on eyes, tongue and teeth; all others lie on the skin."""


@dataclass(eq=False)
class Surfaces:
    """The surfaces of one scene, as landmark files see them.

    A scene read from a file with one common polygon list keeps that list in its document; polygon numbers
    without a shape refer to it.
    """

    scene: FaceScene
    _searches: dict[str, TriangleSearch] = field(default_factory=dict)

    @cached_property
    def _names(self) -> tuple[str, ...]:
        return tuple(s.name for s in self.scene.shapes)

    @cached_property
    def _owners(self) -> tuple[Ints, Ints]:
        """Shape number and local vertex of each vertex in the file's own order."""
        count = self.scene.vertex_count
        owner, local = np.zeros(count, dtype=np.int32), np.zeros(count, dtype=np.int32)
        for number, ids in enumerate(self.scene.file_order().values()):
            owner[ids] = number
            local[ids] = np.arange(len(ids))
        return owner, local

    @cached_property
    def _file_polygons(self) -> tuple[Ints, Ints] | None:
        document = self.scene.document
        return (document.indices, document.offsets) if isinstance(document, MeshDocument) else None

    @cached_property
    def _diagonal(self) -> float:
        used = [self.scene.world_vertices(s.name)[s.mesh.used_vertices] for s in self.scene.shapes]
        points = np.concatenate(used)
        return float(np.linalg.norm(points.max(axis=0) - points.min(axis=0))) if len(points) else 0.0

    def shape_name(self, name: object, where: str) -> str | None:
        """The shape that an entry names; a file of one shape knows only that one; None for none named."""
        if name is None:
            return None
        if not isinstance(name, str):
            raise LandmarkError(f"{where}: 'shape' must be the name of a shape")
        if name in self._names:
            return name
        by_role = [s.name for s in self.scene.shapes if s.role == name]
        if len(by_role) == 1:
            return by_role[0]
        if len(self._names) == 1:
            return self._names[0]
        raise LandmarkError(f"{where}: there is no shape '{name[:60]}'; the file has {', '.join(self._names)[:200]}")

    def locate(self, vertices: Ints, shape: str | None, where: str) -> tuple[str, Ints]:
        """Shape and local numbers of vertices that count in `shape` or, for None, in the file's own order."""
        count = self.scene.vertex_count if shape is None else self.scene.shape(shape).mesh.vertex_count
        if int(vertices.max()) >= count:
            owner = "file" if shape is None else f"shape '{shape}'"
            raise LandmarkError(f"{where}: vertex {int(vertices.max())} is out of range; the {owner} has {count}")
        if shape is not None:
            return shape, vertices
        owners, local = self._owners
        numbers = np.unique(owners[vertices])
        if numbers.size > 1:
            names = ", ".join(self._names[n] for n in numbers.tolist())
            raise LandmarkError(f"{where}: its vertices belong to several shapes ({names})")
        return self._names[int(numbers[0])], local[vertices]

    def polygon(self, number: int, shape: str | None, where: str) -> tuple[str, Ints]:
        """Shape and local vertices of a polygon's corners in the file's order of corners."""
        if shape is None and len(self._names) > 1:
            if self._file_polygons is None:
                raise LandmarkError(f"{where}: name the 'shape' of face {number}; there are {len(self._names)}")
            indices, offsets = self._file_polygons
            self._check_polygon(number, len(offsets) - 1, where)
            return self.locate(indices[offsets[number] : offsets[number + 1]], None, where)
        name = shape or self._names[0]
        mesh = self.scene.shape(name).mesh
        self._check_polygon(number, mesh.face_count, where)
        corners = mesh.face(number)
        return name, corners[::-1] if self.scene.frame.reversed_winding else corners

    @staticmethod
    def _check_polygon(number: int, count: int, where: str) -> None:
        if number >= count:
            raise LandmarkError(f"{where}: face {number} is out of range; there are {count}")

    def snap(self, key: str, position: Floats, shape: str | None, where: str) -> FeaturePoint:
        """Take a position (inside axes) to the nearest point of the surfaces where this feature point can be."""
        names = self._names if shape is None else (shape,)
        skin = tuple(s.name for s in self.scene.with_role(Role.SKIN))
        if shape is None and skin and key not in _INNER_POINTS:
            names = skin
        best: tuple[float, FeaturePoint] | None = None
        for name in names:
            mesh = self.scene.shape(name).mesh
            if mesh.face_count == 0:
                continue
            if name not in self._searches:
                self._searches[name] = TriangleSearch(self.scene.world_vertices(name), mesh.triangles)
            triangle, weights, distance = self._searches[name].closest(position)
            if best is None or distance < best[0]:
                corners = tuple(mesh.triangles[triangle].tolist())
                best = (distance, FeaturePoint(name, corners, tuple(weights.tolist())))
        if best is None:
            raise MeshError("the scene has no polygons to place feature points on")
        if best[0] > SNAP_LIMIT * self._diagonal:
            part = 100.0 * best[0] / self._diagonal if self._diagonal else float("inf")
            raise LandmarkError(
                f"{where} is off the surface: {best[0]:.4g} away, {part:,.1f} % of the mesh's diagonal "
                f"(at most {100 * SNAP_LIMIT:g} %); check the units and axes of the position"
            )
        return best[1]

    def entry(self, point: FeaturePoint) -> dict[str, object]:
        """What a landmark file says of a point."""
        if point.shape is None:
            return {"position": self.scene.frame.to_file(np.asarray(point.point)).tolist()}
        local = np.asarray(point.vertices, dtype=np.int32)
        places = self.scene.file_order()[point.shape][local]
        heavy = [i for i, w in enumerate(point.weights) if w != 0.0]
        if len(heavy) == 1 and point.weights[heavy[0]] == 1.0:
            return {"vertex": int(places[heavy[0]])}
        mesh = self.scene.shape(point.shape).mesh
        if len(self._names) > 1 and self._file_polygons is not None:
            corners, number = _find_polygon(*self._file_polygons, places)
            return _face_entry({}, number, corners, places, point.weights)
        corners, number = _find_polygon(mesh.indices, mesh.offsets, local)
        if self.scene.frame.reversed_winding:
            corners = corners[::-1]
        return _face_entry({"shape": point.shape}, number, corners, local, point.weights)


def _find_polygon(indices: Ints, offsets: Ints, vertices: Ints) -> tuple[Ints, int]:
    """Corners and number of the first polygon that has all these vertices; number -1 if there is none."""
    candidates = np.flatnonzero(np.isin(indices, vertices))
    for number in np.unique(np.searchsorted(offsets, candidates, side="right") - 1).tolist():
        corners = indices[offsets[number] : offsets[number + 1]]
        if np.isin(vertices, corners).all():
            return corners, number
    return np.zeros(0, np.int32), -1


def _face_entry(
    entry: dict[str, object], number: int, corners: Ints, vertices: Ints, weights: tuple[float, ...]
) -> dict[str, object]:
    if number < 0:
        return {**entry, "vertices": vertices.tolist(), "barycentric": list(weights)}
    spread = [0.0] * len(corners)
    for vertex, weight in zip(vertices.tolist(), weights, strict=True):
        spread[corners.tolist().index(vertex)] += weight
    return {**entry, "face": number, "barycentric": spread}
