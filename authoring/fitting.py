"""What makes a face's shape into a FAP: exact at the own feature point, still at the others, nothing left behind."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from authoring.construction import Offsets
from authoring.riders import skin_offsets
from authoring.units import added
from cloning.correct import Correction, correction
from cloning.eyeballs import Ball, balls
from cloning.prepare import PreparedFace
from fba.arrays import Bools, Floats
from fba.faps import LOW_LEVEL_FAPS, fap

PointAxis = tuple[str, int]

CLEARANCE = 0.01
"""Skin that lies on an eyeball stays this far off it, in radii, or as far as it is at rest."""

BURIED = -0.25
"""Skin deeper in the eyeball than this at rest, in radii, is the back of the socket."""

BEHIND = -0.1
"""Skin farther behind the middle of the eyeball than this, in radii, is beside it and cannot come in front."""

PASSES = 3
"""The cornea stands out: skin that is pushed forward lies before another place of the ball."""

NOISE = 3e-4
"""Offsets below this length (eye separations) are what is left of a local correction far away; they become 0."""


@dataclass(frozen=True, eq=False)
class Fitting:
    """Fits motions to one face."""

    face: PreparedFace

    @cached_property
    def ids(self) -> tuple[str, ...]:
        """Feature points on the skin that can be moved one by one: each place once."""
        taken: dict[tuple[tuple[int, float], ...], str] = {}
        for key, (vertices, weights) in self.face.skin.points.items():
            pairs = zip(vertices, weights, strict=True)
            taken.setdefault(tuple(sorted((int(v), round(float(w), 3)) for v, w in pairs if w > 1e-3)), key)
        return tuple(taken.values())

    @cached_property
    def axes(self) -> frozenset[PointAxis]:
        """(point, axis) pairs that translation FAPs measure."""
        found = set()
        for number in LOW_LEVEL_FAPS:
            entry = fap(number)
            if entry.direction is not None:
                found.add((entry.feature_points[0], int(np.argmax(np.abs(entry.direction)))))
        return frozenset(found)

    def at(self, key: str, skin: Floats) -> Floats:
        """A field of the skin (n, 3) at a feature point."""
        vertices, weights = self.face.skin.points[key]
        here: Floats = weights @ skin[vertices]
        return here

    def corrected(self, skin: Floats, wanted: Mapping[PointAxis, float], free: Collection[PointAxis] = ()) -> Floats:
        """Skin offsets (n, 3), mesh units, with `wanted` met and all other FAP axes at zero but the free ones."""
        goals = np.array([self.at(key, skin) for key in self.ids])
        for row, key in enumerate(self.ids):
            for axis in range(3):
                if (key, axis) in wanted:
                    goals[row, axis] = wanted[key, axis]
                elif (key, axis) in self.axes and (key, axis) not in free:
                    goals[row, axis] = 0.0
        motion = np.array(skin)[:, None]
        self._correction.apply(motion, goals[:, None])
        done: Floats = motion[:, 0]
        return done

    def finished(self, raw: Offsets, skin: Floats) -> Offsets:
        """A motion with its final skin, kept off the eyeballs; what rides on the skin follows the change.

        Parameters
        ----------
        raw : the motion as the shapes have it.
        skin : (n, 3) final offsets of the joined skin, mesh units.
        """
        skin = self.face.skin.join(self.seamless(self.face.skin.split(self.off_eyeballs(skin))))
        quiet = np.linalg.norm(skin, axis=1) < NOISE * self.face.fapu.es0
        skin = np.where(quiet[:, None], 0.0, skin)
        change = skin_offsets(self.face, (skin - self.face.skin.join(raw)) / self.face.fapu.es0)
        out = added(raw, change)
        # Rounding of the sum shall not move skin that rests.
        out.update(self.face.skin.split(skin))
        return {name: part for name, part in out.items() if part.any()}

    def seamless(self, offsets: Offsets) -> Offsets:
        """A motion in which the copies of a vertex along a seam go the same way."""
        if not len(self.face.skin.links):
            return offsets
        skin = self.face.skin.join(offsets)
        joined = self.face.skin.split(self.face.skin.seam_mean @ skin)
        return {**offsets, **{name: part for name, part in joined.items() if part.any()}}

    def off_eyeballs(self, skin: Floats) -> Floats:
        """The skin (n, 3) pushed forward where it would get deeper into an eyeball than at rest; heights stay."""
        out = np.array(skin)
        for ball in self._balls:
            local = ball.rest - ball.center
            rest = ball.clearance(local)
            covers: Bools = (rest > BURIED) & (local[:, 2] > 0.0) & skin[ball.vertices].any(axis=1)
            ids, kept = ball.vertices[covers], np.minimum(rest[covers], CLEARANCE)
            for _ in range(PASSES):
                moved = local[covers] + out[ids]
                needed = ball.radius(moved) * (1.0 + kept)
                front = np.sqrt(np.maximum(needed**2 - moved[:, 0] ** 2 - moved[:, 1] ** 2, 0.0))
                before = moved[:, 2] > BEHIND * needed
                out[ids, 2] += np.where(before & (front > 0.0), np.maximum(front - moved[:, 2], 0.0), 0.0)
        return out

    @cached_property
    def _correction(self) -> Correction:
        return correction(self.face.skin, self.ids)

    @cached_property
    def _balls(self) -> list[Ball]:
        return balls(self.face)
