"""From syntax tree to scene: grouping nodes become Transforms, IndexedFaceSets become shapes.

A node that is used several times is in the scene once, where the text has it first; its other instances, and every
node that is neither grouping node nor polygon mesh, stay in the document alone.
"""

from __future__ import annotations

from collections.abc import Container
from dataclasses import replace
from typing import Any

from fba.findings import Finding
from fba.scene import Node, Shape, Transform
from formats.vrml97.geometry import Definitions, child, fixed, material_of, mesh_of
from formats.vrml97.names import Names, unescape
from formats.vrml97.tree import Nodes, Numbers, Statement, Use, VrmlNode, number

CHILD_FIELDS = {
    "Anchor": "children",
    "Billboard": "children",
    "Collision": "children",
    "Group": "children",
    "LOD": "level",
    "Switch": "choice",
    "Transform": "children",
}
"""The grouping nodes of VRML97 and the field that holds their children. Inline is not followed."""

TRANSFORM_FIELDS = {
    "translation": "translation",
    "rotation": "rotation",
    "scale": "scale",
    "scaleOrientation": "scale_orientation",
    "center": "center",
}


def child_field(item: VrmlNode) -> str | None:
    """The field with the children of a grouping node; unknown nodes with a `children` field count as such."""
    if item.type in CHILD_FIELDS:
        return CHILD_FIELDS[item.type]
    return "children" if isinstance(item.get("children"), Nodes) else None


def places_children(item: VrmlNode) -> bool:
    """Whether the fields of a Transform mean here what they mean there."""
    return item.type not in CHILD_FIELDS or item.type == "Transform"


class SceneReader:
    """Build the scene of one document; `nodes` maps the names it gave to syntax tree nodes."""

    def __init__(self, defs: Definitions, keep: Container[str], findings: list[Finding]) -> None:
        self.defs = defs
        self.keep = keep
        self.findings = findings
        self.nodes: dict[str, VrmlNode] = {}
        self.parts: dict[str, Node] = {}
        self.free = Names(unescape(name) for name in defs)
        self.given: set[str] = set()
        self.seen: set[int] = set()

    def roots(self, statements: tuple[Statement, ...]) -> tuple[Node, ...]:
        """All roots that hold a shape, or a transform that must be kept."""
        found = [self.visit(s) for s in statements if isinstance(s, (VrmlNode, Use))]
        return tuple(r for r in found if r is not None)

    def visit(self, item: VrmlNode | Use) -> Node | None:
        if isinstance(item, Use):
            return None
        if id(item) in self.seen:
            return None
        self.seen.add(id(item))
        if item.type == "Shape":
            return self.shape(item)
        if item.type == "Inline":
            self.say("info", "inline", "an Inline file is not followed; its contents stay as they are", item)
            return None
        return self.group(item)

    def say(self, severity: str, code: str, message: str, item: VrmlNode) -> None:
        where = f"line {item.line}" if item.line else item.def_name or ""
        self.findings.append(Finding("info" if severity == "info" else "warning", code, message, where))

    def name(self, item: VrmlNode) -> str:
        name = unescape(item.def_name) if item.def_name is not None else self.free.give(item.type.lower())
        if name in self.given:
            name = self.free.give(name)
        self.given.add(name)
        return name

    def register(self, part: Node, item: VrmlNode) -> Node:
        self.nodes[part.name] = item
        self.parts[part.name] = part
        return part

    def shape(self, item: VrmlNode) -> Node | None:
        mesh = mesh_of(item, self.defs, self.findings)
        if mesh is None:
            geometry = child(item, "geometry", self.defs)
            kind = geometry.type if geometry is not None else "no geometry"
            self.say("info", "geometry", f"a Shape with {kind} is not a polygon mesh; it stays as it is", item)
            return None
        if not mesh.vertex_count:
            self.say("info", "geometry", "a Shape whose IndexedFaceSet has no points stays as it is", item)
            return None
        return self.register(Shape(self.name(item), mesh, materials=(material_of(item, self.defs),)), item)

    def group(self, item: VrmlNode) -> Node | None:
        where = child_field(item)
        if where is None:
            return None
        shown = item.nodes(where)
        if item.type == "LOD":
            shown = shown[:1]
        elif item.type == "Switch":
            choice = int(fixed(item, "whichChoice", (-1.0,))[0])
            shown = shown[choice : choice + 1] if choice >= 0 else ()
        children = [c for c in (self.visit(n) for n in shown) if c is not None]
        if not children and (item.def_name is None or item.def_name not in self.keep):
            return None
        part = Transform(self.name(item), tuple(children))
        if places_children(item):
            part = replace(part, **transform_fields(item))
        return self.register(part, item)


def transform_fields(item: VrmlNode) -> dict[str, Any]:
    """The fields of a Transform node that it sets, by the names that `fba.scene.Transform` has."""
    default = Transform("")
    return {
        ours: fixed(item, theirs, getattr(default, ours))
        for theirs, ours in TRANSFORM_FIELDS.items()
        if isinstance(item.get(theirs), Numbers)
    }


def set_transform_fields(item: VrmlNode, part: Transform) -> VrmlNode:
    """Put the fields of a transform into its node where they differ from what the node says."""
    said = transform_fields(item)
    default = Transform("")
    for theirs, ours in TRANSFORM_FIELDS.items():
        wanted = getattr(part, ours)
        if wanted != said.get(ours, getattr(default, ours)):
            item = item.with_field(theirs, number(*wanted))
    return item
