"""The tongue, FAPs 43-47: a flexible body that bends along its middle curve, its root held.

How much a vertex follows depends on its place between the root and the tip. Raised and shifted tips bend the tongue
along an arc of constant curvature, the cross-sections turn with it; a thrust stretches it; a raised body is a wave
between root and tip; a rolled tongue turns each half up along an arc about the middle curve.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from weakref import WeakKeyDictionary

import numpy as np

from authoring.behind_teeth import inner_side
from authoring.construction import Construction, Offsets
from authoring.riders import in_mesh_units
from authoring.spread import smoothstep, spread
from cloning.bodies import body
from cloning.prepare import PreparedFace
from cloning.surface import Surface, build_surface
from fba.arrays import Floats
from fba.faps import fap
from fba.fapu import ANGLE_UNIT
from fba.scene import Role

TIP, MIDDLE, BORDERS = "6.1", "6.2", ("6.3", "6.4")

ALL_BORDERS = {
    43: (-1080, -540, -270, -135, 135, 270, 540, 1080),
    44: (-1080, -540, -270, -135, 270, 540, 1080),
    45: (-1080, -270, 270, 1080),
    46: (-1080, 1080),
    47: (10000, 20000, 30000, 45000, 60000, 80000, 100000, 125000, 150000),
}
"""Interval borders: bent tongues turn by at most .2 rad between two of them, rolled ones by .5."""

LENGTH = 1.8
"""The root lies this many times the way from tip to middle behind the middle: where MakeHuman's tongue ends."""

STILL_MIDDLE = 0.08
"""Share of the way to the tip and to the root over which the middle keeps its height."""

SHARPEST = 1.2
"""A tongue bends by no more than this angle (rad); what a value asks for beyond that stretches its tip."""

BESIDE_TEETH = 0.5
"""What is farther to the front than this share of the way from middle to tip draws back behind the front teeth."""

SHORTEST = 0.5
"""A lowered tip draws back by no more than this share of the way from middle to tip."""

ROLLED = 0.6
"""Share of the way from root to middle within which the tongue rolls up."""

VALLEY = 0.5
"""Share of the tongue's half width that bends in a roll; beyond it the borders stay straight: a U, no closed pipe."""

ROUNDS = 40
"""Most rounds in which the roll is made exact."""

NEAR_TEETH = 0.08
"""Gums that are one mesh with the tongue lie this near to the teeth, in eye separations ..."""

ROOM = 0.06
"""... and this far outside the box of the tongue: beyond its borders, before its tip, above its middle."""

FARTHEST = 1.2
"""What is farther than this along the mesh from the points of the tongue is throat or palate, in eye separations."""

NEAR_POINTS = 0.3
"""The surface this near to the points of the tongue is tongue."""

SMOOTH = 0.06
"""Length over which a tongue turns into its gums, in eye separations."""

FORWARD = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Tongue:
    """The tongue of one face; lengths in eye separations.

    Attributes
    ----------
    surface : its mesh.
    root, middle, tip : (3,) places of the middle curve.
    along : (n,) -1 at the root and behind it, 0 at the middle 6.2, 1 at the tip 6.1, more before it.
    free : (n,) 1 on the tongue, 0 on gums that are one mesh with it.
    """

    face: PreparedFace
    surface: Surface
    root: Floats
    middle: Floats
    tip: Floats
    along: Floats
    free: Floats

    def at(self, fap_id: int, value: float) -> Offsets:
        """Offsets of a FAP at a value; its feature point moves by exactly that."""
        if fap_id == 47:
            moved = self._rolled(value * ANGLE_UNIT)
        else:
            entry, es0 = fap(fap_id), self.face.fapu.es0
            way = value * self.face.fapu.unit(entry.unit) / es0 * np.asarray(entry.direction)
            moved = {43: self._shifted, 44: self._raised_tip, 45: self._thrust, 46: self._raised}[fap_id](way)
        return in_mesh_units(self.face, self.surface.split(self.free[:, None] * moved))

    def _shifted(self, way: Floats) -> Floats:
        """FAP 43: the whole tongue bends to a side."""
        return self._bent(way, 0.5 * (self.along + 1.0), float(self.tip[2] - self.root[2]))

    def _raised_tip(self, way: Floats) -> Floats:
        """FAP 44: the front bends, the middle keeps its height; a lowered tip draws back behind the teeth."""
        front = np.maximum(self.along - STILL_MIDDLE, 0.0) / (1.0 - STILL_MIDDLE)
        moved = self._bent(way, front, (1.0 - STILL_MIDDLE) * float(self.tip[2] - self.middle[2]))
        return moved if way[1] > 0.0 else moved - self._back(moved, smoothstep(front))[:, None] * FORWARD

    def _back(self, moved: Floats, share: Floats) -> Floats:
        """(n,) how far the tongue draws back so that its front is behind the inner side of the lower teeth."""
        length = float(self.tip[2] - self.middle[2])
        teeth = inner_side(self.face, float(self.middle[2]) + BESIDE_TEETH * length)
        if teeth is None:
            return np.zeros(len(share))
        front = self.along > BESIDE_TEETH
        lacking = teeth.in_front((self.surface.vertices + self.free[:, None] * moved)[front]) / share[front]
        back: Floats = np.clip(lacking.max(initial=0.0), 0.0, SHORTEST * length) * share
        return back

    def _thrust(self, way: Floats) -> Floats:
        """FAP 45: the tongue stretches from its root; the tip goes wholly."""
        share = (self.surface.vertices[:, 2] - self.root[2]) / (self.tip[2] - self.root[2])
        return self._exact(TIP, np.clip(share, 0.0, 1.0), way)

    def _raised(self, way: Floats) -> Floats:
        """FAP 46: a wave that is highest at the middle and ends at tip and root."""
        share = (1.0 - STILL_MIDDLE - np.abs(self.along)) / (1.0 - 2.0 * STILL_MIDDLE)
        return self._exact(MIDDLE, smoothstep(share), way)

    def _exact(self, key: str, share: Floats, way: Floats) -> Floats:
        """A share of a motion for each vertex, scaled so that a feature point moves wholly."""
        at_point = float((self.surface.point_matrix([key]) @ (self.free * share))[0])
        moved: Floats = share[:, None] * way / at_point
        return moved

    def _bent(self, way: Floats, share: Floats, length: float) -> Floats:
        """The tongue bent along an arc, so that its tip moves across by `way`.

        Parameters
        ----------
        share : (n,) of the length, 0 where the bend begins, 1 at the tip.
        """
        from scipy.optimize import brentq

        size = float(np.linalg.norm(way))
        across, at_tip = way / size, self.surface.point_matrix([TIP])

        def missing(angle: float) -> float:
            moved = self.free[:, None] * self._arc(across, share, length, angle)
            return float((at_tip @ (moved @ across))[0]) - size

        lacking = -missing(SHARPEST)
        if lacking > 0.0:
            more = self._exact(TIP, np.minimum(share, 1.0) ** 2, lacking * across)
            return self._arc(across, share, length, SHARPEST) + more
        return self._arc(across, share, length, float(brentq(missing, 0.0, SHARPEST, xtol=1e-14)))

    def _arc(self, across: Floats, share: Floats, length: float, angle: float) -> Floats:
        """Offsets (n, 3) of a bend: the middle curve becomes an arc, the cross-sections turn with it."""
        turn = angle * share
        straight = length * share
        forward = straight * (np.sinc(turn / np.pi) - 1.0)
        sideways = straight * np.sinc(0.5 * turn / np.pi) * np.sin(0.5 * turn)
        height = (self.surface.vertices - self._curve()) @ across
        forward -= height * np.sin(turn)
        sideways += height * (np.cos(turn) - 1.0)
        bent: Floats = sideways[:, None] * across + forward[:, None] * FORWARD
        return bent

    def _rolled(self, angle: float) -> Floats:
        """FAP 47: the borders 6.3 and 6.4 turn up about the line midway between them, by this angle on average."""
        at = self.surface.point_matrix(BORDERS)
        rest = at @ self.surface.vertices
        middle = 0.5 * (rest[0] + rest[1])

        def heights(places: Floats) -> Floats:
            local = places - middle
            height: Floats = np.arctan2(local[:, 1], np.array([1.0, -1.0]) * local[:, 0])
            return height

        asked = angle
        for _ in range(ROUNDS):
            moved = self._curled(asked)
            found = heights(rest + at @ (self.free[:, None] * moved)) - heights(rest)
            asked *= angle / float(found.mean())
        return self._curled(asked)

    def _curled(self, angle: float) -> Floats:
        """Each half bent up into a U: an arc about the middle curve, then straight at this angle."""
        left, right = (self.surface.positions[k] for k in BORDERS)
        bottom = self._curve() + 0.5 * (left + right) - self.middle
        local = self.surface.vertices - bottom
        arc = VALLEY * 0.5 * float(left[0] - right[0])
        side, out = np.sign(local[:, 0]), np.abs(local[:, 0])
        tilt = angle * smoothstep((self.along + 1.0) / ROLLED) * np.minimum(out / arc, 1.0)
        chord, beyond = np.minimum(out, arc) * np.sinc(0.5 * tilt / np.pi), np.maximum(out - arc, 0.0)
        across = chord * np.cos(0.5 * tilt) + beyond * np.cos(tilt) - local[:, 1] * np.sin(tilt)
        up = chord * np.sin(0.5 * tilt) + beyond * np.sin(tilt) + local[:, 1] * (np.cos(tilt) - 1.0)
        return np.column_stack([side * (across - out), up, np.zeros(len(up))])

    def _curve(self) -> Floats:
        """(n, 3) the place of the middle curve beside each vertex."""
        stops = np.array([self.root, self.middle, self.tip])
        return np.column_stack([np.interp(self.along, [-1.0, 0.0, 1.0], stops[:, k]) for k in range(3)])


_MADE: WeakKeyDictionary[PreparedFace, Tongue | None] = WeakKeyDictionary()


def tongue(face: PreparedFace) -> Tongue | None:
    """The tongue of a face; None where it is no mesh of its own or its points do not lie on it."""
    if face not in _MADE:
        _MADE[face] = _tongue(face)
    return _MADE[face]


def _tongue(face: PreparedFace) -> Tongue | None:
    names = [s.name for s in face.scene.with_role(Role.TONGUE) if s.mesh.vertex_count]
    if not names or any(face.points[k].shape not in names for k in (TIP, MIDDLE) if k in face.points):
        return None
    surface = build_surface(face.scene, face.points, names, face.fapu.es0)
    if TIP not in surface.points or MIDDLE not in surface.points:
        return None
    tip, middle = surface.positions[TIP], surface.positions[MIDDLE]
    front = float(tip[2] - middle[2])
    if not front > 0.0:
        return None
    depth = np.array([max(middle[2] - LENGTH * front, float(surface.vertices[:, 2].min())), middle[2], tip[2]])
    root = np.array([middle[0], middle[1], depth[0]])
    z = surface.vertices[:, 2]
    along = np.interp(z, depth, [-1.0, 0.0, 1.0]) + np.maximum(z - tip[2], 0.0) / front
    return Tongue(face, surface, root, middle, tip, along, _free(face, surface))


def _free(face: PreparedFace, surface: Surface) -> Floats:
    """1 on the tongue; 0 on gums, palate and throat that are one mesh with it; smooth between them."""
    from scipy.spatial import cKDTree

    p, v = surface.positions, surface.vertices
    away = surface.distances([k for k in (TIP, MIDDLE, *BORDERS) if k in surface.points], FARTHEST).min(axis=0)
    held = ~np.isfinite(away)
    teeth = [body(face, role) for role in (Role.UPPER_TEETH, Role.LOWER_TEETH)]
    places = [part.vertices for part in teeth if part is not None]
    if places:
        near = cKDTree(np.concatenate(places) / face.fapu.es0).query(v)[0] < NEAR_TEETH
        outside = (v[:, 2] > p[TIP][2] + ROOM) | (v[:, 1] > p[MIDDLE][1] + ROOM)
        if all(k in surface.points for k in BORDERS):
            outside |= (v[:, 0] > p[BORDERS[0]][0] + ROOM) | (v[:, 0] < p[BORDERS[1]][0] - ROOM)
        held |= near & outside
    if not held.any():
        return np.ones(surface.vertex_count)
    firmness = (away < NEAR_POINTS).astype(np.float64)
    firmness[held] = np.inf
    return spread(surface)(np.where(held, 0.0, 1.0), firmness, SMOOTH)


def _construction(fap_id: int) -> Construction:
    def make(face: PreparedFace, value: int) -> Offsets:
        found = tongue(face)
        return {} if found is None else found.at(fap_id, value)

    needs = (TIP, MIDDLE, *BORDERS) if fap_id == 47 else (TIP, MIDDLE)
    return Construction(fap_id, ALL_BORDERS[fap_id], needs, make)


CONSTRUCTIONS: Mapping[int, Construction] = MappingProxyType({n: _construction(n) for n in ALL_BORDERS})
