"""XML is read without entities, document types or network, in bounded depth and memory."""

from __future__ import annotations

import gzip
from pathlib import Path

import pytest

from fba.errors import FbaError, InputFileError, TextSyntaxError
from formats import xml_tree
from formats.xml_tree import attribute, parse_xml, read_xml

LAUGHS = b'<!DOCTYPE l [<!ENTITY a "ha">' + b"".join(
    b'<!ENTITY %c "%s">' % (98 + k, b"&%c;" % (97 + k) * 10) for k in range(9)
)


def test_elements_attributes_lines_and_text() -> None:
    root = parse_xml(b'<?xml version="1.0"?>\n<a:x xmlns:a="u" n="1 &amp;&#65;"><y/>\n one<z><y m=\'2\'/></z>two</a:x>')
    assert (root.tag, root.attributes, root.text) == ("x", {"n": "1 &A"}, "\n onetwo")
    assert [c.tag for c in root.children] == ["y", "z"]
    assert [(e.attributes, e.line) for e in root.all("y")] == [({}, 2), ({"m": "2"}, 3)]


def test_what_is_escaped_reads_back() -> None:
    value = "a \"b\" <c> & 'd'\te\nf\r\ng ü 🙂"
    assert parse_xml(f"<x{attribute('n', value)}/>".encode()).attributes["n"] == value
    assert parse_xml(f"<x{attribute('n', chr(0) + chr(0xD800))}/>".encode()).attributes["n"] == "\ufffd\ufffd"


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (LAUGHS + b"]><l>&j;</l>", "line 1, column 13: a document type with declarations"),
        (b'<!DOCTYPE l [<!ENTITY e SYSTEM "file:///etc/passwd">]><l>&e;</l>', "a document type with declarations"),
        (b'<!DOCTYPE l SYSTEM "http://127.0.0.1:9/l.dtd" [<!ENTITY % e SYSTEM "x"> %e;]><l/>', "a document type"),
        (b'<!DOCTYPE l SYSTEM "http://127.0.0.1:9/l.dtd"><l>&e;</l>', "the entity 'e'"),
        (b"<l>&e;</l>", "undefined entity"),
        (b"<l>" * 100_000, "nested deeper than 512"),
        (b"<l>", "no element found .is the file cut off"),
        (b"<l", "unclosed token .is the file cut off"),
        (b"<l><![CDATA[x", "cut off"),
        (b"<l n='1' n='2'/>", "duplicate attribute"),
        (b"<l></m>", "line 1, column 6: no XML: mismatched tag"),
        (b"", "no element found"),
        (b"\xff\xfe\x00", "file"),
        (b"<?xml version='1.0' encoding='rot13'?><l/>", "file"),
        (b"<?xml version='1.0' encoding='nothing'?><l/>", "file"),
        (b"<?xml version='1.0' encoding='big5'?><l/>", "file"),
    ],
)
def test_what_is_refused(data: bytes, said: str) -> None:
    with pytest.raises(FbaError, match=said):
        parse_xml(data, "file")


def test_an_external_document_type_is_passed_over() -> None:
    assert parse_xml(b'<!DOCTYPE l PUBLIC "-//l//" "http://127.0.0.1:9/l.dtd"><l n="1&e;"/>').attributes == {"n": "1"}


def test_numbers_of_elements_and_attributes_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(xml_tree, "MAX_ITEMS", 10)
    assert len(parse_xml(b"<l>" + b"<m/>" * 9 + b"</l>").children) == 9
    with pytest.raises(TextSyntaxError, match="more than 10 elements"):
        parse_xml(b"<l>" + b"<m n='1'/>" * 5 + b"</l>")


def test_an_attribute_of_many_megabytes_is_read_once() -> None:
    text = b"1 " * (4 << 20)
    assert len(parse_xml(b"<l n='" + text + b"'/>").attributes["n"]) == len(text)


def test_encodings_and_compression(tmp_path: Path) -> None:
    text = "<?xml version='1.0' encoding='ENC'?><l n='ü'/>"
    for name in ("utf-8", "utf-16", "iso-8859-1", "cp1252"):
        data = text.replace("ENC", name).encode(name)
        assert parse_xml(data).attributes["n"] == "ü"
    path = tmp_path / "a.xml"
    path.write_bytes(gzip.compress(text.replace("ENC", "utf-8").encode()))
    assert read_xml(path).tag == "l"
    with pytest.raises(InputFileError, match="does not exist"):
        read_xml(tmp_path / "none.xml")
