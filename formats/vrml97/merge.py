"""From scene to syntax tree: put the scene back into the document it came from, or make a clean one.

Everything of the document that is not a mesh or transform of the scene is written back as it was. Transforms that
were put above existing nodes are put above their nodes in the tree; a shape that was cut into several gives place
to its parts, which take over its appearance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fba.arrays import Ints
from fba.scene import FaceScene, Node, Shape, Transform
from formats.vrml97.axes import in_file_axes
from formats.vrml97.document import METADATA_DEF, VrmlDocument
from formats.vrml97.geometry import (
    appearance_node,
    changed_shape,
    rows_of,
    same_mesh,
    shape_node,
)
from formats.vrml97.names import Names, escape
from formats.vrml97.references import definitions_first
from formats.vrml97.scene import CHILD_FIELDS, child_field, places_children, set_transform_fields
from formats.vrml97.tree import Nodes, Route, Statement, Strings, VrmlNode, definitions, node, number


def merge(scene: FaceScene) -> tuple[tuple[Statement, ...], dict[str, str]]:
    """Build the statements of a file for a scene.

    Returns
    -------
    statements : without Face nodes and metadata.
    def_names : name of every shape and transform -> its DEF name in the statements.
    """
    document = scene.document if isinstance(scene.document, VrmlDocument) else VrmlDocument()
    roots = in_file_axes(scene)
    merger = _Merger(document, scene)
    statements: list[Any] = merger.place(document.statements, roots)
    if not document.statements:
        statements = [*_surroundings(scene, roots), *statements]
    ordered = definitions_first(tuple(statements), merger.defs)
    gone = merger.defs.keys() - definitions(ordered).keys()
    kept = tuple(s for s in ordered if not (isinstance(s, Route) and (s.source in gone or s.target in gone)))
    return kept, merger.def_names


class _Merger:
    def __init__(self, document: VrmlDocument, scene: FaceScene) -> None:
        self.document = document
        self.defs = definitions(document.statements)
        self.names = {id(item): name for name, item in document.nodes.items()}
        outgoing = [n for n, _ in scene.walk()]
        self.alive = {id(known) for known in map(self.known, outgoing) if known is not None}
        self.places = _file_places(document.parts)
        self.def_names: dict[str, str] = {}
        free = Names([*self.defs, METADATA_DEF])
        for part in outgoing:
            known = self.known(part)
            if known is not None and known.def_name is not None:
                self.def_names[part.name] = known.def_name
            else:
                self.def_names[part.name] = free.give(escape(part.name))

    def known(self, part: Node) -> VrmlNode | None:
        """The document's node of this name and kind."""
        same_kind = type(self.document.parts.get(part.name)) is type(part)
        return self.document.nodes[part.name] if same_kind else None

    # --- lists ----------------------------------------------------------------------------------------------

    def place(self, items: Sequence[Any], outgoing: tuple[Node, ...], *, one_each: bool = False) -> list[Any]:
        """A list of the document with the nodes of the scene in it replaced by the outgoing ones.

        one_each : the places in the list have a meaning (Switch, LOD), so parts that replace a shape are grouped.
        """
        at: dict[int, list[Node]] = {}
        loose: list[Node] = []
        position = {id(item): k for k, item in enumerate(items)}
        for part in outgoing:
            covered = [position[i] for i in self.cover(part) if i in position]
            if covered:
                at.setdefault(min(covered), []).append(part)
            else:
                loose.append(part)
        if loose:
            vacant = (k for k, item in enumerate(items) if id(item) in self.names and id(item) not in self.alive)
            at.setdefault(next(vacant, len(items)), []).extend(loose)
        out: list[Any] = []
        for k in range(len(items) + 1):
            found = [self.emit(part) for part in at.get(k, ())]
            if one_each and len(found) > 1:
                found = [node("Group", children=Nodes(tuple(found), True))]
            out.extend(found)
            if not found and k < len(items) and id(items[k]) not in self.names:
                out.append(items[k])
        return out

    def cover(self, part: Node) -> set[int]:
        """The document's nodes that a node stands for: itself, or for a new transform what lies below it."""
        known = self.known(part)
        if known is not None:
            return {id(known)}
        if isinstance(part, Shape):
            return set()
        return set().union(*(self.cover(c) for c in part.children))

    # --- nodes ----------------------------------------------------------------------------------------------

    def emit(self, part: Node) -> VrmlNode:
        name = self.def_names[part.name]
        known = self.known(part)
        if isinstance(part, Shape):
            built = self.new_shape(part) if known is None else self.known_shape(part, known)
        else:
            built = self.transform(part, known)
        return replace(built, def_name=name)

    def transform(self, part: Transform, known: VrmlNode | None) -> VrmlNode:
        if known is None:
            empty = set_transform_fields(node("Transform"), part)
            return empty.with_field("children", Nodes(tuple(self.emit(c) for c in part.children), True))
        where = child_field(known) or "children"
        value = known.get(where)
        items = value.items if isinstance(value, Nodes) else ()
        children = self.place(items, part.children, one_each=CHILD_FIELDS.get(known.type) in ("choice", "level"))
        many = len(children) != 1 or not isinstance(value, Nodes) or value.many
        built = known.with_field(where, Nodes(tuple(children), many)) if children or items else known
        return set_transform_fields(built, part) if places_children(known) else built

    def known_shape(self, part: Shape, known: VrmlNode) -> VrmlNode:
        before = self.document.parts[part.name]
        assert isinstance(before, Shape)
        built = known
        if not same_mesh(part.mesh, before.mesh):
            built = changed_shape(known, before.mesh, part, self.rows(part, before), self.defs)
        if part.materials != before.materials:
            built = built.with_field("appearance", Nodes((appearance_node(part.materials),)))
        return built

    def new_shape(self, part: Shape) -> VrmlNode:
        """A shape that the document does not know: a piece of one of its shapes, or altogether new."""
        for name, before in self.document.parts.items():
            if isinstance(before, Shape) and (rows := self.rows(part, before)) is not None:
                return changed_shape(self.document.nodes[name], before.mesh, part, rows, self.defs)
        return shape_node(self.def_names[part.name], part.mesh, part.materials)

    def rows(self, part: Shape, whole: Shape) -> Ints | None:
        """For each vertex of a shape its place in a shape of the document; None if it is not a part of that.

        The vertices' places in the file tell, where they are noted; else equal coordinates do.
        """
        if part.vertex_ids is not None:
            places = self.places[whole.name]
            inverse = np.full(max(int(places.max(initial=-1)), int(part.vertex_ids.max(initial=-1))) + 1, -1, np.int32)
            inverse[places] = np.arange(places.size)
            found = inverse[part.vertex_ids]
            if found.size and found.min() >= 0 and np.array_equal(whole.mesh.vertices[found], part.mesh.vertices):
                return found
        return rows_of(part.mesh, whole.mesh)


def _file_places(parts: Mapping[str, Shape | Transform]) -> dict[str, Ints]:
    """Name of each shape -> places of its vertices in the file's own vertex list."""
    roots = tuple(p for p in parts.values() if isinstance(p, Shape))
    return FaceScene(roots).file_order()


def _surroundings(scene: FaceScene, roots: tuple[Node, ...]) -> list[VrmlNode]:
    """Title, viewer and a viewpoint in front of the face, for a file that is made from nothing."""
    world = scene.world_neutral()
    low, high = (world.min(axis=0), world.max(axis=0)) if len(world) else (np.zeros(3), np.ones(3))
    middle = (low + high) / 2
    size = float(np.linalg.norm(high - low)) or 1.0
    eye = middle + np.array([0.0, 0.0, 1.5 * size])
    turn = scene.frame.to_file
    return [
        node("WorldInfo", title=Strings((scene.name,))),
        node("NavigationInfo", type=Strings(("EXAMINE", "ANY"), True)),
        node(
            "Viewpoint",
            position=number(*turn(eye)),
            orientation=number(*_view(turn(np.array([0.0, 0.0, 1.0])), turn(np.array([0.0, 1.0, 0.0])))),
            description=Strings(("front",)),
        ),
    ]


def _view(back: np.ndarray[Any, Any], up: np.ndarray[Any, Any]) -> tuple[float, float, float, float]:
    """Axis and angle that turn a viewer's own axes (looking down -Z, Y up) to look along -back with `up` upwards."""
    matrix = np.stack([np.cross(up, back), up, back], axis=1)
    angle = float(np.arccos(np.clip((np.trace(matrix) - 1) / 2, -1.0, 1.0)))
    if angle == 0.0:
        return 0.0, 0.0, 1.0, 0.0
    skew = np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]])
    if np.linalg.norm(skew) < 1e-9:
        column = int(np.argmax(np.diag(matrix)))
        skew = matrix[:, column] + np.eye(3)[column]
    x, y, z = (float(c) for c in skew / np.linalg.norm(skew))
    return x, y, z, angle
