"""One FAP made of a bump: how far it reaches, what it leaves still, and the way its skin goes.

A large motion goes step by step, each with the bump of the skin as it lies by then: what is squeezed between a moving
and a still feature point becomes thin there, but does not fold over as it would along straight lines.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from authoring.bumps import Bumps, Goals, Patch, Place, bumps, pinned
from authoring.carried import carrier
from authoring.clearance import before_eyeballs
from authoring.construction import Construction, Offsets
from authoring.riders import skin_offsets
from authoring.sliding import fit_round
from cloning.prepare import PreparedFace
from fba.arrays import Bools, Floats
from fba.faps import fap

STEP = 0.5
"""Longest step, as a share of the way to the nearest point that must stay: within it no bump folds the skin."""

LEVEL = 1e-9
"""Depths below this, in eye separations, are rounding."""

Values = dict[str, float]


@dataclass(frozen=True)
class BumpMotion:
    """How one FAP moves the skin around its feature point.

    Attributes
    ----------
    fap_id : the FAP.
    borders : the interval borders but 0.
    span : two feature points, whose distance measures the bump.
    reach : radius of the bump, as a share of the span.
    tied : feature points that move along with the FAP's own.
    pins : feature points that stay still besides those that other FAPs move along the same axis.
    slides : True if the skin follows the round of the head.
    bulges : True if the skin goes along its normal at the feature point, as far as the FAP says along its axis.
    carries : True if hidden skin behind the moving one, such as the mouth's lining, goes along.
    shape : (face, feature point -> weight) -> more places with weights, to give the bump its outline.
    """

    fap_id: int
    borders: tuple[int, ...]
    span: tuple[str, str]
    reach: float
    tied: tuple[str, ...] = ()
    pins: tuple[str, ...] = ()
    slides: bool = False
    bulges: bool = False
    carries: bool = False
    shape: Callable[[PreparedFace, Values], list[Place]] | None = None

    @property
    def own(self) -> str:
        """The FAP's feature point."""
        return fap(self.fap_id).feature_points[0]

    @property
    def construction(self) -> Construction:
        """The construction of the FAP."""
        return Construction(self.fap_id, self.borders, tuple(dict.fromkeys((self.own, *self.span))), self.make)

    def make(self, face: PreparedFace, value: int) -> Offsets:
        """Offsets at a border."""
        made = _MADE.setdefault(face, {})
        if self not in made:
            made[self] = {v: skin_offsets(face, field) for v, field in self._fields(face)}
        return dict(made[self][value])

    def _fields(self, face: PreparedFace) -> Iterator[tuple[int, Floats]]:
        """(border, field (n, 3) in eye separations), from 0 outwards on both sides."""
        rest = face.skin.vertices
        way = self._way(face)
        bump = self._bump(face, way)
        entry = fap(self.fap_id)
        unit = face.fapu.unit(entry.unit) / face.fapu.es0
        at_rest = bump.weight(rest)
        ground = fit_round(face.skin, at_rest) if self.slides else None
        for sign in (1, -1):
            shift, field, reached = np.zeros_like(rest), np.zeros_like(rest), 0
            for border in sorted((b for b in self.borders if b * sign > 0), key=abs):
                length = (border - reached) * unit
                steps = int(np.ceil(abs(length) / bump.step - 1e-9))
                for _ in range(steps):
                    weight = bump.weight(rest + field) if shift.any() else at_rest
                    shift = shift + (length / steps) * weight[:, None] * way
                    field = ground.slide(rest, shift) if ground else shift
                reached = border
                done = bump.level(field) if ground else field
                yield border, before_eyeballs(face, done)

    def _way(self, face: PreparedFace) -> Floats:
        """(3,) where the skin goes; 1 along the FAP's axis."""
        direction = np.asarray(fap(self.fap_id).direction)
        if not self.bulges:
            return direction
        normal = (face.skin.point_matrix([self.own]) @ face.skin.normals)[0]
        normal /= max(float(np.linalg.norm(normal)), 1e-12)
        aside = float(normal @ direction)
        depth = float(np.clip(normal[2] / aside, 0.0, 1.0)) if aside > 0.0 else 0.0
        way: Floats = direction + depth * np.array([0.0, 0.0, 1.0])
        return way

    def _bump(self, face: PreparedFace, way: Floats) -> _Bump:
        maker = bumps(face)
        a, b = (face.skin.positions[k] for k in self.span)
        radius = self.reach * float(np.linalg.norm(a - b))
        wanted = {self.own: 1.0, **{k: 1.0 for k in self.tied if k in face.skin.points}}
        free = maker.within(tuple(wanted), radius)
        pins = [*(k for axis in range(3) if way[axis] for k in pinned(axis, tuple(wanted))), *self.pins]
        more = [] if self.shape is None else self.shape(face, wanted)
        goals = maker.goals(wanted, pins, more)
        at, points = face.skin.positions, face.skin.points
        near = [k for k in pins if k in points and free[points[k][0]].all()]
        step = STEP * min([radius, *(float(np.linalg.norm(at[k] - at[self.own])) for k in near)])
        carry = _on_side(carrier(face), maker.side(self.own)) if self.carries else None
        return _Bump(maker, goals, maker.patch(free), step, carry)


def _on_side(carry: Any, side: Bools) -> Any:
    """The same, but skin that is not on a side (n,) stays still whatever moves before it."""
    from scipy.sparse import diags_array

    return carry if side.all() else diags_array(side.astype(np.float64)) @ carry


@dataclass(frozen=True, eq=False)
class _Bump:
    """A bump on one face.

    Attributes
    ----------
    goals : what it must be at places.
    patch : the skin that may move.
    step : longest way to go at once, in eye separations.
    carry : what hidden skin does, see `carrier`; None if it goes its own way.
    """

    maker: Bumps
    goals: Goals
    patch: Patch
    step: float
    carry: Any | None

    def weight(self, places: Floats) -> Floats:
        """The bump (n,) of the skin as it lies by now."""
        weight: Floats = self.patch.weights(self.goals, places)[:, 0]
        return weight if self.carry is None else self.carry @ weight

    def level(self, field: Floats) -> Floats:
        """The field without the depth that sliding gave to feature points whose depth other FAPs move."""
        keys = [k for k in pinned(2) if k in self.maker.surface.points]
        deep = self.maker.surface.point_matrix(keys) @ field[:, 2]
        if np.abs(deep).max(initial=0.0) < LEVEL:
            return field
        leveled = field.copy()
        leveled[:, 2] -= self._depths @ deep
        return leveled

    @cached_property
    def _depths(self) -> Floats:
        """(n, k) bumps at the feature points whose depth other FAPs move, each 0 at the other ones."""
        surface = self.maker.surface
        keys = [k for k in pinned(2) if k in surface.points]
        goals = replace(self.maker.goals(dict.fromkeys(keys, 1.0)), values=np.eye(len(keys)))
        return self.patch.weights(goals, surface.vertices)


_MADE: WeakKeyDictionary[PreparedFace, dict[BumpMotion, dict[int, Offsets]]] = WeakKeyDictionary()
