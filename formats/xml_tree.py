"""XML read safely: no entities but the five of XML, no document type with declarations, nothing fetched.

Depth, number and size are bounded, so that hostile files end in a clear error. Names lose their namespace prefix.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from fba.errors import InputFileError, TextSyntaxError
from formats.vrml97.text import read_unpacked

MAX_DEPTH = 512
"""Elements nested deeper than this are refused. A node of a scene takes two levels: its own and that of its field."""

MAX_ITEMS = 1_000_000
"""Elements and attributes in one file: bounds the memory of the tree."""

_ENDED = frozenset(
    expat.errors.codes[e]
    for e in (
        expat.errors.XML_ERROR_NO_ELEMENTS,
        expat.errors.XML_ERROR_PARTIAL_CHAR,
        expat.errors.XML_ERROR_UNCLOSED_CDATA_SECTION,
        expat.errors.XML_ERROR_UNCLOSED_TOKEN,
    )
)
_NOT_XML = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")
_ESCAPES = {ord("&"): "&amp;", ord("<"): "&lt;", ord(">"): "&gt;", ord('"'): "&quot;"} | {
    ord(c): f"&#{ord(c)};" for c in "\t\n\r"
}


@dataclass(eq=False, slots=True)
class Element:
    """An element: its name without prefix, its attributes in the file's order, the elements in it, its own text.

    line : where it starts, counted from 1.
    """

    tag: str
    attributes: dict[str, str]
    line: int = 0
    children: list[Element] = field(default_factory=list)
    parts: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        """The characters between the elements in it, without pieces of white space."""
        return "".join(self.parts)

    def all(self, tag: str) -> Iterator[Element]:
        """All elements of a name below this one, in the file's order."""
        stack = [iter(self.children)]
        while stack:
            found = next(stack[-1], None)
            if found is None:
                stack.pop()
                continue
            if found.tag == tag:
                yield found
            stack.append(iter(found.children))


def read_xml(path: Path) -> Element:
    """Read an XML file, compressed or not; see `parse_xml`.

    Raises
    ------
    InputFileError
        If the file is missing, empty, cut off or too large.
    """
    return parse_xml(read_unpacked(path), str(path))


def parse_xml(data: bytes, source: str = "") -> Element:
    """Read the bytes of an XML file.

    Parameters
    ----------
    source : file name for messages.

    Returns
    -------
    The root. A document type that only names an external file is passed over; the file is not looked for.

    Raises
    ------
    TextSyntaxError
        With line and column, if the text is no XML, declares a document type of its own, or is too deep or large.

    >>> parse_xml(b"<a:x n='1'><y/></a:x>").children[0].tag
    'y'
    """
    return _Reader(source).read(data)


class _Reader:
    def __init__(self, source: str) -> None:
        self.source = source
        self.items = 0
        self.top = Element("", {})
        self.open = [self.top]
        self.parser = expat.ParserCreate()
        self.parser.buffer_text = True
        self.parser.StartDoctypeDeclHandler = self.doctype
        self.parser.EntityDeclHandler = self.entity
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.end
        self.parser.CharacterDataHandler = self.characters
        # An entity that only an unread document type could declare is an error here, not skipped.
        self.parser.SkippedEntityHandler = self.entity
        self.parser.SetParamEntityParsing(expat.XML_PARAM_ENTITY_PARSING_NEVER)

    def read(self, data: bytes) -> Element:
        try:
            self.parser.Parse(data, True)
        except expat.ExpatError as error:
            cut = " (is the file cut off?)" if error.code in _ENDED else ""
            what = expat.ErrorString(error.code)
            raise TextSyntaxError(f"no XML: {what}{cut}", error.lineno, error.offset + 1, self.source) from None
        except (LookupError, ValueError) as error:
            raise InputFileError(f"{self.source}: its encoding is unknown here ({error}); save it as UTF-8") from None
        return self.top.children[0]

    def fail(self, message: str) -> TextSyntaxError:
        parser = self.parser
        return TextSyntaxError(message, parser.CurrentLineNumber, parser.CurrentColumnNumber + 1, self.source)

    def doctype(self, name: str, system: str | None, public: str | None, internal: int) -> None:
        if internal:
            raise self.fail("a document type with declarations of its own is not read; take the <!DOCTYPE ...> out")

    def entity(self, name: str, *rest: object) -> None:
        raise self.fail(f"the entity '{name}' is not read; write what it stands for")

    def start(self, name: str, attributes: dict[str, str]) -> None:
        self.items += 1 + len(attributes)
        if self.items > MAX_ITEMS:
            raise self.fail(f"the file holds more than {MAX_ITEMS} elements and attributes; split it")
        if len(self.open) > MAX_DEPTH:
            raise self.fail(f"elements are nested deeper than {MAX_DEPTH} levels")
        plain = {k: v for k, v in attributes.items() if ":" not in k and k != "xmlns"}
        element = Element(name.rpartition(":")[2], plain, self.parser.CurrentLineNumber)
        self.open[-1].children.append(element)
        self.open.append(element)

    def end(self, name: str) -> None:
        self.open.pop()

    def characters(self, text: str) -> None:
        if text and not text.isspace():
            self.open[-1].parts.append(text)


def attribute(name: str, value: str) -> str:
    """`` name="value"``, escaped; characters that XML has no way to write become U+FFFD.

    >>> attribute("title", 'a "b" & c')
    ' title="a &quot;b&quot; &amp; c"'
    """
    return f' {name}="{_NOT_XML.sub(chr(0xFFFD), value).translate(_ESCAPES)}"'
