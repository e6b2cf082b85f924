"""Transfers of local shape: a copy of the source's skin lies on the target, deforms, and takes the target along.

What the backends that copy shape changes have in common. The copy has the source's vertices in the target's place; a
solver gives it the source's local changes (triangle by triangle, or tent by tent); each of the target's own vertices
follows its place on the copy. Local changes alone know nothing of amounts, and MPEG-4 asks for amounts in FAPUs: in
the default mode the feature points' goals stand in the same equations.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from cloning.align import anchor_ids
from cloning.fill import HarmonicFill
from cloning.normalize import blend, ratios
from cloning.prepare import PreparedFace
from cloning.refine import Refinement
from cloning.shape_solver import POINT_WEIGHT, ShapeTransfer, column_blocks
from cloning.skin import SkinMap, refined
from cloning.surface import Surface
from cloning.template.correspondence import Correspondence, correspond
from cloning.template.fitting import fit_template
from cloning.vectors import ROWS, length
from fba.arrays import Bools, Floats

RESTING = 1.0
"""How much a vertex that no motion moves is held, against the local changes of one triangle or tent."""

MOVING = 1e-2
"""The same of all other vertices, for their motion scaled by FAPUs: over more than some ten edges that gives the
amount, and the local changes the shape. It also places parts that have nothing at rest."""

MOST = 2.0
"""No vertex moves more than this times as far as FAPU scaling alone would move it, so what rests stays at rest."""


def template_copy(source: PreparedFace, target: PreparedFace) -> tuple[Floats, SkinMap]:
    """Fit the source's skin onto the target.

    Returns
    -------
    copy : (n, 3) the source's vertices in the target's place, eye separations of the target.
    skin_map : from the source's vertices to the target's.
    """
    labels = source.labels.values, target.labels.values
    copy = fit_template(source.skin, target.skin, labels=labels).vertices
    refinements, fine, fine_labels = refined(source.skin, labels[0], target.skin)
    surface = copy
    for step in refinements:
        surface = step.matrix @ surface
    places = correspond(surface, fine.triangles, target.skin, labels=(fine_labels, labels[1]))
    return copy, carrying_map(target.skin, places, refinements, target.labels.between)


def carrying_map(
    skin: Surface, places: Correspondence, refinements: tuple[Refinement, ...] = (), without: Bools | None = None
) -> SkinMap:
    """The operator that takes a target's vertices along with their places; those without a place are filled.

    Parameters
    ----------
    without : (n_t,) bool, vertices that get none; None = all may have one.
    """
    matrix = places.matrix()
    unmatched = ~places.valid if without is None else ~places.valid | without
    if len(skin.links):
        matrix = (skin.seam_mean @ matrix).tocsr()
        unmatched = (skin.seam_mean @ unmatched.astype(float)) > 0.0
    fill = HarmonicFill(skin.vertices, np.concatenate([skin.edges, skin.links]), unmatched)
    return SkinMap(refinements, matrix, np.ones((skin.vertex_count, 3)), fill, unmatched, places.residual)


def goal_transfer(
    source: PreparedFace,
    target: PreparedFace,
    skin_map: SkinMap,
    factor: Callable[[Floats, Any], ShapeTransfer],
    measures: Mapping[str, float],
) -> GoalTransfer:
    """A default mode's transfer.

    Parameters
    ----------
    factor : (n,) how much each vertex is held, and the (k, n) rows that have goals -> the solver.
    measures : of the correspondence, beside those of the map.
    """
    ids = tuple(anchor_ids(source.skin, target.skin))
    points = np.array([source.skin.positions[i] for i in ids])
    return GoalTransfer(
        source,
        target,
        skin_map,
        ids,
        blend(source.skin.vertices, points, ratios(source.fapu, target.fapu, ids) / target.fapu.es0),
        factor,
        {**skin_map.health(), **measures},
        {
            "point_weight": POINT_WEIGHT,
            "moving_weight": MOVING,
            "most": MOST,
            "refinements": len(skin_map.refinements),
        },
    )


@dataclass(frozen=True, eq=False)
class GoalTransfer:
    """A default mode's transfer: feature points have goals, what rests is held.

    Attributes
    ----------
    skin_map : from the source's vertices to the target's.
    ids : feature points that have goals.
    scale : (n, 3) FAPU ratios around each of the source's vertices, from its mesh unit to the target's eye separations.
    factor : see `goal_transfer`.
    solver : None until the resting vertices are known.
    """

    source: PreparedFace
    target: PreparedFace
    skin_map: SkinMap
    ids: tuple[str, ...]
    scale: Floats
    factor: Callable[[Floats, Any], ShapeTransfer]
    measures: Mapping[str, float]
    parameters: Mapping[str, float | str | bool]
    solver: ShapeTransfer | None = None

    def anchored(self, reach: Floats) -> GoalTransfer:
        """The same for motions that move each source vertex by (n,) at most; those that never move are anchors."""
        return replace(self, solver=self.factor(np.where(reach == 0.0, RESTING, MOVING), self.goal_rows()))

    def apply(self, motions: Floats) -> Floats:
        if self.solver is None:
            return self.anchored(_reach(motions)).apply(motions)
        source, target = self.source, self.target
        at_points = (source.skin.point_matrix(self.ids) @ _flat(motions)).reshape(len(self.ids), -1, 3)
        goals = at_points * ratios(source.fapu, target.fapu, self.ids)[:, None] / target.fapu.es0
        deformed, wished = np.empty(motions.shape), np.empty(motions.shape[:2])
        for some in column_blocks(motions.shape[1]):
            block = np.ascontiguousarray(motions[:, some])
            wishes = block * self.scale[:, None]
            wished[:, some] = _lengths(wishes)
            deformed[:, some] = self.solver.apply(block / source.fapu.es0, wishes, goals[:, some])
        carried = self.carry(_flat(deformed)).reshape(-1, *motions.shape[1:])
        most = MOST * self.carry(wished)
        for start in range(0, len(carried), ROWS):
            rows = slice(start, start + ROWS)
            share = np.minimum(most[rows] / np.maximum(_lengths(carried[rows]), 1e-300), 1.0)
            carried[rows] *= (target.fapu.es0 * share)[:, :, None]
        return carried

    def carry(self, values: Floats) -> Floats:
        return self.skin_map.carry(values)

    def goal_rows(self) -> Any:
        """(k, n) sparse: feature points on the source's vertices.

        Those of the target, by way of the map; the source's own where the target's have no partner.
        """
        from scipy.sparse import diags_array

        rows = self.target.skin.point_matrix(self.ids) @ self.skin_map.matrix
        matched = np.asarray(rows.sum(axis=1)).ravel() > 1.0 - 1e-6
        for step in reversed(self.skin_map.refinements):
            rows = rows @ step.matrix
        own = self.source.skin.point_matrix(self.ids)
        return (diags_array(matched.astype(float)) @ rows + diags_array((~matched).astype(float)) @ own).tocsr()


@dataclass(frozen=True, eq=False)
class BareTransfer:
    """A published mode's transfer: local changes alone.

    Attributes
    ----------
    skin_map : from the source's vertices to the target's.
    factor : (n,) how far each of the source's vertices moves at most, mesh units -> the solver.
    turn : (3, 3) from directions of the source to those of the target.
    solver : None until that is known.
    """

    source: PreparedFace
    target: PreparedFace
    skin_map: SkinMap
    factor: Callable[[Floats], ShapeTransfer]
    measures: Mapping[str, float]
    parameters: Mapping[str, float | str | bool]
    turn: Floats = field(default_factory=lambda: np.eye(3))
    solver: ShapeTransfer | None = None

    def anchored(self, reach: Floats) -> BareTransfer:
        """The same for motions that move each source vertex by (n,) at most."""
        return replace(self, solver=self.factor(reach))

    def apply(self, motions: Floats) -> Floats:
        copied = self.deform(motions)
        carried: Floats = self.carry(_flat(copied)).reshape(-1, *motions.shape[1:]) * self.target.fapu.es0
        return carried

    def deform(self, motions: Floats) -> Floats:
        """(n, K, 3) offsets of the copy, in the target's place and eye separations."""
        if self.solver is None:
            return self.anchored(_reach(motions)).deform(motions)
        offsets = motions @ self.turn.T / self.source.fapu.es0
        return self.solver.apply(offsets, wishes=offsets)

    def carry(self, values: Floats) -> Floats:
        return self.skin_map.carry(values)


def _reach(motions: Floats) -> Floats:
    """(n,) the farthest that any of (n, K, 3) offsets moves each vertex."""
    farthest: Floats = _lengths(motions).max(axis=1, initial=0.0)
    return farthest


def _lengths(offsets: Floats) -> Floats:
    """(n, K) lengths of (n, K, 3) offsets."""
    return length([offsets[:, :, axis] for axis in range(3)])


def _flat(offsets: Floats) -> Floats:
    return offsets.reshape(len(offsets), -1)
