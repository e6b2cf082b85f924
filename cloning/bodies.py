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
from cloning.surface import polygon_edges
from fba.arrays import Floats, Ints
from fba.faps import Unit
from fba.scene import Role
from fba.sphere import fit_sphere

RIGID = 0.02
"""A body whose motion is rigid up to this share of its size is carried as a rotation and a translation alone."""

TONGUE_REACH = 0.12
"""A tongue vertex farther than this from the source's tongue after alignment takes its neighbours' motion (ES)."""

TOUCHING = 0.06
"""Gums nearer than this to teeth move with them, in eye separations."""


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
    center_s, center_t = (_middle(f, b, LOWER_TEETH) for f, b in ((source, mine), (target, yours)))
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
    places = center_s + (yours.vertices - center_t) / size
    triangles, weights, _ = nearest_on(places, mine.vertices, mine.triangles)
    corners = mine.triangles[triangles]

    def move(offsets: Floats) -> Floats:
        motion = fit_rigid(mine.vertices, offsets, center_s)
        out = motion.offsets(yours.vertices, center_t, ratio)
        soft = motion.residual > RIGID
        if soft.any():
            rest = offsets - motion.offsets(mine.vertices, center_s, np.ones(3))
            out[:, soft] += size * np.einsum("nc,nckd->nkd", weights, rest[corners][:, :, soft])
        return out

    return move


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
    places = _onto_tongue(source, target, mine, yours, ids)
    es = source.fapu.es0
    triangles, weights, distances = nearest_on(places / es, mine.vertices / es, mine.triangles)
    corners = mine.triangles[triangles]
    ratio = np.array([target.fapu.base(u) / source.fapu.base(u) for u in TONGUE])
    upper, lower = body(target, Role.UPPER_TEETH), body(target, Role.LOWER_TEETH)
    to_upper, _ = _to_body(yours, upper, target.fapu.es0)
    to_lower, tooth = _to_body(yours, lower, target.fapu.es0)
    near = distances < TONGUE_REACH
    gums = ~near & (np.minimum(to_upper, to_lower) < TOUCHING)
    fill = HarmonicFill(yours.vertices, polygon_edges(yours.indices, yours.offsets), ~(near | gums))

    def move(offsets: Floats) -> Floats:
        out = np.einsum("nc,nckd->nkd", weights, offsets[corners]) * ratio
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


def _onto_tongue(source: PreparedFace, target: PreparedFace, mine: Body, yours: Body, ids: Sequence[str]) -> Floats:
    """Target tongue vertices in the source's space: similarity by the tongue's points, or by bounding boxes."""
    if len(ids) >= 3:
        a = np.array([target.place(i) for i in ids])
        b = np.array([source.place(i) for i in ids])
        ca, cb = a.mean(axis=0), b.mean(axis=0)
        u, s, vt = np.linalg.svd((b - cb).T @ (a - ca))
        sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
        turn = (u * sign) @ vt
        size = float((s * sign).sum() / max(float(((a - ca) ** 2).sum()), 1e-30))
        moved: Floats = cb + size * (yours.vertices - ca) @ turn.T
        return moved
    boxes = [(b.vertices.min(axis=0), np.ptp(b.vertices, axis=0)) for b in (mine, yours)]
    (low_s, size_s), (low_t, size_t) = boxes
    scaled: Floats = low_s + (yours.vertices - low_t) * size_s / np.maximum(size_t, 1e-30)
    return scaled


def _to_body(of: Body, other: Body | None, es0: float) -> tuple[Floats, Ints]:
    """Distance (ES) to the nearest vertex of another body, and which one."""
    from scipy.spatial import cKDTree

    if other is None:
        return np.full(len(of.vertices), np.inf), np.zeros(len(of.vertices), np.int32)
    distances, nearest = cKDTree(other.vertices).query(of.vertices)
    return np.asarray(distances) / es0, np.asarray(nearest, dtype=np.int32)


def _middle(face: PreparedFace, joined: Body, ids: Sequence[str]) -> Floats:
    """The middle of these feature points; of the body's bounding box where they are not given."""
    given = [face.place(i) for i in ids if i in face.points]
    if len(given) == len(ids):
        found: Floats = np.mean(given, axis=0)
        return found
    middle: Floats = 0.5 * (joined.vertices.min(axis=0) + joined.vertices.max(axis=0))
    return middle
