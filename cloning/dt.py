"""Deformation transfer as a backend: elastic template, triangle by triangle, then the target's own vertices.

After Xiang, Chen and Yang (2008). The source's skin is fitted onto the target; the fitted skin deforms as the source's
triangles do; each of the target's vertices follows its place on the fitted skin. Deformation transfer alone copies
shape changes, not amounts, and MPEG-4 asks for amounts in FAPUs: in the default mode the feature points' goals stand
in the same equations.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cloning.align import anchor_ids
from cloning.backends import SkinTransfer
from cloning.deformation import POINT_WEIGHT, DeformationTransfer, deformation_transfer
from cloning.fill import HarmonicFill
from cloning.normalize import blend, ratios
from cloning.prepare import PreparedFace
from cloning.refine import Refinement
from cloning.skin import SkinMap, refined, sealed_band
from cloning.surface import Surface
from cloning.template.correspondence import correspond
from cloning.template.fitting import PUBLISHED, fit_template
from fba.arrays import Bools, Floats

LANDMARKS = (
    *("3.7", "3.8", "3.11", "3.12", "4.1", "4.2", "4.5", "4.6", "9.1", "9.2", "9.3", "9.15"),
    *("2.4", "2.5", "8.1", "8.2", "2.1", "2.10", "5.3", "5.4"),
)
"""Twenty of MPEG-4's feature points, for the published mode; which twenty the paper took is shown as a picture only."""

RESTING = 1.0
"""How much a vertex that no motion moves is held, against the gradients of one triangle."""

MOVING = 1e-2
"""The same of all other vertices, for their motion scaled by FAPUs: over more than some ten edges that gives the
amount, and the gradients the shape. It also places parts that have nothing at rest."""

MOST = 2.0
"""No vertex moves more than this times as far as FAPU scaling alone would move it, so what rests stays at rest."""


def build_transfer(source: PreparedFace, target: PreparedFace, as_published: bool) -> SkinTransfer:
    """Prepare deformation transfer between two faces."""
    return _build_published(source, target) if as_published else _build(source, target)


def _build(source: PreparedFace, target: PreparedFace) -> DeformedTransfer:
    labels = source.labels.values, target.labels.values
    fitted = fit_template(source.skin, target.skin, labels=labels)
    refinements, fine, fine_labels = refined(source.skin, labels[0], target.skin)
    surface = fitted.vertices
    for step in refinements:
        surface = step.matrix @ surface
    places = correspond(surface, fine.triangles, target.skin, labels=(fine_labels, labels[1]))
    unmatched = ~places.valid | sealed_band(target.skin, target.labels)
    skin_map = _skin_map(target.skin, refinements, places.matrix(), unmatched, places.residual)
    ids = tuple(anchor_ids(source.skin, target.skin))
    points = np.array([source.skin.positions[i] for i in ids])
    return DeformedTransfer(
        source,
        target,
        fitted.vertices,
        skin_map,
        ids,
        blend(source.skin.vertices, points, ratios(source.fapu, target.fapu, ids) / target.fapu.es0),
        _measures(skin_map),
        {"point_weight": POINT_WEIGHT, "moving_weight": MOVING, "most": MOST, "refinements": len(refinements)},
    )


def _build_published(source: PreparedFace, target: PreparedFace) -> PublishedDeformation:
    landmarks = [i for i in LANDMARKS if i in source.skin.points and i in target.skin.points]
    everything = np.ones(source.skin.vertex_count, bool)
    fitted = fit_template(source.skin, target.skin, landmarks, schedule=PUBLISHED, visible=everything)
    places = correspond(fitted.vertices, source.skin.triangles, target.skin, farthest=np.inf, least_facing=-1.0)
    skin_map = _skin_map(target.skin, (), places.matrix(), ~places.valid, places.residual)
    return PublishedDeformation(
        source, target, fitted.vertices, skin_map, _measures(skin_map), {"landmarks": len(landmarks)}
    )


def _skin_map(
    skin: Surface, refinements: tuple[Refinement, ...], matrix: Any, unmatched: Bools, distances: Floats
) -> SkinMap:
    if len(skin.links):
        matrix = (skin.seam_mean @ matrix).tocsr()
        unmatched = (skin.seam_mean @ unmatched.astype(float)) > 0.0
    fill = HarmonicFill(skin.vertices, np.concatenate([skin.edges, skin.links]), unmatched)
    return SkinMap(refinements, matrix, np.ones((skin.vertex_count, 3)), fill, unmatched, distances)


def _measures(skin_map: SkinMap) -> dict[str, float]:
    found = ~skin_map.unmatched
    return {
        "unmatched_share": float(skin_map.unmatched.mean()),
        "mean_distance_es": float(skin_map.distances[found].mean()) if found.any() else 0.0,
        "rest_without_partner": float(skin_map.fill.unreached.sum()),
    }


@dataclass(frozen=True, eq=False)
class DeformedTransfer:
    """The default mode's transfer.

    Attributes
    ----------
    fitted : (n, 3) the source's skin in the target's place, eye separations of the target.
    skin_map : from the source's vertices to the target's.
    ids : feature points that have goals.
    scale : (n, 3) FAPU ratios around each of the source's vertices, from its mesh unit to the target's eye separations.
    solver : None until the resting vertices are known.
    """

    source: PreparedFace
    target: PreparedFace
    fitted: Floats
    skin_map: SkinMap
    ids: tuple[str, ...]
    scale: Floats
    measures: Mapping[str, float]
    parameters: Mapping[str, float | str | bool]
    solver: DeformationTransfer | None = None

    def anchored(self, reach: Floats) -> DeformedTransfer:
        """The same for motions that move each source vertex by (n,) at most; those that never move are anchors."""
        skin = self.source.skin
        solver = deformation_transfer(
            skin.vertices,
            self.fitted,
            skin.triangles,
            np.where(reach == 0.0, RESTING, MOVING),
            self.goal_rows(),
            POINT_WEIGHT,
            skin.links,
        )
        return replace(self, solver=solver)

    def apply(self, motions: Floats) -> Floats:
        if self.solver is None:
            return self.anchored(_reach(motions)).apply(motions)
        source, target = self.source, self.target
        wishes = motions * self.scale[:, None]
        at_points = (source.skin.point_matrix(self.ids) @ _flat(motions)).reshape(len(self.ids), -1, 3)
        goals = at_points * ratios(source.fapu, target.fapu, self.ids)[:, None] / target.fapu.es0
        deformed = self.solver.apply(motions / source.fapu.es0, wishes, goals)
        carried = self.carry(_flat(deformed)).reshape(-1, *motions.shape[1:])
        most = MOST * self.carry(_lengths(wishes))
        carried *= (target.fapu.es0 * np.minimum(most / np.maximum(_lengths(carried), 1e-300), 1.0))[:, :, None]
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
class PublishedDeformation:
    """The paper's transfer: every triangle counts the same, nothing is held but one resting vertex of each part."""

    source: PreparedFace
    target: PreparedFace
    fitted: Floats
    skin_map: SkinMap
    measures: Mapping[str, float]
    parameters: Mapping[str, float | str | bool]
    solver: DeformationTransfer | None = None

    def anchored(self, reach: Floats) -> PublishedDeformation:
        """The same for motions that move each source vertex by (n,) at most."""
        skin = self.source.skin
        part = skin.components()
        held = np.zeros(skin.vertex_count)
        quietest = np.lexsort((reach, part))
        held[quietest[np.unique(part[quietest], return_index=True)[1]]] = 1.0
        solver = deformation_transfer(skin.vertices, self.fitted, skin.triangles, held, links=skin.links, uniform=True)
        return replace(self, solver=solver)

    def apply(self, motions: Floats) -> Floats:
        if self.solver is None:
            return self.anchored(_reach(motions)).apply(motions)
        offsets = motions / self.source.fapu.es0
        deformed = self.solver.apply(offsets, wishes=offsets)
        carried: Floats = self.carry(_flat(deformed)).reshape(-1, *motions.shape[1:]) * self.target.fapu.es0
        return carried

    def carry(self, values: Floats) -> Floats:
        return self.skin_map.carry(values)


def _reach(motions: Floats) -> Floats:
    """(n,) the farthest that any of (n, K, 3) offsets moves each vertex."""
    farthest: Floats = _lengths(motions).max(axis=1, initial=0.0)
    return farthest


def _lengths(offsets: Floats) -> Floats:
    """(n, K) lengths of (n, K, 3) offsets."""
    squared = np.einsum("nkd,nkd->nk", offsets, offsets)
    lengths: Floats = np.sqrt(squared)
    return lengths


def _flat(offsets: Floats) -> Floats:
    return offsets.reshape(len(offsets), -1)
