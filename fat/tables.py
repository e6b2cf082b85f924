"""Facial Animation Tables exactly as ISO/IEC 14496-1 has them: FaceDefTables, FaceDefMesh, FaceDefTransform."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from fba.arrays import Floats32, Ints, frozen
from fba.errors import FaceDefTablesError
from fba.faps import EXPRESSION_FAP, FAP_COUNT, VISEME_FAP, fap
from fba.high_level import EXPRESSIONS, VISEMES


class TransformField(IntEnum):
    """fieldId of a FaceDefTransform."""

    ROTATION = 1
    SCALE = 2
    TRANSLATION = 3


@dataclass(frozen=True, eq=False)
class FaceDefMesh:
    """How one FAP displaces the vertices of one shape: piecewise linear in the FAP value.

    Attributes
    ----------
    shape : name of the Shape node (faceSceneGraphNode).
    interval_borders : (b,) int32, strictly increasing FAP values, 0 among them.
    coord_index : (k,) int32, the vertices that move.
    displacements : (k, b-1, 3) float32, for each vertex the *slope* in each interval from the lowest to the
        highest: FAPUs per FAP unit, local coordinates of the shape. The slope of a negative interval points
        to where the vertex goes as the FAP gets more negative. The memory order is the standard's order.
    """

    shape: str
    interval_borders: Ints
    coord_index: Ints
    displacements: Floats32

    def __post_init__(self) -> None:
        borders = frozen(self.interval_borders, np.int32, (-1,))
        index = frozen(self.coord_index, np.int32, (-1,))
        slopes = np.asarray(self.displacements, dtype=np.float32)
        where = f"FaceDefMesh of '{self.shape}'"
        if borders.size < 2 or np.any(np.diff(borders) <= 0) or 0 not in borders:
            raise FaceDefTablesError(
                f"{where}: intervalBorders must be at least two increasing integers with 0 among them, "
                f"not {borders.tolist()[:8]}"
            )
        wanted = index.size * (borders.size - 1)
        if slopes.size != wanted * 3:
            raise FaceDefTablesError(
                f"{where}: {index.size} vertices and {borders.size - 1} intervals need {wanted} displacements, "
                f"not {slopes.size / 3:g}"
            )
        put = object.__setattr__
        put(self, "interval_borders", borders)
        put(self, "coord_index", index)
        put(self, "displacements", frozen(slopes, np.float32, (index.size, borders.size - 1, 3)))


@dataclass(frozen=True)
class FaceDefTransform:
    """How one FAP sets one field of a Transform; the field's neutral is 0 rotation, 0 translation, scale 1.

    Attributes
    ----------
    transform : name of the Transform node (faceSceneGraphNode).
    field : which field (fieldId).
    rotation_def : axis and theta; the angle is ``theta * FAP * AU``.
    scale_def, translation_def : the field is ``FAP * scale_def`` (``translation_def``), in units of the mesh.
    """

    transform: str
    field: TransformField = TransformField.ROTATION
    rotation_def: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 0.0)
    scale_def: tuple[float, float, float] = (1.0, 1.0, 1.0)
    translation_def: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class FaceDefTable:
    """One FaceDefTables node: everything that one FAP (or one viseme or expression) does.

    fap_id : 1..68.
    high_level_select : the viseme (1..14) or expression (1..6) number where fap_id is 1 or 2; else 1.
    """

    fap_id: int
    high_level_select: int = 1
    meshes: tuple[FaceDefMesh, ...] = ()
    transforms: tuple[FaceDefTransform, ...] = ()

    @property
    def key(self) -> tuple[int, int]:
        """(fap_id, high_level_select), with 1 as select for every low-level FAP."""
        return (self.fap_id, self.high_level_select if self.fap_id <= EXPRESSION_FAP else 1)

    @property
    def name(self) -> str:
        """The FAP's name, or ``viseme_PP`` / ``expression_joy``."""
        return table_name(*self.key)


def table_name(fap_id: int, select: int = 1) -> str:
    """Name of a FAP, viseme or expression.

    >>> table_name(3), table_name(1, 10), table_name(2, 6)
    ('open_jaw', 'viseme_aa', 'expression_surprise')
    """
    if fap_id == VISEME_FAP:
        return f"viseme_{VISEMES[select - 1].name}" if 1 <= select <= len(VISEMES) else f"viseme_{select}"
    if fap_id == EXPRESSION_FAP:
        known = 1 <= select <= len(EXPRESSIONS)
        return f"expression_{EXPRESSIONS[select - 1].name}" if known else f"expression_{select}"
    return fap(fap_id).name if 1 <= fap_id <= FAP_COUNT else f"fap_{fap_id}"


@dataclass(frozen=True, eq=False)
class FaceDefTables:
    """All tables of a face, in ascending (fap_id, high_level_select); one table for each key."""

    tables: tuple[FaceDefTable, ...] = ()

    def __post_init__(self) -> None:
        ordered = tuple(sorted(self.tables, key=lambda t: t.key))
        keys = [t.key for t in ordered]
        if len(set(keys)) != len(keys):
            twice = next(k for i, k in enumerate(keys) if k in keys[:i])
            raise FaceDefTablesError(f"two FaceDefTables for {table_name(*twice)} (fapID {twice[0]}); merge them")
        object.__setattr__(self, "tables", ordered)

    def __iter__(self) -> Iterator[FaceDefTable]:
        return iter(self.tables)

    def __len__(self) -> int:
        return len(self.tables)

    def get(self, fap_id: int, select: int = 1) -> FaceDefTable | None:
        """The table of a FAP (or viseme or expression), or None."""
        for table in self.tables:
            if table.key == (fap_id, select):
                return table
        return None
