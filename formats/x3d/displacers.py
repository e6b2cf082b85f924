"""FaceDefMeshes as HAnimDisplacers, one for each border of their intervals, and exactly back.

At weight 1 a displacer is the shape as the table has it at that border. The numbers have nine digits, from which the
slopes of the table come back to the last bit of float32; the few that do not are noted beside them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fat.intervals import interval_weights
from fat.tables import FaceDefMesh
from fba.arrays import Floats, Floats32, Ints
from fba.scene import Frame

_DIGITS = 9


@dataclass(frozen=True, eq=False)
class BorderOffsets:
    """Where a FaceDefMesh has its vertices at its borders, in the file's axes.

    Attributes
    ----------
    borders : (b,) those that are not 0.
    offsets : (b, k, 3) in units of the mesh, rounded.
    fixes : places in the flat slopes that rounding changes, and their true values.
    """

    borders: Ints
    offsets: Floats
    fixes: tuple[Ints, Floats32]


def border_offsets(mesh: FaceDefMesh, unit: float, frame: Frame) -> BorderOffsets:
    """Sum the slopes of a table up to its borders.

    unit : FAPU of the table's FAP.
    """
    slopes = frame.to_file(mesh.displacements.astype(np.float64))
    borders = mesh.interval_borders[mesh.interval_borders != 0]
    weights = interval_weights(mesh.interval_borders, borders) * unit
    offsets = _rounded(np.einsum("bi,kic->bkc", weights, slopes))
    exact = slopes.astype(np.float32).reshape(-1)
    wrong = np.flatnonzero(slopes_of(mesh.interval_borders, offsets, unit).reshape(-1) != exact)
    return BorderOffsets(borders, offsets, (wrong.astype(np.int32), exact[wrong]))


def slopes_of(borders: Ints, offsets: Floats, unit: float) -> Floats32:
    """Slopes (k, b-1, 3) of the intervals from the offsets (b-1, k, 3) at all borders but 0."""
    places = np.insert(offsets, int(np.searchsorted(borders, 0)), 0.0, axis=0)
    lengths = np.diff(borders).astype(np.float64) * unit
    if len(borders) > 2:
        lengths = np.where(borders[1:] <= 0, -lengths, lengths)
    slopes = np.diff(places, axis=0) / lengths[:, None, None]
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(slopes.transpose(1, 0, 2)).astype(np.float32)


def fixed_slopes(slopes: Floats32, at: Any, values: Any) -> Floats32:
    """Put noted values in; ValueError if they do not fit."""
    places, right = np.array(at, dtype=np.int64), np.array(values, dtype=np.float32)
    if places.shape != right.shape or places.ndim != 1 or np.any((places < 0) | (places >= slopes.size)):
        raise ValueError("places and values do not fit")
    flat = slopes.reshape(-1).copy()
    flat[places] = right
    return flat.reshape(slopes.shape)


def _rounded(values: Floats) -> Floats:
    """Numbers with nine significant digits."""
    size = np.abs(values)
    exponent = np.floor(np.log10(np.where(size > 0.0, size, 1.0)))
    shift = _DIGITS - 1 - exponent
    power = 10.0 ** np.abs(shift)
    with np.errstate(over="ignore", invalid="ignore"):
        short = np.where(shift >= 0, np.rint(values * power) / power, np.rint(values / power) * power)
    rounded: Floats = np.where(np.isfinite(short), short, values)
    return rounded
