"""Expression Cloning as a backend: radial basis functions, a cylinder, and motion vectors in local frames.

After Noh and Neumann (2001), the baseline that vertex tents are compared with. The source is morphed onto the target by
radial basis functions and projected to its skin along the rays of a cylinder; each source vertex's motion is turned
from its frame on the source to its frame on the morphed one, and scaled by the size of its neighbourhood there; each
target vertex moves like its place on the copy, those on the line where the lips meet like the same lip of the source.

Published mode starts from rules of thumb, and skin behind other skin (mouths, sockets) takes no part. The default mode
starts from the feature points and stays off the cylinder, whose rays fold the copy around eyes and mouth: places are
found on the morphed source, side by side of lips and lids; how motion turns and grows is evened out over the skin, as a
frame of one edge and a box of one ring are noisy; and corrections are those of all backends.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from cloning.align import anchor_ids
from cloning.backends import SkinTransfer
from cloning.contours import CONTOURS, Contour, line_along
from cloning.cylinder import Cylinder, cylinder, round_the_back
from cloning.ec_rules import rule_points
from cloning.interpolate import TriangleMesh2D
from cloning.local_frames import frames_of, sizes_in
from cloning.local_transfer import carrying_map
from cloning.mesh_image import SHEET, draw_mesh
from cloning.prepare import PreparedFace
from cloning.similarity import fit_similarity
from cloning.skin import SkinMap
from cloning.surface import Surface
from cloning.template.correspondence import FARTHEST, Correspondence, correspond
from cloning.visibility import visible
from fba.arrays import Bools, Floats, Ints

RIDGE = 1e-6
"""How much weights of radial basis functions cost, against the points' squared distances."""

EVEN = 0.6
"""How far the default mode evens out turn and growth along the skin, eye separations: about a nose's width. Feature
points are .14, .12 and .09 off at 0.15, 0.3 and 0.6 on ICT-FaceKit, .10, .08 and .06 on two phenotypes; wider than the
parts of a face nothing local would be left."""

LEAST_RULES = 8
"""With fewer points by rule the feature points are taken."""


def build_transfer(source: PreparedFace, target: PreparedFace, as_published: bool) -> SkinTransfer:
    """Prepare Expression Cloning between two faces."""
    mine, yours = source.skin, target.skin
    centers, goals = _points(mine, yours, as_published)
    morphed = morph(mine.vertices, centers, goals)
    if as_published:
        around = cylinder(yours.positions)
        outer = _outermost(mine)
        copy = np.where(outer[:, None], _projected(morphed, yours, around), morphed)
        triangles = mine.triangles[outer[mine.triangles].all(axis=1)]
        skin_map = carrying_map(yours, _on_cylinder(copy, triangles, yours, around))
    else:
        labels = source.labels.values, target.labels.values
        places = correspond(morphed, mine.triangles, yours, labels=labels, farthest=np.inf)
        # The morph is loose far from its points, but what can be seen has a place there: napes rest like napes.
        nowhere = (places.residual > FARTHEST) & ~visible(yours)
        skin_map = carrying_map(yours, places, without=target.labels.between | nowhere)
    maps = motion_maps(mine, morphed) * (target.fapu.es0 / source.fapu.es0)
    maps = maps if as_published else evened(mine, maps)
    sealed = 1 in source.labels.sealed or 1 in target.labels.sealed
    line, on_line = _lip_line(mine, yours, () if sealed else CONTOURS[:2])
    return ClonedTransfer(
        maps,
        skin_map,
        line,
        on_line,
        skin_map.health(),
        {"points": len(centers), "lip_line": len(line)},
    )


@dataclass(frozen=True, eq=False)
class ClonedTransfer:
    """Expression Cloning's transfer.

    Attributes
    ----------
    maps : (n, 3, 3) from the motion of each source vertex to that of the copy, mesh units.
    skin_map : from the source's vertices to the target's.
    line : (k,) target vertices on the line where lips meet.
    on_line : (k, n) sparse, their places on the source's.
    """

    maps: Floats
    skin_map: SkinMap
    line: Ints
    on_line: Any
    measures: Mapping[str, float]
    parameters: Mapping[str, float | str | bool]

    def apply(self, motions: Floats) -> Floats:
        turned = np.einsum("nij,nkj->nki", self.maps, motions).reshape(len(motions), -1)
        carried = self.carry(turned)
        carried[self.line] = self.on_line @ turned
        result: Floats = carried.reshape(-1, *motions.shape[1:])
        return result

    def carry(self, values: Floats) -> Floats:
        return self.skin_map.carry(values)


def morph(places: Floats, centers: Floats, goals: Floats) -> Floats:
    """Move points (n, 3) by a network of multiquadrics that takes centers (k, 3) to goals.

    Each unit is sqrt(r^2 + s^2), s the distance to the nearest other center; a small cost on the weights keeps points
    that nearly touch from fighting. What a similarity explains is taken off first: the network bends only.
    """
    start = fit_similarity(centers, goals)
    far = np.linalg.norm(centers[:, None] - centers[None], axis=2)
    widths = np.where(far > 0.0, far, np.inf).min(axis=0)

    def units(some: Floats) -> Floats:
        squared = np.sum((some[:, None] - centers[None]) ** 2, axis=2)
        found: Floats = np.sqrt(squared + widths**2)
        return found

    inner = units(centers)
    weights = np.linalg.solve(inner.T @ inner + RIDGE * np.eye(len(centers)), inner.T @ (goals - start.apply(centers)))
    moved: Floats = start.apply(places) + units(places) @ weights
    return moved


def motion_maps(source: Surface, copy: Floats) -> Floats:
    """(n, 3, 3) how the motion of each vertex turns and grows from a surface to a copy of it, (n, 3)."""
    mine, yours = frames_of(source, source.vertices), frames_of(source, copy)
    before, after = sizes_in(source, source.vertices, mine), sizes_in(source, copy, yours)
    growth = np.log(np.maximum(after, 1e-9) / np.maximum(before, 1e-9))
    middle, spread = growth.mean(axis=0), growth.std(axis=0)
    growth = np.exp(np.clip(growth, middle - spread, middle + spread))
    maps: Floats = np.einsum("nai,na,naj->nij", yours, growth, mine)
    return maps


def evened(surface: Surface, values: Floats) -> Floats:
    """(n, ...) values of a surface, averaged among neighbours as often as it takes to spread over `EVEN`."""
    from scipy.sparse import csr_array, diags_array, eye_array

    n = surface.vertex_count
    a, b = np.concatenate([surface.edges, surface.links]).T
    where = np.concatenate([a, b]), np.concatenate([b, a])
    ring = csr_array((np.ones(2 * len(a)), where), shape=(n, n)) + eye_array(n)
    mean = diags_array(1.0 / np.asarray(ring.sum(axis=1)).ravel()) @ ring
    length = np.linalg.norm(surface.vertices[surface.edges[:, 0]] - surface.vertices[surface.edges[:, 1]], axis=1)
    flat: Any = values.reshape(n, -1)
    for _ in range(round((EVEN / float(np.median(length))) ** 2)):
        flat = mean @ flat
    found: Floats = flat.reshape(values.shape)
    return found


def _points(mine: Surface, yours: Surface, by_rule: bool) -> tuple[Floats, Floats]:
    """(k, 3) points of the source and (k, 3) of the target that belong together."""
    if by_rule:
        first, second = rule_points(mine), rule_points(yours)
        names = [name for name in first if name in second]
        if len(names) >= LEAST_RULES:
            return np.array([first[name] for name in names]), np.array([second[name] for name in names])
    ids = anchor_ids(mine, yours)
    return np.array([mine.positions[i] for i in ids]), np.array([yours.positions[i] for i in ids])


def _outermost(skin: Surface) -> Bools:
    """(n,) bool, vertices that no other skin hides from the outside of the cylinder."""
    around = cylinder(skin.positions)
    plane, depth = around.project(skin.vertices)
    seen = draw_mesh(plane, depth, skin.triangles, skin.vertices).sample(plane)[0]
    found: Bools = np.linalg.norm(seen - skin.vertices, axis=1) < SHEET
    return found


def _projected(copy: Floats, target: Surface, around: Cylinder) -> Floats:
    """The copy with its vertices on the target's skin, along the cylinder's rays, where there is skin."""
    image = draw_mesh(*around.project(target.vertices), target.triangles, target.vertices)
    places, found = image.sample(around.project(copy)[0])
    return np.where(found[:, None], places, copy)


def _on_cylinder(copy: Floats, triangles: Ints, target: Surface, around: Cylinder) -> Correspondence:
    """The place of each target vertex in the copy's triangles, in the plane of the cylinder; the outermost wins."""
    plane, depth = around.project(copy)
    points, tiles = round_the_back(plane, triangles)
    found = TriangleMesh2D(points, tiles, np.tile(depth, 3)).locate(around.project(target.vertices)[0])
    corners = tiles[found.triangles] % len(copy)
    distances = np.linalg.norm(np.einsum("nk,nkd->nd", found.weights, copy[corners]) - target.vertices, axis=1)
    facing = np.ones(len(distances))
    return Correspondence(found.triangles, corners, found.weights, distances, facing, found.inside, len(copy))


def _lip_line(source: Surface, target: Surface, lips: Sequence[Contour]) -> tuple[Ints, Any]:
    """Vertices of the target on the line where its lips meet, and their places on the same lip of the source.

    The line goes from one inner corner to the other by the inner contour points; both are divided alike by length.
    What both lips share, the corners, has a place on both.
    """
    from scipy.sparse import csr_array, diags_array

    ids, columns, weights = [np.zeros(0, np.int32)], [np.zeros((0, 2), np.int32)], [np.zeros((0, 2))]
    for lip in lips:
        for a, b in pairwise(lip.points):
            (way, shares), (other, wanted) = line_along(source, lip, a, b), line_along(target, lip, a, b)
            if len(way) and len(other):
                at = np.clip(np.searchsorted(shares, wanted, side="right") - 1, 0, len(way) - 2)
                part = (wanted - shares[at]) / np.maximum(shares[at + 1] - shares[at], 1e-12)
                ids.append(other)
                columns.append(np.stack([way[at], way[at + 1]], axis=1))
                weights.append(np.stack([1.0 - part, part], axis=1))
    line, row, count = np.unique(np.concatenate(ids), return_inverse=True, return_counts=True)
    where = np.repeat(row, 2), np.concatenate(columns).ravel()
    summed = csr_array((np.concatenate(weights).ravel(), where), shape=(len(line), source.vertex_count))
    return line, diags_array(1.0 / count) @ summed
