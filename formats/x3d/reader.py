"""X3D files back to scenes and faces: ours exactly, others as their polygon meshes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fat.face import AnimatableFace
from fba.errors import InputFileError
from fba.faps import FAP_COUNT, fap
from fba.fapu import Fapu
from fba.findings import Finding
from fba.scene import FaceScene
from formats.vrml97.document import METADATA_DEF
from formats.vrml97.metadata import read_metadata
from formats.vrml97.reader import assemble
from formats.vrml97.tree import (
    Field,
    Nodes,
    Numbers,
    Strings,
    Use,
    VrmlNode,
    definitions,
    node,
    number,
    numbers,
)
from formats.x3d.displacers import fixed_slopes, slopes_of
from formats.x3d.humanoid import HUMANOID
from formats.x3d.xml_nodes import nodes_of
from formats.xml_tree import Element, read_xml

_ROW = "table: "


@dataclass(frozen=True)
class X3dDocument:
    """What the reader noticed, in plain words."""

    remarks: tuple[str, ...] = ()


def read_x3d(path: Path) -> FaceScene | AnimatableFace:
    """Read a file of any origin; see `formats.x3d.read`."""
    scene = _scene_element(path)
    findings: list[Finding] = []
    if any(child.tag == "ProtoInstance" for child in scene.all("ProtoInstance")):
        findings.append(Finding("info", "protos", "instances of PROTOs are not looked into"))
    nodes = nodes_of(scene)
    face = _stored_face(definitions(nodes), findings)
    plain = tuple(p for item in nodes for p in _plain(item))
    found = assemble((*plain, *([] if face is None else [face])), _stem(path), findings)
    remarks = tuple(f"{f.where}: {f.message}" if f.where else f.message for f in findings)
    if isinstance(found, AnimatableFace):
        return replace(found, scene=replace(found.scene, document=X3dDocument(remarks)))
    return replace(found, document=X3dDocument(remarks))


def _scene_element(path: Path) -> Element:
    root = read_xml(path)
    if root.tag != "X3D":
        raise InputFileError(f"{path} is no X3D file: its root element is <{root.tag}>, not <X3D>")
    scene = next((child for child in root.children if child.tag == "Scene"), None)
    if scene is None:
        raise InputFileError(f"{path} has no <Scene>, so there is nothing in it")
    return scene


def _stem(path: Path) -> str:
    name = path.name
    for extension in (".gz", ".x3d", ".x3dz"):
        if name.lower().endswith(extension):
            name = name[: -len(extension)]
    return name


# --- other nodes --------------------------------------------------------------------------------------------


def _plain(item: VrmlNode | Use | None) -> list[VrmlNode | Use]:
    """A node in the terms of VRML97: joints are Transforms, what segments hold stands in their place."""
    if not isinstance(item, VrmlNode):
        return [] if item is None else [item]
    if item.type == "HAnimSegment" and all(isinstance(n, Use) for n in item.nodes("coord")):
        return [p for child in item.nodes("children") for p in _plain(child)]
    if item.def_name == HUMANOID:
        joints = [n for n in item.nodes("skeleton") if isinstance(n, VrmlNode)]
        return [p for joint in joints for child in joint.nodes("children") for p in _plain(child)]
    body = []
    for part in item.body:
        if isinstance(part, Field) and isinstance(part.value, Nodes):
            part = Field(part.name, Nodes(tuple(p for n in part.value.items for p in _plain(n)), part.value.many))
        body.append(part)
    return [_renamed(replace(item, body=tuple(body)))]


def _renamed(item: VrmlNode) -> VrmlNode:
    if item.type == "HAnimHumanoid":
        bones = (*item.nodes("skeleton"), *item.nodes("skinCoord"), *item.nodes("skin"))
        for name in ("skeleton", "skin", "skinCoord", "joints", "segments", "sites"):
            item = item.with_field(name, None)
        return replace(item.with_field("children", Nodes(bones, True)), type="Transform")
    if item.type in ("HAnimJoint", "HAnimSite"):
        return replace(item.with_field("displacers", None), type="Transform")
    if item.type == "HAnimSegment":
        return replace(item.with_field("displacers", None), type="Group")
    if item.type == "IndexedTriangleSet":
        index = item.get("index")
        if isinstance(index, Numbers) and index.values.size % 3 == 0:
            corners = np.insert(index.values.reshape(-1, 3), 3, -1.0, axis=1)
            item = item.with_field("index", None).with_field("coordIndex", numbers(corners))
            return replace(item, type="IndexedFaceSet")
    return replace(item, type="Coordinate") if item.type == "CoordinateDouble" else item


# --- our own tables -----------------------------------------------------------------------------------------


def _stored_face(known: Mapping[str, VrmlNode], findings: list[Finding]) -> VrmlNode | None:
    """The Face node that the displacers and the metadata tell of; None where there is none, or it does not fit."""
    metadata = known.get(METADATA_DEF)
    info = metadata.get("info") if metadata is not None else None
    strings = info.values if isinstance(info, Strings) else ()
    rows = [text.removeprefix(_ROW) for text in strings if text.startswith(_ROW)]
    if not rows:
        return None
    fapu = read_metadata(strings, []).fapu
    try:
        if fapu is None:
            raise ValueError("the FAPUs are missing")
        tables = tuple(_table(json.loads(row), known, fapu) for row in rows)
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError) as error:
        message = f"the tables do not fit the displacers any more ({str(error)[:80]}); left out"
        findings.append(Finding("warning", "tables", message, METADATA_DEF))
        return None
    return node("Face", fdp=Nodes((node("FDP", faceDefTables=Nodes(tables, True)),)))


def _table(row: Any, known: Mapping[str, VrmlNode], fapu: Fapu) -> VrmlNode:
    fap_id = int(row["fapID"])
    if not 1 <= fap_id <= FAP_COUNT:
        raise ValueError(f"there is no FAP {fap_id}")
    unit = fapu.unit(fap(fap_id).unit)
    return node(
        "FaceDefTables",
        fapID=number(fap_id),
        highLevelSelect=number(int(row["highLevelSelect"])),
        faceDefMesh=Nodes(tuple(_mesh(mesh, known, unit) for mesh in row["meshes"]), True),
        faceDefTransform=Nodes(tuple(_transform(entry) for entry in row["transforms"]), True),
    )


def _mesh(row: Any, known: Mapping[str, VrmlNode], unit: float) -> VrmlNode:
    borders = np.array(row["borders"], dtype=np.int32)
    parts = [known[str(name)] for name in row["displacers"]]
    if borders.ndim != 1 or len(parts) != len(borders) - 1 or np.any(np.diff(borders) <= 0) or 0 not in borders:
        raise ValueError("borders and displacers do not fit")
    index = _numbers(parts[0], "coordIndex")
    offsets = [_numbers(part, "displacements").reshape(-1, 3) for part in parts]
    if any(not np.array_equal(_numbers(part, "coordIndex"), index) for part in parts):
        raise ValueError(f"the displacers of '{row['shape']}' move different vertices")
    if any(len(o) != index.size for o in offsets):
        raise ValueError(f"a displacer of '{row['shape']}' has not as many displacements as vertices")
    slopes = slopes_of(borders, np.stack(offsets), unit)
    if "fixes" in row:
        slopes = fixed_slopes(slopes, *row["fixes"])
    return node(
        "FaceDefMesh",
        faceSceneGraphNode=Nodes((Use(str(row["shape"])),)),
        intervalBorders=numbers(borders),
        coordIndex=numbers(index),
        displacements=numbers(slopes),
    )


def _numbers(item: VrmlNode, name: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    value = item.get(name)
    return value.values if isinstance(value, Numbers) else np.zeros(0)


def _transform(row: Any) -> VrmlNode:
    return node(
        "FaceDefTransform",
        faceSceneGraphNode=Nodes((Use(str(row["node"])),)),
        fieldId=number(int(row["fieldId"])),
        rotationDef=number(*map(float, row["rotationDef"])),
        scaleDef=number(*map(float, row["scaleDef"])),
        translationDef=number(*map(float, row["translationDef"])),
    )
