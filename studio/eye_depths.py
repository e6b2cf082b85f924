"""Which skin gets into the eyeballs in a motion: lids that sink in, or eyeballs that come out through them.

Skin that other skin covers does not count: the back of a lid may sink in where its front stays clear of the eyeball,
as nobody sees it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from cloning.eyeballs import Ball
from cloning.rigid import fit_rigid
from fat.fap_quality import DEPTH, sunk
from fba.arrays import Bools, Floats, Ints
from studio.checked_skin import CheckedSkin
from studio.posing import Key, Poses

AROUND = 2.0
"""Radii about an eyeball within which skin may lie before the skin on it."""

KEPT = 4
"""Motions kept, as two measures look at each."""

ABOVE = 0.01
"""Radii by which skin lies before other skin at least to cover it, so that nothing covers itself."""


@dataclass(frozen=True, eq=False)
class _Eye:
    """One eyeball and the skin before its middle.

    Attributes
    ----------
    before : (m,) clearance of `vertices` at rest.
    vertices : (m,) of the joined skin, close to the eyeball.
    local : (n,) their number for each vertex of the joined skin.
    around : (t, 3) triangles of the joined skin that may cover them.
    """

    ball: Ball
    names: list[str]
    before: Floats
    vertices: Ints
    local: Ints
    around: Ints


@dataclass(frozen=True, eq=False)
class _Look:
    """An eye in a motion, turned back with it, about its centre.

    Attributes
    ----------
    places : (m, 3) of the skin close to it, and which of it sank in, (m,).
    corners : (t, 3, 3) of the triangles that may cover it.
    """

    eye: _Eye
    places: Floats
    sunk: Bools
    corners: Floats

    def covered(self, points: Floats) -> Bools:
        """Which points (k, 3) have skin before them that is clear of the eyeball, seen from its middle."""
        a, b, c = (self.corners[:, k] for k in range(3))
        turns = np.stack([np.cross(p, q) @ points.T for p, q in ((a, b), (b, c), (c, a))])
        on_ray, whose = np.nonzero(np.all(turns >= 0.0, axis=0) | np.all(turns <= 0.0, axis=0))
        normal = np.cross(b - a, c - a)[on_ray]
        slope = np.einsum("ij,ij->i", normal, points[whose])
        with np.errstate(divide="ignore", invalid="ignore"):
            times = np.einsum("ij,ij->i", normal, a[on_ray]) / slope
        over = np.flatnonzero((times > 1.0 + ABOVE) & np.isfinite(times))
        clear = self.eye.ball.clearance(times[over, None] * points[whose[over]]) >= -DEPTH
        found = np.zeros(len(points), dtype=bool)
        found[whose[over[clear]]] = True
        return found


class EyeDepths:
    """The skin before the eyeballs of a face that has some.

    Attributes
    ----------
    vertices : (m,) of the joined skin, before the middle of an eyeball.
    """

    def __init__(self, skin: CheckedSkin, poses: Poses) -> None:
        self._skin, self._poses = skin, poses
        rest = np.concatenate([poses.rest[n] for n in skin.surface.shapes])
        self._eyes = [_eye(skin, ball, names, rest) for ball, names in skin.eyeballs]
        self.vertices: Ints = np.concatenate([eye.vertices for eye in self._eyes])
        self._looks = lru_cache(maxsize=KEPT)(self._look)

    def sunk(self, key: Key) -> Bools:
        """Which of `vertices` a motion takes into an eyeball, with nothing before them, (m,)."""
        found = []
        for look in self._looks(key):
            shown = look.sunk.copy()
            shown[look.sunk] = ~look.covered(look.places[look.sunk])
            found.append(shown)
        return np.concatenate(found)

    def inside(self, key: Key, number: int, triangles: Ints) -> Bools:
        """Which triangles (t, 3) of the joined skin, all before one eyeball, lie wholly inside it."""
        look = self._looks(key)[number]
        inside: Bools = np.all(look.sunk[look.eye.local[triangles]], axis=1)
        return inside

    def shown(self, key: Key, number: int, triangles: Ints) -> Bools:
        """Which triangles (t, 3) of the joined skin, all before one eyeball, have nothing before them."""
        look = self._looks(key)[number]
        return ~look.covered(look.places[look.eye.local[triangles]].mean(axis=1))

    def _look(self, key: Key) -> list[_Look]:
        world, rest = self._poses.world(key), self._poses.rest
        skin = np.concatenate([world[n] for n in self._skin.surface.shapes])
        looks = []
        for eye in self._eyes:
            still = np.concatenate([rest[n] for n in eye.names])
            way = np.concatenate([world[n] for n in eye.names]) - still
            rigid = fit_rigid(still, way[:, None], eye.ball.center)
            middle = eye.ball.center + rigid.shifts[0]
            places = (skin[eye.vertices] - middle) @ rigid.turns[0]
            corners = (skin[eye.around] - middle) @ rigid.turns[0]
            looks.append(_Look(eye, places, sunk(eye.before, eye.ball.clearance(places)), corners))
        return looks


def _eye(skin: CheckedSkin, ball: Ball, names: list[str], rest: Floats) -> _Eye:
    front = ball.rest[:, 2] > ball.center[2]
    vertices = ball.vertices[front]
    local = np.full(skin.surface.vertex_count, -1, dtype=np.int32)
    local[vertices] = np.arange(len(vertices), dtype=np.int32)
    away = rest - ball.center
    near = (np.linalg.norm(away, axis=1) < AROUND * float(np.median(ball.radii))) & (away[:, 2] > 0.0)
    around = skin.surface.triangles[near[skin.surface.triangles].all(axis=1)]
    return _Eye(ball, names, ball.clear_at_rest[front], vertices, local, around)
