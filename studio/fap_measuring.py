"""Measure the quality of every FAP, viseme and expression of a face: see `fat.fap_quality`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from cloning.eyeballs import Ball, balls
from cloning.labels import label
from cloning.lining import coming_through, lining
from cloning.prepare import PreparedFace
from cloning.rigid import fit_rigid
from cloning.surface import Surface, build_surface
from cloning.visibility import visible
from fat.conformance import FapConformance, Probe
from fat.evaluate import Player, Pose
from fat.face import AnimatableFace
from fat.fap_quality import FapQuality, independent_motion, mirrored, parted, penetration, stretch
from fat.quality import asymmetry, flips, mirror_map
from fat.tables import FaceDefTable
from fba.amplitudes import amplitudes
from fba.arrays import Bools, Floats, Ints
from fba.errors import LandmarkError, MeshError
from fba.faps import EXPRESSION_FAP, VISEME_FAP, fap
from fba.high_level import BLEND_MAX
from fba.scene import Role

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


def measure_faps(face: AnimatableFace) -> list[FapQuality]:
    """Measure a face whose tables can be played.

    Returns
    -------
    A row for each direction of each low-level FAP, each viseme and each expression that has a table, in the order
    of the tables, positive direction first. What cannot be measured on this face is None.
    """
    measurer = _Measurer(face)
    return [row for table in face.tables for row in measurer.rows(table)]


@dataclass(frozen=True, eq=False)
class _Skin:
    """All skin of a face as one surface.

    Attributes
    ----------
    seen : (n,) what can be seen on the neutral face.
    hidden : (e, 2) edges with an end that cannot.
    labels : (n,) lips and lids, see `cloning.labels`.
    lining : (m,) vertices that line the inside, see `cloning.lining`.
    linear : shape name -> (3, 3) from its local directions to the world's.
    """

    surface: Surface
    seen: Bools
    hidden: Ints
    labels: Ints
    lining: Ints
    linear: Mapping[str, Floats]

    def offsets(self, face: AnimatableFace, pose: Pose, es0: float) -> Floats:
        """(n, 3) offsets without what transforms do, in eye separations."""
        parts = []
        for name in self.surface.shapes:
            moved = pose.local[name] - face.scene.shape(name).mesh.vertices
            parts.append(moved @ self.linear[name].T)
        offsets: Floats = np.concatenate(parts) / es0
        return offsets


class _Measurer:
    def __init__(self, face: AnimatableFace) -> None:
        self.face = face
        self.player = Player(face, rules=())
        self.rest = self.player.pose().world_shapes()
        self.points = face.feature_points.positions(face.scene, self.rest)
        self.probe = Probe(face, self.rest)
        self.skin = _skin(face)
        self.eyeballs = _eyeballs(face, self.skin)
        self.sides = _sides(face)

    def rows(self, table: FaceDefTable) -> Iterator[FapQuality]:
        """One row for each direction."""
        borders = sorted({int(b) for mesh in table.meshes for b in mesh.interval_borders} - {0})
        high = table.fap_id <= EXPRESSION_FAP
        for value in (BLEND_MAX,) if high else amplitudes()[table.fap_id].values:
            same = [b for b in borders if b * value > 0] or [value]
            limit = max([value, *same], key=abs)
            yield self._row(table, value, value if high else limit, same)

    def _row(self, table: FaceDefTable, value: int, limit: int, borders: list[int]) -> FapQuality:
        pose = self._pose(table.fap_id, table.high_level_select, value)
        world = pose.world_shapes()
        far = pose if limit == value else self._pose(table.fap_id, table.high_level_select, limit)
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
            penetration=self._penetration(world),
            asymmetry=self._asymmetry(table, value, world),
        )
        if self.skin is None:
            return row
        surface, es0 = self.skin.surface, self.face.fapu.es0
        near, wide = (self.skin.offsets(self.face, p, es0) for p in (pose, far))
        return replace(
            row,
            flips=flips(surface.vertices, surface.triangles, near),
            flips_at_limit=flips(surface.vertices, surface.triangles, wide),
            stretch=stretch(surface.vertices, self.skin.hidden, near),
            parted=parted(surface.links, wide),
            through=len(coming_through(surface, self.skin.seen, self.skin.labels, self.skin.lining, near)),
        )

    def _pose(self, fap_id: int, select: int, value: int) -> Pose:
        if fap_id == VISEME_FAP:
            return self.player.pose(viseme=(select, 0, value))
        if fap_id == EXPRESSION_FAP:
            return self.player.pose(expression=(select, value, 0, 0))
        return self.player.pose({fap_id: value})

    def _own(self, table: FaceDefTable, values: list[int]) -> FapConformance | None:
        if table.fap_id <= EXPRESSION_FAP:
            return None
        definition = fap(table.fap_id)
        found = [self.probe.measure(definition, v, self._pose(table.fap_id, 1, v).world_shapes()) for v in values]
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

    def _penetration(self, world: Mapping[str, Floats]) -> float | None:
        if self.skin is None or not self.eyeballs:
            return None
        places = np.concatenate([world[n] for n in self.skin.surface.shapes])
        before, after = [], []
        for ball, names in self.eyeballs:
            rest = np.concatenate([self.rest[n] for n in names])
            way = np.concatenate([world[n] for n in names]) - rest
            rigid = fit_rigid(rest, way[:, None], ball.center)
            local = ball.rest - ball.center
            front = local[:, 2] > 0.0
            moved = places[ball.vertices[front]] - ball.center - rigid.shifts[0]
            before.append(ball.clearance(local[front]))
            after.append(ball.clearance(moved @ rigid.turns[0]))
        return penetration(np.concatenate(before), np.concatenate(after))

    def _asymmetry(self, table: FaceDefTable, value: int, world: Mapping[str, Floats]) -> float | None:
        if self.sides is None:
            return None
        fap_id, at = (table.fap_id, value) if table.fap_id <= EXPRESSION_FAP else mirrored(table.fap_id, value)
        if self.face.tables.get(fap_id, table.high_level_select) is None:
            return None
        names, partner = self.sides
        rest = np.concatenate([self.rest[n] for n in names])
        other = self._pose(fap_id, table.high_level_select, at).world_shapes()
        mine, yours = (np.concatenate([w[n] for n in names]) - rest for w in (world, other))
        return asymmetry(mine, yours, partner)


def _skin(face: AnimatableFace) -> _Skin | None:
    """The skin, with its hidden edges; None without a skin."""
    names = [s.name for s in face.scene.with_role(Role.SKIN)]
    try:
        surface = build_surface(face.scene, face.feature_points, names, face.fapu.es0)
        whole = build_surface(face.scene, face.feature_points, [s.name for s in face.scene.shapes], face.fapu.es0)
    except LandmarkError:
        return None
    shown = whole.split(visible(whole).astype(np.float64))
    seen = np.concatenate([shown[name] > 0.0 for name in names])
    edges = surface.edges
    linear = {name: face.scene.world_matrix(name)[:3, :3] for name in names}
    labels = label(surface).values
    hidden = edges[~seen[edges].all(axis=1)]
    return _Skin(surface, seen, hidden, labels, lining(surface, seen, labels), linear)


def _eyeballs(face: AnimatableFace, skin: _Skin | None) -> list[tuple[Ball, list[str]]]:
    """The eyeballs that are there, each with the names of its shapes."""
    if skin is None or not {"3.5", "3.6"} <= set(face.feature_points):
        return []
    prepared = PreparedFace(face.scene, face.feature_points, face.fapu, skin.surface, label(skin.surface), ())
    shapes = [
        names
        for role in (Role.EYE_LEFT, Role.EYE_RIGHT)
        if (names := [s.name for s in face.scene.with_role(role) if s.mesh.vertex_count])
    ]
    return list(zip(balls(prepared), shapes, strict=True))


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
