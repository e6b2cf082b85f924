"""Which skin gets into the eyeballs in a motion: lids that sink in, or eyeballs that come out through them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cloning.rigid import fit_rigid
from fat.fap_quality import sunk
from fba.arrays import Bools, Floats, Ints
from studio.checked_skin import CheckedSkin


class EyeDepths:
    """The skin before the eyeballs of a face that has some.

    Parameters
    ----------
    rest : shape name -> (n, 3) world vertices of the neutral face.

    Attributes
    ----------
    vertices : (m,) of the joined skin, before the middle of an eyeball.
    """

    def __init__(self, skin: CheckedSkin, rest: Mapping[str, Floats]) -> None:
        self._skin, self._rest = skin, rest
        self._fronts: list[Bools] = [ball.rest[:, 2] > ball.center[2] for ball, _ in skin.eyeballs]
        pairs = [(ball, front) for (ball, _), front in zip(skin.eyeballs, self._fronts, strict=True)]
        self.vertices: Ints = np.concatenate([ball.vertices[front] for ball, front in pairs])
        self._before = np.concatenate([ball.clear_at_rest[front] for ball, front in pairs])

    def sunk(self, world: Mapping[str, Floats]) -> Bools:
        """Which of `vertices` a motion takes into an eyeball, (m,); the eyeballs may move, too."""
        places = np.concatenate([world[n] for n in self._skin.surface.shapes])
        after = []
        for (ball, names), front in zip(self._skin.eyeballs, self._fronts, strict=True):
            rest = np.concatenate([self._rest[n] for n in names])
            way = np.concatenate([world[n] for n in names]) - rest
            rigid = fit_rigid(rest, way[:, None], ball.center)
            moved = places[ball.vertices[front]] - ball.center - rigid.shifts[0]
            after.append(ball.clearance(moved @ rigid.turns[0]))
        return sunk(self._before, np.concatenate(after))
