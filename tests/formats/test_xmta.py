"""XMT-A: the trees, faces and streams of BT in XML, and nothing but the file's own text."""

from __future__ import annotations

import contextlib
import re
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from faces import assert_same_face, small_face
from hypothesis import given, settings
from hypothesis import strategies as st
from test_bt_streams import assert_same_stream, patchy_stream

from fba import FapStream
from fba.errors import FapStreamError, FbaError, InputFileError, TextSyntaxError
from formats import read, read_face, write, xmta
from formats.bifs.scene import BifsScene
from formats.streams import read_stream
from formats.vrml97.parser import parse
from formats.vrml97.tree import Nodes, Numbers, Strings, VrmlNode, definitions
from formats.xml_tree import attribute, parse_xml
from formats.xmta.printer import print_scene
from formats.xmta.reader import read_document

EVERYTHING = r"""
PROTO Odd [ field SFInt32 n 1 field MFString s [ "a \"b\"" "c\\" ] exposedField SFNode thing NULL
  exposedField MFNode things [ Group { } ] eventIn SFTime go eventOut SFBool done field MFFloat none [ ] ]
{ Transform { translation 1 2 3 children IS things } DEF Inner TimeSensor { cycleInterval IS n } }
EXTERNPROTO Far [ field SFColor c exposedField MFVec3f p ] [ "urn:far" "far.wrl#Far" ]
Group { children [
  DEF odd-name Viewpoint { description "it's <a> & \"b\"" position 0 0 5 jump FALSE }
  WorldInfo { title "" info [ "" "x \\" "'y' \"z\"" ] }
  Switch { whichChoice -1 choice [ NULL Group { } ] }
  DEF S Script { url [ "javascript:\nfunction f(v) { if (v < 1) return; }\t" ] directOutput TRUE
    field SFVec3f at 1 2 3 field SFNode self USE odd-name field MFNode all [ USE odd-name ] eventIn SFBool f
    eventOut SFInt32 out }
  Odd { n 7 s "one" thing DEF B Box { size 1 2 3 } things [ USE B Sphere { } ] none [ 1 2.5 ] }
  Far { c 1 0.5 0 p [ 0 0 0 1 1 1 ] }
  Unknown { a 1 2 3 b [ 1 2 3 4 5 6 ] c TRUE d "text" e [ "l" ] f DEF U Group { } }
  Shape { appearance Appearance { texture PixelTexture { image 2 1 1 0xFF 0 repeatS FALSE } }
    geometry IndexedFaceSet { coord Coordinate { point [ 0 0 0 1 0 0 0 1 -2e-30 ] } coordIndex [ 0 1 2 -1 ]
      colorPerVertex FALSE solid FALSE } }
] }
ROUTE S.out TO odd-name.set_bind
"""


def through_xml(text: str) -> tuple[object, ...]:
    scene = BifsScene(parse(text, bt=True))
    return read_document(parse_xml(print_scene(scene).encode()), "x").statements


def normal(statements: object) -> list[str]:
    """What a tree says, in an order that does not depend on where its fields stand."""
    if isinstance(statements, VrmlNode):
        parts = sorted(str(normal(p)) for p in statements.body if "(None,)" not in repr(p) and "Empty" not in repr(p))
        return [statements.type, str(statements.def_name), *parts]
    if isinstance(statements, tuple):
        return [str(normal(s)) for s in statements]
    value = getattr(statements, "value", None)
    name = getattr(statements, "name", "")
    if hasattr(value, "items"):
        return [name, *(str(normal(i)) for i in value.items)]
    if isinstance(value, Numbers):
        return [name, str(value.values.tolist()), str(value.many)]
    return [repr(statements)]


def test_everything_that_a_tree_holds_reads_back() -> None:
    before = parse(EVERYTHING, bt=True)
    after = through_xml(EVERYTHING)
    protos, nodes, routes = before[:2], before[2], before[3]
    assert [getattr(p, "name", "") for p in after[:2]] == ["Odd", "Far"]
    assert after[3] == routes
    assert after[0].interface[:2] == protos[0].interface[:2]  # type: ignore[attr-defined, union-attr]
    assert [i.type for i in after[0].interface] == [i.type for i in protos[0].interface]  # type: ignore[attr-defined, union-attr]
    assert normal(after[0].body) == normal(protos[0].body)  # type: ignore[attr-defined, union-attr]
    assert after[1] == protos[1]
    found = after[2]
    assert isinstance(found, VrmlNode)
    assert isinstance(nodes, VrmlNode)
    for a, b in zip(found.nodes("children"), nodes.nodes("children"), strict=True):
        if isinstance(b, VrmlNode) and b.type not in ("Switch", "Odd"):
            assert normal(a) == normal(b)
    defs = definitions(after)
    assert {"odd-name", "S", "B", "U"} == set(defs)
    odd = next(n for n in found.nodes("children") if isinstance(n, VrmlNode) and n.type == "Odd")
    assert odd.get("s") == Strings(("one",), True)
    assert [n.type for n in found.nodes("children")[2].nodes("choice")] == ["Group", "Group"]  # type: ignore[union-attr]


def test_types_and_values_by_their_names_in_xmta() -> None:
    """Other writers name types and values as the schema of XMT-A does."""
    root = parse_xml(
        SCENE.format("""<ProtoDeclare name="Odd" protoID="1">
 <field name="n" type="Integer" vrml97Hint="field" intValue="1"/>
 <field name="at" type="Vector3Array" vrml97Hint="field" vector3ArrayValue="1 2 3"/>
 <field name="one" type="Node" vrml97Hint="exposedField"><node>NULL</node></field>
 <field name="all" type="Nodes" vrml97Hint="exposedField"><nodes></nodes></field></ProtoDeclare>
 <ProtoInstance name="Odd"><fieldValue name="at" vector3ArrayValue="4 5 6"/></ProtoInstance>""").encode()
    )
    proto, node = read_document(root, "x").statements
    wanted = parse("PROTO Odd [ field SFInt32 n 1 field MFVec3f at [ 1 2 3 ] exposedField SFNode one NULL ] { }")[0]
    assert proto.interface[:3] == wanted.interface  # type: ignore[union-attr]
    assert proto.interface[3].value == Nodes((), True)  # type: ignore[union-attr]
    assert node.get("at") == Numbers(np.array([4.0, 5.0, 6.0]), True)  # type: ignore[union-attr]


def test_fields_of_nodes_always_have_their_element() -> None:
    """MP4Box does not read what follows a field of nodes that is declared without one."""
    scene = BifsScene(parse("PROTO Odd [ exposedField SFNode a NULL exposedField MFNode b [ ] ] { Group { } }"))
    assert re.findall(r"<nodes?>", print_scene(scene)) == ["<node>", "<nodes>"]


def test_the_same_face_as_bt(tmp_path: Path) -> None:
    face = small_face()
    write(face, tmp_path / "a.xmt")
    write(read_face(tmp_path / "a.xmt"), tmp_path / "b.bt")
    write(read_face(tmp_path / "b.bt"), tmp_path / "c.xmta")
    assert_same_face(read_face(tmp_path / "b.bt"), face)
    assert_same_face(read_face(tmp_path / "c.xmta"), face)
    write(read_face(tmp_path / "a.xmt"), tmp_path / "d.xmt")
    assert (tmp_path / "a.xmt").read_bytes() == (tmp_path / "d.xmt").read_bytes()


@pytest.mark.parametrize("rate", [25.0, 30.0, 30000 / 1001])
@pytest.mark.parametrize("suffix", [".xmt", ".xmta", ".xmt.gz"])
def test_streams_read_back(rate: float, suffix: str, tmp_path: Path) -> None:
    stream = patchy_stream(rate)
    path = tmp_path / f"a{suffix}"
    write(small_face(), path, stream)
    found, findings = xmta.read_stream(path)
    assert findings == []
    assert_same_stream(found, stream)
    assert_same_face(read_face(path), small_face())
    if suffix != ".xmt.gz":
        assert_same_stream(read_stream(path)[0], stream)


def test_the_updates_are_plain_xmta() -> None:
    stream = FapStream.build(25, 3, {3: [0, 100, 100]}, visemes=[[0] * 4, [1, 0, 0, 1], [0] * 4])
    text = xmta.to_text(small_face(), stream)
    assert text.endswith("""\
  </Replace>
  <par begin="0.04">
   <Replace atNode="VISEME" atField="viseme_select1" value="1"/>
   <Replace atNode="VISEME" atField="viseme_def" value="true"/>
   <Replace atNode="FAPS" atField="open_jaw" value="100"/>
  </par>
  <par begin="0.08">
   <Replace atNode="VISEME" atField="viseme_select1" value="0"/>
   <Replace atNode="VISEME" atField="viseme_def" value="false"/>
  </par>
 </Body>
</XMT-A>
""")


FACE = """<XMT-A xmlns="urn:mpeg:mpeg4:xmta:schema:2002"><Body><Replace><Scene><Group><children><Face>
 <fap><FAP DEF="F" open_jaw="5"><viseme><Viseme DEF="V" viseme_select1="3"/></viseme></FAP></fap></Face>
 </children></Group></Scene></Replace>{}</Body></XMT-A>"""


def test_updates_of_other_programs(tmp_path: Path) -> None:
    path = tmp_path / "x.xmt"
    path.write_text(
        FACE.format("""
 <par begin="0.04"><Replace atNode="V" atField="viseme_blend" value="20"/><Delete atNode="F"/>
  <Replace atNode="N" atField="open_jaw" value="9"/><Replace atNode="F" atField="open_jaw" value="1 2 3"/></par>
 <par begin="0.08"><par begin="0.04"><Replace extended="fields" atNode="F"><repField atField="open_jaw" value="-30"/>
  <repField atField="viseme"><Viseme viseme_select1="4" viseme_def="true"/></repField></Replace></par></par>
 <Replace begin="0.16" atNode="F" atField="open_jaw" value="2147483647"/>
 <par begin="0.2"><Replace atNode="F" atField="viseme">NULL</Replace></par>
""")
    )
    stream, findings = xmta.read_stream(path)
    assert [f.code for f in findings] == ["frame-rate"]
    assert stream.values[:, 2].tolist() == [5, 5, 5, -30, 0, 0]
    assert stream.mask[:, 2].tolist() == [True] * 4 + [False] * 2
    assert stream.visemes[:, 0].tolist() == [3, 3, 3, 4, 4, 0]
    assert stream.visemes[:, 2].tolist() == [0, 20, 20, 0, 0, 0]
    assert stream.visemes[:, 3].tolist() == [0, 0, 0, 1, 1, 0]
    assert stream.mask[:, 0].tolist() == [True] * 5 + [False]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (FACE.format(""), "nothing moves it"),
        (FACE.format("<par begin='x'/>"), "line 3: expected a number, found 'x'"),
        (FACE.format("<par begin='nan'><Replace atNode='F' atField='open_jaw' value='1'/></par>"), "expected a number"),
        (FACE.format("<par begin='-1'><Replace atNode='F' atField='open_jaw' value='1'/></par>"), "make no stream"),
        (FACE.format("<par begin='1e300'><Replace atNode='F' atField='open_jaw' value='1'/></par>"), "read at most"),
        (FACE.format("<par>" * 200 + "</par>" * 200), "<par> is nested deeper"),
    ],
)
def test_what_is_no_stream_is_refused(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "x.xmt").write_text(text)
    with pytest.raises((FapStreamError, InputFileError), match=said):
        xmta.read_stream(tmp_path / "x.xmt")


SCENE = "<XMT-A><Body><Replace><Scene>{}</Scene></Replace></Body></XMT-A>"
MESH = (
    "<Shape><geometry><IndexedFaceSet coordIndex='0 1 2'><coord><Coordinate point='{}'/></coord></IndexedFaceSet>"
    "</geometry></Shape>"
)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<X3D/>", "the root is <X3D>, not <XMT-A>"),
        ("<XMT-A/>", "no IndexedFaceSet"),
        (SCENE.format(MESH.format("0 0 0 1 0 0 0 1")), "3"),
        (SCENE.format(MESH.format("0 0 0 1 0 0 0 1 x")), "line 1: expected a number, found 'x'"),
        (SCENE.format(MESH.format("0 0 0 1 0 0 0 1 1_0")), "expected a number, found '1_0'"),
        (SCENE.format(MESH.format("0 0 0 1 0 0 0 1 inf")), "expected a number, found 'inf'"),
        (SCENE.format(MESH.format("0" * (5 << 20))), "number"),
        (SCENE.format("<Shape><Box/></Shape>"), "<Box> stands in <Shape> without the element of a field"),
        (SCENE.format("<Group><children><a/></children></Group>"), "<a> is no node"),
        (SCENE.format("<Box solid='x'/><TimeSensor loop='x'/>"), "expected true or false, found 'x'"),
        (SCENE.format("<ROUTE fromNode='a'/>"), "a ROUTE needs"),
        (SCENE.format("<ProtoDeclare/>"), "<ProtoDeclare> has no name"),
        (SCENE.format("<ProtoInstance/>"), "has no name"),
        (SCENE.format("<ProtoDeclare name='a'><field name='b'/></ProtoDeclare>"), "a <field> needs"),
        (SCENE.format("<Group><children>" * 200 + "</children></Group>" * 200), "nested deeper than 128"),
        (SCENE.format("<ProtoDeclare name='a'>" * 200 + "</ProtoDeclare>" * 200), "nested deeper than 128"),
        (SCENE.format("<a>" * 600), "nested deeper than 512"),
        ('<!DOCTYPE a [<!ENTITY b SYSTEM "/etc/passwd">]><XMT-A>&b;</XMT-A>', "document type"),
    ],
)
def test_what_is_no_scene_is_refused(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "x.xmt").write_text(text)
    with pytest.raises(FbaError, match=said):
        read(tmp_path / "x.xmt")


def test_xml_errors_have_line_and_column(tmp_path: Path) -> None:
    (tmp_path / "x.xmt").write_text("<XMT-A>\n <Body></XMT-A>")
    with pytest.raises(TextSyntaxError) as caught:
        read(tmp_path / "x.xmt")
    assert (caught.value.line, caught.value.column) == (2, 10)


def test_strings_whose_marks_are_not_escaped() -> None:
    """Some writers leave quotation marks inside strings as they are."""
    root = parse_xml(SCENE.format('<WorldInfo info=\'"a: "b","c"" "d"\'/>').encode())
    node = read_document(root, "x").statements[0]
    assert isinstance(node, VrmlNode)
    assert node.get("info") == Strings(('a: "b","c"', "d"), True)


ANIMATED = xmta.to_text(small_face(), FapStream.build(25, 2, {3: [0, 1]}, visemes=[[0] * 4, [1, 0, 63, 0]]))
ODD = st.sampled_from(["<", "/>", '"', "NULL", " USE='skin'", "1e999", "-1", "&#1;", "&#65;", "<NULL/>"])


@settings(max_examples=40, deadline=None)
@given(at=st.integers(0, len(ANIMATED)), length=st.integers(0, 40), new=st.text(max_size=6) | ODD)
def test_changed_files_end_in_a_result_or_a_clear_error(at: int, length: int, new: str) -> None:
    data = (ANIMATED[:at] + new + ANIMATED[at + length :]).encode("utf-8", "replace")
    with contextlib.suppress(FbaError):
        assert isinstance(read_document(parse_xml(data), "x").updates, list)


def test_large_lists_are_read_exactly() -> None:
    values = np.random.default_rng(0).normal(size=60_000).astype(np.float32).astype(np.float64)
    values[7] = 1e-320
    scene = BifsScene((VrmlNode("Coordinate", parse("Coordinate { point [ 1 2 3 ] }")[0].body),))  # type: ignore[union-attr]
    node = scene.statements[0]
    assert isinstance(node, VrmlNode)
    scene = BifsScene((node.with_field("point", Numbers(values, True)),))
    found = read_document(parse_xml(print_scene(scene).encode()), "x").statements[0]
    assert isinstance(found, VrmlNode)
    assert found.get("point") == Numbers(values, True)


@pytest.mark.parametrize("inside", ['\\"', '"', "a", "\\", '"x" '])
def test_long_strings_take_little_memory(inside: str) -> None:
    text = attribute("info", '"' + inside * 40_000)
    tracemalloc.start()
    read_document(parse_xml(SCENE.format(f"<WorldInfo{text}/>").encode()), "x")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 20e6
