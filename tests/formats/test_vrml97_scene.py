"""Scenes from VRML97 files, and files that come back with everything they held."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fat.rig import rig_eye, rig_head
from fba import FaceScene, Frame, PolyMesh, Role, Shape, Transform
from fba.errors import InputFileError, MeshError
from formats.vrml97 import VrmlDocument, parse, read, to_text, write
from formats.vrml97.axes import from_file_axes, in_file_axes
from formats.vrml97.tree import ExternProto, Proto, Route, Use, VrmlNode, definitions, walk

HEADER = "#VRML V2.0 utf8\n"
FULL = (
    HEADER
    + """
PROTO Knob [ field SFFloat size 1 ] { Group { } }
EXTERNPROTO Far [ field SFInt32 n ] "far.wrl"
DEF View Viewpoint { position 0 0 9 }
DirectionalLight { direction 0 0 -1 }
DEF Head Transform {
  translation 1 2 3 rotation 0 1 0 0.5
  children [
    DEF Lamp PointLight { }
    DEF Skin Shape {
      appearance DEF Look Appearance { material DEF Paint Material { diffuseColor 1 0.5 0.25 }
        texture ImageTexture { url [ "face.jpg" "http://a/b.jpg" ] repeatS FALSE } }
      geometry DEF Net IndexedFaceSet {
        creaseAngle 1.5 solid FALSE
        coord DEF Points Coordinate { point [ 0 0 0, 2 0 0, 2 2 0, 0 2 0, 1 3 0, 5 5 5, 6 5 5, 5 6 5, 5 5 6 ] }
        coordIndex [ 0 1 2 3 -1, 3 2 4 -1, 5 6 7 -1 5 7 8 -1 5 8 6 -1 6 8 7 ]
        color Color { color [ 0 0 0, .1 0 0, .2 0 0, .3 0 0, .4 0 0, .5 0 0, .6 0 0, .7 0 0, .8 0 0 ] }
      }
    }
    Knob { size 2 }
    DEF Eye Transform { translation 0.5 0 0 children DEF Ball Shape { appearance USE Look
      geometry IndexedFaceSet { coord Coordinate { point [ 0 0 0, 1 0 0, 0 1 0 ] } coordIndex [ 0 1 2 ] } } }
  ]
}
DEF Second Transform { translation 9 0 0 children [ USE Skin ] }
DEF Room Shape { geometry Box { size 9 9 9 } }
Strange { what [ 1 2 3 ] inner Strange { text "x" } }
DEF Timer TimeSensor { }
DEF Turner Script { eventIn SFFloat x field SFNode head USE Head url "javascript: function x(v) { }" }
ROUTE Timer.fraction_changed TO Turner.x
"""
)


def read_scene(tmp_path: Path, text: str) -> FaceScene:
    path = tmp_path / "in.wrl"
    path.write_text(text, encoding="utf-8")
    scene = read(path)
    assert isinstance(scene, FaceScene)
    return scene


def face_set(**fields: str) -> str:
    body = {"coord": "Coordinate { point [ 0 0 0, 1 0 0, 1 1 0, 0 1 0 ] }", "coordIndex": "[ 0 1 2 3 ]", **fields}
    return "geometry IndexedFaceSet { " + " ".join(f"{k} {v}" for k, v in body.items()) + " }"


def test_names_tree_and_materials(tmp_path: Path) -> None:
    scene = read_scene(tmp_path, FULL)
    assert [n.name for n, _ in scene.walk()] == ["Head", "Skin", "Eye", "Ball"]
    assert scene.parents("Ball")[1].translation == (0.5, 0.0, 0.0)
    skin = scene.shape("Skin")
    assert skin.mesh.arities.tolist() == [4, 3, 3, 3, 3, 3]
    assert skin.materials[0].name == "Paint"
    assert skin.materials[0].diffuse == (1, 0.5, 0.25)
    assert skin.materials[0].texture == "face.jpg"
    assert scene.shape("Ball").materials == skin.materials
    document = scene.document
    assert isinstance(document, VrmlDocument)
    assert any("Box is not a polygon mesh" in remark for remark in document.remarks)


def test_a_shape_without_points_stays_in_the_file_alone(tmp_path: Path) -> None:
    empty = "DEF None Shape { geometry IndexedFaceSet { coordIndex [ -1 -1 ] } }\n"
    scene = read_scene(tmp_path, HEADER + empty + "DEF A Shape { " + face_set() + " }")
    assert [s.name for s in scene.shapes] == ["A"]
    write(scene, tmp_path / "out.wrl")
    assert "DEF None Shape" in (tmp_path / "out.wrl").read_text()
    with pytest.raises(InputFileError, match="no polygon mesh"):
        read_scene(tmp_path, HEADER + empty)


def test_unchanged_scene_is_written_as_it_was(tmp_path: Path) -> None:
    scene = read_scene(tmp_path, FULL)
    write(scene, tmp_path / "out.wrl")
    before = parse(FULL)
    after = parse((tmp_path / "out.wrl").read_text())
    assert after[: len(before)] == before
    assert [s.def_name for s in after[len(before) :] if isinstance(s, VrmlNode)] == ["fba_toolkit"]


def test_clockwise_polygons_are_turned_and_written_back_as_they_were(tmp_path: Path) -> None:
    scene = read_scene(tmp_path, HEADER + "DEF A Shape { " + face_set(ccw="FALSE") + " }")
    assert scene.shapes[0].mesh.indices.tolist() == [3, 2, 1, 0]
    out = parse(to_text(scene))[0]
    assert out == parse(HEADER + "DEF A Shape { " + face_set(ccw="FALSE") + " }")[0]


def test_texture_coordinates_and_normals(tmp_path: Path) -> None:
    uv = "TextureCoordinate { point [ 0 0, 1 0, 1 1, 0 1, .5 .5 ] }"
    per_face = {"normal": "Normal { vector [ 0 0 1, 0 0 -1 ] }", "normalPerVertex": "FALSE", "normalIndex": "[ 1 ]"}
    text = "Shape { " + face_set(texCoord=uv, texCoordIndex="[ 4 3 2 1 -1 ]", **per_face) + " }"
    mesh = read_scene(tmp_path, HEADER + text).shapes[0].mesh
    assert mesh.texcoord_indices is not None
    assert mesh.texcoord_indices.tolist() == [4, 3, 2, 1]
    assert mesh.normals is not None
    assert mesh.normal_indices is not None
    assert mesh.normals[mesh.normal_indices].tolist() == [[0, 0, -1]] * 4
    plain = read_scene(tmp_path, HEADER + "Shape { " + face_set(texCoord=uv) + " }").shapes[0].mesh
    assert plain.texcoord_indices is not None
    assert plain.texcoord_indices.tolist() == [0, 1, 2, 3]
    wrong = read_scene(tmp_path, HEADER + "Shape { " + face_set(texCoord=uv, texCoordIndex="[ 0 1 -1 2 ]") + " }")
    assert wrong.shapes[0].mesh.texcoords is None
    assert isinstance(wrong.document, VrmlDocument)
    assert wrong.document.findings[0].code == "texCoordIndex"


def test_degenerate_polygons_are_left_out_and_said(tmp_path: Path) -> None:
    text = "Shape { " + face_set(coordIndex="[ -1 0 1 -1 0 1 2 -1 -1 3 -1 ]") + " }"
    scene = read_scene(tmp_path, HEADER + text)
    assert scene.shapes[0].mesh.indices.tolist() == [0, 1, 2]
    assert isinstance(scene.document, VrmlDocument)
    assert "2 polygons" in scene.document.findings[0].message
    out = parse(to_text(scene))[0]
    assert isinstance(out, VrmlNode)
    assert replace(out, def_name=None) == parse(text)[0]


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"coordIndex": "[ 0 1 9 ]"}, "uses point 9, but there are 4"),
        ({"coordIndex": "[ 0 1 2.5 ]"}, "not an int32"),
        ({"coord": "Coordinate { point [ 0 0 ] }"}, "not a multiple of 3"),
        ({"coord": "Coordinate { point [ 0 0 1e999 ] }"}, "not a finite"),
        ({"coord": 'Coordinate { point "x" }'}, "must be numbers"),
    ],
)
def test_unusable_meshes_are_errors_with_a_line(tmp_path: Path, fields: dict[str, str], said: str) -> None:
    with pytest.raises(MeshError, match=f"line 2: .*{said}"):
        read_scene(tmp_path, HEADER + "Shape { " + face_set(**fields) + " }")


def test_switch_and_lod_show_one_child(tmp_path: Path) -> None:
    shape = "Shape { " + face_set() + " }"
    text = f"{HEADER}Switch {{ whichChoice 1 choice [ DEF A {shape} DEF B {shape} ] }}\n"
    text += f"LOD {{ range [ 5 ] level [ DEF C {shape} DEF D {shape} ] }} Switch {{ choice [ DEF E {shape} ] }}"
    scene = read_scene(tmp_path, text)
    assert [s.name for s in scene.shapes] == ["B", "C"]
    assert {"A", "B", "C", "D", "E"} <= definitions(parse(to_text(scene))).keys()


def test_double_names_become_unique(tmp_path: Path) -> None:
    shape = "DEF A Shape { " + face_set() + " }"
    scene = read_scene(tmp_path, f"{HEADER}{shape} Group {{ children [ {shape} USE A ] }}")
    assert [s.name for s in scene.shapes] == ["A", "A_2"]
    assert [n.name for n in walk(parse(to_text(scene))) if isinstance(n, Use)] == ["A_2"]


def test_head_and_eye_transforms_are_inserted_around_the_nodes(tmp_path: Path) -> None:
    scene = read_scene(tmp_path, FULL)
    rigged, _ = rig_head(scene, np.array([0.0, -1.0, 0.0]))
    rigged, _ = rig_eye(rigged, "left", ["Ball"], scene.world_vertices("Ball").mean(axis=0))
    write(rigged, tmp_path / "out.wrl")
    back = read(tmp_path / "out.wrl")
    assert isinstance(back, FaceScene)
    assert [(n.name, len(c)) for n, c in back.walk()] == [(n.name, len(c)) for n, c in rigged.walk()]
    for shape in rigged.shapes:
        assert np.array_equal(back.world_vertices(shape.name), rigged.world_vertices(shape.name))
    tree = parse((tmp_path / "out.wrl").read_text())
    top = [s.def_name or s.type if isinstance(s, VrmlNode) else type(s) for s in tree]
    assert top == [
        Proto, ExternProto, "View", "DirectionalLight", "head_yaw", "Second", "Room", "Strange", "Timer", "Turner",
        Route, "fba_toolkit",
    ]  # fmt: skip
    defs = definitions(tree)
    assert defs["Skin"] == definitions(parse(FULL))["Skin"]
    head = defs["Head"].nodes("children")
    assert [n.def_name or n.type for n in head if isinstance(n, VrmlNode)] == ["Lamp", "Skin", "Knob", "Eye"]
    assert [n.def_name for n in defs["Eye"].nodes("children") if isinstance(n, VrmlNode)] == ["eye_left_yaw"]


def test_a_transform_that_takes_the_name_of_a_shape(tmp_path: Path) -> None:
    scene = read_scene(tmp_path, HEADER + "DEF A Shape { " + face_set() + " }")
    changed = replace(scene, roots=(Transform("A", (replace(scene.shapes[0], name="B"),), (1.0, 0.0, 0.0)),))
    write(changed, tmp_path / "out.wrl")
    back = read(tmp_path / "out.wrl")
    assert isinstance(back, FaceScene)
    assert [n.name for n, _ in back.walk()] == ["A", "B"]


def test_deep_but_legal_nesting(tmp_path: Path) -> None:
    depth = 118
    text = HEADER + "Group { children [ " * depth + "Shape { " + face_set() + " }" + " ] }" * depth
    scene = read_scene(tmp_path, text)
    rigged, _ = rig_head(scene, np.zeros(3))
    write(rigged, tmp_path / "out.wrl")
    back = read(tmp_path / "out.wrl")
    assert isinstance(back, FaceScene)
    assert len(back.parents(back.shapes[0].name)) == depth + 3


def test_a_root_that_moves_forward_keeps_its_references(tmp_path: Path) -> None:
    shape = "Shape { appearance USE Look " + face_set() + " }"
    text = (
        f"{HEADER}DEF A Shape {{ {face_set()} }}\nShape {{ appearance DEF Look Appearance {{ }} geometry Box {{ }} }}\n"
    )
    scene = read_scene(tmp_path, f"{text}DEF B {shape}")
    rigged, _ = rig_head(scene, np.zeros(3))
    tree = parse(to_text(rigged))
    seen: set[str] = set()
    for item in walk(tree):
        if isinstance(item, Use):
            assert item.name in seen
        elif item.def_name:
            seen.add(item.def_name)
    assert "Look" in seen


def test_a_shape_cut_into_skin_and_eye_keeps_its_look(tmp_path: Path) -> None:
    scene = read_scene(tmp_path, FULL)
    whole = scene.shape("Skin")
    mask = np.arange(9) < 5
    skin, _ = whole.mesh.submesh(mask)
    eye, _ = whole.mesh.submesh(~mask)
    parts = (
        Shape("Skin", skin, Role.SKIN, whole.materials),
        Shape("eyeball", eye, Role.EYE_LEFT, whole.materials),
    )
    head = scene.roots[0]
    assert isinstance(head, Transform)
    cut = replace(scene, roots=(replace(head, children=(*parts, *head.children[1:])),))
    write(cut, tmp_path / "out.wrl")
    back = read(tmp_path / "out.wrl")
    assert isinstance(back, FaceScene)
    assert [s.name for s in back.shapes] == ["Skin", "Ball", "eyeball"]
    assert [s.role for s in back.shapes] == [Role.SKIN, Role.OTHER, Role.EYE_LEFT]
    assert np.array_equal(back.shape("eyeball").mesh.vertices, eye.vertices)
    assert back.shape("eyeball").materials == whole.materials
    defs = definitions(parse((tmp_path / "out.wrl").read_text()))
    assert defs["eyeball"].nodes("appearance") == (Use("Look"),)
    for name, rows in (("Skin", range(5)), ("eyeball", range(5, 9))):
        geometry = defs[name].nodes("geometry")[0]
        assert isinstance(geometry, VrmlNode)
        assert geometry.get("creaseAngle") == definitions(parse(FULL))["Net"].get("creaseAngle")
        color = geometry.nodes("color")[0]
        assert isinstance(color, VrmlNode)
        assert np.allclose(color.get("color").values[::3], np.array(rows) / 10)  # type: ignore[union-attr]


def test_colors_of_polygons_go_with_the_polygons(tmp_path: Path) -> None:
    colors = "Color { color [ 1 0 0, 0 1 0, 0 0 1 ] }"
    fields = {"color": colors, "colorPerVertex": "FALSE", "colorIndex": "[ 2 0 1 ]"}
    fields["coordIndex"] = "[ 0 1 2 -1 1 2 3 -1 0 2 3 ]"
    scene = read_scene(tmp_path, HEADER + "DEF A Shape { " + face_set(**fields) + " }")
    part, _ = scene.shapes[0].mesh.submesh(np.array([False, True, True, True]))
    cut = replace(scene, roots=(Shape("part", part),))
    geometry = definitions(parse(to_text(cut)))["part"].nodes("geometry")[0]
    assert isinstance(geometry, VrmlNode)
    color = geometry.nodes("color")[0]
    assert isinstance(color, VrmlNode)
    assert color.get("color").values.tolist() == [1, 0, 0]  # type: ignore[union-attr]
    assert not geometry.get("colorPerVertex").values[0]  # type: ignore[union-attr]


def test_parts_with_coincident_vertices_take_their_own_colors(tmp_path: Path) -> None:
    """Two triangles in the same place, told apart by the noted places of their vertices alone."""
    colors = "Color { color [ 1 0 0, 0 1 0 ] }"
    points = "Coordinate { point [ 0 0 0, 1 0 0, 1 1 0, 0 0 0, 1 0 0, 1 1 0 ] }"
    fields = {"color": colors, "colorPerVertex": "FALSE", "coord": points, "coordIndex": "[ 0 1 2 -1 3 4 5 -1 ]"}
    scene = read_scene(tmp_path, HEADER + "DEF A Shape { " + face_set(**fields) + " }")
    mesh = scene.shapes[0].mesh
    parts = []
    for name, mask in (("back", np.arange(6) >= 3), ("front", np.arange(6) < 3)):
        part, ids = mesh.submesh(mask)
        parts.append(Shape(name, part, vertex_ids=ids))
    write(replace(scene, roots=tuple(parts)), tmp_path / "out.wrl")
    defs = definitions(parse((tmp_path / "out.wrl").read_text()))
    found = [defs[n].nodes("geometry")[0].nodes("color")[0] for n in ("back", "front")]  # type: ignore[union-attr]
    assert [c.get("color").values.tolist() for c in found] == [[0, 1, 0], [1, 0, 0]]  # type: ignore[union-attr]
    back = read(tmp_path / "out.wrl")
    assert isinstance(back, FaceScene)
    assert np.array_equal(back.world_neutral(), scene.world_neutral())


def test_new_texture_coordinates_are_written(tmp_path: Path) -> None:
    uv = "TextureCoordinate { point [ 0 0, 1 0, 1 1, 0 1 ] }"
    scene = read_scene(tmp_path, HEADER + "DEF A Shape { " + face_set(texCoord=uv) + " }")
    shape = scene.shapes[0]
    changed = replace(shape.mesh, texcoords=np.full((4, 2), 0.125))
    write(replace(scene, roots=(replace(shape, mesh=changed),)), tmp_path / "out.wrl")
    back = read(tmp_path / "out.wrl")
    assert isinstance(back, FaceScene)
    assert back.shapes[0].mesh.texcoords is not None
    assert np.all(back.shapes[0].mesh.texcoords == 0.125)


def test_moved_vertices_change_nothing_but_the_coordinates(tmp_path: Path) -> None:
    scene = read_scene(tmp_path, FULL)
    skin = scene.shape("Skin")
    moved = skin.mesh.with_vertices(skin.mesh.vertices + 1.0)
    out = definitions(parse(to_text(scene.map_shapes({"Skin": replace(skin, mesh=moved)}))))["Skin"].nodes("geometry")[
        0
    ]
    before = definitions(parse(FULL))["Net"]
    assert isinstance(out, VrmlNode)
    assert out.with_field("coord", None) == replace(before, def_name=None).with_field("coord", None)


def test_a_shape_that_is_gone_stays_where_it_was_used_again(tmp_path: Path) -> None:
    scene = read_scene(tmp_path, FULL)
    head = scene.roots[0]
    assert isinstance(head, Transform)
    whole = head.children[0]
    assert isinstance(whole, Shape)
    part, _ = whole.mesh.submesh(np.arange(9) < 5)
    cut = replace(scene, roots=(replace(head, children=(Shape("front", part), *head.children[1:])),))
    tree = parse(to_text(cut))
    defs = definitions(tree)
    first = [n.def_name or n.type for n in defs["Head"].nodes("children") if isinstance(n, VrmlNode)]
    assert first == ["Lamp", "front", "Knob", "Eye"]
    assert isinstance(defs["Second"].nodes("children")[0], VrmlNode)
    assert "Skin" in defs


def test_turned_axes_go_back_into_the_file_exactly(tmp_path: Path) -> None:
    scene = read_scene(tmp_path, FULL)
    axes = np.array([[-1.0, 0, 0], [0, 0, 1], [0, 1, 0]])
    frame = Frame(axes, True)
    turned = from_file_axes(scene, frame)
    world = scene.world_neutral() @ axes.T
    assert np.allclose(turned.world_neutral(), world, atol=1e-15)
    back = in_file_axes(turned)
    assert np.array_equal(replace(scene, roots=back).world_neutral(), scene.world_neutral())
    before = parse(FULL)
    tree = parse(to_text(turned))
    assert tree[: len(before)] == before
    write(turned, tmp_path / "out.wrl")
    again = read(tmp_path / "out.wrl")
    assert isinstance(again, FaceScene)
    assert np.array_equal(again.frame.axes, axes)
    assert again.frame.reversed_winding
    assert np.array_equal(again.world_neutral(), turned.world_neutral())
    assert np.array_equal(again.shapes[0].mesh.indices, turned.shapes[0].mesh.indices)


def test_scene_without_document_is_a_clean_file(tmp_path: Path) -> None:
    mesh = PolyMesh.from_faces([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.1], [0.5, 1.5, 1 / 3]], [[0, 1, 2, 4, 3]])
    ids = np.array([4, 3, 2, 1, 0], np.int32)
    scene = FaceScene((Shape("my face.1", mesh, Role.SKIN, (), ids),), name="head", meters_per_unit=0.01)
    write(scene, tmp_path / "out.wrl.gz")
    assert (tmp_path / "out.wrl.gz").read_bytes()[:2] == b"\x1f\x8b"
    back = read(tmp_path / "out.wrl.gz")
    assert isinstance(back, FaceScene)
    shape = back.shapes[0]
    assert (shape.name, shape.role, back.name, back.meters_per_unit) == ("my face.1", Role.SKIN, "head", 0.01)
    assert np.array_equal(shape.mesh.vertices, mesh.vertices)
    assert shape.vertex_ids is not None
    assert np.array_equal(shape.vertex_ids, ids)
    assert np.array_equal(back.world_neutral(), scene.world_neutral())


def test_corners_without_texture_coordinate_survive(tmp_path: Path) -> None:
    mesh = PolyMesh.from_faces([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    mesh = replace(mesh, texcoords=np.array([[0.25, 0.5]]), texcoord_indices=np.array([0, -1, 0]))
    write(FaceScene((Shape("a", mesh),)), tmp_path / "out.wrl")
    back = read(tmp_path / "out.wrl")
    assert isinstance(back, FaceScene)
    found = back.shapes[0].mesh
    assert found.texcoords is not None
    assert found.texcoord_indices is not None
    assert found.texcoords.tolist() == [[0.25, 0.5]]
    assert found.texcoord_indices.tolist() == [0, -1, 0]


def test_second_parser_agrees(tmp_path: Path) -> None:
    """PyVRML97 sees the same nodes and the same numbers (it holds them as float32 or float64)."""
    loader = pytest.importorskip("vrml.vrml97.parser")
    scene = read_scene(tmp_path, FULL.replace("EXTERNPROTO", "#").replace("Strange {", "Knob { } #"))
    rigged, _ = rig_head(scene, np.zeros(3))
    text = to_text(rigged)
    ok, tree, used = loader.buildParser().parse(text)
    assert ok
    assert used == len(text)
    points = tree[1].getDEF("Points").point
    expected = np.array(definitions(parse(text))["Points"].get("point").values, dtype=np.float64)  # type: ignore[union-attr]
    assert np.array_equal(np.asarray(points, np.float32).ravel(), expected.astype(np.float32))
    assert struct.calcsize("f") == 4
    assert len(tree[1].getDEF("head_yaw").children) == 1
