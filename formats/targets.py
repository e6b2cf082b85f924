"""Tables as morph targets: one for each border of a table's intervals, and the weights that a FAP value gives them.

A target is the face as the table has it at that border. Between two borders the weights of their targets fade into
each other; beyond the last they go on in a straight line. That is the piecewise linear rule of FaceDefMesh.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fat.build import check_indices
from fat.face import AnimatableFace
from fat.intervals import interval_weights
from fat.tables import FaceDefMesh, FaceDefTable
from fba.arrays import Floats, Ints
from fba.errors import FaceDefTablesError
from fba.faps import EXPRESSION_FAP, FAP_COUNT, fap


@dataclass(frozen=True, eq=False)
class Target:
    """A morph target of one shape.

    Attributes
    ----------
    table : number of the table that it belongs to; border : the value of that table at weight 1.
    index : (k,) int32, the vertices that move.
    offsets : (k, 3) where to, in the shape's local coordinates.
    """

    name: str
    index: Ints
    offsets: Floats
    table: int = 0
    border: int = 0


def target_name(table: FaceDefTable, border: int, last: int) -> str:
    """Name of a target: ``fap_03_open_jaw_512``, ``fap_05_raise_b_midlip_neg_300``, ``viseme_PP``."""
    if table.fap_id <= EXPRESSION_FAP and border == last:
        return table.name
    label = table.name if table.fap_id <= EXPRESSION_FAP else f"fap_{table.fap_id:02d}_{table.name}"
    return f"{label}_{'neg_' if border < 0 else ''}{abs(border)}"


def table_borders(table: FaceDefTable) -> Ints:
    """All borders of a table's meshes, increasing; empty for a table without meshes."""
    if not table.meshes:
        return np.zeros(0, np.int32)
    return np.unique(np.concatenate([mesh.interval_borders for mesh in table.meshes])).astype(np.int32)


def border_weights(borders: Ints, values: ArrayLike) -> Floats:
    """Weights (..., b) of the faces at the borders (b,) at table values (...); that of border 0 says nothing."""
    edges = np.asarray(borders, dtype=np.float64)
    value = np.asarray(values, dtype=np.float64)
    low = np.clip(np.searchsorted(edges, value, side="right") - 1, 0, len(edges) - 2)
    share = (value - edges[low]) / (edges[low + 1] - edges[low])
    weights = np.zeros((*value.shape, len(edges)))
    np.put_along_axis(weights, low[..., None], (1.0 - share)[..., None], axis=-1)
    np.put_along_axis(weights, low[..., None] + 1, share[..., None], axis=-1)
    return weights


def table_targets(face: AnimatableFace) -> dict[str, list[Target]]:
    """The morph targets of every shape, in the order of the tables and from the lowest border to the highest.

    Raises
    ------
    FaceDefTablesError
        If a table speaks of a FAP, shape or vertex that is not there.
    """
    counts = {shape.name: shape.mesh.vertex_count for shape in face.scene.shapes}
    found: dict[str, list[Target]] = {name: [] for name in counts}
    for number, table in enumerate(face.tables):
        if not 1 <= table.fap_id <= FAP_COUNT:
            raise FaceDefTablesError(f"fapID {table.fap_id} is not one of 1..{FAP_COUNT}")
        borders = table_borders(table)
        unit = face.fapu.unit(fap(table.fap_id).unit)
        of_shape: dict[str, list[FaceDefMesh]] = {}
        for mesh in table.meshes:
            check_indices(table, mesh, counts)
            of_shape.setdefault(mesh.shape, []).append(mesh)
        for shape, meshes in of_shape.items():
            index, places = _places(meshes, borders)
            if not np.isfinite(places).all():
                raise FaceDefTablesError(f"{table.name}: displacements of '{shape}' are not finite numbers")
            for border, offsets in zip(borders.tolist(), places * unit, strict=True):
                moved = offsets.any(axis=1)
                if moved.any():
                    name = target_name(table, border, int(borders[-1]))
                    found[shape].append(Target(name, index[moved], offsets[moved], number, border))
    return found


def _places(meshes: Sequence[FaceDefMesh], borders: Ints) -> tuple[Ints, Floats]:
    """Vertices (k,) of a shape that a table moves, and where to at its borders, (b, k, 3) in FAPU."""
    index = np.concatenate([mesh.coord_index for mesh in meshes])
    unique, where = np.unique(index, return_inverse=True)
    places = np.zeros((len(borders), unique.size, 3))
    start = 0
    for mesh in meshes:
        steps = np.ascontiguousarray(mesh.displacements.transpose(1, 0, 2), dtype=np.float64)
        moved = interval_weights(mesh.interval_borders, borders) @ steps.reshape(len(steps), -1)
        at = where[start : start + mesh.coord_index.size]
        moved = moved.reshape(len(borders), -1, 3)
        if unique.size == index.size:
            places[:, at] = moved
        else:
            for row, offsets in zip(places, moved, strict=True):
                np.add.at(row, at, offsets)
        start += mesh.coord_index.size
    return unique.astype(np.int32), places


def target_weights(targets: Sequence[Target], borders: Mapping[int, Ints], values: Floats) -> Floats:
    """Weights (f, targets) of a shape's morph targets at table values (f, tables).

    borders : number of a table -> its borders.
    """
    weights = np.zeros((len(values), len(targets)))
    of_table: dict[int, Floats] = {}
    for column, target in enumerate(targets):
        if target.table not in of_table:
            of_table[target.table] = border_weights(borders[target.table], values[:, target.table])
        place = int(np.searchsorted(borders[target.table], target.border))
        weights[:, column] = of_table[target.table][:, place]
    return weights
