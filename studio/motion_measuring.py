"""Measure every motion of a face for what means something beside the source's: see `studio.verdicts`."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from fat.lip_contact import lip_depth
from fat.quality import roughness
from fat.tables import FaceDefTable
from fat.tearing import SLACK, angles, bending, jumps, reach, stretching
from fba.amplitudes import amplitudes
from fba.arrays import Bools, Floats, Ints
from fba.faps import EXPRESSION_FAP
from fba.high_level import BLEND_MAX
from studio.checked_skin import CheckedSkin
from studio.collisions import LOWER, UPPER, Collisions
from studio.eye_depths import EyeDepths
from studio.face_places import Places
from studio.posing import Poses
from studio.spot import Spot

MOVING = 0.02
"""Share of the largest offset from which a place takes part in a motion."""

TORN = 10
"""A tear is as steep as its tenth-steepest edge: one or two bad edges are a flaw of the mesh, not a tear."""

MOST, TYPICAL = 0.9, 0.5
"""A place stretches as most of its edges do, and bends as its typical hinge does: a crease bends a few, waves all."""

MM = 63.0
"""Millimetres of an adult's eye separation, for bends in degrees per millimetre."""

EAR_FAPS = (65, 66, 67, 68)


@dataclass(frozen=True, slots=True)
class MotionMeasures:
    """The measures of one motion at its normal amplitude.

    Attributes
    ----------
    key : FAP, select, value.
    grain : typical length of the edges that move, in eye separations.
    spots : measure -> its value here; what cannot be measured is absent.
    places : measure -> place -> its value there, of measures that are read place by place, see `studio.face_places`.
    """

    key: tuple[int, int, int]
    name: str
    grain: float
    spots: Mapping[str, Spot]
    places: Mapping[str, Mapping[str, Spot]]

    @property
    def where(self) -> str:
        """The motion's name for messages."""
        return self.name if self.key[0] <= EXPRESSION_FAP else f"{self.name} at {self.key[2]:+d}"


class MotionMeasurer:
    """Measures the motions of a face.

    Parameters
    ----------
    points : feature points by whose places two faces are compared, all of them on this skin.
    eyes : which skin gets into the eyeballs; None for a face without.
    """

    def __init__(self, poses: Poses, skin: CheckedSkin, points: Collection[str], eyes: EyeDepths | None) -> None:
        self.face, self.skin = poses.face, skin
        self.poses, self.rest = poses, poses.rest
        self.collisions = Collisions(poses, skin, eyes)
        rest = skin.surface.vertices
        self.edges = Places(skin, points, skin.seen_edges)
        self.lengths = _lengths(rest, self.edges.members)
        self.hinges = Places(skin, points, skin.seen_hinges)
        self.angles = angles(rest, self.hinges.members)
        self.reach = MM * (reach(rest, self.hinges.members) + SLACK)
        self.upper, self.lower = (
            np.flatnonzero((skin.labels == k) & skin.seen).astype(np.int32) for k in (UPPER, LOWER)
        )
        self.lip_rest = self._lip_depth(np.zeros_like(rest))

    def motions(self, table: FaceDefTable) -> Iterator[MotionMeasures]:
        """The motions of a table: both directions of a FAP, a viseme or an expression."""
        values = (BLEND_MAX,) if table.fap_id <= EXPRESSION_FAP else amplitudes()[table.fap_id].values
        for value in values:
            yield self._motion((table.fap_id, table.high_level_select, value), table.name)

    def _motion(self, key: tuple[int, int, int], name: str) -> MotionMeasures:
        """All measures of one motion."""
        offsets = self.skin.offsets(self.face, self.poses.pose(key))
        size = np.linalg.norm(offsets, axis=1)
        moving = size > MOVING * size.max(initial=0.0)
        edges = self.skin.seen_edges
        edges = edges[moving[edges].any(axis=1)]
        ends = self.skin.surface.vertices[edges]
        grain = float(np.median(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1))) if len(edges) else 0.0
        spots = dict(self._shape(offsets, edges))
        spots |= dict(self._lips(offsets, moving))
        spots |= dict(self.collisions.spots(key))
        if key[0] not in EAR_FAPS and self.skin.back.any():
            spots["still"] = _worst(np.where(self.skin.back, size, 0.0))
        places = {"stretch": dict(self._stretches(offsets, moving)), "bend": dict(self._bends(offsets, moving))}
        return MotionMeasures(key, name, grain, spots, places)

    def _shape(self, offsets: Floats, edges: Ints) -> Iterator[tuple[str, Spot]]:
        """How smoothly the skin moves."""
        if not len(edges):
            yield from ((name, Spot(0.0)) for name in ("tear", "noise"))
            return
        steep = jumps(self.skin.surface.vertices, edges, offsets)
        order = np.argsort(-steep, kind="stable")
        yield "tear", Spot(float(steep[order[min(TORN, len(order)) - 1]]), int(edges[order[0], 0]))
        yield "noise", Spot(roughness(self.skin.surface.edges, offsets, self.skin.seen), int(edges[order[0], 0]))

    def _stretches(self, offsets: Floats, moving: Bools) -> Iterator[tuple[str, Spot]]:
        """How much the edges of each place stretch."""
        edges = self.edges.members
        some: Bools = np.any(moving[edges], axis=1)
        after = _lengths(self.skin.surface.vertices + offsets, edges[some])
        for name, value, at in self.edges.quantiles(MOST, some, stretching(self.lengths[some], after)):
            yield name, Spot(value, int(edges[at, 0]))

    def _bends(self, offsets: Floats, moving: Bools) -> Iterator[tuple[str, Spot]]:
        """How sharply each place bends."""
        hinges = self.hinges.members
        some: Bools = np.any(moving[hinges], axis=1)
        after = angles(self.skin.surface.vertices + offsets, hinges[some])
        sharp = bending(self.angles[some], after) / self.reach[some]
        for name, value, at in self.hinges.quantiles(TYPICAL, some, sharp):
            yield name, Spot(value, int(hinges[at, 0]))

    def _lips(self, offsets: Floats, moving: Bools) -> Iterator[tuple[str, Spot]]:
        """How deep the lips sink into each other."""
        if len(self.upper) and len(self.lower):
            lips = moving[self.upper].any() or moving[self.lower].any()
            depth, vertices = self._lip_depth(offsets) if lips else self.lip_rest
            added = np.maximum(depth - self.lip_rest[0], 0.0)
            yield "lip-depth", Spot(float(added.max()), int(vertices[int(np.argmax(added))]))

    def _lip_depth(self, offsets: Floats) -> tuple[Floats, Ints]:
        surface, fapu = self.skin.surface, self.face.fapu
        places = surface.vertices + offsets
        return lip_depth(places, surface.normals_of(places), self.upper, self.lower, fapu.mns0 / fapu.es0)


def _worst(values: Floats) -> Spot:
    at = int(np.argmax(values))
    return Spot(float(values[at]), at)


def _lengths(vertices: Floats, edges: Ints) -> Floats:
    """(e,) of edges."""
    away = vertices[edges[:, 0]] - vertices[edges[:, 1]]
    lengths: Floats = np.sqrt(np.einsum("ij,ij->i", away, away))
    return lengths
