"""What can be wrong with the Facial Animation Tables of a face, in plain words."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fat.face import AnimatableFace
from fat.intervals import interval_weights
from fat.tables import FaceDefMesh, FaceDefTable, FaceDefTransform, TransformField
from fba.errors import LandmarkError
from fba.faps import EXPRESSION_FAP, FAP_COUNT, LOW_LEVEL_FAPS, VISEME_FAP, Unit, fap
from fba.fapu import FAPU_POINTS, Fapu
from fba.feature_points import FeaturePoint, FeaturePoints, standard_feature_points
from fba.findings import Finding
from fba.high_level import BLEND_MAX, EXPRESSIONS, VISEMES
from fba.scene import FaceScene

HUGE = 3.0
"""Eye separations: no FAP moves any part of a face farther (a wide-open jaw takes the chin about one)."""

MAX_SELECT = 64
"""highLevelSelect has 6 bits: 1..64."""

_MAX_RATIO = 1.05
"""FAPUs that the tables use and those that the feature points give may differ by this factor without a word."""


def validate(face: AnimatableFace) -> list[Finding]:
    """Check the tables of a face against the standard and against the face's own scene.

    Returns
    -------
    Errors (a player fails, or the motion is nonsense), warnings (plays, but not as one would expect) and facts, in
    the order: whole face, then table by table. No errors means that `fat.evaluate.Player` takes the face.
    """
    findings = [*_names(face.scene), *_fapu(face), *_points(face), *_absent(face)]
    for table in face.tables:
        findings += _table(face, table)
    return [*findings, *_fields(face)]


def _names(scene: FaceScene) -> Iterator[Finding]:
    names = [node.name for node, _ in scene.walk()]
    for name in sorted({n for n in names if names.count(n) > 1}):
        message = f"{names.count(name)} nodes are called '{name}'; tables cannot tell them apart: rename them"
        yield Finding("error", "duplicate-name", message, name)


def _fapu(face: AnimatableFace) -> Iterator[Finding]:
    fields = ("irisd0", "es0", "ens0", "mns0", "mw0")
    bad = [n.upper() for n in fields if not (np.isfinite(getattr(face.fapu, n)) and getattr(face.fapu, n) > 0)]
    if bad:
        message = f"{', '.join(bad)} must be positive numbers; check the feature points they are measured from"
        yield Finding("error", "fapu", message)
        return
    points = face.feature_points
    if not all(i in points and _fits(face.scene, points[i]) for i in FAPU_POINTS):
        return
    try:
        needed = FeaturePoints({i: points[i] for i in FAPU_POINTS})
        measured = Fapu.from_feature_points(needed.positions(face.scene))
    except LandmarkError as error:
        yield Finding("error", "fapu", str(error))
        return
    for name in fields:
        used, found = getattr(face.fapu, name), getattr(measured, name)
        if max(used / found, found / used) > _MAX_RATIO:
            message = (
                f"the tables use {name.upper()} = {used:.4g}, the feature points give {found:.4g}: a player that "
                f"measures the face itself moves it by {found / used:.2f} times the intended amount"
            )
            yield Finding("warning", "fapu-differs", message)


def _points(face: AnimatableFace) -> Iterator[Finding]:
    missing = [i for i in FAPU_POINTS if i not in face.feature_points]
    if missing:
        message = f"feature points {', '.join(missing)} are missing; players need them to measure the FAPUs"
        yield Finding("warning", "fapu-points", message)
    others = [i for i in standard_feature_points() if i not in face.feature_points and i not in missing]
    if others:
        message = f"not given, of the standard's 84 feature points: {', '.join(others)}"
        yield Finding("info", "feature-points", message)
    for key, point in face.feature_points.items():
        if not _fits(face.scene, point):
            message = f"{key} names vertices of '{point.shape}' that are not in the scene; it belongs to another mesh"
            yield Finding("error", "feature-point", message, key)


def _fits(scene: FaceScene, point: FeaturePoint) -> bool:
    """Whether a point names a shape of the scene and vertices of it."""
    counts = {s.name: s.mesh.vertex_count for s in scene.shapes}
    return point.shape is None or all(0 <= v < counts.get(point.shape, 0) for v in point.vertices)


def _absent(face: AnimatableFace) -> Iterator[Finding]:
    keys = {t.key for t in face.tables}
    if not keys:
        yield Finding("error", "no-tables", "the face has no tables: nothing moves")
        return
    groups = (
        ("FAPs", [f"{k} {fap(k).name}" for k in LOW_LEVEL_FAPS if (k, 1) not in keys]),
        ("visemes", [v.name for v in VISEMES if (VISEME_FAP, v.id) not in keys]),
        ("expressions", [e.name for e in EXPRESSIONS if (EXPRESSION_FAP, e.id) not in keys]),
    )
    for what, missing in groups:
        if missing:
            message = f"{len(missing)} {what} have no table and do nothing: {', '.join(missing)}"
            yield Finding("info", f"absent-{what.lower()}", message)


def _table(face: AnimatableFace, table: FaceDefTable) -> Iterator[Finding]:
    number, select = table.fap_id, table.high_level_select
    if not 1 <= number <= FAP_COUNT:
        yield Finding("error", "fap-id", f"fapID {number} is not one of 1..{FAP_COUNT}", f"fapID {number}")
        return
    where = table.name
    names: dict[int, tuple[str, int]] = {
        VISEME_FAP: ("viseme", len(VISEMES)),
        EXPRESSION_FAP: ("expression", len(EXPRESSIONS)),
    }
    if number in names:
        what, count = names[number]
        if not 1 <= select <= MAX_SELECT:
            yield Finding(
                "error", "high-level-select", f"highLevelSelect {select} does not fit in 1..{MAX_SELECT}", where
            )
        elif select > count:
            message = f"highLevelSelect {select}: the standard has only {count} {what}s, so no stream asks for it"
            yield Finding("warning", "high-level-select", message, where)
    elif select != 1:
        message = f"highLevelSelect is {select} on a low-level FAP, where it has no meaning; write 1"
        yield Finding("warning", "high-level-select", message, where)
    if not table.meshes and not table.transforms:
        yield Finding("warning", "empty-table", "the table moves nothing", where)
    for mesh in table.meshes:
        yield from _mesh(face, table, mesh)
    for transform in table.transforms:
        yield from _transform(face.scene, table, transform)


def _mesh(face: AnimatableFace, table: FaceDefTable, mesh: FaceDefMesh) -> Iterator[Finding]:
    where = f"{table.name} on '{mesh.shape}'"
    counts = {s.name: s.mesh.vertex_count for s in face.scene.shapes}
    index = mesh.coord_index
    if mesh.shape not in counts:
        yield Finding("error", "unknown-shape", f"there is no shape '{mesh.shape}' in the scene", where)
    elif index.size and (int(index.min()) < 0 or int(index.max()) >= counts[mesh.shape]):
        outside = int(np.count_nonzero((index < 0) | (index >= counts[mesh.shape])))
        message = (
            f"{outside} of {index.size} entries of coordIndex are not vertices of '{mesh.shape}', which has "
            f"{counts[mesh.shape]}; the table belongs to another mesh"
        )
        yield Finding("error", "vertex-index", message, where)
    twice = index.size - np.unique(index).size
    if twice:
        message = (
            f"{twice} vertices are named twice in coordIndex; here they move by the sum, in other players perhaps not"
        )
        yield Finding("warning", "duplicate-index", message, where)
    yield from _borders(table, mesh, where)
    yield from _amounts(face, table, mesh, where)


def _borders(table: FaceDefTable, mesh: FaceDefMesh, where: str) -> Iterator[Finding]:
    borders = mesh.interval_borders.tolist()
    low, high = fap(table.fap_id).i_range
    if table.fap_id <= EXPRESSION_FAP:
        low, high = 0, BLEND_MAX
    outside = [b for b in borders if not low <= b <= high]
    if outside:
        message = (
            f"interval borders {', '.join(map(str, outside))} lie outside {low}..{high}, the values that a stream can "
            "carry in an intra frame"
        )
        yield Finding("warning", "border-range", message, where)
    if borders[-1] <= 0:
        message = (
            f"all intervals {borders} are negative: by the standard's words players disagree on the sign of such a "
            "table; add an interval above 0"
        )
        yield Finding("warning", "negative-interval", message, where)


def _amounts(face: AnimatableFace, table: FaceDefTable, mesh: FaceDefMesh, where: str) -> Iterator[Finding]:
    bad = int(np.count_nonzero(~np.isfinite(mesh.displacements).all(axis=(1, 2))))
    if bad:
        yield Finding("error", "not-finite", f"the displacements of {bad} vertices are not finite numbers", where)
        return
    unit = face.fapu.unit(fap(table.fap_id).unit)
    if not mesh.coord_index.size or not (np.isfinite(face.fapu.es0) and face.fapu.es0 > 0):
        return
    weights = interval_weights(mesh.interval_borders, mesh.interval_borders) * unit
    reach = np.einsum("kjc,bj->bkc", mesh.displacements.astype(np.float64), weights)
    if mesh.shape in {s.name for s in face.scene.shapes}:
        reach = reach @ face.scene.world_matrix(mesh.shape)[:3, :3].T
    largest = float(np.linalg.norm(reach, axis=2).max()) / face.fapu.es0
    if largest > HUGE:
        message = (
            f"a vertex moves by {largest:.3g} eye separations; more than {HUGE:g} cannot be meant: check the FAPUs, "
            "and whether the displacements are slopes in FAPU per FAP unit"
        )
        yield Finding("warning", "huge", message, where)
    elif largest == 0.0:
        yield Finding("info", "no-motion", "all displacements are zero", where)


def _transform(scene: FaceScene, table: FaceDefTable, entry: FaceDefTransform) -> Iterator[Finding]:
    where = f"{table.name} on '{entry.transform}'"
    node = next((t for t in scene.transforms if t.name == entry.transform), None)
    if node is None:
        yield Finding("error", "unknown-transform", f"there is no Transform '{entry.transform}' in the scene", where)
        return
    numbers = (*entry.rotation_def, *entry.scale_def, *entry.translation_def)
    if not np.isfinite(numbers).all():
        yield Finding("error", "not-finite", "its definition holds values that are not finite numbers", where)
    elif entry.field is TransformField.SCALE:
        message = (
            "scale is driven: by the standard the scale is FAP x scaleDef, which is 0 (the part vanishes) at FAP 0; "
            "some players will do that. Use a FaceDefMesh"
        )
        yield Finding("warning", "scale-field", message, where)
    elif entry.field is TransformField.ROTATION and not any(entry.rotation_def[:3]):
        yield Finding("error", "null-axis", "the axis of rotationDef is 0 0 0", where)
    elif entry.field is TransformField.ROTATION and fap(table.fap_id).unit is not Unit.AU:
        message = (
            f"a rotation is driven by a FAP that is no angle ({fap(table.fap_id).unit or 'no unit'}): it turns by "
            "1e-5 rad for each unit, which is very little"
        )
        if abs(entry.rotation_def[3]) < 10.0:
            yield Finding("warning", "rotation-unit", message, where)
    rest = {
        TransformField.ROTATION: node.rotation[3] == 0.0,
        TransformField.TRANSLATION: not any(node.translation),
        TransformField.SCALE: node.scale == (1.0, 1.0, 1.0),
    }
    if not rest[entry.field]:
        message = (
            f"the neutral face already uses the {entry.field.name.lower()} of this Transform, which the FAP "
            "overwrites: the part jumps when the FAP leaves 0. Put the rest pose into a parent Transform"
        )
        yield Finding("warning", "rest-field", message, where)


def _fields(face: AnimatableFace) -> Iterator[Finding]:
    """Fields of one Transform that several FAPs set at the same time."""
    users: dict[tuple[str, TransformField], list[str]] = {}
    for table in face.tables:
        if 1 <= table.fap_id <= FAP_COUNT:
            for entry in table.transforms:
                users.setdefault((entry.transform, entry.field), []).append(table.name)
    for (name, field), tables in users.items():
        if len(tables) > 1:
            message = (
                f"{', '.join(tables)} all set its {field.name.lower()}; each overwrites the others, so only the last "
                "one shows: nest one Transform for each FAP"
            )
            yield Finding("warning", "shared-field", message, name)
