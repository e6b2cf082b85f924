"""Play Facial Animation Tables: from FAP values to vertices, by the equations of ISO/IEC 14496-1.

FAPs that fight when summed are shared first, by the rules of `fat.combine`; without rules the sum is the standard's.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, overload

import numpy as np
from numpy.typing import NDArray

from fat.chains import Chains
from fat.columns import TableColumns
from fat.combine import Combination
from fat.deform import Deformer, Number
from fat.face import AnimatableFace
from fba.arrays import Bools, Floats, Floats32, Ints
from fba.errors import FapStreamError
from fba.faps import EXPRESSION_FAP, LOW_LEVEL_FAPS, VISEME_FAP, fap
from fba.high_level import BLEND_MAX, expression_weights, viseme_weights
from fba.scene import FaceScene
from fba.stream import FapStream

HighLevel = Literal["add", "high_only"]

BATCH_BYTES = 512
"""Frames evaluated in one go, counted in bytes of a coordinate: 64 frames in 8-byte numbers, 128 in 4-byte ones. More
multiply faster, but 20,000 vertices then take 31 MB, and larger arrays come from the system anew, page by page."""

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
        self._columns = TableColumns(face, self._tables)
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

    def frames(self, stream: FapStream, batch: int | None = None) -> Iterator[Pose]:
        """Yield the face at each frame of a stream; FAPs that a frame does not speak of are 0 in it.

        batch : frames evaluated in one go; None for `BATCH_BYTES`.
        """
        for part in self._batches(stream, batch, np.float64):
            yield from self._poses(self.table_values(stream, part))

    @overload
    def world_frames(
        self, stream: FapStream, batch: int | None = None, *, single: Literal[False] = False
    ) -> Iterator[Floats]: ...

    @overload
    def world_frames(
        self, stream: FapStream, batch: int | None = None, *, single: Literal[True]
    ) -> Iterator[Floats32]: ...

    def world_frames(
        self, stream: FapStream, batch: int | None = None, *, single: bool = False
    ) -> Iterator[Floats] | Iterator[Floats32]:
        """Yield (b, N, 3) vertices of up to `batch` frames: what `Pose.world` gives, without the detour.

        Parameters
        ----------
        batch : None for `BATCH_BYTES`.
        single : 4-byte numbers, for drawing: half the memory for a frame, twice the speed. A neutral frame is the
            neutral face rounded to them; others are as exact, but for a few units in the last place.
        """
        if single:
            return self._world_frames(stream, batch, self._world_single)
        return self._world_frames(stream, batch, self._world)

    def _world_frames(
        self, stream: FapStream, batch: int | None, deformer: Deformer[Number]
    ) -> Iterator[NDArray[Number]]:
        for part in self._batches(stream, batch, deformer.number):
            values = self.table_values(stream, part)
            out = deformer(self._columns.weights(values))
            for name, motion in self._chains.motions(values).items():
                relative = (motion.matrices @ self._chains.rest_inverse(name)).astype(deformer.number)
                _move_frames(out, _place(self._order[name]), relative, np.flatnonzero(motion.moving).tolist())
            yield out

    @staticmethod
    def _batches(stream: FapStream, batch: int | None, number: type[Number]) -> Iterator[slice]:
        size = batch or BATCH_BYTES // np.dtype(number).itemsize
        for start in range(0, len(stream), size):
            yield slice(start, start + size)

    def _poses(self, values: Floats) -> Iterator[Pose]:
        local = self._local(self._columns.weights(values))
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
    def _local(self) -> Deformer[np.float64]:
        scene = self.face.scene
        neutral = scene.gather({s.name: s.mesh.vertices for s in scene.shapes})
        return Deformer(neutral, self._columns.turned({}), np.float64)

    @cached_property
    def _world(self) -> Deformer[np.float64]:
        """The same in world coordinates, with every Transform at rest."""
        return self._in_world(np.float64) if self._turned else self._local

    @cached_property
    def _world_single(self) -> Deformer[np.float32]:
        return self._in_world(np.float32)

    def _in_world(self, number: type[Number]) -> Deformer[Number]:
        return Deformer(self.face.scene.world_neutral(), self._columns.turned(self._turned), number)

    @cached_property
    def _turned(self) -> dict[str, Floats]:
        """Linear parts of the matrices of shapes that do not rest in world coordinates."""
        return {n: m[:3, :3] for n, m in self._chains.rest.items() if not np.array_equal(m, np.eye(4))}


def _place(ids: Ints) -> slice | Ints:
    """A slice where the ids follow one another, which is faster."""
    if ids.size and np.array_equal(ids, np.arange(ids[0], ids[0] + ids.size)):
        return slice(int(ids[0]), int(ids[0]) + ids.size)
    return ids


def _move_frames(out: NDArray[Number], place: slice | Ints, matrices: NDArray[Number], frames: list[int]) -> None:
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
