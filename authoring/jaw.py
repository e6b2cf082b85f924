"""The jaw: FAP 3 turns it about its joints, FAPs 14 and 15 push it forward and sideways.

The ear lobes' contact points 10.7 and 10.8 stand for the joints (condyles): rotations fitted to the jaws of modelled
faces turn about a line within .16 eye separations of theirs. Each vertex of the skin follows a share of the jaw's
motion, so it runs along an arc too; the lower teeth and the tongue follow all of it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from weakref import WeakKeyDictionary

import numpy as np

from authoring.construction import Construction, Offsets
from authoring.riders import skin_offsets
from authoring.spread import spread
from authoring.tongue import tongue
from cloning.bodies import Body, body
from cloning.prepare import PreparedFace
from cloning.surface import Surface
from fba.arrays import Bools, Floats
from fba.faps import fap
from fba.findings import Finding
from fba.scene import Role

OPEN_BORDERS = (128, 256, 384, 512, 640, 768, 896, 1024, 1280, 1536, 2048)
"""A chord of 128 MNS units stays within .1 % of the jaw's length of its arc."""

THRUST_BORDERS = (600,)
SHIFT_BORDERS = (-1080, -200, 200, 1080)

WIDEST = np.radians(25.0)
"""A jaw turns no farther (modelled ones 22 and 25 degrees); what a value asks for beyond that, it glides down."""

JOINTS = ("10.7", "10.8")

WITH_JAW = ("2.1", "2.3", "2.10", "2.11", "2.12", "8.2", "8.7", "8.8")
"""Feature points that follow the jaw wholly."""

SHARES: Mapping[str, float] = MappingProxyType(
    {
        **dict.fromkeys(WITH_JAW, 1.0),
        **dict.fromkeys(("2.8", "2.9"), 0.95),
        **dict.fromkeys(("2.4", "2.5", "8.3", "8.4"), 0.45),
        **dict.fromkeys(("5.1", "5.2"), 0.33),
        **dict.fromkeys(("2.13", "2.14"), 0.28),
        **dict.fromkeys(("2.2", "8.1", "8.9", "8.10"), 0.0),
        **dict.fromkeys(("2.6", "2.7", "8.5", "8.6"), 0.03),
        **dict.fromkeys(("5.3", "5.4"), 0.0),
        **dict.fromkeys([f"9.{k}" for k in (1, 2, 3, 4, 5, 6, 7, 12, 13, 14, 15)], 0.0),
        **dict.fromkeys([f"10.{k}" for k in range(1, 11)], 0.0),
    }
)
"""Shares of the other points: means of two modelled jaws (MakeHuman, ICT-FaceKit), rounded."""

SIDEWAYS: Mapping[str, float] = MappingProxyType(
    {
        **SHARES,
        **dict.fromkeys(("2.3", "2.8", "2.9", "8.2", "8.7", "8.8"), 0.9),
        **dict.fromkeys(("2.4", "2.5", "8.3", "8.4"), 0.5),
        **dict.fromkeys(("2.2", "2.6", "2.7", "8.1", "8.5", "8.6", "8.9", "8.10"), 0.25),
        **dict.fromkeys(("5.1", "5.2"), 0.0),
    }
)
"""Shares of a shift: the lips are dragged along, the cheeks' points rest, as they have a lateral FAP of their own."""

FARTHEST = 200
"""A jaw shifts about 10 mm, which is this in MW units; beyond it the teeth and the lips stay behind the chin."""

BEYOND: Mapping[str, float] = MappingProxyType(
    {
        **SIDEWAYS,
        **dict.fromkeys(("2.3", "2.8", "2.9"), 0.35),
        **dict.fromkeys(("8.2", "8.7", "8.8"), 0.4),
        **dict.fromkeys(("2.4", "2.5", "8.3", "8.4"), 0.2),
        **dict.fromkeys(("2.2", "2.6", "2.7", "8.1", "8.5", "8.6", "8.9", "8.10"), 0.1),
    }
)
"""Shares of a shift beyond what a jaw can do: only the chin goes wholly."""

TEETH_BEYOND = 0.25
"""Share of the teeth in that, so that they stay inside the cheeks."""

HELD = 100.0
"""How firmly a feature point holds its share; a region holds with 1."""

SOFT = 0.12
"""Length over which the shares go smoothly from one region to the next, in eye separations."""

MODELLED = 0.04
"""The same where the shares come from a modelled jaw: just enough to take its bumps away."""

THROAT = 1.1
"""The neck rests from this far below the chin, in eye separations."""

NECK_END = 0.05
"""So far above its lower end the skin stays exactly where it is, in eye separations: a body may go on there."""

CORNERS = ("2.4", "2.5")

CORNER, CORNER_HELD = 0.1, 10.0
"""This far around the inner corners of the lips, in eye separations, the folds of the corner go along as one piece."""

LINED = 0.1
"""How firmly the lining of the mouth holds to the teeth beside it in an opening, so that they stay covered."""

BESIDE_TEETH = 0.1
"""Skin nearer to the teeth than this is their gum or the lining of the mouth, in eye separations."""


@dataclass(frozen=True, eq=False)
class Jaw:
    """The jaw of one face.

    Attributes
    ----------
    joint : (3,) a point of the axis, in eye separations.
    axis : (3,) unit vector towards the subject's left.
    shares : (n,) how much of the jaw's turn each vertex of the skin follows; 1 at 2.1.
    sideways, beyond : (n,) the same for shifts up to FARTHEST and beyond it.
    """

    face: PreparedFace
    joint: Floats
    axis: Floats
    shares: Floats
    sideways: Floats
    beyond: Floats

    def opened(self, value: float) -> Offsets:
        """FAP 3: 2.1 goes down by `value`."""
        face = self.face
        drop = value * face.fapu.unit(fap(3).unit) / face.fapu.es0
        angle, glide = self._turn(drop)
        moved = self._turned(face.skin.vertices, self.shares, angle)
        moved[:, 1] -= glide * self.shares
        out = skin_offsets(face, moved)
        for part, share in self._parts:
            turned = self._turned(part.vertices / face.fapu.es0, share, angle)
            turned[:, 1] -= glide * share
            out |= part.split(face.fapu.es0 * turned)
        return out

    def thrust(self, value: float) -> Offsets:
        """FAP 14: 2.1 goes forward by `value`."""
        way = self._way(14, value)
        return self._carried(self.shares[:, None] * way, way)

    def shifted(self, value: float) -> Offsets:
        """FAP 15: 2.1 goes to the subject's right by `value`."""
        near = float(np.clip(value, -FARTHEST, FARTHEST))
        ways = self._way(15, near), self._way(15, value - near)
        skin = self.sideways[:, None] * ways[0] + self.beyond[:, None] * ways[1]
        return self._carried(skin, ways[0] + TEETH_BEYOND * ways[1])

    def _way(self, fap_id: int, value: float) -> Floats:
        """(3,) what a FAP asks of 2.1, in eye separations."""
        entry = fap(fap_id)
        return value * self.face.fapu.unit(entry.unit) / self.face.fapu.es0 * np.asarray(entry.direction)

    def _carried(self, skin: Floats, teeth: Floats) -> Offsets:
        """The skin's motion (n, 3) with teeth and tongue that go one way (3,), in eye separations."""
        out = skin_offsets(self.face, skin)
        for part, share in self._parts:
            out |= part.split(self.face.fapu.es0 * share[:, None] * teeth)
        return out

    def _turn(self, drop: float) -> tuple[float, float]:
        """Angle that takes the chin down, and how far the jaw glides down besides."""
        from scipy.optimize import brentq

        vertices, weights = self.face.skin.points["2.1"]
        places, shares = self.face.skin.vertices[vertices], self.shares[vertices]

        def fallen(angle: float) -> float:
            return -float(weights @ self._turned(places, shares, angle)[:, 1])

        most = fallen(WIDEST)
        if drop >= most:
            return WIDEST, drop - most
        return float(brentq(lambda angle: fallen(angle) - drop, -WIDEST, WIDEST, xtol=1e-14)), 0.0

    def _turned(self, places: Floats, shares: Floats, angle: float) -> Floats:
        """Offsets (n, 3) of places turned about the joints by their share of an angle."""
        local = places - self.joint
        along = (local @ self.axis)[:, None] * self.axis
        turn = (angle * shares)[:, None]
        moved: Floats = (np.cos(turn) - 1.0) * (local - along) + np.sin(turn) * np.cross(self.axis, local)
        return moved

    @cached_property
    def _parts(self) -> list[tuple[Body, Floats]]:
        """Lower teeth and tongue with the share that each of their vertices follows."""
        found = []
        for role in (Role.LOWER_TEETH, Role.TONGUE):
            part = body(self.face, role)
            if part is not None:
                share = np.ones(len(part.vertices)) if role is Role.LOWER_TEETH else self._below(part)
                found.append((part, share))
        return found

    def _below(self, part: Body) -> Floats:
        """Shares of a tongue: 1, but upper gums that are one mesh with it stay with the upper teeth."""
        made = tongue(self.face)
        upper, lower = (_distance(self.face, part.vertices, r) for r in (Role.UPPER_TEETH, Role.LOWER_TEETH))
        if made is None:
            return np.ones(len(part.vertices))
        above = (made.free < 0.5) & (upper < BESIDE_TEETH) & (upper < lower)
        if not above.any():
            return np.ones(len(part.vertices))
        below = ~above & ((lower < BESIDE_TEETH) | (made.free > 0.5))
        firmness = np.where(above, np.inf, below.astype(np.float64))
        return spread(made.surface)(np.where(above, 0.0, 1.0), firmness, 0.5 * SOFT)


def jaw(face: PreparedFace, unit: Offsets | None = None) -> Jaw:
    """Prepare the jaw of a face.

    Parameters
    ----------
    unit : offsets of a modelled jaw opening; its spread over the skin is taken. None = constructed.
    """
    if unit is None and face in _CONSTRUCTED:
        return _CONSTRUCTED[face]
    joint, axis, _ = joints(face)
    shares = _constructed(face, joint, axis, SHARES, LINED) if unit is None else _modelled(face, joint, axis, unit)
    shifts = (_constructed(face, joint, axis, s) for s in (SIDEWAYS, BEYOND))
    found = Jaw(face, joint, axis, *(_unit_at_chin(face, s) for s in (shares, *shifts)))
    if unit is None:
        _CONSTRUCTED[face] = found
    return found


_CONSTRUCTED: WeakKeyDictionary[PreparedFace, Jaw] = WeakKeyDictionary()


def joints(face: PreparedFace) -> tuple[Floats, Floats, list[Finding]]:
    """The jaw's axis: a point of it, in eye separations, its direction to the left, and what had to be assumed."""
    place = face.skin.positions
    if all(i in place for i in JOINTS):
        left, right = (place[i] for i in JOINTS)
        return 0.5 * (left + right), _unit(left - right), []
    said = Finding(
        "info",
        "derived-jaw-joint",
        "10.7 and 10.8 (the ear lobes' contact points) are not given; the jaw turns about the head's pivot 7.1",
        face.scene.name,
    )
    return place["7.1"], np.array([1.0, 0.0, 0.0]), [said]


def findings(face: PreparedFace) -> list[Finding]:
    """What had to be assumed about the jaw of a face."""
    return joints(face)[2]


def open_jaw(face: PreparedFace, values: Iterable[int], unit: Offsets | None = None) -> dict[int, Offsets]:
    """FAP 3 at each of these values; the jaw carries the lower lip ("practical").

    Parameters
    ----------
    values : FAP values, in MNS units.
    unit : offsets of a modelled jaw opening, of which the spread over the skin is taken; None = constructed.
    """
    opening = jaw(face, unit)
    return {value: opening.opened(value) for value in values}


def _constructed(
    face: PreparedFace, joint: Floats, axis: Floats, shares: Mapping[str, float], lined: float = 0.0
) -> Floats:
    """Shares from the feature points: jaw and lower lip go, the head above and behind and the neck rest."""
    skin = face.skin
    wanted, firmness = np.zeros(skin.vertex_count), np.zeros(skin.vertex_count)
    firmness[_resting(face, joint, axis)] = 1.0
    firmness[_lower_end(skin)] = np.inf
    upper, lower = (_distance(face, skin.vertices * face.fapu.es0, r) for r in (Role.UPPER_TEETH, Role.LOWER_TEETH))
    nearer = np.minimum(upper, lower)
    beside = (nearer < BESIDE_TEETH) & (np.maximum(upper, lower) > nearer + 0.5 * BESIDE_TEETH)
    firmness[beside] = lined
    wanted[beside & (lower < upper)] = 1.0
    corners = [i for i in CORNERS if i in skin.points]
    for key, near in zip(corners, skin.distances(corners, CORNER) < CORNER, strict=True):
        wanted[near], firmness[near] = shares[key], CORNER_HELD
    for key, share in shares.items():
        if key in skin.points:
            vertices, weights = skin.points[key]
            wanted[vertices], firmness[vertices] = share, np.maximum(firmness[vertices], HELD * weights)
            if share == 0.0:
                firmness[vertices[weights > 0.0]] = np.inf
    return spread(skin)(wanted, firmness, SOFT)


def _resting(face: PreparedFace, joint: Floats, axis: Floats) -> Bools:
    """The head above the plane through the joints and the base of the nose, what is behind them, and the neck."""
    place, local = face.skin.positions, face.skin.vertices - joint
    up = _unit(np.cross(place["9.15"] - joint, axis))
    above = local @ up > 0.0
    behind = local[:, 2] < 0.0
    neck = face.skin.vertices[:, 1] < place["2.1"][1] - THROAT
    return np.asarray(above | behind | neck)


def _lower_end(skin: Surface) -> Bools:
    """The end of the neck; nothing on a mask that ends with its chin."""
    height = skin.vertices[:, 1]
    return np.asarray(height < min(height.min() + NECK_END, skin.positions["2.1"][1] - NECK_END))


def _modelled(face: PreparedFace, joint: Floats, axis: Floats, unit: Offsets) -> Floats:
    """Shares of a modelled opening: the angle by which each vertex is turned about the joints, beside the chin's."""
    skin = face.skin
    local = skin.vertices - joint
    before = local - (local @ axis)[:, None] * axis
    moved = local + skin.join(unit) / face.fapu.es0
    after = moved - (moved @ axis)[:, None] * axis
    angle = np.arctan2(np.cross(before, after) @ axis, np.einsum("ij,ij->i", before, after))
    chin = float((skin.point_matrix(["2.1"]) @ angle)[0])
    lever = np.einsum("ij,ij->i", before, before)
    end = _lower_end(skin)
    shares = np.where(end, 0.0, np.clip(angle / chin, 0.0, 1.0))
    return spread(skin)(shares, np.where(end, np.inf, lever), MODELLED)


def _unit_at_chin(face: PreparedFace, shares: Floats) -> Floats:
    at: Floats = np.minimum(shares, 1.0) / float((face.skin.point_matrix(["2.1"]) @ shares)[0])
    return at


def _distance(face: PreparedFace, places: Floats, role: Role) -> Floats:
    """(n,) distance of places, in mesh units, from the nearest vertex of a body, in eye separations."""
    from scipy.spatial import cKDTree

    part = body(face, role)
    if part is None:
        return np.full(len(places), np.inf)
    return np.asarray(cKDTree(part.vertices).query(places)[0]) / face.fapu.es0


def _unit(vector: Floats) -> Floats:
    return vector / np.linalg.norm(vector)


NEEDS = ("2.1", "2.3", "2.4", "2.5", "9.15")

CONSTRUCTIONS: Mapping[int, Construction] = MappingProxyType(
    {
        3: Construction(3, OPEN_BORDERS, NEEDS, lambda face, value: jaw(face).opened(value)),
        14: Construction(14, THRUST_BORDERS, NEEDS, lambda face, value: jaw(face).thrust(value)),
        15: Construction(15, SHIFT_BORDERS, NEEDS, lambda face, value: jaw(face).shifted(value)),
    }
)
