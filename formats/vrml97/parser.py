"""Read VRML97 text, or MPEG-4 BT text, into a syntax tree.

The grammar is that of ISO/IEC 14772-1, annex A. The parser walks over the text with compiled expressions; a run of
numbers, however long, is one match and one conversion. Depth and size are bounded, so that hostile text ends in a
clear error.
"""

from __future__ import annotations

import re

import numpy as np

from fba.arrays import Floats
from fba.errors import VrmlSyntaxError
from formats.vrml97.numbers import read_decimals
from formats.vrml97.tree import (
    BodyItem,
    Booleans,
    Empty,
    ExternProto,
    Field,
    Interface,
    Is,
    Nodes,
    Numbers,
    Proto,
    Raw,
    Route,
    Statement,
    Strings,
    Use,
    Value,
    VrmlNode,
)

MAX_DEPTH = 128
"""Nodes nested deeper than this are refused; exporters stay below 40."""

MAX_ITEMS = 1_000_000
"""Nodes, fields, strings and Booleans in one file (numbers are not counted): bounds the memory of the tree."""

# An item that can fail half-way is repeated as `(?:(?>item))+`: Python below 3.11.5 forgets to go back when the last
# round of `(?:item)++` fails.
_BLANK = r"(?:[ \t\n\r\f\v,]++|#[^\n]*+)*+"
_REAL = r"(?:[0-9]++\.?[0-9]*+|\.[0-9]++)(?:[eE][+-]?[0-9]++)?"
_END = r"(?=[ \t\n\r\f\v,#\[\]{}\"]|\Z)"
_NUMBER = rf"(?:[+-]?0[xX][0-9a-fA-F]++|[+-]?{_REAL}|[+-]I){_END}"
_space = re.compile(_BLANK)
_comment = re.compile(r"#[^\n]*+")
_plain_list = re.compile(r"[0-9eE+\-. \t\n,]*+(?=\])")
_run = re.compile(rf"(?:(?>{_NUMBER}{_BLANK}))+")
_id = re.compile(r"[^\x00-\x20\"#'+,\-.0-9\[\\\]{}\x7f][^\x00-\x20\"#',.\[\\\]{}\x7f]*+")
_name = re.compile(r"[^\x00-\x20\"#,\[\]{}\x7f]++")
_string = re.compile(r'"([^"\\]*+(?:\\.[^"\\]*+)*+)"', re.DOTALL)
_escape = re.compile(r"\\(.)", re.DOTALL)
_word = re.compile(r"[^\x00-\x20,#\"{}\[\]]++")
_between_braces = re.compile(r'(?:(?>[^{}\[\]"#]++|"[^"\\]*+(?:\\.[^"\\]*+)*+"|#[^\n]*+))+', re.DOTALL)
_CHUNK = 1 << 21
_BULK = 1 << 12
"""Characters of numbers from which on reading them in bulk is faster than one by one."""

_ACCESS = frozenset({"field", "exposedField", "eventIn", "eventOut"})
_KEYWORDS = _ACCESS | {"DEF", "USE", "PROTO", "EXTERNPROTO", "ROUTE", "TO", "IS", "TRUE", "FALSE", "NULL"}
_TYPES = frozenset(
    f"{a}F{b}"
    for a in "SM"
    for b in ("Bool", "Color", "Float", "Image", "Int32", "Node", "Rotation", "String", "Time", "Vec2f", "Vec3f")
)
_WIDTH = {"SFColor": 3, "SFFloat": 1, "SFInt32": 1, "SFRotation": 4, "SFTime": 1, "SFVec2f": 2, "SFVec3f": 3}
_BT_RAW = frozenset({"InitialObjectDescriptor", "ObjectDescriptor", "AT", "RAP", "UPDATE"})


def parse(text: str, source: str = "", *, bt: bool = False) -> tuple[Statement, ...]:
    """Parse the text of a whole file (the header is a comment).

    Parameters
    ----------
    text : line ends are LF.
    source : file name for messages.
    bt : accept the additions of MPEG-4 BT: object descriptors and timed commands, kept as raw text.

    Raises
    ------
    VrmlSyntaxError
        With line and column, what was found and what was expected; also for text that is too deep or too large.

    >>> parse("Group { children [ ] }")[0].type
    'Group'
    """
    return _Parser(text, source, bt).file()


class _Parser:
    def __init__(self, text: str, source: str, bt: bool) -> None:
        self.text = text
        self.source = source
        self.bt = bt
        self.pos = 0
        self.depth = 0
        self.items = 0
        self.line = 1
        self.line_pos = 0

    # --- positions and errors -------------------------------------------------------------------------------

    def fail(self, message: str, pos: int | None = None) -> VrmlSyntaxError:
        at = self.pos if pos is None else pos
        line = self.text.count("\n", 0, at) + 1
        column = at - (self.text.rfind("\n", 0, at) + 1) + 1
        return VrmlSyntaxError(message, line, column, self.source)

    def expected(self, what: str, pos: int | None = None) -> VrmlSyntaxError:
        at = self.pos if pos is None else pos
        if at >= len(self.text):
            found = "the end of the file (is the file cut off?)"
        else:
            match = _word.match(self.text, at)
            found = repr((match.group() if match else self.text[at])[:40])
        return self.fail(f"expected {what}, found {found}", at)

    def current_line(self) -> int:
        self.line += self.text.count("\n", self.line_pos, self.pos)
        self.line_pos = self.pos
        return self.line

    def spend(self) -> None:
        self.items += 1
        if self.items > MAX_ITEMS:
            raise self.fail(f"the file holds more than {MAX_ITEMS} nodes, fields and strings; split it")

    # --- tokens ---------------------------------------------------------------------------------------------

    def skip(self) -> str:
        """Move behind white space and comments; return the next character, "" at the end."""
        match = _space.match(self.text, self.pos)
        if match:
            self.pos = match.end()
        return self.text[self.pos : self.pos + 1]

    def take(self, character: str, where: str) -> None:
        if self.skip() != character:
            raise self.expected(f"'{character}' {where}")
        self.pos += 1

    def peek_id(self) -> str | None:
        self.skip()
        match = _id.match(self.text, self.pos)
        return match.group() if match else None

    def identifier(self, what: str) -> str:
        found = self.peek_id()
        if found is None or found in _KEYWORDS:
            raise self.expected(what)
        self.pos += len(found)
        return found

    def def_name(self, what: str) -> str:
        """A DEF name; digits and dots that old exporters put there are accepted."""
        self.skip()
        match = _name.match(self.text, self.pos)
        if match is None:
            raise self.expected(what)
        self.pos = match.end()
        return match.group()

    def string(self) -> str:
        match = _string.match(self.text, self.pos)
        if match is None:
            raise self.fail("this string has no closing quotation mark")
        self.spend()
        self.pos = match.end()
        body = match.group(1)
        return _escape.sub(r"\1", body) if "\\" in body else body

    # --- statements -----------------------------------------------------------------------------------------

    def file(self) -> tuple[Statement, ...]:
        found: list[Statement] = []
        while self.skip():
            found.append(self.statement())
        return tuple(found)

    def statement(self) -> Statement:
        word = self.peek_id()
        self.spend()
        if word == "PROTO":
            return self.proto()
        if word == "EXTERNPROTO":
            return self.extern_proto()
        if word == "ROUTE":
            return self.route()
        if self.bt and word in _BT_RAW:
            return self.raw()
        if self.bt and word == "REPLACE":
            self.pos += len(word)
            for wanted in ("SCENE", "BY"):
                if self.peek_id() != wanted:
                    raise self.expected(f"'{wanted}'")
                self.pos += len(wanted)
        if word is None:
            raise self.expected("a node, DEF, USE, PROTO, EXTERNPROTO or ROUTE")
        return self.node()

    def raw(self) -> Raw:
        """BT: everything up to the brace or bracket that closes the next one that opens."""
        start = self.pos
        depth = 0
        while self.pos < len(self.text):
            if part := _between_braces.match(self.text, self.pos):
                self.pos = part.end()
                continue
            depth += 1 if self.text[self.pos] in "{[" else -1
            self.pos += 1
            if depth <= 0:
                return Raw(self.text[start : self.pos])
        raise self.fail("this block is not closed", start)

    def route(self) -> Route:
        self.pos += len("ROUTE")
        ends = []
        for last in (False, True):
            self.skip()
            start = self.pos
            name = self.def_name("NODE.event")
            owner, dot, event = name.rpartition(".")
            if not dot or not owner or not event:
                raise self.fail(f"expected NODE.event in a ROUTE, found {name[:40]!r}", start)
            ends.append((owner, event))
            if not last:
                if self.peek_id() != "TO":
                    raise self.expected("'TO'")
                self.pos += len("TO")
        return Route(*ends[0], *ends[1])

    def proto(self) -> Proto:
        self.pos += len("PROTO")
        self.enter()
        name = self.identifier("the name of the PROTO")
        interface = self.interface(f"PROTO {name}", defaults=True)
        self.take("{", f"before the body of PROTO {name}")
        body: list[Statement] = []
        while self.skip() != "}":
            if self.pos >= len(self.text):
                raise self.expected(f"'}}' after the body of PROTO {name}")
            body.append(self.statement())
        self.pos += 1
        self.depth -= 1
        return Proto(name, interface, tuple(body))

    def extern_proto(self) -> ExternProto:
        self.pos += len("EXTERNPROTO")
        name = self.identifier("the name of the EXTERNPROTO")
        interface = self.interface(f"EXTERNPROTO {name}", defaults=False)
        self.skip()
        urls = self.value(name)
        if isinstance(urls, Empty):
            urls = Strings((), True)
        if not isinstance(urls, Strings):
            raise self.fail(f"EXTERNPROTO {name} needs one or several strings as its address")
        return ExternProto(name, interface, urls)

    def interface(self, what: str, *, defaults: bool) -> tuple[Interface, ...]:
        self.take("[", f"before the interface of {what}")
        found: list[Interface] = []
        while self.skip() != "]":
            word = self.peek_id()
            if word not in _ACCESS:
                raise self.expected(f"field, exposedField, eventIn, eventOut or ']' in the interface of {what}")
            found.append(self.declaration(word, defaults=defaults))
        self.pos += 1
        return tuple(found)

    def declaration(self, access: str, *, defaults: bool) -> Interface:
        self.spend()
        self.pos += len(access)
        kind = self.peek_id()
        if kind is None or kind not in _TYPES:
            raise self.expected("a field type such as SFFloat or MFNode")
        self.pos += len(kind)
        name = self.identifier("a field name")
        value: Value | None = None
        if access in ("field", "exposedField"):
            if defaults:
                self.skip()
                start = self.pos
                value = self.value(name)
                self.check(kind, name, value, start)
        elif self.peek_id() == "IS":
            value = self.value(name)
        return Interface(access, kind, name, value)

    def check(self, kind: str, name: str, value: Value, start: int) -> None:
        """A declared type must match what stands there."""
        if isinstance(value, (Is, Raw)) or (isinstance(value, Empty) and kind.startswith("M")):
            return
        base = kind[2:]
        wanted = {"Bool": Booleans, "Node": Nodes, "String": Strings}.get(base, Numbers)
        width = _WIDTH.get(kind)
        fits = isinstance(value, wanted)
        if fits and width is not None and isinstance(value, Numbers):
            fits = value.values.size == width
        if not fits:
            raise self.expected(f"a value of type {kind} for '{name}'", start)

    # --- nodes ----------------------------------------------------------------------------------------------

    def enter(self) -> None:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise self.fail(f"nodes are nested deeper than {MAX_DEPTH} levels")

    def node(self) -> VrmlNode | Use:
        word = self.peek_id()
        self.spend()
        if word == "USE":
            self.pos += len("USE")
            return Use(self.def_name("a name after USE"))
        name = None
        line = self.current_line()
        if word == "DEF":
            self.pos += len("DEF")
            name = self.def_name("a name after DEF")
        kind = self.identifier("the type of a node")
        self.take("{", f"after {kind}")
        self.enter()
        body: list[BodyItem] = []
        while self.skip() != "}":
            body.append(self.body_item(kind))
        self.pos += 1
        self.depth -= 1
        return VrmlNode(kind, tuple(body), name, line)

    def body_item(self, kind: str) -> BodyItem:
        word = self.peek_id()
        self.spend()
        if word in _ACCESS:
            return self.declaration(word, defaults=True)
        if word == "ROUTE":
            return self.route()
        if word == "PROTO":
            return self.proto()
        if word == "EXTERNPROTO":
            return self.extern_proto()
        name = self.identifier(f"a field name or '}}' in {kind}")
        self.skip()
        return Field(name, self.value(name))

    # --- values ---------------------------------------------------------------------------------------------

    def value(self, name: str) -> Value:
        character = self.text[self.pos : self.pos + 1]
        if character == "[":
            return self.bracketed(name)
        if character == '"':
            return Strings((self.string(),))
        if self.bt and character == "{":
            return self.raw()
        if run := _run.match(self.text, self.pos):
            return Numbers(self.convert(run.start(), run.end()))
        word = self.peek_id()
        if word in ("TRUE", "FALSE") or (self.bt and word in ("true", "false")):
            self.pos += len(word)
            return Booleans((word.upper() == "TRUE",))
        if word == "NULL":
            self.pos += len(word)
            return Nodes((None,))
        if word == "IS":
            self.pos += len(word)
            return Is(self.identifier("the name of a PROTO field after IS"))
        if word is None:
            raise self.expected(f"a value for '{name}'")
        return Nodes((self.node(),))

    def bracketed(self, name: str) -> Value:
        self.pos += 1
        if (plain := _plain_list.match(self.text, self.pos)) and not plain.group().isspace() and plain.group():
            values = self.convert(plain.start(), plain.end())
            self.pos += 1
            return Numbers(values, True)
        character = self.skip()
        if character == "]":
            self.pos += 1
            return Empty()
        if run := _run.match(self.text, self.pos):
            values = self.convert(run.start(), run.end())
            self.take("]", f"or a number in '{name}'")
            return Numbers(values, True)
        if character == '"':
            strings = [self.string()]
            while self.skip() == '"':
                strings.append(self.string())
            self.take("]", f"or a string in '{name}'")
            return Strings(tuple(strings), True)
        if self.peek_id() in ("TRUE", "FALSE"):
            return self.booleans(name)
        return self.node_list(name)

    def booleans(self, name: str) -> Booleans:
        found: list[bool] = []
        while (word := self.peek_id()) in ("TRUE", "FALSE"):
            self.spend()
            self.pos += len(word)
            found.append(word == "TRUE")
        self.take("]", f"or TRUE or FALSE in '{name}'")
        return Booleans(tuple(found), True)

    def node_list(self, name: str) -> Nodes:
        items: list[VrmlNode | Use | None] = []
        while self.skip() != "]":
            word = self.peek_id()
            if word is None:
                raise self.expected(f"a node or ']' in '{name}'")
            if word == "NULL":
                self.spend()
                self.pos += len(word)
                items.append(None)
                continue
            items.append(self.node())
        self.pos += 1
        return Nodes(tuple(items), True)

    def convert(self, start: int, end: int) -> Floats:
        """Numbers of a stretch of text that holds nothing else; moves behind it."""
        parts: list[Floats] = []
        at = start
        while at < end:
            stop = min(at + _CHUNK, end)
            if stop < end:
                cut = max(self.text.rfind(c, at, stop) for c in " \n\t,")
                newline = self.text.rfind("\n", at, stop)
                if "#" in self.text[at:stop]:
                    cut = newline
                if cut <= at:
                    raise self.fail("expected a number, found a very long word or comment", at)
                stop = cut + 1
            parts.append(self.convert_part(at, stop))
            at = stop
        self.pos = end
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def convert_part(self, start: int, end: int) -> Floats:
        piece = self.text[start:end]
        if "#" in piece:
            piece = _comment.sub(" ", piece)
        if len(piece) >= _BULK and (values := read_decimals(piece)) is not None:
            return values
        words = piece.replace(",", " ").split()
        try:
            return np.array(list(map(float, words)))
        except ValueError:
            return np.array([self.slow_number(word, start) for word in words])

    def slow_number(self, word: str, start: int) -> float:
        unsigned = word.lstrip("+-")
        if unsigned == "I":
            return float("-inf") if word[0] == "-" else float("inf")
        try:
            return float(int(word, 16)) if unsigned[:2] in ("0x", "0X") else float(word)
        except (ValueError, OverflowError):
            place = re.search(rf"(?<![^\s,\[]){re.escape(word)}{_END}", self.text[start:])
            raise self.expected("a number", start + (place.start() if place else 0)) from None
