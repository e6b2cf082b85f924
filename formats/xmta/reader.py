"""From the elements of XMT-A to a scene's syntax tree and the updates that follow."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from fba.errors import InputFileError
from formats.bifs.playing import Update, plain_value
from formats.vrml97.parser import MAX_DEPTH
from formats.vrml97.tree import (
    BodyItem,
    ExternProto,
    Field,
    Interface,
    Is,
    Nodes,
    Proto,
    Route,
    Statement,
    Strings,
    Use,
    Value,
    VrmlNode,
)
from formats.xml_tree import Element
from formats.xmta.fields import field_type
from formats.xmta.values import ValueReader

_TYPES = {
    **{name: f"SF{name}" for name in ("Color", "Float", "Image", "Node", "Rotation", "String", "Time")},
    **{f"{name}s": f"MF{name}" for name in ("Color", "Float", "Image", "Node", "Rotation", "String", "Time")},
    "Boolean": "SFBool",
    "Integer": "SFInt32",
    "Vector2": "SFVec2f",
    "Vector3": "SFVec3f",
    "Booleans": "MFBool",
    "Integers": "MFInt32",
    "Vector2Array": "MFVec2f",
    "Vector3Array": "MFVec3f",
    "Vector2s": "MFVec2f",
    "Vector3s": "MFVec3f",
}
"""Names of types in XMT-A that are not those of VRML97."""

_OWN = frozenset({"DEF", "USE", "binaryID"})
"""Attributes of nodes that are no fields."""


@dataclass(frozen=True, eq=False)
class Document:
    """What an XMT-A file says: the scene's statements, and the updates of fields in the file's order."""

    statements: tuple[Statement, ...] = ()
    updates: list[Update] = field(default_factory=list)


def read_document(root: Element, source: str) -> Document:
    """Read the scene and its updates; commands that insert or delete are passed over.

    Raises
    ------
    InputFileError
        With the line, if the file is no XMT-A, or a value is not what its field takes.
    """
    if root.tag != "XMT-A":
        raise InputFileError(f"{source}: the root is <{root.tag[:40]}>, not <XMT-A>; this is no XMT-A file")
    return _Reader(source).document(root)


class _Reader(ValueReader):
    def __init__(self, source: str) -> None:
        super().__init__(source)
        self.protos: dict[str, Mapping[str, str]] = {}

    # --- commands -------------------------------------------------------------------------------------------

    def document(self, root: Element) -> Document:
        statements: list[Statement] = []
        updates: list[Update] = []
        for body in (b for b in root.children if b.tag == "Body"):
            for seconds, command in self.commands(body, 0.0, 0):
                scene = next((c for c in command.children if c.tag == "Scene"), None)
                if "atNode" in command.attributes:
                    updates.extend(self.updates(command, seconds))
                elif scene is not None and not statements:
                    statements.extend(self.statements(scene, 0))
        return Document(tuple(statements), updates)

    def commands(self, owner: Element, start: float, depth: int) -> Iterator[tuple[float, Element]]:
        """Replace elements with their times."""
        if depth > MAX_DEPTH:
            raise self.fail(owner, f"<par> is nested deeper than {MAX_DEPTH} levels")
        for element in owner.children:
            if element.tag in ("par", "Replace"):
                begin = element.attributes.get("begin", "")
                seconds = start + float(self.numbers(begin, element, 1)[0]) if begin.strip() else start
                if element.tag == "Replace":
                    yield seconds, element
                else:
                    yield from self.commands(element, seconds, depth + 1)

    def updates(self, command: Element, seconds: float) -> Iterator[Update]:
        parts = [c for c in command.children if c.tag == "repField"] or [command]
        for part in parts:
            name, said = part.attributes.get("atField"), part.attributes.get("value")
            inside = [self.node(c, 0) for c in part.children if c.tag[:1].isupper() and c.tag != "NULL"]
            if name is None or len(inside) > 1:
                continue
            value: float | VrmlNode | None = None
            if inside:
                value = plain_value(Nodes(tuple(inside)))
            elif said is not None and said.strip() != "NULL":
                guessed = self.value(said, None, part)
                value = plain_value(guessed)
                if value is None:
                    continue
            yield Update(seconds, command.attributes["atNode"], name, value)

    # --- statements -----------------------------------------------------------------------------------------

    def statements(self, owner: Element, depth: int) -> Iterator[Statement]:
        for element in owner.children:
            if element.tag in ("ProtoDeclare", "ExternProtoDeclare"):
                yield self.proto(element, depth)
            elif element.tag == "ROUTE":
                yield self.route(element)
            elif element.tag[:1].isupper() and element.tag != "IS":
                yield self.node(element, depth)

    def route(self, element: Element) -> Route:
        ends = [element.attributes.get(n, "") for n in ("fromNode", "fromField", "toNode", "toField")]
        if not all(ends):
            raise self.fail(element, "a ROUTE needs fromNode, fromField, toNode and toField")
        return Route(ends[0], ends[1], ends[2], ends[3])

    def proto(self, element: Element, depth: int) -> Proto | ExternProto:
        name = element.attributes.get("name", "")
        if not name or depth >= MAX_DEPTH:
            what = f"is nested deeper than {MAX_DEPTH} levels" if name else "has no name"
            raise self.fail(element, f"<{element.tag}> {what}")
        interface = tuple(self.interface(c, depth) for c in element.children if c.tag == "field")
        self.protos[name] = {i.name: i.type for i in interface}
        if element.tag == "ExternProtoDeclare":
            urls = self.value(element.attributes.get("locations", ""), "MFString", element)
            return ExternProto(name, interface, urls if isinstance(urls, Strings) else Strings((), True))
        inside = Element("", {}, element.line, [c for c in element.children if c.tag != "field"])
        return Proto(name, interface, tuple(self.statements(inside, depth + 1)))

    def interface(self, element: Element, depth: int) -> Interface:
        said = element.attributes
        name, kind, access = (said.get(k, "") for k in ("name", "type", "vrml97Hint"))
        kind = _TYPES.get(kind, kind)
        if not (name and kind and access):
            raise self.fail(element, "a <field> needs name, type and vrml97Hint")
        value: Value | None = None
        if access in ("field", "exposedField"):
            value = self.declared(element, kind, depth)
        return Interface(access, kind, name, value)

    def declared(self, element: Element, kind: str | None, depth: int) -> Value | None:
        """The value of a <field> or <fieldValue>: an attribute, or nodes."""
        for child in element.children:
            if child.tag in ("node", "nodes"):
                return self.nodes(child, child.tag == "nodes", depth)
        if any(c.tag[:1].isupper() for c in element.children) or (kind or "").endswith("Node"):
            return self.nodes(element, kind == "MFNode" or len(element.children) > 1, depth)
        text = next((v for k, v in element.attributes.items() if k.lower().endswith("value")), None)
        return None if text is None else self.value(text, kind, element)

    # --- nodes ----------------------------------------------------------------------------------------------

    def node(self, element: Element, depth: int) -> VrmlNode | Use:
        if depth >= MAX_DEPTH:
            raise self.fail(element, f"nodes are nested deeper than {MAX_DEPTH} levels")
        said = element.attributes
        if "USE" in said:
            return Use(said["USE"])
        instance = element.tag == "ProtoInstance"
        kind = said.get("name", "") if instance else element.tag
        if not kind:
            raise self.fail(element, "a <ProtoInstance> has no name")
        body: list[BodyItem] = []
        for name, text in said.items():
            if name not in _OWN and not (instance and name in ("name", "protoName")):
                value = self.value(text, self.type_of(kind, name), element)
                body.append(Field(name, value))
        for child in element.children:
            body.extend(self.part(kind, child, depth))
        ties = {t.name: t.value for t in body if isinstance(t, Field) and isinstance(t.value, Is)}
        body = [
            _tied(p, ties) for p in body if not (isinstance(p, Field) and p.name in ties and _declares(body, p.name))
        ]
        return VrmlNode(kind, tuple(body), said.get("DEF"), element.line)

    def type_of(self, kind: str, name: str) -> str | None:
        return self.protos.get(kind, {}).get(name) or field_type(kind, name)

    def part(self, kind: str, element: Element, depth: int) -> Iterator[BodyItem]:
        """What an element in a node says: a field of nodes, and the special ones of Scripts and PROTOs."""
        if element.tag == "IS":
            for tie in (c.attributes for c in element.children if c.tag == "connect"):
                if tie.get("nodeField") and tie.get("protoField"):
                    yield Field(tie["nodeField"], Is(tie["protoField"]))
        elif element.tag == "field":
            yield self.interface(element, depth)
        elif element.tag == "fieldValue":
            name = element.attributes.get("name", "")
            value = self.declared(element, self.type_of(kind, name), depth)
            if name and value is not None:
                yield Field(name, value)
        elif element.tag == "ROUTE":
            yield self.route(element)
        elif element.tag in ("ProtoDeclare", "ExternProtoDeclare"):
            yield self.proto(element, depth)
        elif element.tag[:1].isupper():
            raise self.fail(element, f"<{element.tag[:40]}> stands in <{kind[:40]}> without the element of a field")
        else:
            known = self.type_of(kind, element.tag)
            many = known == "MFNode" if known else len(element.children) != 1
            yield Field(element.tag, self.nodes(element, many, depth))

    def nodes(self, owner: Element, many: bool, depth: int) -> Nodes:
        items: list[VrmlNode | Use | None] = []
        for element in owner.children:
            if not element.tag[:1].isupper():
                raise self.fail(element, f"<{element.tag[:40]}> is no node")
            items.append(None if element.tag == "NULL" else self.node(element, depth + 1))
        return Nodes(tuple(items) if items or many else (None,), many)


def _declares(body: list[BodyItem], name: str) -> bool:
    return any(isinstance(p, Interface) and p.name == name for p in body)


def _tied(part: BodyItem, ties: Mapping[str, Value]) -> BodyItem:
    """A Script's declaration with the PROTO field that it takes its value from."""
    if isinstance(part, Interface) and part.name in ties:
        return Interface(part.access, part.type, part.name, ties[part.name])
    return part
