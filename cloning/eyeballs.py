"""Keep the skin off the eyeballs: lids that slide over a ball of another size or place would sink into it.

A target's skin must clear its eyeball as far as the source's skin clears its own at the same place of the same
motion, in radii, up to a thin layer. What the source hides inside the ball (the back of a lid) stays inside.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from cloning.bodies import body
from cloning.correct import smooth_step
from cloning.parts import PUPILS, eye_center
from cloning.prepare import PreparedFace
from fba.arrays import Floats, Ints

NEAR = 1.7
"""Skin within this many radii of the centre of an eyeball is watched."""

LAYER = 0.03
"""No more than this clearance is asked for, in radii."""

SHARE = 0.15
"""Skin that rests nearer to the ball than the source's comes off it within a motion of this many radii."""

HIDDEN = 0.03
"""Skin that the source keeps this deep inside its ball is the back of a lid and may lie anywhere in the ball."""

FAR = 0.5
"""Clearance of skin that is not near an eyeball, in radii."""


@dataclass(frozen=True, eq=False)
class Ball:
    """One eyeball and the skin around it.

    Attributes
    ----------
    center : (3,) world coordinates.
    way, radii : (b, 3) unit directions of the ball's own vertices and (b,) their distances: the cornea stands out.
    vertices : (m,) the skin vertices near it.
    rest : (m, 3) where they rest.
    """

    center: Floats
    way: Floats
    radii: Floats
    vertices: Ints
    rest: Floats

    @cached_property
    def _ways(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self.way)

    def radius(self, local: Floats) -> Floats:
        """Distance of the ball's surface from its centre in the directions of (..., 3) points."""
        length = np.maximum(np.linalg.norm(local, axis=-1, keepdims=True), 1e-12)
        away, near = self._ways.query((local / length).reshape(-1, 3), k=min(4, len(self.way)))
        weight = 1.0 / np.maximum(away, 1e-6) ** 2
        found: Floats = (weight * self.radii[near]).sum(axis=1) / weight.sum(axis=1)
        return found.reshape(local.shape[:-1])

    def clearance(self, local: Floats) -> Floats:
        """(...) distance of points from the ball's surface, in radii; negative inside."""
        cleared: Floats = np.linalg.norm(local, axis=-1) / self.radius(local) - 1.0
        return cleared

    @cached_property
    def clear_at_rest(self) -> Floats:
        """(m,) clearance of the skin at rest."""
        return self.clearance(self.rest - self.center)

    def clear_in_motion(self, offsets: Floats) -> Floats:
        """(m, K) clearance of the skin in K motions (m, K, 3); most of it rests in most of them."""
        cleared = np.repeat(self.clear_at_rest[:, None], offsets.shape[1], axis=1)
        vertex, motion = np.nonzero(np.any(offsets != 0.0, axis=2))
        cleared[vertex, motion] = self.clearance(self.rest[vertex] + offsets[vertex, motion] - self.center)
        return cleared


def balls(face: PreparedFace) -> list[Ball]:
    """The eyeballs of a face that are meshes of their own, left and right."""
    found = []
    rest = face.skin.vertices * face.fapu.es0
    for pupil, role in PUPILS.items():
        joined = body(face, role)
        if joined is None:
            continue
        center = eye_center(joined.vertices, face.place(pupil))
        way, radii = _outline(joined.vertices - center)
        local = rest - center
        near = np.linalg.norm(local, axis=1) < NEAR * float(np.median(radii))
        vertices = np.flatnonzero(near).astype(np.int32)
        found.append(Ball(center, way, radii, vertices, rest[vertices]))
    return found


@dataclass(frozen=True, eq=False)
class EyeGuard:
    """Pushes a target's skin forward off its eyeballs; x and y, in which lids are measured, stay as they are.

    Attributes
    ----------
    mine, yours : eyeballs of source and target.
    carry : carries a field of the source's skin to the target's.
    """

    mine: Sequence[Ball]
    yours: Sequence[Ball]
    carry: Callable[[Floats], Floats]

    def apply(self, source_motion: Floats, motion: Floats) -> None:
        """Correct (n_t, K, 3) offsets in place, given the source's (n_s, K, 3); what does not move stays."""
        watched = [np.any(source_motion[b.vertices] != 0.0, axis=(0, 2)) for b in self.mine]
        some = np.flatnonzero(np.any(watched, axis=0)).astype(np.int32) if watched else np.zeros(0, np.int32)
        if not len(some) or not self.yours:
            return
        field = np.full((len(source_motion), len(some) + 1), FAR)
        for ball in self.mine:
            moving = ball.clear_in_motion(source_motion[np.ix_(ball.vertices, some)])
            cleared = np.column_stack([ball.clear_at_rest, moving])
            field[ball.vertices] = np.minimum(field[ball.vertices], cleared)
        carried = self.carry(field)
        for ball in self.yours:
            self._push(ball, motion, some, carried[ball.vertices, 0], carried[ball.vertices, 1:])

    def _push(self, ball: Ball, motion: Floats, some: Ints, at_rest: Floats, wanted: Floats) -> None:
        offsets = motion[np.ix_(ball.vertices, some)]
        place = (ball.rest - ball.center)[:, None] + offsets
        # Nothing farther out is pushed: a hundredth more, for places just behind the ball's middle.
        farthest = (1.01 + LAYER) * float(ball.radii.max())
        inside = np.einsum("mkc,mkc->mk", place, place) < farthest**2
        inside &= np.any(offsets != 0.0, axis=2) & (ball.rest[:, 2] > ball.center[2])[:, None]
        vertex, which = np.nonzero(inside)
        moved, place = offsets[vertex, which], place[vertex, which]
        radius = ball.radius(place)
        lacking = np.minimum(ball.clear_at_rest - np.minimum(at_rest, LAYER), 0.0)[vertex]
        free = np.clip(np.linalg.norm(moved, axis=1) / (SHARE * radius), 0.0, 1.0)
        needed = radius * (1.0 + np.minimum(wanted[vertex, which], LAYER) + lacking * (1.0 - free))
        flat = place[:, 0] ** 2 + place[:, 1] ** 2
        front = np.sqrt(np.maximum(needed**2 - flat, 0.0))
        behind = (flat < needed**2) & (place[:, 2] > -0.1 * radius)
        push = np.where(behind, np.maximum(front - place[:, 2], 0.0), 0.0)
        motion[ball.vertices[vertex], some[which], 2] += push * smooth_step(1.0 + wanted[vertex, which] / HIDDEN)


def eye_guard(source: PreparedFace, target: PreparedFace, carry: Callable[[Floats], Floats]) -> EyeGuard:
    """The guard of a pair of faces."""
    return EyeGuard(balls(source), balls(target), carry)


def _outline(local: Floats) -> tuple[Floats, Floats]:
    """Directions and distances of the outermost layer of an eyeball (an iris below a cornea does not count)."""
    from scipy.spatial import cKDTree

    radii = np.linalg.norm(local, axis=1)
    kept = radii > 0.5 * radii.max()
    way, radii = local[kept] / radii[kept, None], radii[kept]
    near = cKDTree(way).query(way, k=min(6, len(way)))[1]
    return way, radii[near].max(axis=1)
