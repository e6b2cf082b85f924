"""Facial Animation Tables without what nobody can see: fewer intervals, fewer digits, a smaller file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from fat.intervals import interval_weights
from fat.tables import FaceDefMesh, FaceDefTables
from fba.arrays import Bools, Floats
from fba.faps import fap
from fba.fapu import Fapu

UNSEEN = 0.005
"""Part of a table's largest offset by which a vertex may miss its place at a border that is left out ..."""

SMALL = 5e-4
"""... or, where that is more, this: three hundredths of a millimetre, in eye separations."""

ROUNDING = 1e-7
"""Largest error of rounding at the last border, in eye separations."""


def compact(
    tables: FaceDefTables, fapu: Fapu, unseen: float = UNSEEN, small: float = SMALL, rounding: float = ROUNDING
) -> FaceDefTables:
    """Leave out borders between which vertices go straight anyway, and digits that do not matter.

    Parameters
    ----------
    tables : of a face with these FAP units.
    unseen : how far a vertex may be from its place at a border that is left out, as a part of the table's largest
        offset there. At the borders that are kept, always the outermost ones and 0, it is exact.
    small : the same in eye separations; the larger of the two holds.
    rounding : largest error of the written numbers at the outermost border, in eye separations.

    Returns
    -------
    The same tables. Where some vertices of a shape go straight and others do not, the shape has two FaceDefMeshes.
    """
    out = []
    for table in tables:
        unit = fapu.unit(fap(table.fap_id).unit) / fapu.es0
        largest: dict[int, float] = {}
        placed = [(mesh, _places(mesh)) for mesh in table.meshes]
        for mesh, places in placed:
            for border, length in zip(mesh.interval_borders.tolist(), _lengths(places), strict=True):
                largest[border] = max(largest.get(border, 0.0), float(length.max(initial=0.0)))
        limits = {border: max(unseen * length, small / unit) for border, length in largest.items()}
        parts = (part for mesh, places in placed for part in _thinned(mesh, places, limits))
        out.append(replace(table, meshes=tuple(_rounded(part, rounding / unit) for part in parts)))
    return FaceDefTables(tuple(out))


def _places(mesh: FaceDefMesh) -> Floats:
    """Accumulated displacements at the borders, (b, k, 3) in FAPU."""
    weights = interval_weights(mesh.interval_borders, mesh.interval_borders)
    steps = np.ascontiguousarray(mesh.displacements.transpose(1, 0, 2), dtype=np.float64)
    places: Floats = (weights @ steps.reshape(len(steps), -1)).reshape(len(weights), -1, 3)
    return places


def _lengths(places: Floats) -> Floats:
    lengths: Floats = np.sqrt(np.einsum("bkc,bkc->bk", places, places))
    return lengths


def _thinned(mesh: FaceDefMesh, places: Floats, limits: dict[int, float]) -> Iterator[FaceDefMesh]:
    borders = mesh.interval_borders
    zero = int(np.searchsorted(borders, 0))
    allowed = np.array([limits[b] for b in borders.tolist()])
    few = np.unique([0, zero, borders.size - 1])
    straight = np.ones(len(mesh.coord_index), dtype=bool)
    sides = list(pairwise(few.tolist()))
    for low, high in sides:
        straight &= (_bend(mesh, places, low, high) <= allowed[low : high + 1, None]).all(axis=0)
    if straight.any():
        yield _with_borders(mesh, places, few.tolist(), straight)
    if not straight.all():
        bent = places[:, ~straight]
        kept = [_kept(mesh, bent, allowed, low, high) for low, high in sides]
        yield _with_borders(mesh, places, sorted({row for side in kept for row in side}), ~straight)


def _bend(mesh: FaceDefMesh, places: Floats, low: int, high: int) -> Floats:
    """Distance of the places at borders low to high from the straight line between the two, (high - low + 1, k)."""
    borders = mesh.interval_borders[low : high + 1].astype(np.float64)
    share = (borders - borders[0]) / (borders[-1] - borders[0])
    return _lengths(places[low : high + 1] - places[low] - share[:, None, None] * (places[high] - places[low]))


def _kept(mesh: FaceDefMesh, places: Floats, allowed: Floats, low: int, high: int) -> list[int]:
    """Borders between which straight lines stay close enough (U. Ramer, 1972; D. Douglas and T. Peucker, 1973)."""
    inside = slice(low + 1, high)
    away = _bend(mesh, places, low, high).max(axis=1)[1:-1] / np.maximum(allowed[inside], 1e-300)
    if away.max(initial=0.0) <= 1.0:
        return [low, high]
    worst = low + 1 + int(np.argmax(away))
    return [*_kept(mesh, places, allowed, low, worst), *_kept(mesh, places, allowed, worst, high)]


def _with_borders(mesh: FaceDefMesh, places: Floats, kept: list[int], which: Bools) -> FaceDefMesh:
    borders = mesh.interval_borders[kept]
    steps = np.diff(places[kept][:, which], axis=0) / np.diff(borders)[:, None, None]
    outward = np.where((borders[:-1] >= 0) | (borders.size == 2), 1.0, -1.0)
    slopes = (outward[:, None, None] * steps).transpose(1, 0, 2)
    return FaceDefMesh(mesh.shape, borders, mesh.coord_index[which], slopes.astype(np.float32))


def _rounded(mesh: FaceDefMesh, rounding: float) -> FaceDefMesh:
    span = float(np.abs(mesh.interval_borders).max())
    decimals = int(np.ceil(np.log10(0.5 * span / rounding)))
    slopes = np.round(mesh.displacements.astype(np.float64), decimals) + 0.0  # no negative zeros
    return replace(mesh, displacements=slopes.astype(np.float32))
