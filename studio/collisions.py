"""What crosses what in a motion: lids and eyeballs, lips and teeth, the tongue and the teeth.

Triangle is tested against triangle, exactly. What crosses at rest already does not count.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fat.fap_quality import DEPTH
from fat.intersections import crossing
from fba.arrays import Bools, Floats, Ints
from fba.scene import Role
from studio.checked_skin import CheckedSkin
from studio.eye_depths import EyeDepths
from studio.posing import Key, Poses
from studio.spot import Spot

NEAR_TEETH = 0.25
"""Lips nearer than this to a tooth at rest are watched, in eye separations: a lip is .2 thick."""

UPPER, LOWER = 1, 2
"""Labels of the lips, see `cloning.labels`."""

TONGUE_TIP = "6.1"


class Collisions:
    """Looks for collisions in the motions of a face.

    Parameters
    ----------
    eyes : which skin gets into the eyeballs; None for a face without.
    """

    def __init__(self, poses: Poses, skin: CheckedSkin, eyes: EyeDepths | None) -> None:
        self._face, self._skin = poses.face, skin
        self._poses, self._rest, self._eyes = poses, poses.rest, eyes

    def spots(self, key: Key) -> Iterator[tuple[str, Spot]]:
        """Percent of what is watched that collides: before the worse eyeball, lips, tongue."""
        for name, parts in self._watched.items():
            yield name, max((self._spot(part, key) for part in parts), key=lambda s: s.value)

    def _spot(self, part: _Watched, key: Key) -> Spot:
        world = self._poses.world(key)
        hit = self._hit(part, world)
        if self._eyes is not None and part.eye is not None:
            hit = np.union1d(hit, np.flatnonzero(self._eyes.inside(key, part.eye, part.triangles)))
        new = hit[~np.isin(hit, self._at_rest[id(part)])]
        if self._eyes is not None and part.eye is not None and len(new):
            new = new[self._eyes.shown(key, part.eye, part.triangles[new])]
        share = 100.0 * len(new) / len(part.triangles)
        if not len(new) or part.point is not None:
            return Spot(share, None, part.point if len(new) else None)
        corners = part.triangles[new].ravel()
        seen = corners[self._skin.seen[corners]]
        return Spot(share, int((seen if len(seen) else corners)[0]))

    def _hit(self, part: _Watched, world: Mapping[str, Floats]) -> Ints:
        """The watched triangles that cross a body; where no body moves, only those that move are tested again."""
        some = np.arange(len(part.triangles), dtype=np.int32)
        if world is not self._rest and all(
            np.array_equal(world[n], self._rest[n]) for names, _ in part.bodies for n in names
        ):
            moved = np.concatenate([np.any(world[n] != self._rest[n], axis=1) for n in part.shapes])
            some = some[moved[part.triangles].any(axis=1)]
        if not len(some):
            return some
        corners = np.concatenate([world[n] for n in part.shapes])[part.triangles[some]]
        found = []
        for shapes, center in part.bodies:
            moving = sum(float(len(world[n])) for n in shapes)
            shift = sum((world[n] - self._rest[n]).sum(axis=0) for n in shapes) / moving
            for shape in shapes:
                places = world[shape]
                if center is not None:
                    middle = center + shift
                    places = middle + (1.0 - DEPTH) * (places - middle)
                found.append(crossing(corners, places[self._face.scene.shape(shape).mesh.triangles]))
        hit: Ints = some[np.unique(np.concatenate(found))]
        return hit

    @cached_property
    def _at_rest(self) -> dict[int, Ints]:
        return {id(part): self._hit(part, self._rest) for parts in self._watched.values() for part in parts}

    @cached_property
    def _watched(self) -> dict[str, list[_Watched]]:
        scene, surface = self._face.scene, self._skin.surface
        teeth = [
            s.name
            for role in (Role.UPPER_TEETH, Role.LOWER_TEETH)
            for s in scene.with_role(role)
            if len(s.mesh.triangles)
        ]
        rows = tuple(((n,), None) for n in teeth)
        found: dict[str, list[_Watched]] = {"lids": [], "teeth": [], "tongue": []}
        for number, (ball, names) in enumerate(self._skin.eyeballs):
            before = np.zeros(surface.vertex_count, dtype=bool)
            before[ball.vertices[ball.rest[:, 2] > ball.center[2]]] = True
            inside = surface.triangles[before[surface.triangles].all(axis=1)]
            found["lids"].append(_Watched(surface.shapes, inside, ((tuple(names), ball.center),), eye=number))
        if teeth:
            lips = np.isin(self._skin.labels, (UPPER, LOWER)) & self._before(teeth)
            found["teeth"].append(
                _Watched(surface.shapes, surface.triangles[lips[surface.triangles].all(axis=1)], rows)
            )
            tongue = [s for s in scene.with_role(Role.TONGUE) if len(s.mesh.triangles)]
            starts = np.cumsum([0, *(s.mesh.vertex_count for s in tongue)])
            triangles = [s.mesh.triangles + start for s, start in zip(tongue, starts.tolist(), strict=False)]
            if tongue:
                shapes = tuple(s.name for s in tongue)
                point = TONGUE_TIP if TONGUE_TIP in self._face.feature_points else None
                found["tongue"].append(_Watched(shapes, np.concatenate(triangles), rows, point=point))
        some = {name: [p for p in parts if len(p.triangles)] for name, parts in found.items()}
        return {name: parts for name, parts in some.items() if parts}

    def _before(self, teeth: list[str]) -> Bools:
        """(n,) the skin near some teeth at rest."""
        from scipy.spatial import cKDTree

        es0 = self._face.fapu.es0
        tree = cKDTree(np.concatenate([self._rest[n] for n in teeth]) / es0)
        away = tree.query(self._skin.surface.vertices, distance_upper_bound=NEAR_TEETH)[0]
        return np.asarray(away) < NEAR_TEETH


@dataclass(frozen=True, eq=False)
class _Watched:
    """What must not sink into some bodies.

    Attributes
    ----------
    shapes : whose vertices are joined, and triangles (t, 3) of these.
    bodies : each by its shapes; one with a centre is made smaller about it by DEPTH, which is how far skin may sink in.
    eye : the number of the eyeball; what lies wholly inside it counts, too, and what other skin covers does not.
    point : the feature point where collisions are told; None: where they are, on the skin.
    """

    shapes: tuple[str, ...]
    triangles: Ints
    bodies: tuple[tuple[tuple[str, ...], Floats | None], ...]
    eye: int | None = None
    point: str | None = None


__all__ = ["Collisions"]
