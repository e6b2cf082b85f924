"""The syntax tree of VRML97 (ISO/IEC 14772-1) and MPEG-4 BT text.

Values are typed by what the text says, not by a table of nodes, so that unknown nodes keep everything: numbers
are float64 (every SFFloat, SFInt32 and SFTime fits exactly), and `many` tells a bracketed list from a bare value.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fba.arrays import Floats, frozen


@dataclass(frozen=True, eq=False, slots=True)
class Numbers:
    """Numbers of any numeric field type; `values` is flat (n,) float64."""

    values: Floats
    many: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", frozen(self.values, np.float64, (-1,)))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Numbers) and self.many == other.many and np.array_equal(self.values, other.values)


@dataclass(frozen=True, slots=True)
class Strings:
    """SFString or MFString."""

    values: tuple[str, ...]
    many: bool = False


@dataclass(frozen=True, slots=True)
class Booleans:
    """SFBool (or a list of them, which EXTERNPROTO extensions use)."""

    values: tuple[bool, ...]
    many: bool = False


@dataclass(frozen=True, slots=True)
class Nodes:
    """SFNode or MFNode; None is NULL."""

    items: tuple[VrmlNode | Use | None, ...]
    many: bool = False


@dataclass(frozen=True, slots=True)
class Empty:
    """``[ ]``: a list whose type the text does not tell."""


@dataclass(frozen=True, slots=True)
class Is:
    """``IS name``: the field of the enclosing PROTO that this field takes its value from."""

    name: str


@dataclass(frozen=True, slots=True)
class Raw:
    """BT text in braces that is kept as it is: object descriptors and commands."""

    text: str


Value = Numbers | Strings | Booleans | Nodes | Empty | Is | Raw


@dataclass(frozen=True, slots=True)
class Use:
    """``USE name``."""

    name: str


@dataclass(frozen=True, slots=True)
class Field:
    """``name value`` in the body of a node."""

    name: str
    value: Value


@dataclass(frozen=True, slots=True)
class Interface:
    """An interface declaration of a PROTO, EXTERNPROTO or Script.

    access : "field", "exposedField", "eventIn" or "eventOut". value : the default; None where there is none.
    """

    access: str
    type: str
    name: str
    value: Value | None = None


@dataclass(frozen=True, slots=True)
class Route:
    """``ROUTE source.event_out TO target.event_in``."""

    source: str
    event_out: str
    target: str
    event_in: str


@dataclass(frozen=True, slots=True)
class Proto:
    """``PROTO name [ interface ] { body }``."""

    name: str
    interface: tuple[Interface, ...]
    body: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class ExternProto:
    """``EXTERNPROTO name [ interface ] urls``."""

    name: str
    interface: tuple[Interface, ...]
    urls: Strings


@dataclass(frozen=True, slots=True)
class VrmlNode:
    """A node: its type name, its body in file order, its DEF name, and the line it starts in (0: not from a file)."""

    type: str
    body: tuple[BodyItem, ...] = ()
    def_name: str | None = None
    line: int = field(default=0, compare=False)

    def get(self, name: str) -> Value | None:
        """The value of a field; None if the node does not set it. The last one counts if it is set twice."""
        for item in reversed(self.body):
            if isinstance(item, Field) and item.name == name:
                return item.value
        return None

    def nodes(self, name: str) -> tuple[VrmlNode | Use, ...]:
        """The nodes in a field, NULL left out; empty if the field holds no nodes."""
        value = self.get(name)
        return tuple(i for i in value.items if i is not None) if isinstance(value, Nodes) else ()

    def with_field(self, name: str, value: Value | None) -> VrmlNode:
        """Set a field where it stands, or at the end; None removes it."""
        body: list[BodyItem] = []
        done = value is None
        for item in self.body:
            if isinstance(item, Field) and item.name == name:
                if not done and value is not None:
                    body.append(Field(name, value))
                    done = True
                continue
            body.append(item)
        if not done and value is not None:
            body.append(Field(name, value))
        return replace(self, body=tuple(body))


BodyItem = Field | Interface | Route | Proto | ExternProto
Statement = VrmlNode | Use | Route | Proto | ExternProto | Raw


def node(type_name: str, def_name: str | None = None, /, **fields: Value | None) -> VrmlNode:
    """Build a node; fields that are None are left out.

    >>> node("Group", "head", children=Nodes((), True)).def_name
    'head'
    """
    return VrmlNode(type_name, tuple(Field(k, v) for k, v in fields.items() if v is not None), def_name)


def number(*values: float) -> Numbers:
    """A bare number, vector, colour or rotation."""
    return Numbers(np.asarray(values, dtype=np.float64))


def numbers(values: ArrayLike) -> Numbers:
    """A bracketed list of numbers or vectors."""
    return Numbers(np.array(values, dtype=np.float64).reshape(-1), many=True)


def child_nodes(item: Any) -> Iterator[VrmlNode | Use]:
    """Yield the nodes directly below a node, interface or value; bodies of PROTOs are another name space: left out."""
    if isinstance(item, VrmlNode):
        for part in item.body:
            yield from child_nodes(part)
    elif isinstance(item, (Field, Interface)):
        yield from child_nodes(item.value)
    elif isinstance(item, Nodes):
        for found in item.items:
            if found is not None:
                yield found


def walk(statements: Iterable[Any]) -> Iterator[VrmlNode | Use]:
    """Yield all nodes and USEs in text order, parents first, without those in bodies of PROTOs."""
    stack = [iter([s for s in statements if isinstance(s, (VrmlNode, Use))])]
    while stack:
        found = next(stack[-1], None)
        if found is None:
            stack.pop()
            continue
        yield found
        if isinstance(found, VrmlNode):
            stack.append(child_nodes(found))


def definitions(statements: Iterable[Any]) -> dict[str, VrmlNode]:
    """DEF name -> node over the whole tree; the first one counts."""
    found: dict[str, VrmlNode] = {}
    for item in walk(statements):
        if isinstance(item, VrmlNode) and item.def_name is not None:
            found.setdefault(item.def_name, item)
    return found
