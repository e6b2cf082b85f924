"""Write BIFS scenes as XMT-A: fields of numbers, strings and Booleans as attributes, fields of nodes as elements."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Any

from formats.bifs.changes import TICKS
from formats.bifs.scene import BifsScene
from formats.vrml97.decimals import decimals
from formats.vrml97.printer import number_words
from formats.vrml97.tree import (
    Booleans,
    Empty,
    ExternProto,
    Field,
    Interface,
    Is,
    Nodes,
    Numbers,
    Proto,
    Route,
    Strings,
    Use,
    Value,
    VrmlNode,
    child_nodes,
)
from formats.xml_tree import attribute
from formats.xmta.fields import FIELDS, field_type

_HEADER = """\
<?xml version="1.0" encoding="UTF-8"?>
<XMT-A xmlns="urn:mpeg:mpeg4:xmta:schema:2002">
 <Header>
  <InitialObjectDescriptor objectDescriptorID="od1" binaryID="1">
   <Descr>
    <esDescr>
     <ES_Descriptor ES_ID="es1" binaryID="1">
      <decConfigDescr>
       <DecoderConfigDescriptor streamType="3" objectTypeIndication="MPEG4Systems1">
        <decSpecificInfo>
         <BIFSConfig>
          <commandStream pixelMetric="true"><size pixelWidth="320" pixelHeight="240"/></commandStream>
         </BIFSConfig>
        </decSpecificInfo>
       </DecoderConfigDescriptor>
      </decConfigDescr>{}
     </ES_Descriptor>
    </esDescr>
   </Descr>
  </InitialObjectDescriptor>
 </Header>
"""

_CLOCK = """
      <slConfigDescr>
       <SLConfigDescriptor>
        <custom useAccessUnitEndFlag="true" timeStampResolution="{}" timeStampLength="32"/>
       </SLConfigDescriptor>
      </slConfigDescr>"""

_XML_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.\-]*")
_MANY_NODES = frozenset({"choice", "level"})
"""Fields in which the places of nodes have a meaning, so that a NULL must keep its own."""


def print_scene(scene: BifsScene) -> str:
    """The text of an XMT-A file. What BIFS alone says in BT braces (commands inside nodes) is left out."""
    printer = _Printer(scene)
    out = [_HEADER.format("" if scene.timing.resolution == TICKS else _CLOCK.format(scene.timing.resolution))]
    out.append(" <Body>\n  <Replace>\n   <Scene>\n")
    out.extend(printer.statements(scene.statements, 4))
    out.append("   </Scene>\n  </Replace>\n")
    for frame in scene.frames:
        seconds = round(frame.number * scene.timing.step / scene.timing.resolution, 6)
        out.append(f'  <par begin="{seconds!r}">\n')
        for change in frame.changes:
            said = (("atNode", change.node), ("atField", change.field), ("value", str(change.value).lower()))
            out.append(f"   <Replace{''.join(attribute(*pair) for pair in said)}/>\n")
        out.append("  </par>\n")
    out.append(" </Body>\n</XMT-A>\n")
    return "".join(out)


class _Printer:
    def __init__(self, scene: BifsScene) -> None:
        self.types = {n.def_name: n.type for n in _every_node(scene.statements) if n.def_name is not None}

    def statements(self, items: Iterable[Any], depth: int) -> Iterator[str]:
        """PROTOs, nodes, ROUTEs; those that stand inside nodes come out here, where XMT-A has them."""
        items = tuple(items)
        inside = [
            p for n in _every_node(items, protos=False) for p in n.body if isinstance(p, (Proto, ExternProto, Route))
        ]
        for item in (*inside, *items):
            if isinstance(item, (Proto, ExternProto)):
                yield from self.declaration(item, depth)
        for item in items:
            if isinstance(item, (VrmlNode, Use)):
                yield from self.node(item, depth)
        for item in (*inside, *items):
            if isinstance(item, Route):
                names = ("fromNode", "fromField", "toNode", "toField")
                ends = (item.source, item.event_out, item.target, item.event_in)
                yield f"{' ' * depth}<ROUTE{''.join(map(attribute, names, ends))}/>\n"

    def declaration(self, item: Proto | ExternProto, depth: int) -> Iterator[str]:
        pad, tag = " " * depth, "ProtoDeclare" if isinstance(item, Proto) else "ExternProtoDeclare"
        urls = attribute("locations", _said(item.urls)) if isinstance(item, ExternProto) else ""
        yield f"{pad}<{tag}{attribute('name', item.name)}{urls}>\n"
        for part in item.interface:
            yield from self.interface(part, depth + 1)
        if isinstance(item, Proto):
            yield from self.statements(item.body, depth + 1)
        yield f"{pad}</{tag}>\n"

    def interface(self, item: Interface, depth: int) -> Iterator[str]:
        said = attribute("name", item.name) + attribute("type", item.type) + attribute("vrml97Hint", item.access)
        value = Nodes((), item.type == "MFNode") if item.type.endswith("Node") and item.value == Empty() else item.value
        yield from self.valued("field", said, value, depth)

    def valued(self, tag: str, said: str, value: Value | None, depth: int) -> Iterator[str]:
        """An element with a value as attribute or as nodes in it."""
        pad = " " * depth
        if isinstance(value, Nodes):
            inner = "nodes" if value.many else "node"
            yield f"{pad}<{tag}{said}>\n{pad} <{inner}>\n"
            yield from self.nodes(value, depth + 2)
            yield f"{pad} </{inner}>\n{pad}</{tag}>\n"
        else:
            plain = isinstance(value, (Numbers, Strings, Booleans, Empty))
            yield f"{pad}<{tag}{said}{attribute('value', _said(value)) if plain else ''}/>\n"

    def nodes(self, value: Nodes, depth: int, empty: str = "") -> Iterator[str]:
        for item in value.items:
            if item is not None:
                yield from self.node(item, depth)
            elif empty:
                yield f"{' ' * depth}{empty}\n"

    def node(self, item: VrmlNode | Use, depth: int) -> Iterator[str]:
        kind = item.type if isinstance(item, VrmlNode) else self.types.get(item.name, "Group")
        instance = kind not in FIELDS
        start = " " * depth + ("<ProtoInstance" + attribute("name", kind) if instance else f"<{kind}")
        if isinstance(item, Use):
            yield f"{start}{attribute('USE', item.name)}/>\n"
            return
        if item.def_name is not None:
            start += attribute("DEF", item.def_name)
        inside = list(self.body(item, depth + 1, instance))
        plain = {} if instance else {f.name: f.value for f in item.body if isinstance(f, Field)}
        yield start
        for name, value in plain.items():
            if isinstance(value, (Numbers, Strings, Booleans, Empty)) and _XML_NAME.fullmatch(name):
                yield attribute(name, _said(value, field_type(kind, name)))
        yield "/>\n" if not inside else ">\n"
        if inside:
            yield from inside
            yield f"{' ' * depth}</{'ProtoInstance' if instance else kind}>\n"

    def body(self, item: VrmlNode, depth: int, instance: bool) -> Iterator[str]:
        """The elements in a node."""
        pad = " " * depth
        ties = [
            (p.name, p.value.name) for p in item.body if isinstance(p, (Field, Interface)) and isinstance(p.value, Is)
        ]
        for part in item.body:
            if isinstance(part, Interface):
                yield from self.interface(part, depth)
        if ties:
            yield f"{pad}<IS>\n"
            for ours, theirs in ties:
                yield f"{pad} <connect{attribute('nodeField', ours)}{attribute('protoField', theirs)}/>\n"
            yield f"{pad}</IS>\n"
        for name, value in {p.name: p.value for p in item.body if isinstance(p, Field)}.items():
            if instance and not isinstance(value, Is):
                yield from self.valued("fieldValue", attribute("name", name), value, depth)
            elif isinstance(value, Nodes) and _XML_NAME.fullmatch(name) and (value.many or any(value.items)):
                yield f"{pad}<{name}>\n"
                yield from self.nodes(value, depth + 1, "<Group/>" if name in _MANY_NODES else "")
                yield f"{pad}</{name}>\n"


def _every_node(items: Iterable[Any], *, protos: bool = True) -> Iterator[VrmlNode]:
    """All nodes below statements, on request with those in PROTOs."""
    stack = list(items)
    while stack:
        item = stack.pop()
        if isinstance(item, VrmlNode):
            yield item
            stack.extend(child_nodes(item))
            stack.extend(p for p in item.body if protos and isinstance(p, Proto))
        elif isinstance(item, Proto) and protos:
            stack.extend(item.body)


def _said(value: Value | None, kind: str | None = None) -> str:
    """A value as the text of an attribute."""
    if isinstance(value, Numbers):
        flat = value.values
        return (decimals(flat, flat.size + 1) if flat.size else "") or " ".join(number_words(flat))
    if isinstance(value, Booleans):
        return " ".join("true" if b else "false" for b in value.values)
    if isinstance(value, Strings):
        if not value.many and kind != "MFString" and len(value.values) == 1:
            return value.values[0]
        return " ".join('"' + s.replace("\\", "\\\\").replace('"', '\\"') + '"' for s in value.values)
    return ""
