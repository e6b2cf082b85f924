"""VRML97 for browsers that know no MPEG-4 nodes: the same file, with PROTOs that play the tables.

The Face, its tables and all else are as in the native form and read back the same. What is new: the Face's PROTO has
a Script, each table's PROTO a `value` in FAP units, and a FAP stream becomes a TimeSensor with interpolators.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from fat.face import AnimatableFace
from fat.tables import FaceDefTable
from fba.arrays import Floats
from fba.faps import fap
from fba.scene import FaceScene
from fba.stream import FapStream
from formats.vrml97.document import PLAYER_DEF
from formats.vrml97.names import Names
from formats.vrml97.portable_motion import (
    Motion,
    check_one_driver,
    clock,
    stream_values,
    table_labels,
    transform_motion,
    value_motion,
)
from formats.vrml97.portable_scene import fields_of, lit, resolved, target_of
from formats.vrml97.portable_script import SCRIPT
from formats.vrml97.tree import (
    BodyItem,
    Booleans,
    Empty,
    Field,
    Interface,
    Is,
    Nodes,
    Proto,
    Route,
    Statement,
    Strings,
    Use,
    VrmlNode,
    definitions,
    number,
)
from formats.vrml97.writer import declarations, pieces

FACE = "fba_face"
"""DEF name of the Face."""

_SCRIPT = VrmlNode(
    "Script",
    (
        Interface("field", "SFNode", "fdp", Is("fdp")),
        Interface("field", "MFNode", "coords", Is("coords")),
        Interface("eventIn", "SFFloat", "set_value", Is("set_value")),
        Field("directOutput", Booleans((True,))),
        Field("mustEvaluate", Booleans((True,))),
        Field("url", Strings((SCRIPT,), True)),
    ),
)


def portable_statements(face: FaceScene | AnimatableFace, stream: FapStream | None) -> tuple[Statement, ...]:
    """All statements of a file; a plain scene gets lights alone.

    Raises
    ------
    UnsupportedFeatureError, FaceDefTablesError
        If two tables drive one field of one transform, or one speaks of a transform that is not there.
    """
    built = pieces(face)
    if not isinstance(face, AnimatableFace):
        return (*lit(built.statements, face.frame), built.metadata)
    assert built.face is not None
    check_one_driver(face)
    labels = table_labels(face, definitions(built.statements))
    tables = fields_of(built.face, "fdp", "faceDefTables")
    shapes = list(dict.fromkeys(target_of(m) for table in tables for m in fields_of(table, "faceDefMesh")))
    scene, coordinates = _with_coordinates(built.statements, shapes)
    played = _playing_face(built.face, face, labels, shapes, coordinates)
    player = _player(face, stream, labels, tables)
    protos = [_playing_proto(p) for p in declarations(built.face)]
    return (*protos, *lit(scene, face.scene.frame), built.metadata, played, player)


# --- the scene ----------------------------------------------------------------------------------------------


def _with_coordinates(
    statements: tuple[Statement, ...], shapes: list[str]
) -> tuple[tuple[Statement, ...], dict[str, str]]:
    """Give the Coordinate of each of these Shapes a DEF name; normals that would stay behind are left out.

    Returns
    -------
    statements : the file. names : DEF name of a Shape -> that of its Coordinate.
    """
    known = definitions(statements)
    free = Names(known)
    faces: dict[int, str] = {}
    names: dict[str, str] = {}
    for shape in shapes:
        geometry = resolved(known[shape], "geometry", known)
        coordinate = resolved(geometry, "coord", known)
        if id(geometry) not in faces:
            faces[id(geometry)] = coordinate.def_name or free.give(f"{shape}_points")
        names[shape] = faces[id(geometry)]

    def visit(item: Any) -> Any:
        if not isinstance(item, VrmlNode):
            return item
        name = faces.get(id(item))
        body: list[BodyItem] = []
        for part in item.body:
            if isinstance(part, (Field, Interface)) and isinstance(part.value, Nodes):
                part = replace(part, value=Nodes(tuple(visit(n) for n in part.value.items), part.value.many))
            body.append(part)
        item = replace(item, body=tuple(body))
        if name is None:
            return item
        (coordinate,) = item.nodes("coord")
        if isinstance(coordinate, VrmlNode):
            item = item.with_field("coord", Nodes((replace(coordinate, def_name=name),)))
        return item.with_field("normal", None).with_field("normalIndex", None)

    return tuple(visit(s) for s in statements), names


# --- the face -----------------------------------------------------------------------------------------------


def _playing_face(
    built: VrmlNode, face: AnimatableFace, labels: list[str], shapes: list[str], coordinates: Mapping[str, str]
) -> VrmlNode:
    """The Face with what its PROTO needs besides: names, units and numbers of shapes."""
    (fdp,) = fields_of(built, "fdp")
    tables = []
    for label, table, item in zip(labels, face.tables, fdp.nodes("faceDefTables"), strict=True):
        assert isinstance(item, VrmlNode)
        meshes = fields_of(item, "faceDefMesh")
        meshes = [m.with_field("shape", number(shapes.index(target_of(m)))) for m in meshes]
        item = item.with_field("unit", number(_unit(face, table)))
        item = item.with_field("faceDefMesh", Nodes(tuple(meshes), True) if meshes else None)
        tables.append(replace(item, def_name=label))
    fdp = fdp.with_field("faceDefTables", Nodes(tuple(tables), True))
    playing = built.with_field("fdp", Nodes((fdp,)))
    playing = playing.with_field("coords", Nodes(tuple(Use(coordinates[s]) for s in shapes), True))
    return replace(playing, def_name=FACE)


def _unit(face: AnimatableFace, table: FaceDefTable) -> float:
    return face.fapu.unit(fap(table.fap_id).unit)


def _playing_proto(proto: Proto) -> Proto:
    """A declaration of the native form with the fields and the Script that play the tables.

    The Script reads the fields of tables and meshes, so that all of them are exposed.
    """
    interface = list(proto.interface)
    body = proto.body
    if proto.name in ("FaceDefTables", "FaceDefMesh"):
        interface = [replace(i, access="exposedField") for i in interface]
    if proto.name == "FaceDefMesh":
        interface.append(Interface("exposedField", "SFInt32", "shape", number(0)))
    elif proto.name == "FaceDefTables":
        interface.append(Interface("exposedField", "SFFloat", "unit", number(1)))
        interface.append(Interface("exposedField", "SFFloat", "value", number(0)))
    elif proto.name == "Face":
        # A Script's field can stand for a field of the PROTO, not for an exposedField.
        interface = [replace(i, access="field") if i.name == "fdp" else i for i in interface]
        interface.append(Interface("field", "MFNode", "coords", Empty()))
        interface.append(Interface("eventIn", "SFFloat", "set_value"))
        body = (*body, _SCRIPT)
    return replace(proto, interface=tuple(interface), body=body)


# --- the motion ---------------------------------------------------------------------------------------------


def _player(face: AnimatableFace, stream: FapStream | None, labels: list[str], tables: list[VrmlNode]) -> VrmlNode:
    """A Group with the interpolators and ROUTEs: from time to tables, from tables to the Script and to transforms."""
    parts: list[Motion] = []
    if stream is not None and len(stream):
        times, values = stream_values(face, stream)
        parts.append(Motion((clock(times, stream.frame_rate),)))
        parts += [_timed(label, times, column) for label, column in zip(labels, values.T, strict=True) if column.any()]
    for label, table, item in zip(labels, face.tables, tables, strict=True):
        if table.meshes:
            parts.append(Motion(routes=(Route(label, "value_changed", FACE, "set_value"),)))
        entries = fields_of(item, "faceDefTransform")
        for number_of_entry, (entry, turned) in enumerate(zip(table.transforms, entries, strict=True)):
            name = f"{label}_turns" if not number_of_entry else f"{label}_turns_{number_of_entry + 1}"
            made = transform_motion(face, entry, name, target_of(turned))
            parts.append(Motion(made.nodes, (Route(label, "value_changed", name, "set_fraction"), *made.routes)))
    motion = Motion.joined(parts)
    return VrmlNode("Group", (Field("children", Nodes(motion.nodes, True)), *motion.routes), PLAYER_DEF)


def _timed(label: str, times: Floats, values: Floats) -> Motion:
    made = value_motion(label, times, values)
    return replace(made, routes=(*made.routes, Route(f"{label}_values", "value_changed", label, "set_value")))
