"""Measure every motion of a face for what means something beside the source's: see `studio.verdicts`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fat.fap_quality import DEPTH
from fat.intersections import crossing
from fat.lip_contact import lip_depth
from fat.quality import edge_stretch, roughness
from fat.tables import FaceDefTable
from fat.tearing import SLACK, bending, jumps
from fba.amplitudes import amplitudes
from fba.arrays import Bools, Floats, Ints
from fba.faps import EXPRESSION_FAP
from fba.high_level import BLEND_MAX
from fba.scene import Role
from studio.checked_skin import CheckedSkin
from studio.posing import Poses

MOVING = 0.02
"""Share of the largest offset from which a place takes part in a motion."""

TORN = 10
"""A tear is as steep as its tenth-steepest edge: one or two bad edges are a flaw of the mesh, not a tear."""

NEAR_TEETH = 0.25
"""Lips nearer than this to a tooth at rest are watched, in eye separations: a lip is .2 thick."""

EAR_FAPS = (65, 66, 67, 68)
UPPER, LOWER = 1, 2
"""Labels of the lips, see `cloning.labels`."""


@dataclass(frozen=True, slots=True)
class Spot:
    """A measure and where it is worst: a vertex of the joined skin, or a feature point."""

    value: float
    vertex: int | None = None
    point: str | None = None


@dataclass(frozen=True, slots=True)
class MotionMeasures:
    """The measures of one motion at its normal amplitude.

    Attributes
    ----------
    key : FAP, select, value.
    grain : typical length of the edges that move, in eye separations.
    spots : measure -> its value here; what cannot be measured is absent.
    """

    key: tuple[int, int, int]
    name: str
    grain: float
    spots: Mapping[str, Spot]

    @property
    def where(self) -> str:
        """The motion's name for messages."""
        return self.name if self.key[0] <= EXPRESSION_FAP else f"{self.name} at {self.key[2]:+d}"


class MotionMeasurer:
    """Measures the motions of a face."""

    def __init__(self, poses: Poses, skin: CheckedSkin) -> None:
        self.face, self.skin = poses.face, skin
        self.poses, self.rest = poses, poses.rest
        self.upper, self.lower = (
            np.flatnonzero((skin.labels == k) & skin.seen).astype(np.int32) for k in (UPPER, LOWER)
        )
        self.lip_rest = self._lip_depth(np.zeros_like(skin.surface.vertices))

    def motions(self, table: FaceDefTable) -> Iterator[MotionMeasures]:
        """The motions of a table: both directions of a FAP, a viseme or an expression."""
        values = (BLEND_MAX,) if table.fap_id <= EXPRESSION_FAP else amplitudes()[table.fap_id].values
        for value in values:
            yield self._motion((table.fap_id, table.high_level_select, value), table.name)

    def _motion(self, key: tuple[int, int, int], name: str) -> MotionMeasures:
        """All measures of one motion."""
        world = self.poses.world(key)
        offsets = self.skin.offsets(self.face, self.poses.pose(key))
        size = np.linalg.norm(offsets, axis=1)
        moving = size > MOVING * size.max(initial=0.0)
        edges = self.skin.seen_edges
        edges = edges[moving[edges].any(axis=1)]
        ends = self.skin.surface.vertices[edges]
        grain = float(np.median(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1))) if len(edges) else 0.0
        spots = dict(self._shape(offsets, moving, edges))
        spots |= self._contacts(offsets, moving, world)
        if key[0] not in EAR_FAPS and self.skin.back.any():
            behind = np.where(self.skin.back, size, 0.0)
            spots["still"] = _worst(behind)
        return MotionMeasures(key, name, grain, spots)

    def _shape(self, offsets: Floats, moving: Bools, edges: Ints) -> Iterator[tuple[str, Spot]]:
        """How smoothly the skin moves."""
        rest = self.skin.surface.vertices
        if not len(edges):
            yield from ((name, Spot(0.0)) for name in ("tear", "stretch99", "noise", "bend"))
            return
        steep = jumps(rest, edges, offsets)
        order = np.argsort(-steep, kind="stable")
        yield "tear", Spot(float(steep[order[min(TORN, len(order)) - 1]]), int(edges[order[0], 0]))
        yield "stretch99", Spot(edge_stretch(rest, edges, offsets), _longest(rest, edges, offsets))
        rough = roughness(self.skin.surface.edges, offsets)
        yield "noise", Spot(rough, int(edges[order[0], 0]))
        bends = self.skin.seen_hinges
        bends = bends[moving[bends].any(axis=1)]
        degrees = bending(rest, bends, offsets)
        if len(degrees):
            yield "bend", Spot(float(np.percentile(degrees, 95)), int(bends[int(np.argmax(degrees)), 0]))

    def _contacts(self, offsets: Floats, moving: Bools, world: Mapping[str, Floats]) -> dict[str, Spot]:
        """What the skin sinks into."""
        spots = {}
        if len(self.upper) and len(self.lower):
            lips = moving[self.upper].any() or moving[self.lower].any()
            depth, vertices = self._lip_depth(offsets) if lips else self.lip_rest
            added = np.maximum(depth - self.lip_rest[0], 0.0)
            spots["lip-depth"] = Spot(float(added.max()), int(vertices[int(np.argmax(added))]))
        for name, places in self._obstacles.items():
            spots[name] = self._collisions(name, places, world)
        return spots

    def _lip_depth(self, offsets: Floats) -> tuple[Floats, Ints]:
        surface, fapu = self.skin.surface, self.face.fapu
        places = surface.vertices + offsets
        return lip_depth(places, surface.normals_of(places), self.upper, self.lower, fapu.mns0 / fapu.es0)

    def _collisions(self, name: str, obstacle: _Obstacle, world: Mapping[str, Floats]) -> Spot:
        """Percent of the watched skin that crosses something in a motion, but not at rest."""
        some = np.arange(len(obstacle.watched), dtype=np.int32)
        if all(np.array_equal(world[n], self.rest[n]) for names, _ in obstacle.bodies for n in names):
            moved = [np.any(world[n] != self.rest[n], axis=1) for n in self.skin.surface.shapes]
            some = some[np.concatenate(moved)[self.skin.surface.triangles[obstacle.watched]].any(axis=1)]
        here = some[self._crossing(obstacle, world, some)] if len(some) else some
        new = here[~np.isin(here, self._at_rest[name])]
        corners = self.skin.surface.triangles[obstacle.watched[new]].ravel()
        seen = corners[self.skin.seen[corners]]
        vertex = int((seen if len(seen) else corners)[0]) if len(new) else None
        return Spot(100.0 * len(new) / len(obstacle.watched), vertex)

    def _crossing(self, obstacle: _Obstacle, world: Mapping[str, Floats], some: Ints) -> Ints:
        """Which of some of the watched triangles cross a body."""
        corners = self.skin.surface.triangles[obstacle.watched[some]]
        skin = np.concatenate([world[n] for n in self.skin.surface.shapes])[corners]
        found = []
        for shapes, center in obstacle.bodies:
            moved = sum(float(len(world[n])) for n in shapes)
            shift = sum((world[n] - self.rest[n]).sum(axis=0) for n in shapes) / moved
            for shape in shapes:
                places = world[shape]
                if center is not None:
                    middle = center + shift
                    places = middle + (1.0 - DEPTH) * (places - middle)
                found.append(crossing(skin, places[self.face.scene.shape(shape).mesh.triangles]))
        hit: Ints = np.unique(np.concatenate(found))
        return hit

    @cached_property
    def _at_rest(self) -> dict[str, Ints]:
        return {
            n: self._crossing(o, self.rest, np.arange(len(o.watched), dtype=np.int32))
            for n, o in self._obstacles.items()
        }

    @cached_property
    def _obstacles(self) -> dict[str, _Obstacle]:
        """Eyeballs before the lids, teeth before the lips; what is not there is absent."""
        found = {}
        triangles = self.skin.surface.triangles
        teeth = [s.name for r in (Role.UPPER_TEETH, Role.LOWER_TEETH) for s in self.face.scene.with_role(r)]
        teeth = [name for name in teeth if len(self.face.scene.shape(name).mesh.triangles)]
        lips = np.isin(self.skin.labels, (UPPER, LOWER)) & self._before(teeth)
        balls = []
        around = np.zeros(len(lips), dtype=bool)
        for ball, names in self.skin.eyeballs:
            around[ball.vertices[ball.rest[:, 2] > ball.center[2]]] = True
            balls.append((tuple(names), ball.center))
        for name, where, bodies in (
            ("lids", around, tuple(balls)),
            ("teeth", lips, tuple(((n,), None) for n in teeth)),
        ):
            watched = np.flatnonzero(where[triangles].all(axis=1)).astype(np.int32)
            if bodies and len(watched):
                found[name] = _Obstacle(watched, bodies)
        return found

    def _before(self, teeth: list[str]) -> Bools:
        """(n,) the skin near some teeth at rest."""
        from scipy.spatial import cKDTree

        if not teeth:
            return np.zeros(self.skin.surface.vertex_count, dtype=bool)
        es0 = self.face.fapu.es0
        tree = cKDTree(np.concatenate([self.rest[n] for n in teeth]) / es0)
        away = tree.query(self.skin.surface.vertices, distance_upper_bound=NEAR_TEETH)[0]
        return np.asarray(away) < NEAR_TEETH


@dataclass(frozen=True, eq=False)
class _Obstacle:
    """What skin must not sink into: triangles (t,) of the skin, and bodies by their shapes.

    A body with a centre is made smaller about it by DEPTH, which is how far skin may sink in.
    """

    watched: Ints
    bodies: tuple[tuple[tuple[str, ...], Floats | None], ...]


def _worst(values: Floats) -> Spot:
    at = int(np.argmax(values))
    return Spot(float(values[at]), at)


def _longest(vertices: Floats, edges: Ints, offsets: Floats) -> int:
    """An end of the edge that changes its length most, measured beside it and SLACK."""
    moved = vertices + offsets
    before, after = (np.linalg.norm(v[edges[:, 0]] - v[edges[:, 1]], axis=1) + SLACK for v in (vertices, moved))
    return int(edges[int(np.argmax(np.abs(np.log(after / before)))), 0])
