"""Does each FAP do what MPEG-4 says? Its own feature point must move by its FAPU amount along its axis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fat.evaluate import Player
from fat.face import AnimatableFace
from fat.tables import FaceDefTable
from fba.arrays import Floats
from fba.faps import LOW_LEVEL_FAPS, Fap, Unit, fap
from fba.scene import Role
from fba.sphere import fit_sphere

Kind = Literal["translation", "rotation", "roll", "dilation"]

OWN_SHARE = 0.005
"""A FAP conforms when its own feature point is off by no more than this share of its motion ..."""

OWN_UNITS = 1.0
"""... or by no more than this many FAP units: a value is an integer."""

TEST_ANGLE = 10_000
"""AU (0.1 rad) at which rotations are measured that no interval border names."""

_LARGEST_ANGLE = 150_000
"""AU; rotations are measured up to here, well below half a turn."""

RIM_SHARE = 0.95
"""The rim of a pupil goes at least this share of the farthest way: its vertices lie on a ring that is nearly round."""

_SQUINT = 0.8
"""Cosine between an eye's neutral gaze and +Z; no face squints by 37 degrees, but half a ball's middle may be off."""

_EYE_ROLES = {"3.5": Role.EYE_LEFT, "3.6": Role.EYE_RIGHT}
_TONGUE_BORDERS = ("6.3", "6.4")
_HEAD_GROUPS = ("2.", "3.", "4.", "5.", "8.", "9.", "10.", "11.")

_World = Mapping[str, Floats]


@dataclass(frozen=True, slots=True)
class FapConformance:
    """How one FAP moves its own feature point, at the value where it is farthest off.

    Attributes
    ----------
    point : id of the feature point; for rotations the one that names the part that turns.
    kind : "translation" of a point, "rotation" of eyeball or head, "roll" of the tongue, "dilation" of a pupil.
    value : the FAP value, which is also the wanted motion in FAP units.
    found : the motion found along the FAP's axis, in FAP units.
    off_axis : the motion across the axis, in FAP units.
    error_units : distance from the wanted motion in FAP units; across the axis it counts for rotations only, as
        MPEG-4 leaves the other axes of a point free.
    """

    fap_id: int
    name: str
    point: str
    kind: Kind
    value: int
    found: float
    off_axis: float
    error_units: float

    @property
    def relative_error(self) -> float:
        """The error as a share of the wanted motion."""
        return self.error_units / abs(self.value)

    @property
    def passed(self) -> bool:
        """Within OWN_SHARE or OWN_UNITS."""
        return self.relative_error <= OWN_SHARE or self.error_units <= OWN_UNITS


def conformance(face: AnimatableFace) -> list[FapConformance]:
    """Measure every low-level FAP that has a table and whose feature point is given.

    Returns
    -------
    One result for each FAP, in ascending order, measured at the borders of its intervals (for transforms at
    TEST_ANGLE or at the ends of the standard's range) and taken where it is worst. FAPs that cannot be measured are
    absent: no table, no feature point on a surface, no eyeball shape.

    Raises
    ------
    FaceDefTablesError
        If the tables cannot be played.
    """
    player = Player(face)
    probe = Probe(face, player.pose().world_shapes())
    results = []
    for table in face.tables:
        if table.fap_id not in LOW_LEVEL_FAPS:
            continue
        definition = fap(table.fap_id)
        found = []
        for value in _values(table, definition):
            result = probe.measure(definition, value, player.pose({table.fap_id: value}).world_shapes())
            found += [result] if result is not None else []
        if found:
            results.append(max(found, key=lambda r: (not r.passed, r.relative_error)))
    return results


def _values(table: FaceDefTable, definition: Fap) -> list[int]:
    borders = {int(b) for mesh in table.meshes for b in mesh.interval_borders} - {0}
    if definition.unit is Unit.AU:
        named = {int(np.clip(b, -_LARGEST_ANGLE, _LARGEST_ANGLE)) for b in borders}
        return sorted(named or ({TEST_ANGLE, -TEST_ANGLE} if definition.bidirectional else {TEST_ANGLE}))
    return sorted(borders or set(definition.i_range) - {0})


class Probe:
    """Measures the own motion of FAPs against the neutral face.

    Parameters
    ----------
    neutral : shape name -> (n, 3) world vertices of the neutral face.
    """

    def __init__(self, face: AnimatableFace, neutral: _World) -> None:
        self._face = face
        self._neutral = neutral
        self._rest = face.feature_points.positions(face.scene, neutral)

    def measure(self, definition: Fap, value: int, world: _World) -> FapConformance | None:
        """Return how a FAP at a value moves its part, or None if that cannot be seen on this face."""
        moved = self._face.feature_points.positions(self._face.scene, world)
        point = definition.feature_points[0]
        unit = self._face.fapu.unit(definition.unit)
        kind: Kind
        if definition.direction is not None:
            if not self._on_surface(point) or (point in _EYE_ROLES and not self._eye_shapes(point)):
                return None
            motion = (moved[point] - self._rest[point]) / unit
            along = float(motion @ definition.direction)
            across = float(np.linalg.norm(motion - along * np.asarray(definition.direction)))
            kind, error = "translation", abs(along - value)
        elif definition.rotation_axis is not None:
            turn = self._turn(point, world, moved)
            if turn is None:
                return None
            turn = turn / unit
            along = float(turn @ definition.rotation_axis)
            across = float(np.linalg.norm(turn - along * np.asarray(definition.rotation_axis)))
            kind, error = "rotation", float(np.hypot(along - value, across))
        else:
            kind = "roll" if definition.unit is Unit.AU else "dilation"
            amount = self._roll(moved) if kind == "roll" else self._dilation(point, world)
            if amount is None:
                return None
            along, across = amount / unit, 0.0
            error = abs(along - value)
        return FapConformance(definition.id, definition.name, point, kind, value, along, across, error)

    def _on_surface(self, point: str) -> bool:
        return point in self._rest and self._face.feature_points[point].shape is not None

    def _turn(self, point: str, world: _World, moved: Mapping[str, Floats]) -> Floats | None:
        """Rotation vector (3,) in radians of an eyeball, or of the head by its feature points."""
        if point in _EYE_ROLES:
            names = self._eye_shapes(point)
            if not names:
                return None
            return rotation_vector(
                np.concatenate([self._neutral[n] for n in names]), np.concatenate([world[n] for n in names])
            )
        used = [k for k in self._rest if k.startswith(_HEAD_GROUPS) and self._on_surface(k)]
        if len(used) < 4:
            return None
        return rotation_vector(np.array([self._rest[k] for k in used]), np.array([moved[k] for k in used]))

    def _eye_shapes(self, point: str) -> list[str]:
        """The shapes of an eyeball: by role, else the one (not the skin) that carries the pupil."""
        shapes = [s.name for s in self._face.scene.with_role(_EYE_ROLES[point])]
        if shapes or not self._on_surface(point):
            return shapes
        name = self._face.feature_points[point].shape
        return [s.name for s in self._face.scene.shapes if s.name == name and s.role is not Role.SKIN]

    def _roll(self, moved: Mapping[str, Floats]) -> float | None:
        """Mean angle (rad) by which the borders of the tongue turn up about the line midway between them."""
        if not all(self._on_surface(k) for k in _TONGUE_BORDERS):
            return None
        left, right = (self._rest[k] for k in _TONGUE_BORDERS)
        middle = 0.5 * (left + right)
        total = 0.0
        for key, rest, side in ((_TONGUE_BORDERS[0], left, 1.0), (_TONGUE_BORDERS[1], right, -1.0)):
            before, after = rest - middle, moved[key] - middle
            total += np.arctan2(after[1], side * after[0]) - np.arctan2(before[1], side * before[0])
        return 0.5 * float(total)

    def _dilation(self, point: str, world: _World) -> float | None:
        """Change of the pupil's diameter: twice the way outwards of the vertices that move most (its rim)."""
        names = self._eye_shapes(point) if self._on_surface(point) else []
        if not names:
            return None
        rest = np.concatenate([self._neutral[n] for n in names])
        moved = np.concatenate([world[n] for n in names])
        way = np.linalg.norm(moved - rest, axis=1)
        if not way.max() > 0.0:
            return 0.0
        rim = way > RIM_SHARE * way.max()
        center = fit_sphere(rest)[0]
        return 2.0 * widening(rest[rim] - self._rest[point], moved[rim] - rest[rim], self._rest[point] - center)


def widening(rim: Floats, way: Floats, gaze: Floats) -> float:
    """By how much the radius of a ring grows.

    Parameters
    ----------
    rim, way : (n, 3) vertices on it, from the pupil's point, and their offsets.
    gaze : (3,) across the ring, of any length; +Z, where a neutral face looks, if it is far from that.

    Notes
    -----
    Measured across the gaze, from the place where the lines of the ways meet (next to the pupil's point where they
    meet nowhere). A pupil's rim lies on an iris or on
    a bulge and goes up or down on it as well, which makes it no wider; and the feature point of the pupil lies on the
    cornea before it, or beside the middle of a ring that a mesh has no round vertices for.
    """
    if not gaze[2] > _SQUINT * np.linalg.norm(gaze):
        gaze = np.array([0.0, 0.0, 1.0])
    plane = np.linalg.svd(gaze[None])[2][1:]
    places, ways = rim @ plane.T, way @ plane.T
    lengths = np.linalg.norm(ways, axis=1, keepdims=True)
    across = (ways / np.maximum(lengths, 1e-300))[:, ::-1] * [-1.0, 1.0]
    middle = np.linalg.lstsq(across, np.einsum("ij,ij->i", across, places), rcond=1e-6)[0]
    outwards = places - middle
    outwards /= np.maximum(np.linalg.norm(outwards, axis=1, keepdims=True), 1e-300)
    return float(np.einsum("ij,ij->i", outwards, ways).mean())


def rotation_vector(before: Floats, after: Floats) -> Floats:
    """Rotation vector (3,) in radians of the rigid motion nearest to before -> after, both (n, 3) (Kabsch)."""
    a, b = before - before.mean(axis=0), after - after.mean(axis=0)
    u, _, vt = np.linalg.svd(a.T @ b)
    sign = np.sign(np.linalg.det(vt.T @ u.T))
    turn = vt.T @ np.diag([1.0, 1.0, sign]) @ u.T
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine = 0.5 * float(np.linalg.norm(axis))
    angle = float(np.arctan2(sine, 0.5 * (np.trace(turn) - 1.0)))
    vector: Floats = axis * (0.5 * angle / sine) if sine > 0.0 else np.zeros(3)
    return vector
