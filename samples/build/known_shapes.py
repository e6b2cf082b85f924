"""A face whose FAPs and whose modelled shapes are both known: what tables between the two are measured on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cloning.prepare import prepare
from cloning.visibility import visible
from fat.evaluate import Player
from fat.face import AnimatableFace
from fat.quality import fap_values, feature_point_motion
from fba.arrays import Bools, Floats
from fba.faps import LOW_LEVEL_FAPS, fap, faps
from fba.fapu import ANGLE_UNIT
from fba.scene import Role
from samples.build.closed import fit_similarity

EYES = ((Role.EYE_LEFT, 23, 25), (Role.EYE_RIGHT, 24, 26))
"""Role of an eyeball, the FAPs of its yaw and of its pitch."""


@dataclass(frozen=True, eq=False)
class KnownShapes:
    """An animatable face and shapes that an artist modelled on it.

    Attributes
    ----------
    shapes : shape name -> (N, 3) offsets from neutral over the whole file; inside axes, mesh units.
    """

    name: str
    face: AnimatableFace
    shapes: Mapping[str, Floats]

    @cached_property
    def player(self) -> Player:
        """Corners of the lips share what two tied FAPs ask for; all else is the standard's plain sum."""
        return Player(self.face, rules=("corners",))

    @cached_property
    def neutral(self) -> Floats:
        """(N, 3) vertices at rest, world coordinates, inside axes."""
        return self.face.scene.world_neutral()

    @cached_property
    def seen(self) -> Bools:
        """(N,) vertices of the skin that can be seen from outside."""
        prepared = prepare(self.face.scene, self.face.feature_points, "source")
        found = prepared.skin.split(visible(prepared.skin).astype(np.float64)[:, None])
        scene = self.face.scene
        every = {s.name: np.zeros((s.mesh.vertex_count, 3)) for s in scene.shapes}
        mask: Bools = scene.gather({**every, **{n: np.repeat(v, 3, axis=1) for n, v in found.items()}})[:, 0] > 0.5
        return mask

    @cached_property
    def moving(self) -> frozenset[int]:
        """Low-level FAPs that the face has tables for."""
        return frozenset(t.fap_id for t in self.face.tables if t.fap_id in LOW_LEVEL_FAPS)

    def of_role(self, *roles: Role) -> Bools:
        """(N,) vertices of the shapes with these roles."""
        mask = np.zeros(len(self.neutral), dtype=bool)
        for role in roles:
            for shape in self.face.scene.with_role(role):
                mask[self.face.scene.file_order()[shape.name]] = True
        return mask

    def judged(self, offsets: Floats) -> Bools:
        """(N,) vertices on which a motion is compared: visible skin and eyeballs; the tongue where these stay still."""
        outside = self.seen | self.of_role(Role.EYE_LEFT, Role.EYE_RIGHT)
        still = float(np.abs(offsets[outside]).max(initial=0.0)) < STILL * self.face.fapu.es0
        return self.of_role(Role.TONGUE) if still else outside

    def motion(self, faps: Mapping[int, float]) -> Floats:
        """(N, 3) offsets of the face's own tables at FAP values; FAPs without a table do nothing."""
        return self.player.pose({k: v for k, v in faps.items() if k in self.moving}).world() - self.neutral

    def values(self, offsets: Floats) -> dict[int, float]:
        """FAP -> the value that a motion shows: feature points along their axes, and how far the eyeballs turn."""
        motion = feature_point_motion(self.face.feature_points, self.face.scene.scatter(offsets))
        return {**fap_values(motion, self.face.fapu), **self._turns(offsets)}

    def _turns(self, offsets: Floats) -> dict[int, float]:
        found = {}
        for role, yaw, pitch in EYES:
            ball = self.of_role(role)
            if ball.any():
                gaze = fit_similarity(self.neutral[ball], (self.neutral + offsets)[ball])[1][:, 2]
                found[yaw] = float(np.arctan2(gaze[0], gaze[2])) / ANGLE_UNIT
                found[pitch] = float(-np.arcsin(np.clip(gaze[1], -1.0, 1.0))) / ANGLE_UNIT
        return found

    def lengths(self, offsets: Floats) -> dict[int, float]:
        """The values of a motion as lengths in eye separations, so that small and large units weigh alike."""
        fapu = self.face.fapu
        unit = {k: fapu.unit(fap(k).unit) * (self._eye_radius if k in TURNS else 1.0) / fapu.es0 for k in COMPARED}
        return {k: v * unit[k] for k, v in self.values(offsets).items() if k in unit}

    @cached_property
    def _eye_radius(self) -> float:
        balls = [self.neutral[self.of_role(role)] for role, _, _ in EYES]
        return max((0.5 * float(np.ptp(ball[:, 1])) for ball in balls if len(ball)), default=0.0)

    @cached_property
    def point_rows(self) -> tuple[str, ...]:
        """Feature points that some compared FAP moves."""
        return tuple(dict.fromkeys(fap(k).feature_points[0] for k in COMPARED if k not in TURNS))

    def point_motion(self, offsets: Floats) -> float:
        """Size of the whole motion of the feature points, all axes, in eye separations."""
        motion = feature_point_motion(self.face.feature_points, self.face.scene.scatter(offsets))
        rows = [motion[p] for p in self.point_rows if p in motion]
        return float(np.linalg.norm(np.array(rows))) / self.face.fapu.es0


TURNS = tuple(k for _, *numbers in EYES for k in numbers)
COMPARED = (*TURNS, *(f.id for f in faps() if f.direction is not None and f.id not in (27, 28)))
"""FAPs that motions are compared by: where an eyeball goes is read off its turn."""

STILL = 1e-3
"""Eye separations below which nothing is seen moving."""
