"""Measure the quality of every FAP, viseme and expression of a face: see `fat.fap_quality`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from cloning.lining import coming_through
from fat.conformance import FapConformance, Probe
from fat.face import AnimatableFace
from fat.fap_quality import FapQuality, independent_motion, mirrored, parted, stretch
from fat.folds import largest_fold
from fat.quality import asymmetry, flips, mirror_map, turned_over
from fat.tables import FaceDefTable
from fba.amplitudes import amplitudes
from fba.arrays import Floats, Ints
from fba.errors import MeshError
from fba.faps import EXPRESSION_FAP, fap
from fba.high_level import BLEND_MAX
from fba.scene import Role
from studio.checked_skin import CheckedSkin, check_skin
from studio.eye_depths import EyeDepths
from studio.posing import Key, Poses

SYMMETRIC = 1e-3
"""Eye separations by which the vertices of a symmetric mesh may miss their mirror images."""

_PARTS = (
    (Role.SKIN,),
    (Role.EYE_LEFT, Role.EYE_RIGHT),
    (Role.UPPER_TEETH,),
    (Role.LOWER_TEETH,),
    (Role.TONGUE,),
)
"""What is symmetric or not, each for itself."""


def measure_faps(face: AnimatableFace, skin: CheckedSkin | None = None) -> list[FapQuality]:
    """Measure a face whose tables can be played.

    Parameters
    ----------
    skin : its skin, where it is there already.

    Returns
    -------
    A row for each direction of each low-level FAP, each viseme and each expression that has a table, in the order
    of the tables, positive direction first. What cannot be measured on this face is None.
    """
    poses, skin = Poses(face), skin or check_skin(face)
    measurer = FapMeasurer(poses, skin, eye_depths(skin, poses))
    return [row for table in face.tables for row in measurer.rows(table)]


def eye_depths(skin: CheckedSkin | None, poses: Poses) -> EyeDepths | None:
    """What tells which skin gets into the eyeballs; None without eyeballs."""
    return EyeDepths(skin, poses) if skin is not None and skin.eyeballs else None


class FapMeasurer:
    """Measures the tables of a face."""

    def __init__(self, poses: Poses, skin: CheckedSkin | None, eyes: EyeDepths | None) -> None:
        self.face = face = poses.face
        self.poses, self.rest = poses, poses.rest
        self.points = face.feature_points.positions(face.scene, self.rest)
        self.probe = Probe(face, self.rest)
        self.skin = skin
        self.sides = _sides(face)
        self.eyes = eyes

    def rows(self, table: FaceDefTable) -> Iterator[FapQuality]:
        """One row for each direction."""
        borders = sorted({int(b) for mesh in table.meshes for b in mesh.interval_borders} - {0})
        high = table.fap_id <= EXPRESSION_FAP
        for value in (BLEND_MAX,) if high else amplitudes()[table.fap_id].values:
            same = [b for b in borders if b * value > 0] or [value]
            limit = max([value, *same], key=abs)
            yield self._row(table, value, value if high else limit, same)

    def _row(self, table: FaceDefTable, value: int, limit: int, borders: list[int]) -> FapQuality:
        key = (table.fap_id, table.high_level_select, value)
        pose, world = self.poses.pose(key), self.poses.world(key)
        far = pose if limit == value else self.poses.pose((table.fap_id, table.high_level_select, limit))
        talk, other = self._cross_talk(table, world)
        row = FapQuality(
            fap_id=table.fap_id,
            select=table.high_level_select,
            name=table.name,
            value=value,
            limit=limit,
            own=self._own(table, borders),
            cross_talk=talk,
            cross_fap=other,
            flips=None,
            flips_at_limit=None,
            stretch=None,
            parted=None,
            penetration=self._penetration(key),
            asymmetry=self._asymmetry(table, value, world),
        )
        if self.skin is None:
            return row
        surface = self.skin.surface
        near, wide = (self.skin.offsets(self.face, p) for p in (pose, far))
        moving, over = turned_over(surface.vertices, surface.triangles, near)
        turned = 100.0 * len(over) / moving if moving else 0.0
        shown = surface.triangles[over]
        return replace(
            row,
            flips=turned,
            flips_at_limit=turned if far is pose else flips(surface.vertices, surface.triangles, wide),
            stretch=stretch(surface.vertices, self.skin.hidden_edges, near),
            parted=parted(surface.links, wide),
            fold=largest_fold(surface.vertices, shown[self.skin.seen[shown].all(axis=1)]),
            through=len(coming_through(surface, self.skin.seen, self.skin.labels, self.skin.lining, near)),
        )

    def _own(self, table: FaceDefTable, values: list[int]) -> FapConformance | None:
        if table.fap_id <= EXPRESSION_FAP:
            return None
        definition = fap(table.fap_id)
        found = [self.probe.measure(definition, v, self.poses.world((table.fap_id, 1, v))) for v in values]
        seen = [f for f in found if f is not None]
        return max(seen, key=lambda f: (not f.passed, f.relative_error), default=None)

    def _cross_talk(self, table: FaceDefTable, world: Mapping[str, Floats]) -> tuple[float | None, int | None]:
        if table.fap_id <= EXPRESSION_FAP:
            return None, None
        moved = self.face.feature_points.positions(self.face.scene, world)
        on_surface = [k for k, p in self.face.feature_points.items() if p.shape is not None]
        motion = {k: moved[k] - self.points[k] for k in on_surface}
        steps = [float(np.linalg.norm(v - self.rest[n], axis=1).max(initial=0.0)) for n, v in world.items()]
        return independent_motion(fap(table.fap_id), motion, self.face.fapu, max(steps, default=0.0))

    def _penetration(self, key: Key) -> float | None:
        """Percent of the skin before the eyeballs that gets into them."""
        if self.eyes is None:
            return None
        sunk = self.eyes.sunk(key)
        return 100.0 * float(np.mean(sunk)) if len(sunk) else 0.0

    def _asymmetry(self, table: FaceDefTable, value: int, world: Mapping[str, Floats]) -> float | None:
        if self.sides is None:
            return None
        fap_id, at = (table.fap_id, value) if table.fap_id <= EXPRESSION_FAP else mirrored(table.fap_id, value)
        if self.face.tables.get(fap_id, table.high_level_select) is None:
            return None
        names, partner = self.sides
        rest = np.concatenate([self.rest[n] for n in names])
        other = self.poses.world((fap_id, table.high_level_select, at))
        mine, yours = (np.concatenate([w[n] for n in names]) - rest for w in (world, other))
        return asymmetry(mine, yours, partner)


def _sides(face: AnimatableFace) -> tuple[list[str], Ints] | None:
    """Names of the shapes that are symmetric, and each vertex's mirror image among their joined vertices."""
    names: list[str] = []
    partner: list[Ints] = []
    start = 0
    for roles in _PARTS:
        some = [s.name for role in roles for s in face.scene.with_role(role) if s.mesh.vertex_count]
        if not some:
            continue
        vertices = np.concatenate([face.scene.world_vertices(n) for n in some])
        try:
            mirror = mirror_map(vertices, SYMMETRIC * face.fapu.es0)
        except MeshError:
            if Role.SKIN in roles:
                return None
            continue
        names += some
        partner.append(mirror + start)
        start += len(vertices)
    return (names, np.concatenate(partner)) if partner else None
