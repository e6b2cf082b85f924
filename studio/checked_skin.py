"""The skin of a face, made ready to be measured motion by motion."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cloning.eyeballs import Ball, balls
from cloning.labels import label
from cloning.lining import lining
from cloning.prepare import PreparedFace
from cloning.surface import Surface, build_surface
from cloning.visibility import visible
from fat.evaluate import Pose
from fat.face import AnimatableFace
from fat.tearing import hinges
from fba.arrays import Bools, Floats, Ints
from fba.errors import LandmarkError
from fba.scene import Role

LIPS = 2
"""Greatest label of a lip, see `cloning.labels`; lids have greater ones."""
EAR = "10.3"
BEHIND = 0.1
"""Eye separations behind the ear's front from which a head is its back, which no FAP but an ear's moves."""


@dataclass(frozen=True, eq=False)
class CheckedSkin:
    """All skin of a face as one surface, in eye separations.

    Attributes
    ----------
    seen : (n,) what can be seen on the neutral face.
    labels : (n,) lips and lids, see `cloning.labels`.
    lining : (m,) vertices that line mouth, cheeks and nose, see `cloning.lining`.
    eyeballs : the eyeballs that are there, each with the names of its shapes.
    """

    surface: Surface
    seen: Bools
    labels: Ints
    lining: Ints
    eyeballs: list[tuple[Ball, list[str]]]

    def offsets(self, face: AnimatableFace, pose: Pose) -> Floats:
        """(n, 3) offsets without what transforms do, in eye separations."""
        offsets: Floats = self.surface.join(pose.mesh_offsets()) / face.fapu.es0
        return offsets

    @cached_property
    def hidden_edges(self) -> Ints:
        """(e, 2) edges with an end that cannot be seen."""
        edges = self.surface.edges
        return edges[~self.seen[edges].all(axis=1)]

    @cached_property
    def seen_edges(self) -> Ints:
        """(e, 2) edges whose ends can be seen."""
        edges = self.surface.edges
        return edges[self.seen[edges].all(axis=1)]

    @cached_property
    def seen_hinges(self) -> Ints:
        """(h, 4) pairs of triangles that can be seen, see `fat.tearing.hinges`."""
        found = hinges(self.surface.triangles)
        return found[self.seen[found].all(axis=1)]

    @cached_property
    def back(self) -> Bools:
        """(n,) what can be seen of the back of the head, behind the ears; nothing where no ear is given."""
        ear = self.surface.positions.get(EAR)
        if ear is None:
            return np.zeros(self.surface.vertex_count, dtype=bool)
        behind: Bools = self.seen & (self.surface.vertices[:, 2] < ear[2] - BEHIND)
        return behind


def check_skin(face: AnimatableFace) -> CheckedSkin | None:
    """Make the skin of a face ready; None without a skin."""
    names = [s.name for s in face.scene.with_role(Role.SKIN)]
    try:
        surface = build_surface(face.scene, face.feature_points, names, face.fapu.es0)
        whole = build_surface(face.scene, face.feature_points, [s.name for s in face.scene.shapes], face.fapu.es0)
    except LandmarkError:
        return None
    shown = whole.split(visible(whole).astype(np.float64))
    seen = np.concatenate([shown[name] > 0.0 for name in names])
    labels = label(surface)
    prepared = PreparedFace(face.scene, face.feature_points, face.fapu, surface, labels, ())
    eyeballs = _eyeballs(face, prepared)
    lined = lining(surface, seen, labels.values)
    # Around the eyes lids slide over the skin of the sockets, and what shows there are the eyeballs.
    sockets = [ball.vertices for ball, _ in eyeballs] + [np.flatnonzero(labels.values > LIPS)]
    lined = np.setdiff1d(lined, np.concatenate(sockets)).astype(np.int32)
    return CheckedSkin(surface, seen, labels.values, lined, eyeballs)


def common_points(one: CheckedSkin | None, other: CheckedSkin | None) -> set[str]:
    """The feature points that two skins have."""
    return set() if one is None or other is None else set(one.surface.points) & set(other.surface.points)


def _eyeballs(face: AnimatableFace, prepared: PreparedFace) -> list[tuple[Ball, list[str]]]:
    if not {"3.5", "3.6"} <= set(face.feature_points):
        return []
    shapes = [
        names
        for role in (Role.EYE_LEFT, Role.EYE_RIGHT)
        if (names := [s.name for s in face.scene.with_role(role) if s.mesh.vertex_count])
    ]
    return list(zip(balls(prepared), shapes, strict=True))
