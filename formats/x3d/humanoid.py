"""A face as an HAnimHumanoid: transforms become joints, shapes segments, tables displacers of segments.

What drives a displacer is an interpolator whose keys are values of the table: so that piecewise linear tables play
without a Script.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fat.build import check_indices
from fat.face import AnimatableFace
from fat.tables import FaceDefMesh, FaceDefTable
from fba.errors import FaceDefTablesError
from fba.faps import FAP_COUNT, fap
from fba.scene import FaceScene
from fba.stream import FapStream
from formats.targets import border_weights
from formats.vrml97.axes import turn_axis, turn_point, turn_sizes
from formats.vrml97.merge import merge
from formats.vrml97.metadata import metadata_node
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
from formats.vrml97.portable_scene import lit
from formats.vrml97.tree import Nodes, Route, Statement, Strings, Use, VrmlNode, definitions, node, numbers
from formats.x3d.displacers import BorderOffsets, border_offsets

HUMANOID = "fba_humanoid"
"""DEF name of the HAnimHumanoid; its one root joint holds the scene."""

_PASSED = (-(2.0**20), -(2.0**11), 0.0, 2.0**11, 2.0**20)
"""Keys of an interpolator that gives what it gets: near to 0 to a ten-thousandth of a FAP unit also in float32."""

_BEYOND = 10.0
"""Interpolators go on beyond the last borders as far as this many times their range."""


def x3d_statements(face: FaceScene | AnimatableFace, stream: FapStream | None) -> tuple[Statement, ...]:
    """Nodes and ROUTEs of a file.

    Raises
    ------
    UnsupportedFeatureError, FaceDefTablesError
        If two tables drive one field of one transform; if a table speaks of what is not there.
    """
    scene = face.scene if isinstance(face, AnimatableFace) else face
    scene = replace(scene, document=None)
    statements, def_names = merge(scene)
    if not isinstance(face, AnimatableFace):
        return (*lit(statements, scene.frame), metadata_node(scene, def_names))
    face = replace(face, scene=scene)
    check_one_driver(face)
    tables = _Tables(face, def_names, stream)
    roots = {def_names[root.name] for root in scene.roots}
    bones = [_bone(s, tables) for s in statements if isinstance(s, VrmlNode) and s.def_name in roots]
    others = tuple(s for s in statements if not (isinstance(s, VrmlNode) and s.def_name in roots))
    metadata = metadata_node(face, def_names)
    info = metadata.get("info")
    assert isinstance(info, Strings)
    metadata = metadata.with_field("info", Strings((*info.values, *tables.rows), True))
    motion = Motion.joined(tables.motions)
    return (*lit(others, scene.frame), metadata, _humanoid(scene.name, bones), *motion.nodes, *motion.routes)


def _humanoid(name: str, bones: list[VrmlNode]) -> VrmlNode:
    root = node("HAnimJoint", f"{HUMANOID}_root", name=Strings(("humanoid_root",)), children=Nodes(tuple(bones), True))
    below = definitions([root]).values()
    uses = {
        field: Nodes(tuple(Use(n.def_name) for n in below if n.type == kind and n.def_name), True)
        for field, kind in (("joints", "HAnimJoint"), ("segments", "HAnimSegment"))
    }
    return node(
        "HAnimHumanoid",
        HUMANOID,
        name=Strings((name,)),
        version=Strings(("2.0",)),
        skeleton=Nodes((root,), True),
        **uses,
    )


def _bone(item: VrmlNode, tables: _Tables) -> VrmlNode:
    """A Transform as a joint, a Shape as a segment."""
    assert item.def_name is not None
    if item.type == "Shape":
        return _segment(item, tables)
    children = tuple(_bone(c, tables) for c in item.nodes("children") if isinstance(c, VrmlNode))
    joint = item.with_field("children", Nodes(children, True)).with_field("name", Strings((item.def_name,)))
    return replace(joint, type="HAnimJoint")


def _segment(item: VrmlNode, tables: _Tables) -> VrmlNode:
    name = item.def_name
    assert name is not None
    segment = tables.names.give(f"{name}_segment")
    displacers = tables.displacers.get(name)
    if not displacers:
        return node("HAnimSegment", segment, name=Strings((name,)), children=Nodes((item,), True))
    (geometry,) = item.nodes("geometry")
    assert isinstance(geometry, VrmlNode)
    (coordinate,) = geometry.nodes("coord")
    assert isinstance(coordinate, VrmlNode)
    points = tables.names.give(f"{name}_points")
    geometry = geometry.with_field("coord", Nodes((replace(coordinate, def_name=points),)))
    return node(
        "HAnimSegment",
        segment,
        name=Strings((name,)),
        children=Nodes((item.with_field("geometry", Nodes((geometry,))),), True),
        coord=Nodes((Use(points),)),
        displacers=Nodes(tuple(displacers), True),
    )


@dataclass(frozen=True)
class _Place:
    """A table on its way into the file: the DEF name of what takes its value, and its unit."""

    table: FaceDefTable
    label: str
    unit: float


class _Tables:
    """The tables as nodes.

    Attributes
    ----------
    displacers : DEF name of a Shape -> its displacers. motions : all interpolators. rows : what `stored_face` reads.
    """

    def __init__(self, face: AnimatableFace, def_names: dict[str, str], stream: FapStream | None) -> None:
        self.face = face
        self.def_names = def_names
        self.counts = {s.name: s.mesh.vertex_count for s in face.scene.shapes}
        self.labels = table_labels(face, def_names.values())
        self.names = Names([*def_names.values(), *self.labels])
        self.displacers: dict[str, list[VrmlNode]] = {}
        self.motions: list[Motion] = []
        self.rows: list[str] = []
        values = np.zeros((0, len(self.labels)))
        if stream is not None and len(stream):
            times, values = stream_values(face, stream)
            self.motions.append(Motion((clock(times, stream.frame_rate),)))
        for number_of_table, (table, label) in enumerate(zip(face.tables, self.labels, strict=True)):
            if not 1 <= table.fap_id <= FAP_COUNT:
                raise FaceDefTablesError(f"fapID {table.fap_id} is not one of 1..{FAP_COUNT}")
            column = values[:, number_of_table]
            entry = node("ScalarInterpolator", label, key=numbers(_PASSED), keyValue=numbers(_PASSED))
            self.motions.append(Motion((entry,)))
            if column.any():
                given = Route(f"{label}_values", "value_changed", label, "set_fraction")
                self.motions += [value_motion(label, times, column), Motion(routes=(given,))]
            self._add(_Place(table, label, face.fapu.unit(fap(table.fap_id).unit)))

    def _add(self, place: _Place) -> None:
        weights: dict[tuple[bytes, int], str] = {}
        row: dict[str, Any] = {"fapID": place.table.fap_id, "highLevelSelect": place.table.high_level_select}
        row["meshes"] = [self._mesh(mesh, place, weights) for mesh in place.table.meshes]
        row["transforms"] = self._transforms(place)
        self.rows.append(f"table: {json.dumps(row, separators=(',', ':'))}")

    def _mesh(self, mesh: FaceDefMesh, place: _Place, weights: dict[tuple[bytes, int], str]) -> dict[str, Any]:
        check_indices(place.table, mesh, self.counts)
        found = border_offsets(mesh, place.unit, self.face.scene.frame)
        if not np.isfinite(found.offsets).all():
            raise FaceDefTablesError(f"{place.table.name}: displacements of '{mesh.shape}' are not finite numbers")
        shape = self.def_names[mesh.shape]
        made = [self._displacer(mesh, found, k, place, weights) for k in range(len(found.borders))]
        self.displacers.setdefault(shape, []).extend(made)
        row: dict[str, Any] = {"shape": shape, "borders": mesh.interval_borders.tolist()}
        row["displacers"] = [item.def_name for item in made]
        if found.fixes[0].size:
            row["fixes"] = [found.fixes[0].tolist(), found.fixes[1].astype(np.float64).tolist()]
        return row

    def _displacer(
        self, mesh: FaceDefMesh, found: BorderOffsets, k: int, place: _Place, weights: dict[tuple[bytes, int], str]
    ) -> VrmlNode:
        """The displacer of one border, and the interpolator of its weight, which displacers of other shapes share."""
        border = int(found.borders[k])
        name = f"{place.label}_{'neg_' if border < 0 else ''}{abs(border)}"
        key = (mesh.interval_borders.tobytes(), border)
        routes: list[Route] = []
        nodes: tuple[VrmlNode, ...] = ()
        if key not in weights:
            weights[key] = self.names.give(f"{name}_weight")
            nodes = (_weight(weights[key], mesh, border),)
            routes.append(Route(place.label, "value_changed", weights[key], "set_fraction"))
        given = self.names.give(f"{name}_{self.def_names[mesh.shape]}")
        routes.append(Route(weights[key], "value_changed", given, "set_weight"))
        self.motions.append(Motion(nodes, tuple(routes)))
        return node(
            "HAnimDisplacer",
            given,
            name=Strings((name,)),
            coordIndex=numbers(mesh.coord_index),
            displacements=numbers(found.offsets[k]),
        )

    def _transforms(self, place: _Place) -> list[dict[str, Any]]:
        rows = []
        turn = self.face.scene.frame.to_file
        for entry in place.table.transforms:
            target = self.def_names[entry.transform]
            motion = transform_motion(self.face, entry, self.names.give(f"{place.label}_turns"), target)
            route = Route(place.label, "value_changed", motion.nodes[0].def_name or "", "set_fraction")
            self.motions.append(Motion(motion.nodes, (route, *motion.routes)))
            row: dict[str, Any] = {"node": target, "fieldId": int(entry.field)}
            row["rotationDef"] = [*turn_axis(entry.rotation_def[:3], turn), entry.rotation_def[3]]
            row["scaleDef"] = turn_sizes(entry.scale_def, turn)
            row["translationDef"] = turn_point(entry.translation_def, turn)
            rows.append(row)
        return rows


def _weight(name: str, mesh: FaceDefMesh, border: int) -> VrmlNode:
    """From values of a table to the weight of the displacer at one border."""
    borders = mesh.interval_borders
    far = _BEYOND * float(borders[-1] - borders[0])
    key = np.concatenate([[borders[0] - far], borders, [borders[-1] + far]])
    weights = border_weights(borders, key)[:, int(np.searchsorted(borders, border))]
    return node("ScalarInterpolator", name, key=numbers(key), keyValue=numbers(weights + 0.0))
