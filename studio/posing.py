"""A face in one motion after the other, for measuring: what was asked for last is kept."""

from __future__ import annotations

from functools import lru_cache

from fat.evaluate import Player, Pose
from fat.face import AnimatableFace
from fba.arrays import Floats
from fba.faps import EXPRESSION_FAP, VISEME_FAP

KEPT = 16
"""Poses kept: a FAP in both directions, near and far, and the same of the other side's; 40 MB at 100,000 vertices."""

Key = tuple[int, int, float]
"""FAP, select, value; for visemes and expressions the select is their number, for all others 1."""


class Poses:
    """The motions of a face whose tables can be played, each alone.

    Attributes
    ----------
    player : plays without rules for FAPs that fight, as each motion comes alone.
    rest : shape name -> (n, 3) world vertices of the neutral face.
    """

    def __init__(self, face: AnimatableFace) -> None:
        self.face = face
        self.player = Player(face, rules=())
        self.rest = self.player.pose().world_shapes()
        self._kept = lru_cache(maxsize=KEPT)(self._made)

    def pose(self, key: Key) -> Pose:
        """The face in a motion."""
        return self._kept(key)[0]

    def world(self, key: Key) -> dict[str, Floats]:
        """Shape name -> (n, 3) world vertices in a motion; not to be changed."""
        return self._kept(key)[1]

    def _made(self, key: Key) -> tuple[Pose, dict[str, Floats]]:
        fap_id, select, value = key
        if fap_id == VISEME_FAP:
            pose = self.player.pose(viseme=(select, 0, int(value)))
        elif fap_id == EXPRESSION_FAP:
            pose = self.player.pose(expression=(select, int(value), 0, 0))
        else:
            pose = self.player.pose({fap_id: value})
        return pose, pose.world_shapes()
