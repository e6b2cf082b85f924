"""Play some frames of a stream for some vertices, again and again with another face or stream."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fat.evaluate import Player
from fat.face import AnimatableFace
from fat.tables import FaceDefMesh, FaceDefTable, FaceDefTables
from fba.arrays import Floats, Ints
from fba.orientation import to_file_order
from fba.stream import FapStream


@dataclass(frozen=True, eq=False)
class Replay:
    """Some frames of a stream (rows), to be played for some vertices (ids, in the file's order)."""

    face: AnimatableFace
    stream: FapStream
    ids: Ints
    rows: Ints
    rules: Collection[str] = ()

    @cached_property
    def small(self) -> AnimatableFace:
        """The face with tables that speak of these vertices alone: they play the same, faster."""
        return self.reduced(self.face)

    @cached_property
    def playing(self) -> AnimatableFace:
        """The small face with those tables alone that move something in these frames."""
        moves = np.any(self._player.table_values(cut(self.stream, self.rows)) != 0, axis=0).tolist()
        tables = tuple(table for table, moving in zip(self.small.tables, moves, strict=True) if moving)
        return replace(self.small, tables=FaceDefTables(tables))

    @cached_property
    def right(self) -> Floats:
        """What is right: vertices (rows, ids, 3)."""
        return self.play()

    @cached_property
    def rest(self) -> Floats:
        """The face at rest: vertices (ids, 3)."""
        neutral: Floats = to_file_order(self.face.scene, self.face.scene.world_neutral())[self.ids]
        return neutral

    def reduced(self, face: AnimatableFace) -> AnimatableFace:
        """A face's tables without what they say of all other vertices."""
        kept = np.zeros(face.scene.vertex_count, dtype=bool)
        kept[self.ids] = True
        order = face.scene.file_order()

        def mesh(m: FaceDefMesh) -> FaceDefMesh:
            some = np.flatnonzero(kept[order[m.shape]][m.coord_index])
            return replace(m, coord_index=m.coord_index[some], displacements=m.displacements[some])

        return with_meshes(face, mesh)

    def play(
        self,
        face: AnimatableFace | None = None,
        stream: FapStream | None = None,
        rows: Ints | None = None,
    ) -> Floats:
        """Vertices (rows, ids, 3) of another face, another stream, or other frames of it."""
        player = self._player if face is None else Player(face, rules=self.rules)
        return self._frames(player, cut(stream or self.stream, self.rows if rows is None else rows))

    def play_combined(self) -> Floats:
        """Vertices (rows, ids, 3) where FAPs that fight are combined by all rules."""
        return self._frames(Player(self.small), cut(self.stream, self.rows))

    @cached_property
    def _player(self) -> Player:
        return Player(self.small, rules=self.rules)

    def _frames(self, player: Player, stream: FapStream) -> Floats:
        scene = player.face.scene
        return np.concatenate([to_file_order(scene, batch)[:, self.ids] for batch in player.world_frames(stream)])


def cut(stream: FapStream, rows: Ints) -> FapStream:
    """Some frames of a stream, one after the other."""
    names = ("values", "mask", "visemes", "expressions")
    numbers = np.arange(len(rows), dtype=np.int32)
    return replace(stream, frame_numbers=numbers, **{name: getattr(stream, name)[rows] for name in names})


def with_tables(face: AnimatableFace, change: Callable[[FaceDefTable], FaceDefTable]) -> AnimatableFace:
    """A face with all its tables changed."""
    return replace(face, tables=FaceDefTables(tuple(change(table) for table in face.tables)))


def with_meshes(face: AnimatableFace, change: Callable[[FaceDefMesh], FaceDefMesh]) -> AnimatableFace:
    """A face with the meshes of all its tables changed."""
    return with_tables(face, lambda table: replace(table, meshes=tuple(change(m) for m in table.meshes)))
