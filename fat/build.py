"""From motions to Facial Animation Tables, and back."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

import numpy as np

from fat.face import AnimatableFace
from fat.intervals import interval_weights
from fat.motion import FaceMotion
from fat.tables import FaceDefMesh, FaceDefTable, FaceDefTables, FaceDefTransform, table_name
from fba.arrays import Floats, Floats32, Ints
from fba.errors import FaceDefTablesError
from fba.faps import FAP_COUNT, fap
from fba.fapu import Fapu
from fba.scene import FaceScene

SMALLEST_SHARE = 10.0
"""A dropped offset stays below ``10 x threshold`` of the largest offset of its motion, so that motions far
smaller than the eye separation keep theirs."""

Key = tuple[int, int]


def build_tables(
    scene: FaceScene,
    fapu: Fapu,
    motions: Iterable[FaceMotion],
    transforms: Mapping[Key, Sequence[FaceDefTransform]] | None = None,
    threshold: float = 1e-5,
) -> FaceDefTables:
    """Turn motions into Facial Animation Tables.

    Parameters
    ----------
    scene : the neutral face.
    fapu : its units; visemes and expressions have the unit 1.
    motions : offsets at FAP values; those of one FAP (viseme, expression) become the borders of its intervals.
        A shape that is absent from one of them does not move at that value.
    transforms : (fap_id, select) -> FaceDefTransforms that the same tables get.
    threshold : vertices whose offset stays below ``threshold * ES0`` (and below a ten times larger part of
        the motion's own largest offset) at every value are left out.

    Returns
    -------
    One table for each key that moves anything.

    Raises
    ------
    FaceDefTablesError
        If a motion has no FAP, the value 0, an unknown shape, offsets of a wrong shape or not finite, or if
        two motions hold for the same value of the same FAP.

    Notes
    -----
    Where only negative values are given, one interval of the same length as the innermost is added above zero
    with the opposite slope. The standard's rule for a single interval and its rule for negative values differ in
    sign on a lone ``[-a 0]``; with the mirrored interval every reading gives the same straight line, which is
    also what a lone ``[0 a]`` gives below zero.
    """
    groups: dict[Key, dict[int, FaceMotion]] = {}
    for motion in motions:
        key = _key(motion)
        if motion.value in groups.setdefault(key, {}):
            raise FaceDefTablesError(f"two motions for {table_name(*key)} at the value {motion.value}; keep one")
        groups[key][motion.value] = motion
    moved: Mapping[Key, Sequence[FaceDefTransform]] = transforms or {}
    inverse = {s.name: _inverse_linear(scene, s.name) for s in scene.shapes}
    counts = {s.name: s.mesh.vertex_count for s in scene.shapes}
    tables = []
    for key in sorted({*groups, *moved}):
        meshes: tuple[FaceDefMesh, ...] = ()
        if key in groups:
            _check(groups[key].values(), counts)
            unit = fapu.unit(fap(key[0]).unit)
            if not (np.isfinite(unit) and unit > 0.0):
                raise FaceDefTablesError(f"{table_name(*key)}: its FAPU is {unit}, but must be a positive number")
            meshes = _meshes(groups[key], unit, threshold, fapu.es0, inverse)
        turns = tuple(moved.get(key, ()))
        if meshes or turns:
            tables.append(FaceDefTable(*key, meshes, turns))
    return FaceDefTables(tuple(tables))


def face_motions(face: AnimatableFace, keys: Collection[Key] | None = None) -> list[FaceMotion]:
    """Return the motions that the meshes of the tables hold: one for each border but 0.

    Parameters
    ----------
    keys : the (fap_id, select) wanted; None for all.

    Returns
    -------
    Accumulated offsets at the borders, world coordinates, in the order of the tables and rising values.
    FaceDefTransforms are not part of them.

    Raises
    ------
    FaceDefTablesError
        If a table speaks of a shape or vertex that the scene does not have.
    """
    linear = {s.name: face.scene.world_matrix(s.name)[:3, :3] for s in face.scene.shapes}
    counts = {s.name: s.mesh.vertex_count for s in face.scene.shapes}
    out = []
    for table in face.tables:
        if keys is not None and table.key not in keys:
            continue
        unit = face.fapu.unit(fap(table.fap_id).unit)
        for mesh in table.meshes:
            check_indices(table, mesh, counts)
        borders = sorted({int(b) for mesh in table.meshes for b in mesh.interval_borders} - {0})
        for border in borders:
            offsets: dict[str, Floats] = {}
            for mesh in table.meshes:
                total = offsets.setdefault(mesh.shape, np.zeros((counts[mesh.shape], 3)))
                weights = interval_weights(mesh.interval_borders, border) * unit
                part = np.einsum("kjc,j->kc", mesh.displacements.astype(np.float64), weights)
                np.add.at(total, mesh.coord_index, part @ linear[mesh.shape].T)
            out.append(FaceMotion(table.name, *table.key, border, offsets))
    return out


def check_indices(table: FaceDefTable, mesh: FaceDefMesh, counts: Mapping[str, int]) -> None:
    """Raise FaceDefTablesError if a FaceDefMesh names a shape or a vertex that is not there."""
    if mesh.shape not in counts:
        raise FaceDefTablesError(f"{table.name}: there is no shape '{mesh.shape}' in the scene")
    index = mesh.coord_index
    if index.size and (int(index.min()) < 0 or int(index.max()) >= counts[mesh.shape]):
        raise FaceDefTablesError(
            f"{table.name}: coordIndex runs from {int(index.min())} to {int(index.max())}, "
            f"but '{mesh.shape}' has {counts[mesh.shape]} vertices"
        )


def _key(motion: FaceMotion) -> Key:
    if motion.fap_id is None or not 1 <= motion.fap_id <= FAP_COUNT:
        raise FaceDefTablesError(
            f"motion '{motion.name}' has no FAP; only FAPs 1 to {FAP_COUNT} fit in Facial Animation Tables"
        )
    if motion.value == 0:
        raise FaceDefTablesError(f"motion '{motion.name}' holds for the value 0, where the face is neutral")
    return FaceDefTable(motion.fap_id, motion.select).key


def _inverse_linear(scene: FaceScene, name: str) -> Floats | None:
    """Inverse linear part of a shape's world matrix; None where it is the identity."""
    linear = scene.world_matrix(name)[:3, :3]
    if np.array_equal(linear, np.eye(3)):
        return None
    try:
        inverse: Floats = np.linalg.inv(linear).astype(np.float64, copy=False)
    except np.linalg.LinAlgError:
        raise FaceDefTablesError(f"shape '{name}' is scaled to nothing by the transforms above it") from None
    return inverse


def _check(motions: Iterable[FaceMotion], counts: Mapping[str, int]) -> None:
    for motion in motions:
        for name, offsets in motion.offsets.items():
            where = f"motion '{motion.name}' at {motion.value}"
            if name not in counts:
                raise FaceDefTablesError(f"{where}: there is no shape '{name}' in the scene")
            if offsets.shape != (counts[name], 3):
                raise FaceDefTablesError(
                    f"{where}: '{name}' needs offsets of shape {(counts[name], 3)}, not {offsets.shape}"
                )
            if not np.all(np.isfinite(offsets)):
                raise FaceDefTablesError(f"{where}: '{name}' has offsets that are not finite numbers")


def _meshes(
    motions: Mapping[int, FaceMotion],
    unit: float,
    threshold: float,
    es0: float,
    inverse: Mapping[str, Floats | None],
) -> tuple[FaceDefMesh, ...]:
    lengths = {value: {name: _lengths(o) for name, o in motion.offsets.items()} for value, motion in motions.items()}
    cutoff = {}
    for value, parts in lengths.items():
        largest = max((float(length.max(initial=0.0)) for length in parts.values()), default=0.0)
        cutoff[value] = threshold * min(es0, SMALLEST_SHARE * largest)
    borders = np.array(sorted({0, *motions}), dtype=np.int32)
    meshes = []
    for name, turn in inverse.items():
        kept = np.zeros(0, dtype=bool)
        for value, parts in lengths.items():
            if name in parts:
                moves = (parts[name] > 0.0) & (parts[name] >= cutoff[value])
                kept = moves if not kept.size else kept | moves
        index = np.flatnonzero(kept).astype(np.int32)
        if not index.size:
            continue
        places = np.zeros((borders.size, index.size, 3))
        for row, value in enumerate(borders.tolist()):
            if value and name in motions[value].offsets:
                offsets = motions[value].offsets[name][index]
                places[row] = offsets if turn is None else offsets @ turn.T
        all_borders, slopes = _slopes(borders, places / unit)
        meshes.append(FaceDefMesh(name, all_borders, index, slopes))
    return tuple(meshes)


def _lengths(offsets: Floats) -> Floats:
    lengths: Floats = np.sqrt(np.einsum("ij,ij->i", offsets, offsets))
    return lengths


def _slopes(borders: Ints, places: Floats) -> tuple[Ints, Floats32]:
    """Slopes (k, b-1, 3) from accumulated displacements (b, k, 3) in FAPU, from zero outwards.

    Each slope leads from the place that the rounded slopes before it reach, so that rounding does not add up.
    """
    zero = int(np.searchsorted(borders, 0))
    slopes = np.zeros((places.shape[1], borders.size - 1, 3), dtype=np.float32)
    for step in (1, -1):
        reached = np.zeros_like(places[0])
        outward = range(zero + step, borders.size if step > 0 else -1, step)
        for row in outward:
            length = float(abs(borders[row] - borders[row - step]))
            interval = row - 1 if step > 0 else row
            with np.errstate(over="ignore"):
                slopes[:, interval] = (places[row] - reached) / length
            reached += length * slopes[:, interval].astype(np.float64)
    if zero == borders.size - 1:
        borders = np.append(borders, -borders[-2]).astype(np.int32)
        slopes = np.concatenate([slopes, -slopes[:, -1:]], axis=1)
    if not np.all(np.isfinite(slopes)):
        raise FaceDefTablesError("displacements are too large for 32-bit numbers; check the FAPUs and the offsets")
    return borders, slopes
