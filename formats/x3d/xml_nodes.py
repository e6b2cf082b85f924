"""The syntax tree of VRML97 as the XML of X3D (ISO/IEC 19776-1), and back.

A field with nodes is the child elements that name it as their containerField; all other fields are attributes.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np

from fba.arrays import Floats
from fba.errors import InputFileError
from formats.vrml97.decimals import decimals
from formats.vrml97.numbers import read_decimals
from formats.vrml97.parser import MAX_DEPTH
from formats.vrml97.printer import number_words
from formats.vrml97.tree import (
    Booleans,
    Field,
    Nodes,
    Numbers,
    Route,
    Statement,
    Strings,
    Use,
    Value,
    VrmlNode,
)
from formats.xml_tree import Element, attribute
from formats.xmta.fields import field_type

_PER_LINE = 12

_CONTAINERS = {
    "appearance": ("Appearance",),
    "material": ("Material",),
    "texture": ("ImageTexture", "MovieTexture", "PixelTexture"),
    "textureTransform": ("TextureTransform",),
    "coord": ("Coordinate", "CoordinateDouble"),
    "color": ("Color", "ColorRGBA"),
    "normal": ("Normal",),
    "texCoord": ("TextureCoordinate",),
    "displacers": ("HAnimDisplacer",),
    "geometry": (
        "Box", "Cone", "Cylinder", "ElevationGrid", "Extrusion", "IndexedFaceSet", "IndexedLineSet",
        "IndexedTriangleSet", "IndexedTriangleFanSet", "IndexedTriangleStripSet", "LineSet", "PointSet", "Sphere",
        "Text", "TriangleFanSet", "TriangleSet", "TriangleStripSet",
    ),
}  # fmt: skip
_CONTAINER = {node: name for name, nodes in _CONTAINERS.items() for node in nodes}
"""Where a node stands that does not say it; all others are children."""

_NO_NODES = frozenset({"ROUTE", "ProtoDeclare", "ExternProtoDeclare", "ProtoInstance", "IMPORT", "EXPORT", "field"})

_LIKE = {
    "CoordinateDouble": "Coordinate",
    "HAnimHumanoid": "Transform",
    "HAnimJoint": "Transform",
    "HAnimSite": "Transform",
    "IndexedTriangleSet": "IndexedFaceSet",
}
"""Nodes of X3D alone, whose fields are those of a VRML97 node."""

_TYPES = {
    ("HAnimDisplacer", "coordIndex"): "MFInt32",
    ("HAnimDisplacer", "displacements"): "MFVec3f",
    ("IndexedTriangleSet", "index"): "MFInt32",
}

_SPELLED = {"LOD": "level", "Switch": "choice"}
"""Nodes that call their children otherwise in VRML97."""

_STRING = re.compile(r'"([^"\\]*(?:\\.[^"\\]*)*)("|\\?\Z)', re.DOTALL)
"""One without its closing mark reaches to the end: it is left out, and not looked for again at every later mark."""


# --- writing ------------------------------------------------------------------------------------------------


def print_xml(statements: Iterable[Statement]) -> str:
    """Write nodes and ROUTEs as elements, one line each; long lists of numbers go over several lines."""
    out: list[str] = []
    for statement in statements:
        if isinstance(statement, Route):
            start = attribute("fromNode", statement.source) + attribute("fromField", statement.event_out)
            end = attribute("toNode", statement.target) + attribute("toField", statement.event_in)
            out.append(f"<ROUTE{start}{end}/>\n")
        elif isinstance(statement, (VrmlNode, Use)):
            _element(statement, "children", {}, out)
        else:
            raise TypeError(f"X3D has no {type(statement).__name__} here")
    return "".join(out)


def _element(item: VrmlNode | Use, container: str, types: dict[str, str], out: list[str]) -> None:
    where = "" if container == "children" else attribute("containerField", container)
    if isinstance(item, Use):
        out.append(f"<{types[item.name]}{attribute('USE', item.name)}{where}/>\n")
        return
    if item.def_name is not None:
        types[item.def_name] = item.type
    out.append(f"<{item.type}" + ("" if item.def_name is None else attribute("DEF", item.def_name)) + where)
    below: list[tuple[str, VrmlNode | Use]] = []
    for part in item.body:
        if not isinstance(part, Field):
            raise TypeError(f"X3D has no {type(part).__name__} in a node here")
        if isinstance(part.value, Nodes):
            below += [(part.name, found) for found in part.value.items if found is not None]
        else:
            out.append(_attribute(part.name, part.value))
    if not below:
        out.append("/>\n")
        return
    out.append(">\n")
    for name, found in below:
        _element(found, name, types, out)
    out.append(f"</{item.type}>\n")


def _attribute(name: str, value: Value) -> str:
    if isinstance(value, Numbers):
        return f' {name}="{_number_text(value.values)}"'
    if isinstance(value, Booleans):
        return attribute(name, " ".join("true" if b else "false" for b in value.values))
    if not isinstance(value, Strings):
        return f' {name}=""'
    if not value.many:
        return attribute(name, value.values[0])
    return attribute(name, " ".join('"' + s.replace("\\", "\\\\").replace('"', '\\"') + '"' for s in value.values))


def _number_text(values: Floats) -> str:
    if values.size > _PER_LINE:
        fast = decimals(values, _PER_LINE)
        if fast is not None:
            return fast
    words = number_words(values)
    return "\n".join(" ".join(words[k : k + _PER_LINE]) for k in range(0, len(words), _PER_LINE))


# --- reading ------------------------------------------------------------------------------------------------


def nodes_of(scene: Element) -> tuple[VrmlNode | Use, ...]:
    """The nodes of a Scene element; what is not in VRML97 keeps its nodes and loses the fields that nobody knows.

    Raises
    ------
    InputFileError
        If an attribute is not what its field holds, or nodes are nested too deep.
    """
    return tuple(_node(child, 1) for child in scene.children if child.tag not in _NO_NODES)


def _node(element: Element, depth: int) -> VrmlNode | Use:
    if depth > MAX_DEPTH:
        raise InputFileError(f"line {element.line}: nodes are nested deeper than {MAX_DEPTH} levels")
    if "USE" in element.attributes:
        return Use(element.attributes["USE"])
    body: list[Field] = []
    for name, text in element.attributes.items():
        kind = _TYPES.get((element.tag, name)) or field_type(_LIKE.get(element.tag, element.tag), name)
        if kind is not None and "Node" not in kind:
            body.append(Field(name, _value(kind, text, f"line {element.line}: {element.tag}.{name}")))
    fields: dict[str, list[VrmlNode | Use]] = {}
    for child in element.children:
        if child.tag not in _NO_NODES:
            name = child.attributes.get("containerField", _CONTAINER.get(child.tag, "children"))
            if name == "children":
                name = _SPELLED.get(element.tag, name)
            fields.setdefault(name, []).append(_node(child, depth + 1))
    for name, nodes in fields.items():
        single = field_type(element.tag, name) == "SFNode"
        body.append(Field(name, Nodes(tuple(nodes[:1] if single else nodes), not single)))
    return VrmlNode(element.tag, tuple(body), element.attributes.get("DEF"), element.line)


def _value(kind: str, text: str, where: str) -> Value:
    many = kind.startswith("MF")
    if kind == "SFString":
        return Strings((text,))
    if kind == "MFString":
        found = [re.sub(r"\\(.)", r"\1", s, flags=re.DOTALL) for s, end in _STRING.findall(text) if end == '"']
        return Strings(tuple(found or ([text] if text.strip() else [])), True)
    if kind.endswith("Bool"):
        words = text.split()
        if any(w.lower() not in ("true", "false") for w in words) or (not many and len(words) != 1):
            raise InputFileError(f"{where} must be true or false, not '{text[:40]}'")
        return Booleans(tuple(w.lower() == "true" for w in words), many)
    values = read_decimals(text) if text.strip() else np.zeros(0)
    if values is None:
        try:
            # Pixels may be hexadecimal.
            words = text.replace(",", " ").split()
            values = np.array([int(w, 16) if w[:2] in ("0x", "0X") else float(w) for w in words], dtype=np.float64)
        except (ValueError, OverflowError):
            raise InputFileError(f"{where} must be numbers, not '{text[:40]}'") from None
    return Numbers(values, many)
