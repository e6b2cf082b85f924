"""FaceDefMesh as UsdSkel blend shapes with inbetweens, and back; plain targets as well.

Weight 1 is the last positive border of a table; every other border is an inbetween at ``border / last``,
negative ones too, with the displacement accumulated there. UsdSkel goes linearly from one to the next, and on
beyond the last, which is what the standard says of a FaceDefMesh.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdSkel

from fat.intervals import interval_weights
from fat.tables import FaceDefMesh, FaceDefTable
from fba.arrays import Floats, Floats32, Ints
from fba.errors import FaceDefTablesError, InputFileError
from fba.faps import fap
from fba.fapu import Fapu
from formats.normals import SmoothNormals
from formats.targets import table_borders
from formats.usd.axes import StageAxes
from formats.usd.names import Namer
from formats.usd.properties import ints, need, put, put_array, rows, to_single, vt

AGREEMENT = 1e-5
"""Offsets that differ from what the slopes give by less than this share of the largest are rounding."""

ROUNDED_PLACES = 8
"""Slopes with at most so many decimal places were rounded."""

NORMAL_PLACES = 4
"""Decimal places of what rounded tables do to normals: a hundredth of a degree."""


@dataclass(frozen=True, eq=False)
class Between:
    """An inbetween: at which weight the offsets (k, 3) hold, and those of the normals."""

    weight: float
    offsets: Floats
    normals: Floats | None


class MeshTargets:
    """Collects the blend shapes of one mesh and tells it of them."""

    def __init__(self, mesh: Usd.Prim, namer: Namer, axes: StageAxes, normals: SmoothNormals | None) -> None:
        self.mesh = mesh
        self._axes = axes
        self._normals = normals
        self._namer = namer
        self._token_namer = Namer()
        self._tokens: list[str] = []
        self._paths: list[Sdf.Path] = []

    @property
    def tokens(self) -> tuple[str, ...]:
        """Names of the blend shapes so far, as a SkelAnimation has to list them."""
        return tuple(self._tokens)

    def turned(self, index: Ints, offsets: Floats, places: int | None = None) -> Floats | None:
        """What offsets do to the normals of these vertices (k, 3); None where the mesh has normals of its own.

        places : round to so many decimal places; None keeps all digits.
        """
        return None if self._normals is None else rounded(self._normals.offsets(index, offsets), places)

    def add(
        self,
        name: str,
        index: Ints,
        offsets: Floats,
        normals: Floats | None,
        between: Mapping[str, Between] | None = None,
    ) -> UsdSkel.BlendShape:
        """Author a blend shape.

        Parameters
        ----------
        name : what animations know it by; the prim gets another one where that is taken by a subset.
        index : (k,) vertices that move.
        offsets, normals : (k, 3) at weight 1; inside axes, local coordinates of the mesh.
        between : the inbetweens by their names.
        """
        path = self.mesh.GetPath().AppendChild(self._namer.name(name))
        shape = UsdSkel.BlendShape.Define(self.mesh.GetStage(), path)
        shape.CreateOffsetsAttr(self._stage_vectors(offsets))
        shape.CreatePointIndicesAttr(vt(index))
        if normals is not None:
            shape.CreateNormalOffsetsAttr(self._stage_vectors(normals))
        for label, values in (between or {}).items():
            inbetween = shape.CreateInbetween(label)
            inbetween.SetWeight(values.weight)
            inbetween.SetOffsets(self._stage_vectors(values.offsets))
            if values.normals is not None:
                inbetween.SetNormalOffsets(self._stage_vectors(values.normals))
        self._tokens.append(self._token_namer.name(name))
        self._paths.append(path)
        return shape

    def _stage_vectors(self, values: Floats) -> Any:
        return vt(to_single(self._axes.vectors(values)))

    def bind(self) -> None:
        """Tell the mesh its blend shapes."""
        binding = UsdSkel.BindingAPI.Apply(self.mesh)
        binding.CreateBlendShapesAttr(self._tokens)
        binding.CreateBlendShapeTargetsRel().SetTargets(self._paths)


def rounded(values: Floats, places: int | None) -> Floats:
    """Numbers of so many decimal places (None: as they are), without negative zeros."""
    if places is None:
        return values
    short: Floats = np.round(values, places) + 0.0
    return short


def full_value(borders: Ints) -> int:
    """The value of a table at weight 1: its last positive border, or the size of the first where none is positive.

    borders : increasing, those of all meshes of the table (`formats.targets.table_borders`).
    """
    last = int(borders[-1])
    return last if last > 0 else -int(borders[0])


def write_face_def_mesh(
    targets: MeshTargets, table: FaceDefTable, mesh: FaceDefMesh, fapu: Fapu, axes: StageAxes
) -> Sdf.Path:
    """Author one FaceDefMesh as a blend shape; its slopes are kept exactly beside the offsets.

    Where the slopes were rounded, the offsets are too: their text would be twice as long and say nothing more.
    """
    full = full_value(table_borders(table))
    places = _inbetween_borders(mesh.interval_borders, full)
    unit = fapu.unit(fap(table.fap_id).unit)
    offsets = _accumulated(mesh, [full, *places], unit)
    if not np.all(np.isfinite(to_single(offsets))):
        raise FaceDefTablesError(f"{table.name} moves '{mesh.shape}' further than 32-bit numbers can say")
    digits = _places(mesh, float(np.abs(offsets).max(initial=0.0)), full, unit)
    offsets = rounded(offsets, digits)
    normal_places = None if digits is None else NORMAL_PLACES
    index = mesh.coord_index
    between = {
        f"at_{border}".replace("-", "minus_"): Between(
            border / full, values, targets.turned(index, values, normal_places)
        )
        for border, values in zip(places, offsets[1:], strict=True)
    }
    shape = targets.add(table.name, index, offsets[0], targets.turned(index, offsets[0], normal_places), between)
    prim = shape.GetPrim()
    put(prim, "fapID", Sdf.ValueTypeNames.Int, table.fap_id)
    put(prim, "highLevelSelect", Sdf.ValueTypeNames.Int, table.high_level_select)
    put(prim, "valueAtWeightOne", Sdf.ValueTypeNames.Int, full)
    put_array(prim, "intervalBorders", mesh.interval_borders)
    put_array(prim, "slopes", to_single(axes.vectors(mesh.displacements)).reshape(-1, 3))
    return shape.GetPath()


def _places(mesh: FaceDefMesh, largest: float, full: int, unit: float) -> int | None:
    """Decimal places that the offsets of rounded slopes deserve, and that keep AGREEMENT; None for other slopes."""
    slopes = mesh.displacements
    for places in range(ROUNDED_PLACES + 1):
        if np.array_equal(np.round(slopes.astype(np.float64), places).astype(np.float32), slopes):
            step = min(10.0**-places * abs(full) * unit, AGREEMENT * largest)
            return -int(np.floor(np.log10(step))) if step > 0.0 else None
    return None


def _inbetween_borders(borders: Ints, full: int) -> list[int]:
    """The borders of a mesh that are not weight 0 or 1."""
    return [int(b) for b in borders if b not in (0, full)]


def _accumulated(mesh: FaceDefMesh, values: list[int], unit: float) -> Floats:
    """Accumulated displacements (v, k, 3) at FAP values; inside axes, local coordinates."""
    weights = interval_weights(mesh.interval_borders, values) * unit
    places: Floats = np.einsum("vj,kjc->vkc", weights, mesh.displacements.astype(np.float64))
    return places


def read_face_def_mesh(prim: Usd.Prim, shape: str, fap_id: int, fapu: Fapu, axes: StageAxes) -> FaceDefMesh:
    """Read a FaceDefMesh back.

    The exact slopes are used while the offsets agree with them. Where another program has changed the offsets,
    these are turned into slopes.

    Raises
    ------
    InputFileError
        If the attributes contradict each other.
    """
    blend = UsdSkel.BlendShape(prim)
    borders = ints(need(prim, "intervalBorders"))
    index = ints(blend.GetPointIndicesAttr().Get() or [])
    slopes = rows(need(prim, "slopes"), 3)
    unit = fapu.unit(fap(fap_id).unit)
    full = int(need(prim, "valueAtWeightOne"))
    if full == 0:
        raise InputFileError(f"{prim.GetPath()} is damaged: its fba:valueAtWeightOne is 0")
    values = [full, *_inbetween_borders(borders, full)]
    stored = _stored_offsets(blend, values, index.size)
    try:
        if slopes.size == index.size * (borders.size - 1) * 3:
            mesh = FaceDefMesh(shape, borders, index, _inside(slopes.reshape(index.size, -1, 3), axes))
            again = axes.vectors(_accumulated(mesh, values, unit))
            if np.abs(again - stored).max(initial=0.0) <= AGREEMENT * np.abs(stored).max(initial=0.0):
                return mesh
        return FaceDefMesh(shape, borders, index, _inside(_slopes(borders, values, stored, unit), axes))
    except FaceDefTablesError as error:
        raise InputFileError(f"{prim.GetPath()} is damaged: {error}") from error


def _inside(slopes: NDArray[Any], axes: StageAxes) -> Floats32:
    turned: Floats32 = to_single(axes.frame.from_file(slopes))
    return turned


def _stored_offsets(blend: UsdSkel.BlendShape, values: list[int], count: int) -> NDArray[np.float32]:
    full = values[0]
    found = [rows(blend.GetOffsetsAttr().Get(), 3)]
    by_weight = {np.float32(i.GetWeight()): i for i in blend.GetInbetweens()}
    for value in values[1:]:
        inbetween = by_weight.get(np.float32(value / full))
        if inbetween is None:
            raise InputFileError(f"{blend.GetPath()} has no inbetween for the border {value} (weight {value / full:g})")
        found.append(rows(inbetween.GetOffsets(), 3))
    if any(len(f) != count for f in found):
        raise InputFileError(f"{blend.GetPath()} has offsets of {len(found[0])} points, but {count} point indices")
    return np.stack(found)


def _slopes(borders: Ints, values: list[int], offsets: NDArray[np.float32], unit: float) -> Floats:
    """Slopes (k, b-1, 3) whose accumulated displacements at these values are the offsets (v, k, 3), as near as can be.

    Where weight 1 lies beyond a mesh's own borders there is one offset more than there are slopes.
    """
    weights = interval_weights(borders, values) * unit
    slopes: Floats = np.einsum("jv,vkc->kjc", np.linalg.pinv(weights), offsets.astype(np.float64))
    return slopes
