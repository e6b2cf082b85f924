"""The motions of a source face, those of its transforms included."""

from __future__ import annotations

import numpy as np

from fat.build import face_motions
from fat.evaluate import Player
from fat.face import AnimatableFace
from fat.motion import FaceMotion
from fat.rig import EYE_FAPS, HEAD_FAPS
from fba.arrays import Floats
from fba.faps import EXPRESSION_FAP, VISEME_FAP, fap
from fba.high_level import BLEND_MAX

Key = tuple[int, int]

TURNING: frozenset[Key] = frozenset((n, 1) for rows in (*EYE_FAPS.values(), HEAD_FAPS) for _, n in rows)
"""FAPs that turn eyeballs and head: carried by transforms, never by vertices."""

LOW_LEVEL_VALUE = 512
"""FAP value at which a table without meshes is played."""


def turning_keys(source: AnimatableFace) -> frozenset[Key]:
    """The rotations of eyes and head that the source has transforms for."""
    return frozenset(t.key for t in source.tables if t.key in TURNING and t.transforms)


def source_motions(source: AnimatableFace, faps: frozenset[int] | None = None) -> list[FaceMotion]:
    """Motions of all tables, world offsets, rotations of eyes and head left out.

    Tables that move transforms (teeth or tongue under a node of their own, as in models of the 1990s) are played
    and the result is measured, so that their parts can be carried as vertices.

    Parameters
    ----------
    faps : FAP numbers wanted; None = all.
    """
    wanted = [t for t in source.tables if faps is None or t.fap_id in faps]
    still = {t.key for t in wanted if not t.transforms or t.key in TURNING}
    motions = face_motions(source, still)
    played = [t for t in wanted if t.key not in still]
    if played:
        player = Player(source, rules=())
        rest = {s.name: source.scene.world_vertices(s.name) for s in source.scene.shapes}
        for table in played:
            borders = {int(b) for m in table.meshes for b in m.interval_borders} - {0}
            high = table.fap_id <= EXPRESSION_FAP
            values = sorted(borders) or ([BLEND_MAX] if high else _values(table.fap_id))
            for value in values:
                pose = _pose(player, table.key, value)
                offsets = {n: v - rest[n] for n, v in pose.items() if np.any(v != rest[n])}
                motions.append(FaceMotion(table.name, *table.key, value, offsets))
    return sorted(motions, key=lambda m: (m.fap_id or 0, m.select, m.value))


def _values(number: int) -> list[int]:
    return [-LOW_LEVEL_VALUE, LOW_LEVEL_VALUE] if fap(number).bidirectional else [LOW_LEVEL_VALUE]


def _pose(player: Player, key: Key, value: int) -> dict[str, Floats]:
    if key[0] == VISEME_FAP:
        return player.pose(viseme=(key[1], 0, value)).world_shapes()
    if key[0] == EXPRESSION_FAP:
        return player.pose(expression=(key[1], value, 0, 0)).world_shapes()
    return player.pose({key[0]: value}).world_shapes()
