"""Tables as blend shapes for programs that know neither inbetweens nor negative weights.

Each sign of a FAP becomes a shape of its own, ``open_jaw_pos`` or ``open_jaw_neg``, which goes in a straight line.
What the intervals of the table add to that line becomes corrective shapes, ``open_jaw_pos_512``: at weight 1 where the
table has a border, fading to 0 towards the borders beside it. All weights lie between 0 and 1, and the sum of the
shapes is what the table says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fat.face import AnimatableFace
from fat.tables import FaceDefTable
from fba.arrays import Floats, Ints
from fba.faps import EXPRESSION_FAP, Unit, fap
from fba.fapu import Fapu
from formats.normals import SmoothNormals
from formats.targets import Target, border_weights, table_borders, table_targets

NEGLIGIBLE = 0.01
"""Correctives by less than so many of the smallest FAPU are left out: a hundred-thousandth of a mouth's width."""

LEAST = 1e-3
"""Motion by less than so many of the smallest FAPU is none."""

MESH_UNITS = (Unit.IRISD, Unit.ES, Unit.ENS, Unit.MNS, Unit.MW)


@dataclass(frozen=True, eq=False)
class OneSided:
    """A blend shape.

    Attributes
    ----------
    table : number of the table that it belongs to.
    ramp : increasing values of that table, each with the weight at it; between them are straight lines.
    at : the table's value at weight 1.
    index : (k,) int32, the vertices that move; offsets : (k, 3) where to, in the shape's local coordinates.
    normals : (k, 3) what happens to the normals; None where the mesh has normals of its own.
    """

    name: str
    table: int
    ramp: tuple[tuple[float, float], ...]
    at: float
    index: Ints
    offsets: Floats
    normals: Floats | None

    def weight(self, values: Floats) -> Floats:
        """Weights (f,) at table values (f,)."""
        places, weights = np.array(self.ramp).T
        found: Floats = np.interp(values, places, weights)
        return found


def smallest_unit(fapu: Fapu) -> float:
    """The smallest FAPU of lengths, as long as one step of a FAP."""
    return min(fapu.unit(unit) for unit in MESH_UNITS)


def one_sided(
    face: AnimatableFace, normals: dict[str, SmoothNormals | None], values: Floats | None = None
) -> dict[str, list[OneSided]]:
    """Split all tables of a face.

    Parameters
    ----------
    normals : of every shape.
    values : (f, tables) that will be played. Where they go beyond a table's borders, weight 1 is their extreme.

    Raises
    ------
    FaceDefTablesError
        If a table speaks of a FAP, shape or vertex that is not there.
    """
    tables = list(face.tables)
    still = np.zeros((1, len(tables)))
    spoken = still if values is None else np.concatenate([still, values])
    low, high = spoken.min(axis=0), spoken.max(axis=0)
    unit = smallest_unit(face.fapu)
    found: dict[str, list[OneSided]] = {}
    for name, targets in table_targets(face).items():
        found[name] = []
        for number, table in enumerate(tables):
            own = [target for target in targets if target.table == number]
            if own:
                split = _Split(table, number, own, normals[name], unit)
                found[name] += split.sides(float(low[number]), float(high[number]))
    return found


class _Split:
    """What one table does to one mesh."""

    def __init__(
        self, table: FaceDefTable, number: int, targets: Sequence[Target], normals: SmoothNormals | None, unit: float
    ) -> None:
        self._table = table
        self._number = number
        self._borders = table_borders(table)
        self._normals = normals
        self._limit, self._least = NEGLIGIBLE * unit, LEAST * unit
        self._index = np.unique(np.concatenate([target.index for target in targets])).astype(np.int32)
        self._places = np.zeros((len(self._borders), len(self._index), 3))
        for target in targets:
            row = int(np.searchsorted(self._borders, target.border))
            self._places[row, np.searchsorted(self._index, target.index)] = target.offsets

    def sides(self, low: float, high: float) -> list[OneSided]:
        """The shapes of both signs, for values from low to high at least."""
        first, last = float(self._borders[0]), float(self._borders[-1])
        both = self._table.fap_id > EXPRESSION_FAP and fap(self._table.fap_id).bidirectional
        # Beyond its borders a table goes on in a straight line, also through zero.
        top = max(high, last if last > 0.0 else -first if both else 0.0)
        bottom = min(low, first if first < 0.0 else -last if both else 0.0)
        return [*self._side("pos", top), *self._side("neg", bottom)]

    def _side(self, label: str, end: float) -> list[OneSided]:
        if end == 0.0:
            return []
        inner = sorted((float(b) for b in self._borders if 0.0 < b / end < 1.0), key=abs)
        nodes = [*inner, end]
        moved = np.tensordot(border_weights(self._borders, nodes), self._places, axes=1)
        turned = None if self._normals is None else np.stack([self._normals.offsets(self._index, m) for m in moved])
        name = self._name(label)
        whole = self._shape(name, ((0.0, 0.0), (end, 1.0)), end, moved[-1], None if turned is None else turned[-1])
        shapes = [whole]
        for place, node in enumerate(inner):
            share = node / end
            before = nodes[place - 1] if place else 0.0
            ramp = ((before, 0.0), (node, 1.0), (nodes[place + 1], 0.0))
            normals = None if turned is None else turned[place] - share * turned[-1]
            offsets = moved[place] - share * moved[-1]
            shapes.append(self._shape(f"{name}_{abs(node):.0f}", ramp, node, offsets, normals))
        return [shape for shape in shapes if shape.index.size]

    def _name(self, label: str) -> str:
        """Visemes and expressions have one sign only."""
        if self._table.fap_id <= EXPRESSION_FAP and label == "pos":
            return self._table.name
        return f"{self._table.name}_{label}"

    def _shape(
        self, name: str, ramp: tuple[tuple[float, float], ...], at: float, offsets: Floats, normals: Floats | None
    ) -> OneSided:
        """A shape whose weight goes through these values of the table."""
        limit = self._least if len(ramp) == 2 else self._limit
        kept = np.einsum("ij,ij->i", offsets, offsets) > limit * limit
        index = self._index[kept]
        turned = None if normals is None else normals[kept]
        return OneSided(name, self._number, tuple(sorted(ramp)), at, index, offsets[kept], turned)
