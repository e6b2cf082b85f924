"""The VRML97 grammar: trees, exact round trips, errors with their place, hostile text."""

from __future__ import annotations

import contextlib
import gzip
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fba.errors import FbaError, InputFileError, VrmlSyntaxError
from formats.bt import read as read_bt
from formats.vrml97 import parse, print_tree, read
from formats.vrml97 import text as vrml_text
from formats.vrml97.names import escape, unescape
from formats.vrml97.numbers import read_decimals
from formats.vrml97.printer import number_words, shortest_float32
from formats.vrml97.references import definitions_first, unique_definitions
from formats.vrml97.tree import (
    Booleans,
    Empty,
    ExternProto,
    Interface,
    Is,
    Nodes,
    Numbers,
    Proto,
    Route,
    Strings,
    Use,
    VrmlNode,
)

EVERYTHING = """#VRML V2.0 utf8
# a comment with { [ " in it
EXTERNPROTO Far [ eventIn SFTime go field SFVec3f at exposedField MFString words eventOut SFBool done ]
  [ "far.wrl#Far", "urn:x" ]
PROTO Lamp [
  field SFColor tint 1 0.5 .25
  exposedField MFNode children [ ]
  field SFNode extra NULL
  field MFInt32 numbers [1,2,,3 -4]
  field SFImage picture 2 2 1 0xFF 0x10 0 255
  eventIn SFBool set_on
  eventOut SFTime since
] {
  PROTO Inner [ field SFString name "in \\"quotes\\" and \\\\ back" ] { Group { } }
  DEF L PointLight { color IS tint on TRUE attenuation 1. 0 1e-3 }
  Group { children IS children }
  Script { eventIn SFBool set_on IS set_on directOutput TRUE mustEvaluate FALSE
    field SFNode light USE L field MFRotation turns [0 1 0 3.14, 1 0 0 -1.5E+2] field SFTime now 12345678901.25
    url [ "javascript: function set_on(v) { print('#'); }" "b.class" ] }
  ROUTE L.on TO L.set_on
}
DEF Top-1 Transform {
  translation 1 -2 +3 rotation 0 0 1 .5
  children [ DEF Clock TimeSensor { cycleInterval 2 loop TRUE }, USE Top-2
    Shape { geometry IndexedFaceSet { coord DEF C Coordinate { point [ 0 0 0, 1 0 0, 1 1 0 ] } coordIndex [0,1,2,-1] } }
    DEF P PositionInterpolator { key [0 .5 1] keyValue [ 0 0 0 1 1 1 0 0 0 ] }
    Unknown_1 { a 1 2 3 b [ ] c "x" d [ "x" "y" ] e TRUE f [ TRUE FALSE ] g Node { } h [ Node { } NULL ] i NULL }
    ROUTE Clock.fraction_changed TO P.set_fraction ]
}
Lamp { tint 0 0 1 children Lamp { } }
ROUTE P.value_changed TO Top-1.set_translation
"""
EVERYTHING = EVERYTHING.replace(
    "    ROUTE Clock.fraction_changed TO P.set_fraction ]\n", "  ]\n  ROUTE Clock.fraction_changed TO P.set_fraction\n"
)


def test_everything_of_the_grammar_is_in_the_tree() -> None:
    tree = parse(EVERYTHING)
    far, lamp, top, _, route = tree
    assert isinstance(far, ExternProto)
    assert far.urls == Strings(("far.wrl#Far", "urn:x"), True)
    assert [i.access for i in far.interface] == ["eventIn", "field", "exposedField", "eventOut"]
    assert isinstance(lamp, Proto)
    assert lamp.interface[0] == Interface("field", "SFColor", "tint", Numbers(np.array([1, 0.5, 0.25])))
    assert lamp.interface[1].value == Empty()
    assert lamp.interface[2].value == Nodes((None,))
    assert lamp.interface[3].value == Numbers(np.array([1, 2, 3, -4]), True)
    assert lamp.interface[4].value == Numbers(np.array([2, 2, 1, 255, 16, 0, 255]))
    inner, light, group, script, inside = lamp.body
    assert isinstance(inner, Proto)
    assert inner.interface[0].value == Strings(('in "quotes" and \\ back',))
    assert isinstance(light, VrmlNode)
    assert light.get("color") == Is("tint")
    assert light.get("attenuation") == Numbers(np.array([1, 0, 1e-3]))
    assert isinstance(group, VrmlNode)
    assert group.get("children") == Is("children")
    assert isinstance(script, VrmlNode)
    assert script.body[0] == Interface("eventIn", "SFBool", "set_on", Is("set_on"))
    assert script.body[3] == Interface("field", "SFNode", "light", Nodes((Use("L"),)))
    assert inside == Route("L", "on", "L", "set_on")
    assert isinstance(top, VrmlNode)
    assert top.def_name == "Top-1"
    assert len(top.nodes("children")) == 5
    unknown = top.nodes("children")[4]
    assert isinstance(unknown, VrmlNode)
    assert unknown.get("a") == Numbers(np.array([1.0, 2, 3]))
    assert unknown.get("f") == Booleans((True, False), True)
    assert unknown.get("h") == Nodes((VrmlNode("Node"), None), True)
    assert top.body[-1] == Route("Clock", "fraction_changed", "P", "set_fraction")
    assert route == Route("P", "value_changed", "Top-1", "set_translation")


def test_written_tree_reads_back_equal() -> None:
    tree = parse(EVERYTHING)
    text = print_tree(tree)
    assert parse(text) == tree
    assert print_tree(parse(text)) == text


@pytest.mark.parametrize("newline", ["\r\n", "\r"])
def test_line_ends_do_not_matter(newline: str, tmp_path: Path) -> None:
    path = tmp_path / "a.wrl"
    path.write_bytes(b"\xef\xbb\xbf" + EVERYTHING.replace("\n", newline).encode())
    text, findings = vrml_text.read_text(path)
    assert text == EVERYTHING
    assert not findings


def test_latin_1_is_read_and_said(tmp_path: Path) -> None:
    path = tmp_path / "a.wrl"
    path.write_bytes('#VRML V2.0 utf8\nWorldInfo { title "Jörg" }'.encode("latin-1"))
    text, findings = vrml_text.read_text(path)
    assert "Jörg" in text
    assert [(f.code, f.where) for f in findings] == [("encoding", "line 2")]


@pytest.mark.parametrize(
    ("text", "line", "column", "said"),
    [
        ("Group {\n  children [ Shape { ]\n}", 2, 22, "expected a field name or '}' in Shape, found ']'"),
        ("Group {\n", 2, 1, "the end of the file"),
        ("Group { children [", 1, 19, "expected a node or ']' in 'children', found the end of the file"),
        ("Transform { translation 1 2x 3 }", 1, 27, "expected a field name or '}' in Transform, found '2x'"),
        ("Shape { p [ 1 2 1.2.3 ] }", 1, 17, "expected a number, found '1.2.3'"),
        ('WorldInfo { title "abc }', 1, 19, "no closing quotation mark"),
        ("ROUTE a.b c.d", 1, 11, "expected 'TO'"),
        ("ROUTE ab TO c.d", 1, 7, "expected NODE.event"),
        ("DEF x y z", 1, 9, "expected '{' after y"),
        ("}", 1, 1, "expected a node, DEF, USE"),
        ("PROTO A [ field SFVec3f p 1 2 ] { }", 1, 27, "a value of type SFVec3f for 'p'"),
        ("PROTO A [ field SFFoo p 1 ] { }", 1, 17, "a field type"),
        ("PROTO A [ slot SFBool p ] { }", 1, 11, "expected field, exposedField"),
        ("A { b 1 \n c }", 2, 4, "expected a value for 'c', found '}'"),
        ('A { b [ 1 2\n "x" ] }', 2, 2, "expected ']' or a number"),
        ("A { b 0x }", 1, 7, "a value for 'b', found '0x'"),
        ("A { DEF 1 }", 1, 5, "expected a field name"),
        ("Group \x00 { }", 1, 7, "expected '{' after Group"),
        ("A { x [ 1e5 # 1e\n, 1e ] }", 2, 3, "expected ']' or a number in 'x', found '1e'"),
        ("A { x [ 1e5 1e ] }", 1, 13, "expected a number, found '1e'"),
        ("A { x 0x" + "f" * 500 + " }", 1, 7, "expected a number"),
    ],
)
def test_errors_say_where_and_what(text: str, line: int, column: int, said: str) -> None:
    with pytest.raises(VrmlSyntaxError) as caught:
        parse(text, "face.wrl")
    assert said in str(caught.value)
    assert str(caught.value).startswith("face.wrl:line ")
    assert (caught.value.line, caught.value.column) == (line, column)


def test_numbers_keep_every_bit() -> None:
    random = np.random.default_rng(3)
    values = np.concatenate(
        [random.normal(size=2000) * 10.0 ** random.integers(-300, 300, 2000), [0.0, -0.0, 5e-324, 1.7e308, 2**53, 0.1]]
    )
    tree = (VrmlNode("A", ()).with_field("x", Numbers(values, True)),)
    back = parse(print_tree(tree))[0]
    assert isinstance(back, VrmlNode)
    found = back.get("x")
    assert isinstance(found, Numbers)
    assert np.array_equal(found.values.view(np.int64), values.view(np.int64))


def test_float32_are_written_as_short_as_possible_and_exact() -> None:
    random = np.random.default_rng(4)
    bits = random.integers(0, 2**32, 20000, dtype=np.uint32)
    values = bits.view(np.float32)
    values = np.concatenate([values[np.isfinite(values)], np.float32([0, -0.0, 0.1, 1e-45, 3.4028235e38, 16777216])])
    short = shortest_float32(values)
    words = number_words(short)
    assert np.array_equal(np.array(words, dtype=np.float64).astype(np.float32), values)
    reference = [np.format_float_scientific(v, unique=True) for v in values]

    def digits(word: str) -> int:
        return len(word.lower().split("e")[0].replace("-", "").replace(".", "").strip("0"))

    assert all(digits(w) <= digits(r) for w, r in zip(words, reference, strict=True))


_words = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False, width=32).map(lambda v: repr(float(np.float32(v)))),
    st.floats(allow_nan=False, allow_infinity=False).map(repr),
    st.integers(-(10**20), 10**20).map(str),
    st.from_regex(r"[+-]?([0-9]{1,12}\.?[0-9]{0,18}|\.[0-9]{1,17})([eE][+-]?[0-9]{1,3})?", fullmatch=True),
)


@settings(max_examples=200, deadline=None)
@given(st.lists(_words, min_size=1, max_size=60), st.sampled_from([" ", "\n", ", ", ",,\t", " \n  "]))
def test_bulk_numbers_are_those_of_float(words: list[str], between: str) -> None:
    found = read_decimals(between.join(words))
    if found is not None:
        wanted = np.array([float(w) for w in words])
        np.testing.assert_array_equal(found.view(np.int64), wanted.view(np.int64))


@settings(max_examples=300, deadline=None)
@given(st.lists(st.text("0123456789.eE+-", min_size=1, max_size=12), min_size=1, max_size=8))
def test_bulk_numbers_are_as_strict_as_float(words: list[str]) -> None:
    found = read_decimals(" ".join([*words, *["0.5"] * 40]))
    try:
        wanted = [float(w) for w in words]
    except ValueError:
        assert found is None
    else:
        assert found is None or found[: len(words)].tolist() == wanted


def test_slopes_are_read_in_bulk() -> None:
    slopes = np.random.default_rng(1).normal(size=3000).astype(np.float32) * 10.0 ** np.arange(-9, 6).repeat(200)
    words = number_words(shortest_float32(slopes.astype(np.float32)))
    found = read_decimals(" ".join(words))
    assert found is not None
    np.testing.assert_array_equal(found.astype(np.float32), slopes.astype(np.float32))
    assert read_decimals("") is not None
    for wrong in ("1-2", "1.2.3", "--1", ".", "1e", "e5", "1e5.0", "1ee5", "0x10", "+I", "1:2", "\xe9", "1 2 3/"):
        assert read_decimals(wrong) is None


@pytest.mark.parametrize(
    ("word", "said"), [("1.2.3", "'1.2.3'"), ("1-2", "'1-2'"), ("--4", "'--4'"), (".", "'.'"), ("7e", "'7e'")]
)
def test_a_wrong_word_among_many_numbers_is_found(word: str, said: str) -> None:
    numbers = "\n".join(["0.125 -3e-05 17 .5,"] * 2000)
    text = f"Coordinate {{ point [\n{numbers}\n0 {word} 1\n{numbers} ] }}"
    with pytest.raises(VrmlSyntaxError, match="expected a number") as caught:
        parse(text)
    assert (caught.value.line, caught.value.column) == (2002, 3)
    assert said in str(caught.value)


def test_rare_numbers_among_many_keep_their_value() -> None:
    words = ["0x1F", "+I", "1e400", "-0", "5e-324", "12345678901234567890"]
    numbers = " ".join(["0.125 -3e-05 17 .5,"] * 2000)
    (tree,) = parse(f"A {{ b [ {numbers} {' '.join(words)} # a comment 1 2 3\n {numbers} ] }}")
    assert isinstance(tree, VrmlNode)
    value = tree.get("b")
    assert isinstance(value, Numbers)
    assert value.values[8000:8006].tolist() == [31, np.inf, np.inf, 0, 5e-324, 12345678901234567890.0]
    assert value.values.size == 16006


@pytest.mark.parametrize("name", ["a", "left eye", "9.3", "DEF", "a_x20_b", "ö", "", "_x", "頭", "a.b[c]{d}\"#'"])
def test_any_name_becomes_a_def_name_and_back(name: str) -> None:
    written = escape(name)
    node = parse(f"DEF {written} Group {{ }}")[0]
    assert isinstance(node, VrmlNode)
    assert unescape(node.def_name or "") == name


def test_use_means_the_nearest_def_before_it() -> None:
    tree = parse("DEF A Box { } Group { children [ USE A DEF A Cone { } USE A ] } ROUTE A.x TO A.y")
    unique = unique_definitions(tree)
    assert (
        print_tree(unique).split()
        == print_tree(
            parse("DEF A Box { } Group { children [ USE A DEF A_2 Cone { } USE A_2 ] } ROUTE A_2.x TO A_2.y")
        ).split()
    )


def test_definitions_move_to_their_first_use() -> None:
    tree = parse("Group { children [ USE B ] } DEF A Group { children DEF B Box { } } USE A")
    assert definitions_first(tree) == parse("Group { children [ DEF B Box { } ] } DEF A Group { children USE B } USE A")


# --- hostile files ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("opening", ["Group { children [ ", "A { b A { c ", "PROTO A [ ] { "])
def test_endless_nesting_is_an_error(opening: str) -> None:
    with pytest.raises(VrmlSyntaxError, match="nested deeper than 128"):
        parse(opening * 20000)


def test_chains_of_use_do_not_nest_without_end(tmp_path: Path) -> None:
    path = tmp_path / "a.wrl"
    links = "".join(f"DEF A{k} Group {{ children [ USE A{k + 1} ] }}\n" for k in range(3000))
    path.write_text("#VRML V2.0 utf8\n" + links + "DEF A3000 Group { }")
    with pytest.raises(FbaError, match="nested deeper"):
        read(path)


def test_doubling_use_is_read_once(tmp_path: Path) -> None:
    path = tmp_path / "a.wrl"
    triangle = "Shape { geometry IndexedFaceSet { coord Coordinate { point [0 0 0 1 0 0 0 1 0] } coordIndex [0 1 2] } }"
    levels = "".join(f"DEF A{k} Group {{ children [ USE A{k - 1} USE A{k - 1} ] }}\n" for k in range(1, 100))
    path.write_text(f"#VRML V2.0 utf8\nDEF A0 {triangle}\n{levels}")
    scene = read(path)
    assert scene.vertex_count == 3  # type: ignore[union-attr]


def test_thousands_of_equal_and_missing_names_end(tmp_path: Path) -> None:
    path = tmp_path / "a.wrl"
    shape = "Shape { geometry IndexedFaceSet { coord USE C coordIndex [0 1 2] } }\n"
    first = shape.replace("USE C", "DEF C Coordinate { point [0 0 0 1 0 0 0 1 0] }")
    path.write_text("#VRML V2.0 utf8\n" + first + ("DEF A " + shape + shape + "DEF G Group { }\n") * 5000)
    scene = read(path)
    assert len(scene.shapes) == 10001  # type: ignore[union-attr]


def test_too_many_nodes_are_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("formats.vrml97.parser.MAX_ITEMS", 1000)
    with pytest.raises(VrmlSyntaxError, match="more than 1000 nodes"):
        parse("A{}" * 2000)
    with pytest.raises(VrmlSyntaxError, match="more than 1000 nodes"):
        parse("A { b [" + '"x"' * 2000 + "] }")


def test_gzip_bombs_stop_at_the_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(vrml_text, "MAX_TEXT", 1 << 20)
    path = tmp_path / "a.wrz"
    path.write_bytes(gzip.compress(b" " * (200 << 20), 1))
    tracemalloc.start()
    with pytest.raises(InputFileError, match="unpacks to more than 1 MiB"):
        vrml_text.read_text(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 8 << 20


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "empty"),
        (gzip.compress(b"#VRML V2.0 utf8\nGroup { }", mtime=0)[:-12], "cut off"),
        (b"\x1f\x8b\x08garbage that is not gzip", "damaged gzip|cut off"),
        (b"\xff\xfe#\x00V\x00", "UTF-16"),
        (b"#VRML V1.0 ascii\nSeparator { }", "VRML 1.0"),
        (b"#VRML V2.0 utf8\nGroup { }", "no IndexedFaceSet"),
        (b"\x89PNG\r\n\x1a\n\x00\x00", "line 2, column 1"),
    ],
)
def test_wrong_files_are_clear_errors(data: bytes, said: str, tmp_path: Path) -> None:
    path = tmp_path / "a.wrl"
    path.write_bytes(data)
    with pytest.raises(InputFileError, match=said):
        read(path)


SMALL = (
    "#VRML V2.0 utf8\nPROTO P [ field SFInt32 n 0 ] { Group { } }\nDEF T Transform { translation 1 2 3 children [\n"
    'DEF S Shape { appearance Appearance { texture ImageTexture { url "a.png" } } geometry DEF I IndexedFaceSet {\n'
    "coord Coordinate { point [ 0 0 0, 1 0 0, 1 1 0, 0 1 0 ] } coordIndex [ 0 1 2 -1 0 2 3 -1 ] ccw FALSE\n"
    "texCoord TextureCoordinate { point [ 0 0 1 0 1 1 0 1 ] } color Color { color [ 1 0 0 0 1 0 ] }\n"
    "colorPerVertex FALSE normal Normal { vector [ 0 0 1 ] } normalIndex [ 0 0 ] normalPerVertex FALSE } } ] }\n"
    "Switch { whichChoice 0 choice [ USE S ] } ROUTE T.a TO T.b\n"
    "Face { fdp FDP { featurePointsCoord Coordinate { point [ 0 0 0 ] } faceSceneGraph [ USE T ] faceDefTables [\n"
    "FaceDefTables { fapID 3 faceDefMesh [ FaceDefMesh { faceSceneGraphNode USE S intervalBorders [ 0 1080 ]\n"
    "coordIndex [ 0 1 ] displacements [ 0 -1 0 0 -0.5 0 ] } ] faceDefTransform [ FaceDefTransform {\n"
    "faceSceneGraphNode USE T rotationDef 0 1 0 1 } ] } ] } }\n"
    'DEF fba_toolkit WorldInfo { info [ "format: \\"fba-toolkit/1\\"" "frame: {\\"axes\\":[[1,0,0],[0,1,0],[0,0,1]],'
    '\\"reversed_winding\\":false}" "shape: {\\"name\\":\\"S\\",\\"role\\":\\"skin\\",\\"materials\\":[],'
    '\\"vertex_ids\\":[[0,4]],\\"face_groups\\":[[0,2]],\\"group_names\\":[\\"g\\"]}" "fapu: {\\"irisd0\\":1}" ] }\n'
)
DAMAGE = r"""{ } [ ] " # \ -1 1e999 -1e40 99999999999 0x1F NULL IS Shape Face ROUTE PROTO TRUE nan +I é"""
TOKENS = [*DAMAGE.split(), "", "\x00", "USE S", "USE T", "USE I", "DEF S", "DEF T", "Group {", "0 0", "[ ]"]


@settings(max_examples=250, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_damaged_files_raise_nothing_but_our_errors(tmp_path: Path, data: st.DataObject) -> None:
    path = tmp_path / "a.wrl"
    path.write_text(SMALL)
    read(path)
    text = SMALL
    for _ in range(data.draw(st.integers(1, 3))):
        start = data.draw(st.integers(0, len(text)))
        end = min(len(text), start + data.draw(st.integers(0, 40)))
        text = text[:start] + data.draw(st.sampled_from(TOKENS)) + text[end:]
    path.write_text(text, encoding="utf-8")
    with contextlib.suppress(FbaError):
        read(path)


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_damaged_bt_raises_nothing_but_our_errors(tmp_path: Path, data: st.DataObject) -> None:
    path = tmp_path / "a.bt"
    text = SMALL + 'AT 40 { REPLACE T.translation BY 1 2 3 }\nUPDATE OD [ ObjectDescriptor { url "a]" } ]\n'
    path.write_text(text)
    read_bt(path)
    for _ in range(data.draw(st.integers(1, 3))):
        start = data.draw(st.integers(0, len(text)))
        end = min(len(text), start + data.draw(st.integers(0, 40)))
        text = text[:start] + data.draw(st.sampled_from([*TOKENS, "AT", "UPDATE", "REPLACE"])) + text[end:]
    path.write_text(text, encoding="utf-8")
    with contextlib.suppress(FbaError):
        read_bt(path)


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.binary(min_size=1, max_size=200), st.booleans())
def test_any_bytes_raise_nothing_but_our_errors(tmp_path: Path, data: bytes, header: bool) -> None:
    path = tmp_path / "a.wrl"
    path.write_bytes(b"#VRML V2.0 utf8\n" + data if header else data)
    with pytest.raises(FbaError):
        read(path)


_names = st.text("abcXYZ_é", min_size=1, max_size=5).filter(
    lambda s: s not in {"DEF", "USE", "IS", "TO"} and not s.startswith("_x")
)
_values = st.recursive(
    st.one_of(
        st.builds(
            lambda v, many: Numbers(np.array(v), many),
            st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=15),
            st.booleans(),
        ),
        st.builds(lambda v: Strings((v,)), st.text(st.characters(exclude_characters="\r", codec="utf-8"))),
        st.builds(lambda v: Strings(tuple(v), True), st.lists(st.text('a"\\ #\n{'), min_size=1, max_size=3)),
        st.builds(lambda v: Booleans((v,)), st.booleans()),
        st.just(Empty()),
        st.builds(lambda n: Nodes((Use(n),)), _names),
    ),
    lambda inner: st.builds(
        lambda kinds, many: Nodes(tuple(kinds) if many else (kinds[0],), many),
        st.lists(
            st.builds(
                lambda kind, name, fields: VrmlNode(kind, def_name=name).with_field("f", fields),
                _names,
                st.none() | _names,
                inner,
            ),
            min_size=1,
            max_size=3,
        ),
        st.booleans(),
    ),
    max_leaves=8,
)


@settings(max_examples=150, deadline=None)
@given(_values)
def test_any_tree_survives_writing_and_reading(value: object) -> None:
    tree = (VrmlNode("Top").with_field("v", value),)  # type: ignore[arg-type]
    assert parse(print_tree(tree)) == tree
