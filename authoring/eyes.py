"""The eyeballs: FAPs 27 and 28 push them forward or back, FAPs 29 and 30 change the size of the pupils.

Eyeballs turn (FAPs 23-26) by nodes of the scene, not by vertices. A pupil can only change where the mesh of the
eyeball has a ring of vertices around it.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from weakref import WeakKeyDictionary

import numpy as np

from authoring.construction import Construction, Offsets
from authoring.lids import STILL_POINTS
from authoring.on_eyeball import eyeball, keep_clear
from authoring.riders import in_mesh_units, skin_offsets
from authoring.spread import spread
from cloning.bodies import Body, body
from cloning.eyeballs import NEAR, Ball
from cloning.parts import PUPILS, eye_center
from cloning.prepare import PreparedFace
from cloning.surface import polygon_edges
from fba.arrays import Floats, Ints
from fba.faps import fap

SIDES: Mapping[int, str] = MappingProxyType({27: "3.5", 28: "3.6", 29: "3.5", 30: "3.6"})
"""FAP -> pupil."""

THRUST_BORDERS = (-600, -150, 100, 300, 600)
DILATION_BORDERS = (-300, 420)
"""At -341 a pupil of IRISD0/3, as MPEG-4's neutral face has it, would be closed."""

PUPIL, IRIS = 1.0 / 6.0, 0.5
"""Their radii in IRISD0 in MPEG-4's neutral face."""

LIKELY = 1.8
"""A ring counts as the rim of the pupil or iris if its radius differs by less than this factor."""

EVEN = 0.01
"""The radii of a ring's vertices differ from one to the next by less than this share of the one looked for."""

ROUND = 0.08
"""All radii of a ring lie within this share of the radius that is looked for."""

FEWEST = 6
"""Vertices of a ring."""

TOUCHES = 0.15
"""Skin nearer to the ball than this, in radii, is pushed out with it."""

IN_FRONT = 0.5
"""Cosine of the angle to the gaze within which it lies before the ball, not beside it."""

HELD = 30.0
"""How firmly the lids go with the ball: their margins would fold if one side stayed behind."""

FOLLOWS_BACK = 0.15
"""Lids sink in by this share of the way of an eyeball that goes back."""

SMOOTH = 0.06
"""Length over which the skin around the eye goes along less and less, in eye separations."""


def thrust(face: PreparedFace, fap_id: int, value: int) -> Offsets:
    """FAP 27 or 28: the eyeball goes forward by a value, the lids on it with it; empty without an eyeball."""
    joined = body(face, PUPILS[SIDES[fap_id]])
    ball = eyeball(face, SIDES[fap_id])
    if joined is None or ball is None:
        return {}
    entry = fap(fap_id)
    way = value * face.fapu.unit(entry.unit) / face.fapu.es0 * np.asarray(entry.direction)
    share = _around(face, SIDES[fap_id], ball) * (1.0 if value > 0 else FOLLOWS_BACK)
    skin = share[:, None] * way
    keep_clear(face, ball, skin, way)
    return skin_offsets(face, skin) | in_mesh_units(face, joined.split(np.broadcast_to(way, joined.vertices.shape)))


_AROUND: WeakKeyDictionary[PreparedFace, dict[str, Floats]] = WeakKeyDictionary()


def _around(face: PreparedFace, pupil: str, ball: Ball) -> Floats:
    """(n,) how much the skin goes along with an eyeball: the lids wholly, what is off the ball not at all."""
    known = _AROUND.setdefault(face, {})
    if pupil not in known:
        skin = face.skin
        wanted, firmness = np.zeros(skin.vertex_count), np.full(skin.vertex_count, np.inf)
        local = ball.rest - ball.center
        clear = ball.clearance(local)
        on_ball = (clear < TOUCHES) & (local[:, 2] > IN_FRONT * np.linalg.norm(local, axis=1))
        wanted[ball.vertices[on_ball]] = 1.0
        firmness[ball.vertices[clear < NEAR - 1.05]] = 0.0
        firmness[ball.vertices[on_ball]] = HELD
        for key in STILL_POINTS:
            if key in skin.points:
                vertices, weights = skin.points[key]
                wanted[vertices[weights > 0.0]], firmness[vertices[weights > 0.0]] = 0.0, np.inf
        known[pupil] = spread(skin)(wanted, firmness, SMOOTH)
    return known[pupil]


def dilate(face: PreparedFace, fap_id: int, value: int) -> Offsets:
    """FAP 29 or 30: the pupil's diameter grows by a value; empty where the eyeball has no ring around the pupil."""
    key = SIDES[fap_id]
    joined = body(face, PUPILS[key])
    if joined is None or face.points[key].shape not in joined.names:
        return {}
    pupil = face.place(key)
    center = eye_center(joined.vertices, pupil)
    gaze = (pupil - center) / np.linalg.norm(pupil - center)
    radius = _off_axis(joined.vertices - center, gaze)
    rim = _ring(joined, center, gaze, radius, PUPIL * face.fapu.irisd0)
    if rim is None:
        return {}
    edge = _ring(joined, center, gaze, radius, IRIS * face.fapu.irisd0)
    outside = float(radius[edge].mean()) if edge is not None else IRIS * face.fapu.irisd0
    inside = float(radius[rim].mean())
    front = (joined.vertices - center) @ gaze > 0.0
    growth = 0.5 * value * face.fapu.unit(fap(fap_id).unit)
    if not -inside < growth < outside - inside:
        return {}
    grown = np.interp(radius, [0.0, inside, outside], [0.0, growth, 0.0])
    moved = _spread_from_axis(joined.vertices - center, gaze, np.where(front, grown, 0.0))
    return {name: part for name, part in joined.split(moved).items() if part.any()}


def _ring(joined: Body, center: Floats, gaze: Floats, radius: Floats, wanted: float) -> Ints | None:
    """The vertices of a ring about the gaze whose radius is next to the one wanted; None if there is none."""
    front: Ints = np.flatnonzero(((joined.vertices - center) @ gaze > 0.0) & (radius > 0.0)).astype(np.int32)
    order = front[np.argsort(radius[front], kind="stable")]
    cuts = np.flatnonzero(np.diff(radius[order]) > EVEN * wanted) + 1
    runs = [run.astype(np.int32) for run in np.split(order, cuts) if np.ptp(radius[run]) < ROUND * wanted]
    rings = [ring for ring in runs if _closed(joined, ring, center, gaze)]
    ratios = [abs(float(np.log(radius[ring].mean() / wanted))) for ring in rings]
    if not ratios or min(ratios) > np.log(LIKELY):
        return None
    return np.asarray(rings[int(np.argmin(ratios))], dtype=np.int32)


def _closed(joined: Body, ring: Ints, center: Floats, gaze: Floats) -> bool:
    """True if vertices lie all around an axis, each one joined to the next by an edge."""
    if len(ring) < FEWEST:
        return False
    local = joined.vertices[ring] - center
    first = np.cross(gaze, np.eye(3)[int(np.argmin(np.abs(gaze)))])
    order = ring[np.argsort(np.arctan2(local @ np.cross(gaze, first), local @ first), kind="stable")]
    edges = {(int(a), int(b)) for a, b in polygon_edges(joined.indices, joined.offsets)}
    pairs = np.sort(np.stack([order, np.roll(order, -1)], axis=1), axis=1)
    return all((int(a), int(b)) in edges for a, b in pairs)


def _off_axis(local: Floats, gaze: Floats) -> Floats:
    distance: Floats = np.linalg.norm(local - (local @ gaze)[:, None] * gaze, axis=1)
    return distance


def _spread_from_axis(local: Floats, gaze: Floats, growth: Floats) -> Floats:
    """Offsets that take places off an axis by a growth (n,), at the same distance from the middle of the ball."""
    height = local @ gaze
    out = local - height[:, None] * gaze
    radius = np.maximum(np.linalg.norm(out, axis=1), 1e-300)
    wider = radius + growth
    lower = np.sqrt(np.maximum(height**2 + radius**2 - wider**2, 0.0))
    moved: Floats = (growth / radius)[:, None] * out
    moved += np.where(growth != 0.0, np.sign(height) * lower - height, 0.0)[:, None] * gaze
    return moved


def _construction(fap_id: int) -> Construction:
    pushes = fap_id in (27, 28)
    make = thrust if pushes else dilate
    borders = THRUST_BORDERS if pushes else DILATION_BORDERS
    return Construction(fap_id, borders, (SIDES[fap_id],), lambda face, value: make(face, fap_id, value))


CONSTRUCTIONS: Mapping[int, Construction] = MappingProxyType({n: _construction(n) for n in SIDES})
