"""Play Facial Animation Tables: from FAP values to vertices, by the equations of ISO/IEC 14496-1.

FAPs that fight when summed are shared first, by the rules of `fat.combine`; without rules the sum is the standard's.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from fat.build import check_indices
from fat.chains import Chains
from fat.combine import Combination
from fat.deform import Column, Deformer
from fat.face import AnimatableFace
from fat.intervals import IntervalRule, interval_rule
from fat.tables import FaceDefTable
from fba.arrays import Bools, Floats, Ints
from fba.errors import FaceDefTablesError, FapStreamError
from fba.faps import EXPRESSION_FAP, FAP_COUNT, LOW_LEVEL_FAPS, VISEME_FAP, fap
from fba.high_level import BLEND_MAX, expression_weights, viseme_weights
from fba.scene import FaceScene
from fba.stream import FapStream

HighLevel = Literal["add", "high_only"]

BATCH_FRAMES = 64
"""Frames evaluated in one go; 20,000 vertices then take 31 MB."""

_ROW = 64
"""Vertices whose coordinates are shifted as one row; see `_move_frames`."""


@dataclass(frozen=True, eq=False)
class Pose:
    """A face at one moment.

    Attributes
    ----------
    local : shape name -> (n, 3) vertices in the shape's local coordinates.
    matrices : shape name -> (4, 4) from there to world coordinates (inside axes).
    """

    scene: FaceScene
    local: dict[str, Floats]
    matrices: Mapping[str, Floats]

    def mesh_offsets(self) -> dict[str, Floats]:
        """What meshes do, without the Transforms: shape name -> offsets (n, 3) in the world directions of rest."""
        return {
            s.name: (self.local[s.name] - s.mesh.vertices) @ self.scene.world_matrix(s.name)[:3, :3].T
            for s in self.scene.shapes
        }

    def world_shapes(self) -> dict[str, Floats]:
        """Shape name -> (n, 3) vertices in world coordinates, inside axes."""
        return {name: _transformed(vertices, self.matrices[name]) for name, vertices in self.local.items()}

    def world(self) -> Floats:
        """(N, 3) vertices of all shapes in the file's own order, world coordinates, inside axes."""
        return self.scene.gather(self.world_shapes())


class Player:
    """Evaluates the tables of a face.

    Parameters
    ----------
    face : the animatable face.
    high_level : what a viseme or expression and low-level FAPs do together. "add": their displacements add.
        "high_only": a frame with a viseme or expression leaves out its low-level FAPs.
    rules : how FAPs that fight are combined, names out of `fat.combine.RULES`; None for all rules, an empty
        collection for the standard's plain sum. A low-level FAP that comes alone is the same either way.

    Raises
    ------
    FaceDefTablesError
        If a table speaks of a FAP, shape, vertex or Transform that is not there, or holds displacements that are
        not finite numbers.
    FapStreamError
        If a rule is unknown.

    Notes
    -----
    Displacements of all tables add up in the local coordinates of a shape; then the Transforms apply. The value
    of a viseme's table is ``viseme_blend`` for select1 and ``63 - viseme_blend`` for select2, that of an
    expression's table its intensity, both with the unit 1. A FAP without a table has no effect.
    """

    def __init__(
        self, face: AnimatableFace, high_level: HighLevel = "add", rules: Collection[str] | None = None
    ) -> None:
        self.face = face
        self.high_level = high_level
        self._tables = tuple(face.tables)
        self._low = np.array([t.fap_id > EXPRESSION_FAP for t in self._tables], dtype=bool)
        self._order = face.scene.file_order()
        self._chains = Chains(face.scene, self._tables)
        self._plan = _Plan(face, self._tables)
        self._combination = Combination(face, rules)

    def pose(
        self,
        faps: Mapping[int, float] | None = None,
        viseme: tuple[int, int, int] | None = None,
        expression: tuple[int, int, int, int] | None = None,
    ) -> Pose:
        """Return the face at FAP values.

        Parameters
        ----------
        faps : FAP number 3..68 -> value in FAP units.
        viseme : viseme_select1, viseme_select2, viseme_blend.
        expression : expression_select1, expression_intensity1, expression_select2, expression_intensity2.

        Raises
        ------
        FapStreamError
            If a FAP number is not 3..68 or a value is not a finite number.
        """
        given = dict(faps or {})
        for number, value in given.items():
            if number not in LOW_LEVEL_FAPS:
                raise FapStreamError(
                    f"there is no low-level FAP {number}; FAPs 1 and 2 are given as viseme, expression"
                )
            if not np.isfinite(value):
                raise FapStreamError(f"FAP {number} ({fap(number).name}) has the value {value}, not a finite number")
        high = {VISEME_FAP: viseme_weights(*(viseme or (0, 0, 0)))}
        high[EXPRESSION_FAP] = expression_weights(*(expression or (0, 0, 0, 0)))
        values = np.zeros((1, len(self._tables)))
        for k, table in enumerate(self._tables):
            source = high.get(table.fap_id)
            values[0, k] = given.get(table.fap_id, 0.0) if source is None else source.get(table.high_level_select, 0.0)
        return next(self._poses(self._choose(values, np.array([bool(high[1] or high[2])]))))

    def frames(self, stream: FapStream, batch: int = BATCH_FRAMES) -> Iterator[Pose]:
        """Yield the face at each frame of a stream; FAPs that a frame does not speak of are 0 in it."""
        for start in range(0, len(stream), batch):
            yield from self._poses(self.table_values(stream, slice(start, start + batch)))

    def world_frames(self, stream: FapStream, batch: int = BATCH_FRAMES) -> Iterator[Floats]:
        """Yield (b, N, 3) vertices of up to `batch` frames: what `Pose.world` gives, without the detour."""
        for start in range(0, len(stream), batch):
            values = self.table_values(stream, slice(start, start + batch))
            out = self._world_deformer(self._plan.weights(values))
            for name, motion in self._chains.motions(values).items():
                relative = motion.matrices @ self._chains.rest_inverse(name)
                _move_frames(out, _place(self._order[name]), relative, np.flatnonzero(motion.moving).tolist())
            yield out

    def _poses(self, values: Floats) -> Iterator[Pose]:
        local = self._local_deformer(self._plan.weights(values))
        motions = self._chains.motions(values)
        places = {name: _place(ids) for name, ids in self._order.items()}
        for k, vertices in enumerate(local):
            matrices = {n: motions[n].matrices[k] if n in motions else m for n, m in self._chains.rest.items()}
            yield Pose(self.face.scene, {name: vertices[place] for name, place in places.items()}, matrices)

    def table_values(self, stream: FapStream, part: slice = slice(None)) -> Floats:
        """Values (f, tables) of the face's tables in a part of a stream, fighting FAPs already combined."""
        select1, select2, blend, _ = (stream.visemes[part] * stream.mask[part, :1]).T
        visemes = ((select1, blend), (select2, BLEND_MAX - blend))
        first, amount1, second, amount2, _, _ = (stream.expressions[part] * stream.mask[part, 1:2]).T
        expressions = ((first, amount1), (second, amount2))
        values = np.zeros((len(blend), len(self._tables)))
        for k, table in enumerate(self._tables):
            if table.fap_id > EXPRESSION_FAP:
                values[:, k] = stream.values[part, table.fap_id - 1] * stream.mask[part, table.fap_id - 1]
                continue
            for select, amount in visemes if table.fap_id == VISEME_FAP else expressions:
                values[:, k] += np.where(select == table.high_level_select, amount, 0)
        present = np.zeros(len(blend), dtype=bool)
        for select, amount in (*visemes, *expressions):
            present |= (select != 0) & (amount != 0)
        return self._choose(values, present)

    def _choose(self, values: Floats, high_level_present: Bools) -> Floats:
        if self.high_level == "high_only":
            values[np.ix_(high_level_present, self._low)] = 0.0
        return self._combination(values)

    @cached_property
    def _local_deformer(self) -> Deformer:
        scene = self.face.scene
        neutral = scene.gather({s.name: s.mesh.vertices for s in scene.shapes})
        return Deformer(neutral, self._plan.columns({}))

    @cached_property
    def _world_deformer(self) -> Deformer:
        """The same in world coordinates, with every Transform at rest."""
        turned = {n: m[:3, :3] for n, m in self._chains.rest.items() if not np.array_equal(m, np.eye(4))}
        if not turned:
            return self._local_deformer
        return Deformer(self.face.scene.world_neutral(), self._plan.columns(turned))


class _Plan:
    """The intervals of all tables as columns; those with the same FAP and borders share a column."""

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

    def columns(self, turned: Mapping[str, Floats]) -> list[Column]:
        """All columns in the file's vertex order; slopes of `turned` shapes multiplied by a (3, 3) matrix."""
        parts: list[list[tuple[Ints, Floats]]] = [[] for _ in self._table_of]
        for number, table in enumerate(self._tables):
            for mesh in table.meshes:
                start = self._starts[number, mesh.interval_borders.tobytes()]
                index = self._order[mesh.shape][mesh.coord_index]
                for interval in range(mesh.interval_borders.size - 1):
                    slopes = mesh.displacements[:, interval].astype(np.float64)
                    if mesh.shape in turned:
                        slopes = slopes @ turned[mesh.shape].T
                    parts[start + interval].append((index, slopes))
        return [Column(np.concatenate([i for i, _ in p]), np.concatenate([d for _, d in p])) for p in parts]


def _place(ids: Ints) -> slice | Ints:
    """A slice where the ids follow one another, which is faster."""
    if ids.size and np.array_equal(ids, np.arange(ids[0], ids[0] + ids.size)):
        return slice(int(ids[0]), int(ids[0]) + ids.size)
    return ids


def _move_frames(out: Floats, place: slice | Ints, matrices: Floats, frames: list[int]) -> None:
    """Transform the vertices at `place` in these frames of out (f, n, 3) by matrices (f, 4, 4), in place.

    Written for speed, as a turning head moves every vertex: one frame at a time stays in the processor's cache,
    and numpy adds long rows several times as fast as rows of three.
    """
    buffer = np.empty_like(out[0, place])
    long = buffer.shape[0] // _ROW * _ROW
    rows = buffer[:long].reshape(-1, 3 * _ROW)
    linear = np.ascontiguousarray(matrices[:, :3, :3].transpose(0, 2, 1))
    shift = np.tile(matrices[:, :3, 3], (1, _ROW))
    for frame in frames:
        np.matmul(out[frame, place], linear[frame], out=buffer)
        rows += shift[frame]
        buffer[long:] += shift[frame, :3]
        out[frame, place] = buffer


def _transformed(vertices: Floats, matrix: Floats) -> Floats:
    if np.array_equal(matrix, np.eye(4)):
        return vertices
    turned: Floats = vertices @ matrix[:3, :3].T + matrix[:3, 3]
    return turned
