"""The Face node of ISO/IEC 14496-1 and the toolkit's tables: both directions."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fat.face import AnimatableFace
from fat.tables import FaceDefMesh, FaceDefTable, FaceDefTables, FaceDefTransform, TransformField
from fba.arrays import Floats, Ints
from fba.errors import FaceDefTablesError, FbaError, LandmarkError
from fba.faps import EXPRESSION_FAP, LOW_LEVEL_FAPS, VISEME_FAP, fap
from fba.feature_points import standard_feature_points
from fba.scene import FaceScene, Frame, Shape
from formats.vrml97.axes import turn_axis, turn_point, turn_sizes
from formats.vrml97.geometry import Definitions, child, fixed, resolve, values_of
from formats.vrml97.printer import shortest_float32
from formats.vrml97.tree import (
    Nodes,
    Numbers,
    Use,
    VrmlNode,
    node,
    number,
    numbers,
)

MISSING = 3.4028235e38
"""Coordinate of a feature point that the face lacks. The standard writes +I, which neither VRML97 nor BT text can
say in a vector; the largest float32 is what MPEG-4 decoders hold for it."""

_FAP_FIELDS = {
    6: "stretch_l_corner",
    7: "stretch_r_corner",
    10: "lower_b_lip_lm",
    11: "lower_b_lip_rm",
    53: "stretch_l_cornerlip",
    54: "stretch_r_cornerlip",
}
"""Fields of the FAP node that are spelled otherwise than the FAP in ISO/IEC 14496-2."""

_FAR = 1e38


def fap_field(number_of_fap: int) -> str:
    """Name of the FAP node's field for a low-level FAP.

    >>> fap_field(3), fap_field(6)
    ('open_jaw', 'stretch_l_corner')
    """
    return _FAP_FIELDS.get(number_of_fap, fap(number_of_fap).name)


# --- writing ------------------------------------------------------------------------------------------------


def face_node(face: AnimatableFace, def_names: Mapping[str, str], scene_graph: Nodes) -> VrmlNode:
    """The Face node; `scene_graph` is what faceSceneGraph holds."""
    coordinate = node("Coordinate", point=numbers(_calibration_points(face)))
    tables = tuple(_table_node(t, def_names, face.scene.frame) for t in face.tables)
    fdp = node(
        "FDP",
        featurePointsCoord=Nodes((coordinate,)),
        faceSceneGraph=scene_graph,
        faceDefTables=Nodes(tables, True),
    )
    return node("Face", fap=Nodes((_fap_node(face.tables),)), fdp=Nodes((fdp,)))


def _calibration_points(face: AnimatableFace) -> Floats:
    """(84, 3) positions of the standard's points in the file's axes, MISSING where there is none."""
    shapes = {s.name for s in face.scene.shapes}
    for key, point in face.feature_points.items():
        if point.shape is not None and point.shape not in shapes:
            raise LandmarkError(f"feature point {key} lies on '{point.shape}', which is not in the scene")
    positions = face.feature_points.positions(face.scene)
    frame = face.scene.frame
    rows = [frame.to_file(positions[i]) if i in positions else [MISSING] * 3 for i in standard_feature_points()]
    return np.array(rows, dtype=np.float64)


def _fap_node(tables: FaceDefTables) -> VrmlNode:
    """Neutral values for every FAP that has a table; all others stay "not initialised"."""
    keys = {t.fap_id for t in tables}
    fields: dict[str, Nodes | Numbers] = {}
    if VISEME_FAP in keys:
        fields["viseme"] = Nodes((node("Viseme"),))
    if EXPRESSION_FAP in keys:
        fields["expression"] = Nodes((node("Expression"),))
    for k in LOW_LEVEL_FAPS:
        if k in keys:
            fields[fap_field(k)] = number(0)
    return node("FAP", **fields)


def _table_node(table: FaceDefTable, def_names: Mapping[str, str], frame: Frame) -> VrmlNode:
    meshes = tuple(_mesh_node(m, def_names, frame) for m in table.meshes)
    transforms = tuple(_transform_node(t, def_names, frame) for t in table.transforms)
    return node(
        "FaceDefTables",
        fapID=number(table.fap_id),
        highLevelSelect=number(table.high_level_select),
        faceDefMesh=Nodes(meshes, True) if meshes else None,
        faceDefTransform=Nodes(transforms, True) if transforms else None,
    )


def _target(name: str, def_names: Mapping[str, str]) -> Nodes:
    if name not in def_names:
        raise FaceDefTablesError(f"a table refers to '{name}', which is not in the scene")
    return Nodes((Use(def_names[name]),))


def _mesh_node(table: FaceDefMesh, def_names: Mapping[str, str], frame: Frame) -> VrmlNode:
    slopes = frame.to_file(table.displacements.astype(np.float64)).astype(np.float32)
    return node(
        "FaceDefMesh",
        faceSceneGraphNode=_target(table.shape, def_names),
        intervalBorders=numbers(table.interval_borders),
        coordIndex=numbers(table.coord_index),
        displacements=numbers(shortest_float32(slopes)),
    )


def _transform_node(table: FaceDefTransform, def_names: Mapping[str, str], frame: Frame) -> VrmlNode:
    turn = frame.to_file
    rotation = (*turn_axis(table.rotation_def[:3], turn), table.rotation_def[3])
    scale, translation = turn_sizes(table.scale_def, turn), turn_point(table.translation_def, turn)
    default = FaceDefTransform("")
    return node(
        "FaceDefTransform",
        faceSceneGraphNode=_target(table.transform, def_names),
        fieldId=number(int(table.field)),
        rotationDef=number(*rotation) if rotation != default.rotation_def else None,
        scaleDef=number(*scale) if scale != default.scale_def else None,
        translationDef=number(*translation) if translation != default.translation_def else None,
    )


# --- reading ------------------------------------------------------------------------------------------------


def fdp_of(faces: tuple[VrmlNode, ...], defs: Definitions) -> VrmlNode | None:
    """The first FDP that holds tables; None if no Face of the file has any."""
    for face in faces:
        fdp = child(face, "fdp", defs)
        if fdp is not None and fdp.nodes("faceDefTables"):
            return fdp
    return None


def referred_names(fdp: VrmlNode, defs: Definitions) -> set[str]:
    """DEF names that FaceDefTransforms refer to."""
    found: set[str] = set()
    for table in _tables(fdp, defs):
        for entry in table.nodes("faceDefTransform"):
            target = resolve(entry, defs)
            for item in () if target is None else target.nodes("faceSceneGraphNode"):
                name = item.name if isinstance(item, Use) else item.def_name
                if name is not None:
                    found.add(name)
    return found


def _tables(fdp: VrmlNode, defs: Definitions) -> list[VrmlNode]:
    found = [resolve(i, defs) for i in fdp.nodes("faceDefTables")]
    return [t for t in found if t is not None and t.type == "FaceDefTables"]


class TableReader:
    """Read FaceDefTables of one file.

    Parameters
    ----------
    scene_names : DEF name -> name of the shape or transform in the scene.
    geometry_names : DEF name of an IndexedFaceSet -> name of the shape around it.
    """

    def __init__(
        self,
        scene: FaceScene,
        defs: Definitions,
        scene_names: Mapping[str, str],
        geometry_names: Mapping[str, str],
    ) -> None:
        self.scene = scene
        self.defs = defs
        self.scene_names = scene_names
        self.geometry_names = geometry_names
        self.shapes = {s.name: s for s in scene.shapes}
        self.below: dict[str, list[str]] = {t.name: [] for t in scene.transforms}
        for part, above in scene.walk():
            for transform in above if isinstance(part, Shape) else ():
                self.below[transform.name].append(part.name)

    def read(self, fdp: VrmlNode) -> FaceDefTables:
        """All tables; several for one FAP are put together.

        Raises
        ------
        FaceDefTablesError
            With the line, if a table contradicts itself or refers to nothing in the scene.
        """
        merged: dict[tuple[int, int], FaceDefTable] = {}
        for entry in _tables(fdp, self.defs):
            table = self.table(entry)
            before = merged.get(table.key)
            if before is not None:
                meshes = (*before.meshes, *table.meshes)
                transforms = (*before.transforms, *table.transforms)
                table = FaceDefTable(before.fap_id, before.high_level_select, meshes, transforms)
            merged[table.key] = table
        return FaceDefTables(tuple(merged.values()))

    def table(self, entry: VrmlNode) -> FaceDefTable:
        number_of_fap = self.integer(entry, "fapID", 1)
        select = self.integer(entry, "highLevelSelect", 1)
        if not 1 <= number_of_fap <= 68:
            raise FaceDefTablesError(f"line {entry.line}: fapID {number_of_fap} is not 1 to 68")
        meshes = [resolve(i, self.defs) for i in entry.nodes("faceDefMesh")]
        transforms = [resolve(i, self.defs) for i in entry.nodes("faceDefTransform")]
        return FaceDefTable(
            number_of_fap,
            select,
            tuple(self.mesh(m) for m in meshes if m is not None),
            tuple(self.transform(t) for t in transforms if t is not None),
        )

    def integer(self, owner: VrmlNode, name: str, default: int) -> int:
        value = fixed(owner, name, (float(default),))[0]
        if abs(value) > 2**31 - 1 or value != int(value):
            raise FaceDefTablesError(f"line {owner.line}: {owner.type}.{name} must be an integer, not {value:g}")
        return int(value)

    def integers(self, owner: VrmlNode, name: str) -> Ints:
        values = values_of(owner, name, 1)
        flat = np.zeros(0) if values is None else values[:, 0]
        if np.any(np.abs(flat) > 2**31 - 1) or np.any(flat != np.rint(flat)):
            raise FaceDefTablesError(f"line {owner.line}: {owner.type}.{name} must hold integers")
        return flat.astype(np.int32)

    def mesh(self, entry: VrmlNode) -> FaceDefMesh:
        name = self.shape_name(entry)
        index = self.integers(entry, "coordIndex")
        count = self.shapes[name].mesh.vertex_count
        if index.size and (index.min() < 0 or index.max() >= count):
            raise FaceDefTablesError(
                f"line {entry.line}: coordIndex of the FaceDefMesh of '{name}' runs from {index.min()} to "
                f"{index.max()}, but the shape has {count} vertices"
            )
        slopes = values_of(entry, "displacements", 3)
        turned = self.scene.frame.from_file(np.zeros((0, 3)) if slopes is None else slopes)
        with np.errstate(over="ignore"):
            short = turned.astype(np.float32)
        if not np.all(np.isfinite(short)):
            raise FaceDefTablesError(f"line {entry.line}: a displacement of '{name}' does not fit float32")
        try:
            return FaceDefMesh(name, self.integers(entry, "intervalBorders"), index, short)
        except FbaError as error:
            raise FaceDefTablesError(f"line {entry.line}: {error}") from None

    def transform(self, entry: VrmlNode) -> FaceDefTransform:
        name = self.scene_names.get(self.target(entry) or "")
        if name not in self.below:
            raise FaceDefTablesError(f"line {entry.line}: this FaceDefTransform does not refer to a Transform by USE")
        field = self.integer(entry, "fieldId", 1)
        if field not in (1, 2, 3):
            raise FaceDefTablesError(f"line {entry.line}: fieldId {field} is not 1, 2 or 3")
        turn = self.scene.frame.from_file
        x, y, z, angle = fixed(entry, "rotationDef", (0.0, 0.0, 1.0, 0.0))
        return FaceDefTransform(
            name,
            TransformField(field),
            (*turn_axis((x, y, z), turn), angle),
            turn_sizes(fixed(entry, "scaleDef", (1.0, 1.0, 1.0)), turn),
            turn_point(fixed(entry, "translationDef", (0.0, 0.0, 0.0)), turn),
        )

    def target(self, entry: VrmlNode) -> str | None:
        """DEF name of what an entry refers to."""
        for item in entry.nodes("faceSceneGraphNode"):
            return item.name if isinstance(item, Use) else item.def_name
        return None

    def shape_name(self, entry: VrmlNode) -> str:
        """The shape that a FaceDefMesh means: a Shape, its IndexedFaceSet, or a group with one shape below it."""
        target = self.target(entry)
        name = self.scene_names.get(target or "", self.geometry_names.get(target or ""))
        if name in self.shapes:
            return name
        if name in self.below:
            below = self.below[name]
            if len(below) == 1:
                return below[0]
            raise FaceDefTablesError(
                f"line {entry.line}: a FaceDefMesh refers to '{target}', which holds {len(below)} shapes; "
                "it must refer to one Shape"
            )
        raise FaceDefTablesError(
            f"line {entry.line}: a FaceDefMesh refers to '{target}', which is no polygon mesh of the scene"
        )


def calibration_points(fdp: VrmlNode, defs: Definitions) -> dict[str, Floats]:
    """Feature point id -> (3,) in the file's axes, from featurePointsCoord; missing points are left out."""
    owner = child(fdp, "featurePointsCoord", defs)
    value = owner.get("point") if owner is not None else None
    if not isinstance(value, Numbers) or value.values.size % 3:
        return {}
    rows = value.values.reshape(-1, 3)
    pairs = zip(standard_feature_points(), rows, strict=False)
    return {i: row for i, row in pairs if np.all(np.isfinite(row)) and np.all(np.abs(row) < _FAR)}
