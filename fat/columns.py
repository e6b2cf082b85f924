"""The intervals of Facial Animation Tables as columns of displacements, and how much of each a FAP value takes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fat.build import check_indices
from fat.deform import Column
from fat.face import AnimatableFace
from fat.intervals import IntervalRule, interval_rule
from fat.tables import FaceDefTable
from fba.arrays import Floats, Ints
from fba.errors import FaceDefTablesError
from fba.faps import FAP_COUNT, fap


class TableColumns:
    """The intervals of all tables as columns; those of one table with the same borders share a column.

    Parameters
    ----------
    face : its scene and FAPU; tables : its tables.

    Raises
    ------
    FaceDefTablesError
        If a table speaks of a FAP, shape or vertex that is not there, or holds displacements that are not finite.
    """

    def __init__(self, face: AnimatableFace, tables: Sequence[FaceDefTable]) -> None:
        self._order = face.scene.file_order()
        counts = {s.name: s.mesh.vertex_count for s in face.scene.shapes}
        self._starts: dict[tuple[int, bytes], int] = {}
        rules: list[IntervalRule] = []
        table_of: list[int] = []
        units: list[float] = []
        for number, table in enumerate(tables):
            if not 1 <= table.fap_id <= FAP_COUNT:
                raise FaceDefTablesError(f"fapID {table.fap_id} is not one of 1..{FAP_COUNT}")
            unit = face.fapu.unit(fap(table.fap_id).unit)
            for mesh in table.meshes:
                check_indices(table, mesh, counts)
                if not np.all(np.isfinite(mesh.displacements)):
                    raise FaceDefTablesError(f"{table.name}: displacements of '{mesh.shape}' are not finite numbers")
                key = (number, mesh.interval_borders.tobytes())
                if key not in self._starts:
                    self._starts[key] = len(table_of)
                    rules.append(interval_rule(mesh.interval_borders))
                    intervals = mesh.interval_borders.size - 1
                    table_of += [number] * intervals
                    units += [unit] * intervals
        self._tables = tables
        self._table_of = np.array(table_of, dtype=np.int32)
        self._low, self._high, self._origin, sign = (
            np.concatenate([np.zeros(0), *(getattr(r, part) for r in rules)])
            for part in ("low", "high", "origin", "sign")
        )
        self._scale = sign * np.array(units)

    def weights(self, values: Floats) -> Floats:
        """Weights (f, K) of the columns at table values (f, tables)."""
        clipped = np.clip(values[:, self._table_of], self._low, self._high)
        weights: Floats = (clipped - self._origin) * self._scale
        return weights

    def turned(self, matrices: Mapping[str, Floats]) -> list[Column]:
        """All columns in the file's vertex order; slopes of shapes in `matrices` turned by the (3, 3) found there."""
        parts: list[list[tuple[Ints, Floats]]] = [[] for _ in self._table_of]
        for number, table in enumerate(self._tables):
            for mesh in table.meshes:
                start = self._starts[number, mesh.interval_borders.tobytes()]
                index = self._order[mesh.shape][mesh.coord_index]
                for interval in range(mesh.interval_borders.size - 1):
                    slopes = mesh.displacements[:, interval].astype(np.float64)
                    if mesh.shape in matrices:
                        slopes = slopes @ matrices[mesh.shape].T
                    parts[start + interval].append((index, slopes))
        return [Column(np.concatenate([i for i, _ in p]), np.concatenate([d for _, d in p])) for p in parts]
