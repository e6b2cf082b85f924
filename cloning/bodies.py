"""Motion of the parts that are not skin: lower teeth, tongue and eyeballs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cloning.bind import nearest_on
from cloning.fill import HarmonicFill
from cloning.normalize import TONGUE, factors
from cloning.parts import LOWER_TEETH, PUPILS, eye_center
from cloning.prepare import PreparedFace
from cloning.rigid import fit_rigid
from cloning.similarity import fit_similarity
from cloning.surface import polygon_edges
from fat.conformance import RIM_SHARE, widening
from fba.arrays import Floats, Ints
from fba.faps import Unit
from fba.scene import Role
from fba.sphere import fit_sphere

RIGID = 0.02
"""A body whose motion is rigid up to this share of its size is carried as a rotation and a translation alone."""

TONGUE_REACH = 0.12
"""A tongue vertex farther than this from the source's tongue after alignment takes its neighbours' motion (ES)."""

MOUTH = ("2.1", "2.2", "2.3", "2.4", "2.5", "2.10", "8.1", "8.2", "9.15")
"""By these a tongue without points of its own is laid into the source's mouth."""

TOUCHING = 0.06
"""Gums nearer than this to teeth move with them, in eye separations."""

BESIDE = 0.05
"""Gums are farther than this from where the source's tongue lies, in eye separations; a tongue's tip touches teeth."""

RING = 0.5
"""A rim that widens by less than this share of its farthest way is no pupil's."""

PASSES = 4
COARSER = 1.5
"""A pupil's rim on a coarse eyeball is widened or narrowed by at most this factor to move as far as the source's."""

STILL = 1e-3
"""Feature points that move less than this share of a motion's largest offset rest."""

BUMP = 0.5
"""Width of what is added around a feature point of the tongue, of the distance to the next one."""


@dataclass(frozen=True, eq=False)
class Body:
    """All shapes of one role joined: names, first vertex of each, world vertices, polygons."""

    names: tuple[str, ...]
    starts: Ints
    vertices: Floats
    indices: Ints
    offsets: Ints
    triangles: Ints

    def join(self, motions: Sequence[Any]) -> Floats:
        """(n, K, 3) offsets from K mappings shape -> (n_s, 3)."""
        out = np.zeros((len(self.vertices), len(motions), 3))
        for k, motion in enumerate(motions):
            for s, name in enumerate(self.names):
                if name in motion:
                    out[self.starts[s] : self.starts[s + 1], k] = motion[name]
        return out

    def split(self, offsets: Floats) -> dict[str, Floats]:
        return {name: offsets[self.starts[s] : self.starts[s + 1]] for s, name in enumerate(self.names)}


def body(face: PreparedFace, role: Role) -> Body | None:
    """Join the shapes of a role; None if there are none."""
    shapes = [s for s in face.scene.with_role(role) if s.mesh.vertex_count]
    if not shapes:
        return None
    starts = np.concatenate([[0], np.cumsum([s.mesh.vertex_count for s in shapes])]).astype(np.int32)
    corners = np.concatenate([[0], np.cumsum([s.mesh.indices.size for s in shapes])])
    return Body(
        tuple(s.name for s in shapes),
        starts,
        np.concatenate([face.scene.world_vertices(s.name) for s in shapes]),
        np.concatenate([s.mesh.indices + starts[k] for k, s in enumerate(shapes)]).astype(np.int32),
        np.concatenate([s.mesh.offsets[:-1] + corners[k] for k, s in enumerate(shapes)] + [corners[-1:]]).astype(
            np.int32
        ),
        np.concatenate([s.mesh.triangles + starts[k] for k, s in enumerate(shapes)]).astype(np.int32),
    )


Mover = Callable[[Floats], Floats]
"""(n_source, K, 3) offsets of a source's body to (n_target, K, 3) of the target's, mesh units."""


def teeth_mover(source: PreparedFace, target: PreparedFace, mine: Body, yours: Body, turning: bool) -> Mover:
    """Lower teeth: one rigid motion; the rotation of the source, its path scaled by the jaw's FAPUs.

    Parameters
    ----------
    turning : False carries the translation alone, as Facial Motion Cloning publishes it.
    """
    shared = all(i in face.points for i in LOWER_TEETH for face in (source, target))
    center_s, center_t = (_middle(f, b, LOWER_TEETH if shared else ()) for f, b in ((source, mine), (target, yours)))
    ratio = factors(target.fapu, ["9.11"])[0] / factors(source.fapu, ["9.11"])[0]

    def move(offsets: Floats) -> Floats:
        motion = fit_rigid(mine.vertices, offsets, center_s)
        if turning:
            return motion.offsets(yours.vertices, center_t, ratio)
        return np.broadcast_to(motion.shifts * ratio, (len(yours.vertices), *motion.shifts.shape)).copy()

    return move


def eye_mover(source: PreparedFace, target: PreparedFace, mine: Body, yours: Body, role: Role) -> Mover:
    """Eyeballs: rotation and translation as they are; what is not rigid (a pupil's dilation) by place on the ball."""
    pupil = next(key for key, r in PUPILS.items() if r is role)
    center_s = eye_center(mine.vertices, source.place(pupil))
    center_t = eye_center(yours.vertices, target.place(pupil))
    ratio = np.full(3, target.fapu.base(Unit.ES) / source.fapu.base(Unit.ES))
    size = fit_sphere(yours.vertices)[1] / fit_sphere(mine.vertices)[1]
    iris = target.fapu.irisd0 / source.fapu.irisd0
    gaze = (target.place(pupil) - center_t) / np.linalg.norm(target.place(pupil) - center_t)
    gaze_s = (source.place(pupil) - center_s) / np.linalg.norm(source.place(pupil) - center_s)
    away = yours.vertices - center_t
    along = away @ gaze
    front = (along > 0.0)[:, None]
    places = center_s + np.where(
        front, along[:, None] * gaze / size + (away - along[:, None] * gaze) / iris, away / size
    )
    triangles, weights, _ = nearest_on(places, mine.vertices, mine.triangles)
    corners = mine.triangles[triangles]
    at_pupil = _point_rows(source, mine, [pupil]), _point_rows(target, yours, [pupil])

    def move(offsets: Floats) -> Floats:
        motion = fit_rigid(mine.vertices, offsets, center_s)
        out = motion.offsets(yours.vertices, center_t, ratio)
        soft = motion.residual > RIGID
        if soft.any():
            rest = offsets - motion.offsets(mine.vertices, center_s, np.ones(3))
            goals = _at(at_pupil[0], offsets[:, soft]) * ratio
            wanted = iris * _widths(mine.vertices - source.place(pupil), offsets[:, soft], gaze_s)
            out[:, soft] += _exact(
                iris * np.einsum("nc,nckd->nkd", weights, rest[corners][:, :, soft]),
                out[:, soft],
                goals,
                wanted,
                at_pupil[1],
                yours.vertices - target.place(pupil),
                gaze,
            )
        return out

    return move


def _exact(
    added: Floats, rigid: Floats, goals: Floats, wanted: Floats, rows: Floats, places: Floats, gaze: Floats
) -> Floats:
    """What is added (n, K, 3) to a rigid motion: the rim widens as wanted (K,), the pupil's point is at its goal.

    Parameters
    ----------
    goals : (k, K, 3) of the points of rows (k, n); k is 0 where the pupil is no point of the ball.
    places : (n, 3) vertices from the pupil's point.
    gaze : (3,) unit, across which the rim's way counts.
    """
    for _ in range(PASSES):
        far = _widths(places, rigid + added, gaze)
        rings = np.abs(far) > RING * np.linalg.norm(rigid + added, axis=2).max(axis=0)
        ratio = np.clip(wanted / np.where(rings, far, 1.0), 1.0 / COARSER, COARSER)
        added = added * np.where(rings, ratio, 1.0)[:, None]
        for row, goal in zip(rows, goals, strict=False):
            added += row[:, None, None] * (goal - _at(row[None], rigid + added)[0]) / (row @ row)
    return added


def _widths(places: Floats, offsets: Floats, gaze: Floats) -> Floats:
    """(K,) by how much the vertices that move nearly as far as any, a rim, go outwards in offsets (n, K, 3)."""
    length = np.linalg.norm(offsets, axis=2)
    rims = length > RIM_SHARE * length.max(axis=0)
    return np.array([widening(places[rim], offsets[rim, k], gaze) for k, rim in enumerate(rims.T)])


def _at(rows: Floats, offsets: Floats) -> Floats:
    """(k, K, 3) offsets (n, K, 3) at points."""
    at: Floats = np.einsum("pn,nkd->pkd", rows, offsets)
    return at


def tongue_mover(
    source: PreparedFace, target: PreparedFace, mine: Body, yours: Body, jaw: Callable[[], Floats | None]
) -> Mover:
    """Tongue: moves like the same place of the source's tongue, not rigidly.

    Gums that are one mesh with the tongue follow the teeth beside them: the upper ones rest.

    Parameters
    ----------
    jaw : gives the (n_teeth, K, 3) offsets of the target's lower teeth, or None.
    """
    ids = [i for i in ("6.1", "6.2", "6.3", "6.4") if i in source.points and i in target.points]
    places = _onto_tongue(source, target, yours, ids)
    es = source.fapu.es0
    triangles, weights, distances = nearest_on(places / es, mine.vertices / es, mine.triangles)
    corners = mine.triangles[triangles]
    ratio = np.array([target.fapu.base(u) / source.fapu.base(u) for u in TONGUE])
    upper, lower = body(target, Role.UPPER_TEETH), body(target, Role.LOWER_TEETH)
    to_upper, _ = _to_body(yours, upper, target.fapu.es0)
    to_lower, tooth = _to_body(yours, lower, target.fapu.es0)
    near = distances < TONGUE_REACH
    gums = (distances > BESIDE) & (np.minimum(to_upper, to_lower) < TOUCHING)
    near &= ~gums
    fill = HarmonicFill(yours.vertices, polygon_edges(yours.indices, yours.offsets), ~(near | gums))

    at_mine, at_yours = (_point_rows(f, b, ids) for f, b in ((source, mine), (target, yours)))
    bumps = _bumps(yours.vertices, at_yours)

    def move(offsets: Floats) -> Floats:
        goals = _at(at_mine, offsets)
        scales = _scales(goals, ratio, at_mine @ mine.vertices, at_yours @ yours.vertices, ids)
        out = np.einsum("nc,nckd->nkd", weights, offsets[corners]) * scales
        missing = goals * scales - _at(at_yours, out)
        out += np.einsum("np,pkd->nkd", bumps, missing)
        teeth = jaw()
        out[gums] = 0.0
        follows = gums & (to_lower < to_upper)
        if teeth is not None and follows.any():
            out[follows] = teeth[tooth[follows]]
        flat = out.reshape(len(out), -1)
        fill.apply(flat)
        filled: Floats = flat.reshape(out.shape)
        return filled

    return move


def _point_rows(face: PreparedFace, of: Body, ids: Sequence[str]) -> Floats:
    """(k, n) weights of feature points over the vertices of a body; zero where they lie elsewhere."""
    rows = np.zeros((len(ids), len(of.vertices)))
    for k, key in enumerate(ids):
        point = face.points.get(key)
        if point is not None and point.shape in of.names:
            start = of.starts[of.names.index(point.shape)]
            for vertex, weight in zip(point.vertices, point.weights, strict=True):
                rows[k, start + vertex] += weight
    return rows[rows.any(axis=1)]


def _bumps(places: Floats, rows: Floats) -> Floats:
    """(n, k) smooth functions over vertices (n, 3), each 1 at its own point of rows (k, n) and 0 at the others."""
    at = rows @ places
    between = np.linalg.norm(at[:, None] - at[None], axis=2)
    np.fill_diagonal(between, np.inf)
    width = BUMP * between.min(axis=1, initial=np.inf)
    width = np.where(np.isfinite(width), width, np.ptp(places, axis=0).max())
    away = np.linalg.norm(places[:, None] - at[None], axis=2)
    round_ = np.exp(-0.5 * (away / width) ** 2)
    bumps: Floats = round_ @ np.linalg.pinv(rows @ round_)
    return bumps


def _scales(goals: Floats, ratio: Floats, mine: Floats, yours: Floats, ids: Sequence[str]) -> Floats:
    """(K, 3) factors of motions of the tongue: the FAPUs', but for a roll, which turns by the same angle.

    Parameters
    ----------
    goals : (k, K, 3) offsets of the source's feature points.
    mine, yours : (k, 3) where they lie.
    """
    scales = np.broadcast_to(ratio, (goals.shape[1], 3)).copy()
    if len(ids) < 4 or len(mine) < 4 or len(yours) < 4:
        return scales
    size = np.linalg.norm(goals, axis=2)
    rolls = size[:2].max(axis=0) < STILL * size[2:].max(axis=0)
    scales[rolls] = np.linalg.norm(yours[2] - yours[3]) / np.linalg.norm(mine[2] - mine[3])
    return scales


def _onto_tongue(source: PreparedFace, target: PreparedFace, yours: Body, ids: Sequence[str]) -> Floats:
    """Target tongue vertices in the source's space: similarity by the tongue's points, or by the mouth's."""
    known = [key for key in (ids if len(ids) >= 3 else MOUTH) if key in source.points and key in target.points]
    places, goals = (np.array([face.place(key) for key in known]) for face in (target, source))
    return fit_similarity(places, goals).apply(yours.vertices)


def _to_body(of: Body, other: Body | None, es0: float) -> tuple[Floats, Ints]:
    """Distance (ES) to the nearest vertex of another body, and which one."""
    from scipy.spatial import cKDTree

    if other is None:
        return np.full(len(of.vertices), np.inf), np.zeros(len(of.vertices), np.int32)
    distances, nearest = cKDTree(other.vertices).query(of.vertices)
    return np.asarray(distances) / es0, np.asarray(nearest, dtype=np.int32)


def _middle(face: PreparedFace, joined: Body, ids: Sequence[str]) -> Floats:
    """The middle of these feature points; of the body's bounding box where there are none."""
    if ids:
        found: Floats = np.mean([face.place(i) for i in ids], axis=0)
        return found
    middle: Floats = 0.5 * (joined.vertices.min(axis=0) + joined.vertices.max(axis=0))
    return middle
