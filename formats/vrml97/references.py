"""DEF and USE over a whole tree: unique names, and every DEF at its first place in the text."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from fba.errors import UnsupportedFeatureError
from formats.vrml97.names import Names
from formats.vrml97.parser import MAX_DEPTH
from formats.vrml97.tree import (
    Field,
    Interface,
    Nodes,
    Route,
    Statement,
    Use,
    VrmlNode,
    definitions,
    walk,
)


def unique_definitions(statements: tuple[Statement, ...]) -> tuple[Statement, ...]:
    """Rename the second and later DEFs of a name; USE and ROUTE follow (they mean the nearest DEF before them)."""
    names = [n.def_name for n in walk(statements) if isinstance(n, VrmlNode) and n.def_name is not None]
    if len(set(names)) == len(names):
        return statements
    free = Names(names)
    seen: set[str] = set()
    current: dict[str, str] = {}

    def visit(item: Any) -> Any:
        if isinstance(item, Use):
            return Use(current.get(item.name, item.name))
        if isinstance(item, Route):
            source, target = (current.get(n, n) for n in (item.source, item.target))
            return replace(item, source=source, target=target)
        if not isinstance(item, VrmlNode):
            return item
        name = item.def_name
        if name is not None:
            if name in seen:
                current[name] = free.give(name)
                name = current[name]
            seen.add(name)
        return replace(item, def_name=name, body=_body(item, visit))

    return tuple(visit(s) for s in statements)


def _body(item: VrmlNode, visit: Any) -> tuple[Any, ...]:
    """The body of a node with `visit` applied to the nodes and ROUTEs in it."""
    out: list[Any] = []
    for part in item.body:
        if isinstance(part, (Field, Interface)) and isinstance(part.value, Nodes):
            items = tuple(None if i is None else visit(i) for i in part.value.items)
            out.append(replace(part, value=Nodes(items, part.value.many)))
        else:
            out.append(visit(part) if isinstance(part, Route) else part)
    return tuple(out)


def definitions_first(
    statements: Iterable[Statement], more: Mapping[str, VrmlNode] | None = None
) -> tuple[Statement, ...]:
    """Move every DEF to its first use in the text; a USE that nothing in the tree answers takes its node from `more`.

    Raises
    ------
    UnsupportedFeatureError
        If nodes come to lie deeper than the parser allows.
    """
    statements = tuple(statements)
    known = {**(more or {}), **definitions(statements)}
    placed: set[str] = set()

    def visit(item: Any, depth: int) -> Any:
        if depth >= MAX_DEPTH:
            raise UnsupportedFeatureError(f"nodes used by USE are nested deeper than {MAX_DEPTH} levels")
        if isinstance(item, Use):
            if item.name in placed or item.name not in known:
                return item
            item = known[item.name]
        if not isinstance(item, VrmlNode):
            return item
        if item.def_name is not None:
            if item.def_name in placed:
                return Use(item.def_name)
            placed.add(item.def_name)
        return replace(item, body=_body(item, lambda part: visit(part, depth + 1)))

    return tuple(visit(s, 0) for s in statements)
