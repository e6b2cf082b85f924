"""The map from a source's skin to a target's: one sparse operator for every motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cloning.align import align, anchor_ids
from cloning.antialias import edge_samples
from cloning.fill import HarmonicFill
from cloning.labels import Labels
from cloning.locate import Places, closest
from cloning.refine import Refinement, refine
from cloning.settle import settle
from cloning.surface import Surface
from fba.arrays import Bools, Floats, Ints

FARTHEST = 0.10
"""A vertex has no partner farther from the source's skin than this, in eye separations, after alignment."""

LEAST_FACING = 0.25
"""A vertex has no partner where the skins' normals differ by more than about 75 degrees."""

COARSER = 1.5
"""A source is refined where its edges are longer than the target's by this factor."""

MOST_VERTICES = 120_000


@dataclass(frozen=True, eq=False)
class SkinMap:
    """Carries offsets from the source's skin to the target's.

    Attributes
    ----------
    refinements : smooth upsampling of the source, applied first.
    matrix : (n_t, n) sparse, rows add up to 1; zero rows for vertices without a partner.
    scale : (n_t, 3) FAPU ratios target/source for each vertex and axis, mesh units.
    fill : fills the vertices without a partner.
    unmatched : (n_t,) bool.
    distances : (n_t,) how far each vertex is from the source's skin after alignment.
    """

    refinements: tuple[Refinement, ...]
    matrix: Any
    scale: Floats
    fill: HarmonicFill
    unmatched: Bools
    distances: Floats

    def apply(self, motions: Floats) -> Floats:
        """Carry K motions at once: (n_s, K, 3) source offsets to (n_t, K, 3) target offsets, mesh units."""
        count = motions.shape[1]
        carried = self.carry(motions.reshape(len(motions), -1)).reshape(-1, count, 3)
        carried *= self.scale[:, None, :]
        return carried

    def carry(self, values: Floats) -> Floats:
        """Carry any field, unscaled: (n_s, m) to (n_t, m)."""
        fine = np.ascontiguousarray(values)
        for step in self.refinements:
            fine = step.apply(fine)
        carried: Floats = self.matrix @ fine
        self.fill.apply(carried)
        return carried

    def health(self) -> dict[str, float]:
        """How well the two skins found each other, for the report."""
        found = ~self.unmatched
        return {
            "unmatched_share": float(self.unmatched.mean()),
            "mean_distance_es": float(self.distances[found].mean()) if found.any() else 0.0,
            "rest_without_partner": float(self.fill.unreached.sum()),
        }


def build_skin_map(
    source: Surface, source_labels: Labels, target: Surface, target_labels: Labels, scale: Floats
) -> SkinMap:
    """Find every target vertex's place on the source's skin.

    Parameters
    ----------
    scale : (n_t, 3) FAPU ratios in mesh units.
    """
    refinements, fine, fine_labels = refined(source, source_labels.values, target)
    moved = align(source, target, target_labels.values)

    def locate(points: Floats) -> tuple[Places, Floats]:
        found = find(points, target.normals_of(points), target_labels.values)
        corners = fine.vertices[fine.triangles[found.triangles]]
        return found, np.einsum("nk,nkd->nd", found.weights, corners)

    def find(points: Floats, normals: Floats, labels: Ints) -> Places:
        return closest(points, normals, labels, fine.vertices, fine.normals, fine.triangles, fine_labels)

    fixed = target.point_matrix(anchor_ids(source, target))
    moved, places = settle(target, moved, fixed, locate, FARTHEST, LEAST_FACING)
    return map_of_places(refinements, fine, target, target_labels, moved, places, find, scale)


def map_of_places(
    refinements: tuple[Refinement, ...],
    fine: Surface,
    target: Surface,
    target_labels: Labels,
    moved: Floats,
    places: Places,
    find: Callable[[Floats, Floats, Ints], Places],
    scale: Floats,
) -> SkinMap:
    """Make the operator out of the places of a target's vertices on the source.

    Parameters
    ----------
    refinements, fine : the source, subdivided; source and target lie on each other.
    moved : (n_t, 3) the target's vertices in that common place.
    places : theirs on `fine`; those farther than `FARTHEST` need not be found.
    find : gives the places of points, by their normals and labels.
    scale : (n_t, 3) FAPU ratios in mesh units.
    """
    labels = target_labels.values
    spacing = np.einsum("nk,nk->n", places.weights, _spacing(fine)[fine.triangles[places.triangles]])
    unmatched = (places.distances > FARTHEST) | (places.facing < LEAST_FACING) | target_labels.between
    extra = edge_samples(moved, target.normals_of(moved), target.edges, labels, spacing)
    wanted = ~unmatched[extra.owners]
    owners = extra.owners[wanted]
    more = find(extra.points[wanted], extra.normals[wanted], labels[owners])
    matrix = _matrix(places, more, owners, unmatched, fine)
    if len(target.links):
        matrix = (target.seam_mean @ matrix).tocsr()
        unmatched = (target.seam_mean @ unmatched.astype(float)) > 0.0
    edges = np.concatenate([target.edges, target.links])
    fill = HarmonicFill(target.vertices, edges, unmatched)
    return SkinMap(refinements, matrix, scale, fill, unmatched, places.distances)


def _matrix(places: Places, more: Places, owners: Ints, unmatched: Bools, fine: Surface) -> Any:
    from scipy.sparse import csr_array, diags_array

    good = (more.triangles >= 0) & (more.distances <= FARTHEST) & (more.facing >= LEAST_FACING)
    rows = np.concatenate([np.arange(len(places.triangles)), owners[good]])
    triangles = np.concatenate([places.triangles, more.triangles[good]])
    weights = np.concatenate([places.weights, more.weights[good]])
    kept = ~unmatched[rows] & (triangles >= 0)
    rows, triangles, weights = rows[kept], triangles[kept], weights[kept]
    columns = fine.triangles[triangles]
    shape = (len(places.triangles), fine.vertex_count)
    entries = weights.ravel()
    used = entries > 1e-12
    summed = csr_array((entries[used], (np.repeat(rows, 3)[used], columns.ravel()[used])), shape=shape)
    count = np.maximum(np.bincount(rows, minlength=shape[0]), 1)
    return (diags_array(1.0 / count) @ summed).tocsr()


def _spacing(surface: Surface) -> Floats:
    """(n,) mean length of the edges at each vertex."""
    edges, n = surface.edges, surface.vertex_count
    length = np.linalg.norm(surface.vertices[edges[:, 0]] - surface.vertices[edges[:, 1]], axis=1)
    total = np.bincount(edges.ravel(), np.repeat(length, 2), n)
    spacing: Floats = total / np.maximum(np.bincount(edges.ravel(), minlength=n), 1)
    return spacing


def refined(source: Surface, labels: Ints, target: Surface) -> tuple[tuple[Refinement, ...], Surface, Ints]:
    """Subdivide the source until its edges in the face are about as short as the target's."""
    steps: list[Refinement] = []
    while _face_spacing(source) > COARSER * _face_spacing(target) and source.vertex_count * 4 <= MOST_VERTICES:
        step = refine(*source.polygons, source.vertex_count)
        labels = _inherit(step, labels)
        corners = step.polygons[0].reshape(-1, 4)
        source = replace(
            source,
            shapes=(),
            starts=np.zeros(1, np.int32),
            vertices=step.matrix @ source.vertices,
            polygons=step.polygons,
            triangles=np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]]),
            links=np.zeros((0, 2), np.int32),
            points={},
        )
        steps.append(step)
        if len(steps) == 2:
            break
    return tuple(steps), source, labels


def _inherit(step: Refinement, labels: Ints) -> Ints:
    """A new vertex has the label that all of its parents share; else none."""
    parents = step.parents.tocsr()
    first = labels[parents.indices[parents.indptr[:-1]]]
    differs = labels[parents.indices] != np.repeat(first, np.diff(parents.indptr))
    mixed = np.add.reduceat(differs.astype(int), parents.indptr[:-1]) > 0
    found: Ints = np.where(mixed, 0, first)
    return found


def _face_spacing(surface: Surface) -> float:
    """Median edge length within 1.2 eye separations of the nose tip (of the whole skin where there is none)."""
    edges = surface.edges
    middle = 0.5 * (surface.vertices[edges[:, 0]] + surface.vertices[edges[:, 1]])
    length = np.linalg.norm(surface.vertices[edges[:, 0]] - surface.vertices[edges[:, 1]], axis=1)
    tip = surface.positions.get("9.3")
    if tip is not None:
        near = np.linalg.norm(middle - tip, axis=1) < 1.2
        if near.any():
            length = length[near]
    return float(np.median(length))
