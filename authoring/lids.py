"""The lids, FAPs 19-22: skin that slides over the eyeball and closes on a line.

A lid turns about the horizontal axis through the middle of the eyeball, so it keeps its distance from the ball. In
every slice of constant x its rim goes the same share of the way to the other lid's rim: 1024 units of the upper or
the lower lid close the eye, and so does any mixture of both with that sum. The skin between the rim and the brow (or
the cheek) follows less and less.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from weakref import WeakKeyDictionary

import numpy as np

from authoring.construction import Construction, Offsets
from authoring.lid_rims import from_rim, rim_line, to_the_corners
from authoring.on_eyeball import eyeball, keep_clear
from authoring.riders import carried, in_mesh_units
from authoring.spread import Spread, smoothstep, spread
from authoring.unfold import unfold
from cloning.eyeballs import Ball
from cloning.labels import OPPOSITE
from cloning.prepare import PreparedFace
from cloning.rims import EYES, Eye, eyes
from fba.arrays import Bools, Floats
from fba.faps import fap
from fba.fapu import FAPU_DIVISOR
from fba.findings import Finding

LIDS = {19: (0, 0), 20: (1, 0), 21: (0, 1), 22: (1, 1)}
"""FAP -> eye (0 left, 1 right) and lid (0 upper, 1 lower)."""

UPPER_BORDERS = (-1080, -768, -512, -256, 256, 512, 768, 1024, 1080)
LOWER_BORDERS = (-600, -256, 256, 512, 600)
"""A chord of 256 units stays within .4 % of the eyeball's radius of its arc."""

OVERLAP = 0.06
"""A rim goes this share of the eye's opening beyond the other one, but for its feature point, which goes exactly its
way; so no light falls through where rims with different vertices meet. Half-way
it does so hardly at all."""

ANY = 1.0
"""Rims that have gone farther than asked are left so."""

BESIDE = 0.1
"""Share of the way from the feature point to each corner over which the overlap grows."""

CORNER = 0.35
"""Unlabelled skin this near to the line between the ends of both rims, as a share of its length, is the corner."""

SPARE = 0.18
"""At the ends of the rims a closed lid leaves this share of the opening to the margin, which folds up there: skin
that is pressed flat turns over ..."""

NEAR_END = 0.1
"""... fading over this share of the eye's width."""

RIM = 0.02
"""So near to its rim, in eye separations, a lid goes along wholly."""

CLOSING, OPENING = 0.22, 0.4
"""Farther from the rim the skin outside rests, in eye separations: a closing lid unrolls from its fold, an opening
one pushes the skin together up to the brow."""

BEHIND = 0.35
"""Farther from the rim the lining of the socket rests, in eye separations."""

SMOOTH = 0.04
"""Length over which shares are smoothed, in eye separations."""

HELD = 100.0
"""How firmly rims and feature points hold their share."""

STILL_POINTS = (
    *(f"4.{k}" for k in range(1, 7)),
    *(f"5.{k}" for k in range(1, 5)),
    *(f"9.{k}" for k in (1, 2, 3, 4, 5, 6, 7, 12, 13, 14, 15)),
)

SINKS = 0.6
"""A closed lid gives up this share of the distance by which its rim stands farther out than the other one, so that
no slit opens between them from below."""

FARTHEST = np.radians(70.0)
"""A lid turns by less than this."""

STEEPEST = 0.97
"""Largest sine of a rim's height over the middle of the ball."""


@dataclass(frozen=True, eq=False)
class Follow:
    """How the skin follows a rim.

    Attributes
    ----------
    shares : (n,) share of the rim's turn that is wanted of each vertex.
    firmness : (n,) how firmly it holds that, as in `Spread`.
    """

    shares: Floats
    firmness: Floats


@dataclass(frozen=True, eq=False)
class Lid:
    """One lid of a face that is ready to move.

    Attributes
    ----------
    eye, part : of `cloning.rims`; part 0 upper, 1 lower.
    ball : the eyeball.
    slices : (s,) x of the rim, as far as both rims are apart.
    rims : (2, s) heights of the own and of the other rim over the middle of the ball.
    reach : (2, s) distance of these rims from the axis through the middle of the ball.
    closing, opening : how the skin follows the rim.
    """

    face: PreparedFace
    fap_id: int
    eye: Eye
    part: int
    ball: Ball
    slices: Floats
    rims: Floats
    reach: Floats
    closing: Follow
    opening: Follow

    def at(self, value: float) -> Offsets:
        """Offsets at a FAP value; the lid's feature point moves by exactly that."""
        face = self.face
        turn = self._turn(self.closing if value > 0 else self.opening, value)
        scale = self._exact(turn, value)
        turned = self._turned(face.skin.vertices, turn, value, scale)
        skin = turned.copy()
        if value > 0:
            skin[self.eye.lids[self.part].vertices, 1] += self.eye.follow(self.part, skin, self._travel(value), ANY)
        keep_clear(face, self.ball, skin)
        unfold(face.skin, skin)
        keep_clear(face, self.ball, skin)
        riders = carried(face, skin - turned)
        turns = carried(face, np.repeat(turn[:, None], 3, axis=1))
        for name, rest in riders.items():
            places = face.scene.world_vertices(name) / face.fapu.es0
            rest += self._turned(places, turns[name][:, 0], value, scale)
        return in_mesh_units(face, {**face.skin.split(skin), **riders})

    def angles(self, value: float) -> Floats:
        """(s,) angle about +x that takes the rim its share of the way to the other rim."""
        own, other = self.rims
        goal = own + value / FAPU_DIVISOR * self._ends(self.slices, value) * (other - own)
        sines = [np.arcsin(np.clip(y / self.reach[0], -STEEPEST, STEEPEST)) for y in (own, goal)]
        angles: Floats = sines[0] - sines[1]
        return angles

    def _turn(self, follow: Follow, value: float) -> Floats:
        """(n,) angle of the skin: the rim's at the rim, from there over the skin as a thin plate would bend."""
        angles = self.angles(value)
        most = angles[np.argmax(np.abs(angles))]
        wanted = np.interp(self.face.skin.vertices[:, 0], self.slices, angles) / most
        turn: Floats = most * _plate(self.face)(follow.shares * wanted, follow.firmness, SMOOTH)
        return turn

    def _turned(self, places: Floats, turn: Floats, value: float, scale: tuple[float, float]) -> Floats:
        """Offsets (n, 3) of places that turn by an angle (n,) times a scale, and are lifted besides."""
        follows = turn / np.abs(self.angles(value)).max()
        _, y, z = (places - self.middle).T
        nearer = 1.0 - np.abs(follows) * np.interp(places[:, 0], self.slices, self._sink(value)) / np.hypot(y, z)
        cosine, sine = nearer * np.cos(scale[0] * turn) - 1.0, nearer * np.sin(scale[0] * turn)
        return np.column_stack(
            [np.zeros(len(places)), cosine * y - sine * z + scale[1] * np.abs(follows), sine * y + cosine * z]
        )

    def _sink(self, value: float) -> Floats:
        """(s,) by how much the rim comes nearer to the axis."""
        farther: Floats = np.maximum(self.reach[0] - self.reach[1], 0.0)
        return SINKS * max(value, 0.0) / FAPU_DIVISOR * farther

    def _exact(self, turn: Floats, value: float) -> tuple[float, float]:
        """The scale of the turn, and the lift besides, with which the feature point moves exactly by the value."""
        from scipy.optimize import brentq

        entry, skin = fap(self.fap_id), self.face.skin
        assert entry.direction is not None
        vertices, weights = skin.points[entry.feature_points[0]]
        wanted = value * self.face.fapu.unit(entry.unit) / self.face.fapu.es0 * entry.direction[1]

        def missing(scale: float, lift: float = 0.0) -> float:
            turned = self._turned(skin.vertices[vertices], turn[vertices], value, (scale, lift))
            return float(weights @ turned[:, 1]) - wanted

        most = FARTHEST / float(np.abs(turn[vertices]).max())
        if missing(0.0) * missing(most) < 0.0:
            return float(brentq(missing, 0.0, most, xtol=1e-13)), 0.0
        return most, -missing(most) / (missing(most, 1.0) - missing(most))

    def _travel(self, value: float) -> Floats:
        """Share of the opening for each of the eye's slices."""
        count = len(self.eye.open)
        beside = smoothstep(np.abs(np.linspace(-1.0, 1.0, count + 2)[1:-1]) / BESIDE)
        closed = value / FAPU_DIVISOR
        travel: Floats = closed * (1.0 + closed**2 * beside * OVERLAP)
        return travel * self._ends(self.eye.lids[self.part].span, value)

    def _ends(self, x: Floats, value: float) -> Floats:
        """Factor of the way at x: less than 1 at both ends of a closing lid."""
        first, last = self.slices[0], self.slices[-1]
        inside = np.minimum(x - first, last - x) / (NEAR_END * (last - first))
        factor: Floats = 1.0 - SPARE * max(value, 0.0) / FAPU_DIVISOR * (1.0 - smoothstep(inside))
        return factor

    @property
    def middle(self) -> Floats:
        """(3,) the middle of the ball, in eye separations."""
        center: Floats = self.ball.center / self.face.fapu.es0
        return center


def close_lid(
    face: PreparedFace, fap_id: int, values: Iterable[int], unit: Offsets | None = None
) -> dict[int, Offsets]:
    """FAPs 19-22 at each of these values; empty where the lids are grown together.

    Parameters
    ----------
    values : FAP values in IRISD units; 1024 closes the eye, negative ones open it wider.
    unit : offsets of a modelled closing, of which the spread over the skin is taken; None = constructed.
    """
    found = lid(face, fap_id, unit)
    return {} if found is None else {value: found.at(value) for value in values}


def findings(face: PreparedFace) -> list[Finding]:
    """Why lids cannot be made, for each eye of which that is so."""
    return [
        Finding(
            "warning",
            "no-lids",
            f"the {side} eye's lids cannot close: they are grown together, too coarse, or there is no eyeball "
            "below them; model the eye open, and give feature points at its lids and corners",
            face.scene.name,
        )
        for side, fap_id in (("left", 19), ("right", 20))
        if lid(face, fap_id) is None
    ]


_MADE: WeakKeyDictionary[PreparedFace, dict[int, Lid | None]] = WeakKeyDictionary()


def lid(face: PreparedFace, fap_id: int, unit: Offsets | None = None) -> Lid | None:
    """Prepare a lid; None where the lids are grown together or there is no eyeball.

    Parameters
    ----------
    unit : as for `close_lid`.
    """
    made = _MADE.setdefault(face, {})
    if fap_id not in made:
        made[fap_id] = _lid(face, fap_id)
    found = made[fap_id]
    if found is None or unit is None:
        return found
    return replace(found, closing=_modelled(found, unit))


def _lid(face: PreparedFace, fap_id: int) -> Lid | None:
    side, part = LIDS[fap_id]
    eye = to_the_corners(eyes(face)[side])
    ball = eyeball(face, ("3.5", "3.6")[side])
    if eye is None or ball is None:
        return None
    center = ball.center / face.fapu.es0
    own, other = (rim_line(eye, k) - center for k in (part, 1 - part))
    heights = np.stack([own[:, 1], np.interp(own[:, 0], other[:, 0], other[:, 1])])
    reach = np.stack([np.hypot(*own[:, 1:].T), np.interp(own[:, 0], other[:, 0], np.hypot(*other[:, 1:].T))])
    still = Follow(np.zeros(0), np.zeros(0))
    found = Lid(face, fap_id, eye, part, ball, own[:, 0] + center[0], heights, reach, still, still)
    closing, opening = (_constructed(found, above) for above in (CLOSING, OPENING))
    return replace(found, closing=closing, opening=opening)


def _constructed(lid: Lid, above: float) -> Follow:
    """Skin that follows the rim smoothly and rests `above` it outside."""
    rim, rest = _regions(lid, above)
    shares, firmness = _corners(lid)
    firmness[rim], firmness[rest] = HELD, np.inf
    return Follow(np.where(rim, 1.0, np.where(rest, 0.0, shares)), firmness)


def _corners(lid: Lid) -> tuple[Floats, Floats]:
    """Shares (n,) and their firmness of the skin between the ends of both rims: it closes like a bellows."""
    skin, labels = lid.face.skin, lid.face.labels.values
    shares, firmness = np.zeros(skin.vertex_count), np.zeros(skin.vertex_count)
    lines = [rim_line(lid.eye, k) for k in (lid.part, 1 - lid.part)]
    for end in (0, -1):
        own, other = (line[end] for line in lines)
        way = other - own
        at = np.clip((skin.vertices - own) @ way / (way @ way), 0.0, 1.0)
        away = np.linalg.norm(skin.vertices - own - at[:, None] * way, axis=1)
        between = (labels == 0) & (away < CORNER * np.linalg.norm(way))
        height = np.clip((skin.vertices[:, 1] - other[1]) / (own[1] - other[1]), 0.0, 1.0)
        shares[between] = height[between]
        firmness[between] = HELD
    return shares, firmness


def _modelled(lid: Lid, unit: Offsets) -> Follow:
    """As a modelled closing does: the angle by which each vertex is turned beside that of the rim at its x."""
    skin = lid.face.skin
    y, z = (skin.vertices - lid.middle)[:, 1:].T
    moved = skin.vertices - lid.middle + skin.join(unit) / lid.face.fapu.es0
    angle = np.arctan2(y * moved[:, 2] - z * moved[:, 1], y * moved[:, 1] + z * moved[:, 2])
    rims = np.interp(skin.vertices[:, 0], lid.slices, lid.angles(FAPU_DIVISOR), left=0.0, right=0.0)
    point = skin.point_matrix([fap(lid.fap_id).feature_points[0]])
    full = float((point @ angle)[0]) / float((point @ rims)[0])
    shares = np.clip(np.divide(angle, full * rims, out=np.zeros_like(angle), where=rims != 0.0), 0.0, 1.0)
    rim, rest = _regions(lid, OPENING)
    between, firmness = _corners(lid)
    shares = np.where(firmness > 0.0, between, shares)
    firmness = np.maximum(firmness, (rims / np.abs(rims).max()) ** 2)
    firmness[rim], firmness[rest] = HELD, np.inf
    return Follow(np.where(rim, 1.0, np.where(rest, 0.0, shares)), firmness)


def _regions(lid: Lid, above: float) -> tuple[Bools, Bools]:
    """(n,) the skin at the rim that goes along wholly, and the skin that rests."""
    skin, labels = lid.face.skin, lid.face.labels.values
    side, part = LIDS[lid.fap_id]
    own = 3 + 2 * side + part
    away = from_rim(skin, lid.eye, lid.part, 1.5 * max(BEHIND, OPENING))
    lining = np.einsum("ij,ij->i", skin.normals, skin.vertices - lid.middle) < 0.0
    rest = (away > np.where(lining, BEHIND, above)) | (labels == OPPOSITE[own])
    for key in STILL_POINTS:
        if key in skin.points:
            vertices, weights = skin.points[key]
            rest[vertices[weights > 0.0]] = True
    return (away < RIM) & (labels == own) & ~rest, rest


def _plate(face: PreparedFace) -> Spread:
    if face not in _PLATES:
        _PLATES[face] = spread(face.skin)
    return _PLATES[face]


_PLATES: WeakKeyDictionary[PreparedFace, Spread] = WeakKeyDictionary()


def _construction(fap_id: int, borders: tuple[int, ...]) -> Construction:
    needs = [k for corners, lids in EYES for k in (*corners, lids[0][0], lids[1][0]) if fap_id in _OF_EYE[corners]]
    return Construction(
        fap_id, borders, tuple(needs), lambda face, value: close_lid(face, fap_id, [value]).get(value, {})
    )


_OF_EYE = {EYES[0][0]: (19, 21), EYES[1][0]: (20, 22)}

CONSTRUCTIONS: Mapping[int, Construction] = MappingProxyType(
    {n: _construction(n, UPPER_BORDERS if LIDS[n][1] == 0 else LOWER_BORDERS) for n in LIDS}
)
