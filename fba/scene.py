"""The scene graph of a face: named transforms and shapes, their roles, axes and units.

Coordinates inside are right-handed: +X the subject's left, +Y up, +Z the gaze. `Frame` remembers how the
file's own axes were turned, so that writers can give them back exactly.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from pathlib import Path

import numpy as np

from fba.arrays import Floats, Ints, frozen
from fba.errors import MeshError
from fba.mesh import Material, PolyMesh


class Role(StrEnum):
    """What a shape is in the face."""

    SKIN = "skin"
    EYE_LEFT = "eye_left"
    EYE_RIGHT = "eye_right"
    UPPER_TEETH = "upper_teeth"
    LOWER_TEETH = "lower_teeth"
    TONGUE = "tongue"
    OTHER = "other"


@dataclass(frozen=True, eq=False)
class Shape:
    """A mesh in the scene graph, in the local coordinates of its parents.

    Attributes
    ----------
    name : unique in the scene.
    vertex_ids : (n,) int32 or None. Where the file has one common vertex list for several shapes (OBJ): the
        place of each vertex in that list. Shapes without ids follow one another in scene order.
    """

    name: str
    mesh: PolyMesh
    role: Role = Role.OTHER
    materials: tuple[Material, ...] = ()
    vertex_ids: Ints | None = None

    def __post_init__(self) -> None:
        if self.vertex_ids is not None:
            ids = frozen(self.vertex_ids, np.int32, (-1,))
            if ids.size != self.mesh.vertex_count:
                raise MeshError(f"shape '{self.name}': {ids.size} vertex ids for {self.mesh.vertex_count} vertices")
            object.__setattr__(self, "vertex_ids", ids)


@dataclass(frozen=True)
class Transform:
    """A grouping node with the fields of VRML97's Transform (angles in radians).

    ``P = T * C * R * SR * S * -SR * -C``: translation, centre, rotation, scale orientation, scale.
    """

    name: str
    children: tuple[Node, ...] = ()
    translation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 0.0)
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    scale_orientation: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 0.0)
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def matrix(self) -> Floats:
        """Return the 4x4 matrix from the children's coordinates to the parent's."""
        center = translation_matrix(self.center)
        turn = rotation_matrix(self.rotation)
        orient = rotation_matrix(self.scale_orientation)
        scale = np.diag([*self.scale, 1.0])
        back = translation_matrix(tuple(-c for c in self.center))
        return translation_matrix(self.translation) @ center @ turn @ orient @ scale @ orient.T @ back


Node = Shape | Transform


def translation_matrix(offset: tuple[float, ...]) -> Floats:
    """4x4 translation."""
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix


def rotation_matrix(rotation: tuple[float, float, float, float]) -> Floats:
    """4x4 rotation by an angle (radians) about an axis of any length (right-hand rule); a null axis gives I."""
    axis = np.asarray(rotation[:3], dtype=np.float64)
    length = float(np.linalg.norm(axis))
    matrix = np.eye(4)
    if length == 0.0 or rotation[3] == 0.0:
        return matrix
    x, y, z = axis / length
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    matrix[:3, :3] += np.sin(rotation[3]) * cross + (1.0 - np.cos(rotation[3])) * (cross @ cross)
    return matrix


@dataclass(frozen=True, eq=False)
class Frame:
    """How the file's coordinates were turned into the head's: ``inside = axes @ file``.

    Attributes
    ----------
    axes : (3, 3) signed permutation, so that turning forth and back is exact. Determinant -1 for a
        left-handed file.
    reversed_winding : the file's polygons were wound inside out and have been reversed.
    """

    axes: Floats = field(default_factory=lambda: np.eye(3))
    reversed_winding: bool = False

    def __post_init__(self) -> None:
        axes = frozen(self.axes, np.float64, (3, 3))
        if not (np.all(np.isin(axes, (-1.0, 0.0, 1.0))) and np.array_equal(axes @ axes.T, np.eye(3))):
            raise MeshError("the axes of a frame must be a signed permutation")
        object.__setattr__(self, "axes", axes)

    @property
    def identity(self) -> bool:
        return bool(np.array_equal(self.axes, np.eye(3)))

    def to_file(self, vectors: Floats) -> Floats:
        """Turn (..., 3) vectors or points from inside axes to the file's; exact."""
        return vectors if self.identity else _signed(np.asarray(vectors), self.axes.T)

    def from_file(self, vectors: Floats) -> Floats:
        """Turn (..., 3) vectors or points from the file's axes to the inside ones; exact."""
        return vectors if self.identity else _signed(np.asarray(vectors), self.axes)


def _signed(vectors: Floats, axes: Floats) -> Floats:
    source = np.argmax(np.abs(axes), axis=1)
    sign = axes[np.arange(3), source]
    turned: Floats = vectors[..., source] * sign
    return turned


def _product(above: tuple[Transform, ...]) -> Floats:
    """4x4 matrix of a chain of transforms, outermost first."""
    matrix = np.eye(4)
    for transform in above:
        matrix = matrix @ transform.matrix()
    return matrix


def _moved(vertices: Floats, above: tuple[Transform, ...]) -> Floats:
    """(n, 3) vertices below a chain of transforms; the same array if nothing turns them."""
    matrix = _product(above)
    if np.array_equal(matrix, np.eye(4)):
        return vertices
    return vertices @ matrix[:3, :3].T + matrix[:3, 3]


@dataclass(frozen=True, eq=False)
class FaceScene:
    """A scene graph with a face in it.

    Attributes
    ----------
    roots : top nodes, in file order.
    frame : how the file's axes were turned.
    meters_per_unit : metres in one unit of length, when the file says so.
    name : for messages: the file's name without folder and extension.
    document : what the file held besides geometry, kept by the reader of that format for its own writer.
    folder : of the file, where the images lie that materials name; None if it was not read from one.
    images : the images that were inside the file, by the names that materials give them.
    vertex_attributes : (N, k) values in the file's own vertex order, NaN where a vertex has none: "color" (k = 3, or
        4 with opacity; linear light) and "texcoord_1" and above (k = 2, from the lower left corner of the image).
    """

    roots: tuple[Node, ...]
    frame: Frame = field(default_factory=Frame)
    meters_per_unit: float | None = None
    name: str = "face"
    document: object | None = None
    folder: Path | None = None
    images: Mapping[str, bytes] = field(default_factory=dict)
    vertex_attributes: Mapping[str, Floats] = field(default_factory=dict)

    def walk(self) -> Iterator[tuple[Node, tuple[Transform, ...]]]:
        """Yield every node, parents first, with its chain of parent transforms (outermost first)."""

        def visit(node: Node, parents: tuple[Transform, ...]) -> Iterator[tuple[Node, tuple[Transform, ...]]]:
            yield node, parents
            if isinstance(node, Transform):
                for child in node.children:
                    yield from visit(child, (*parents, node))

        for root in self.roots:
            yield from visit(root, ())

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """All shapes in file order."""
        return tuple(node for node, _ in self.walk() if isinstance(node, Shape))

    @property
    def transforms(self) -> tuple[Transform, ...]:
        """All transforms, parents first."""
        return tuple(node for node, _ in self.walk() if isinstance(node, Transform))

    def shape(self, name: str) -> Shape:
        """Return the shape of this name; KeyError if there is none."""
        for shape in self.shapes:
            if shape.name == name:
                return shape
        raise KeyError(name)

    def with_role(self, role: Role) -> tuple[Shape, ...]:
        """All shapes of this role."""
        return tuple(shape for shape in self.shapes if shape.role is role)

    def parents(self, name: str) -> tuple[Transform, ...]:
        """Return the chain of transforms above a node, outermost first; KeyError if there is no such node."""
        for node, chain in self.walk():
            if node.name == name:
                return chain
        raise KeyError(name)

    def world_matrix(self, name: str) -> Floats:
        """4x4 matrix from a node's local coordinates (for a transform: those of its parent) to the world's."""
        return _product(self.parents(name))

    def world_vertices(self, name: str) -> Floats:
        """(n, 3) vertices of one shape at rest in world coordinates; the mesh's own array if nothing turns it."""
        return _moved(self.shape(name).mesh.vertices, self.parents(name))

    @property
    def vertex_count(self) -> int:
        """Number of vertices in the file's own order (see `file_order`)."""
        return int(sum(s.mesh.vertex_count for s in self.shapes))

    def file_order(self) -> dict[str, Ints]:
        """Shape name -> place of each of its vertices in the file's own vertex list.

        Raises
        ------
        MeshError
            If two shapes claim the same place.
        """
        return dict(self._places)

    @cached_property
    def _places(self) -> dict[str, Ints]:
        places: dict[str, Ints] = {}
        start = 0
        for shape in self.shapes:
            if shape.vertex_ids is not None:
                places[shape.name] = shape.vertex_ids
            else:
                places[shape.name] = frozen(range(start, start + shape.mesh.vertex_count), np.int32, (-1,))
            start += shape.mesh.vertex_count
        joined = np.concatenate(list(places.values())) if places else np.zeros(0, np.int32)
        if joined.size and (np.unique(joined).size != joined.size or int(joined.max()) != joined.size - 1):
            raise MeshError("the shapes' vertex ids do not form one vertex list")
        return places

    def gather(self, per_shape: dict[str, Floats]) -> Floats:
        """Put one (n, 3) array for each shape together as (N, 3) in the file's own vertex order."""
        out = np.zeros((self.vertex_count, 3))
        for name, ids in self.file_order().items():
            out[ids] = per_shape[name]
        return out

    def scatter(self, values: Floats) -> dict[str, Floats]:
        """Take (N, 3) values in the file's own vertex order apart, one (n, 3) array for each shape."""
        return {name: values[ids] for name, ids in self.file_order().items()}

    def world_neutral(self) -> Floats:
        """(N, 3) neutral vertices of all shapes in the file's own order, inside axes, world coordinates."""
        found: dict[str, Floats] = {}
        for node, above in self.walk():
            if isinstance(node, Shape):
                found[node.name] = _moved(node.mesh.vertices, above)
        return self.gather(found)

    def map_shapes(self, change: dict[str, Shape]) -> FaceScene:
        """Replace shapes by name."""

        def visit(node: Node) -> Node:
            if isinstance(node, Shape):
                return change.get(node.name, node)
            return replace(node, children=tuple(visit(c) for c in node.children))

        return replace(self, roots=tuple(visit(r) for r in self.roots))
