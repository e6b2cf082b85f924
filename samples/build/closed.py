"""A head without openings: SOMA's skin, cut at the neck and closed there, with feature points.

SOMA's mesh wraps the same person as MakeHuman's middle phenotype, so the points of that phenotype, brought onto it by
a similarity (iterative closest points), lie where they belong up to the wrap's own error.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace

import numpy as np

from fba.arrays import Floats, Ints
from fba.feature_points import FeaturePoint, FeaturePoints
from fba.mesh import Material, PolyMesh
from fba.scene import FaceScene, Role, Shape
from samples.build.colors import SKIN, skin_materials
from samples.build.crop import edge_ring
from samples.build.head import Head, build_head, macro
from samples.build.makehuman import MakeHuman
from samples.build.neutral import lid_points, lip_points
from samples.build.surface import nearest_facing

NECK_RING = (4556, 13989)
"""An edge of SOMA_wrap.obj in the ring at which the head is cut; the ring lies level with the source's."""
NOSE = (0.0, 0.63, 0.2)
"""A place on the head's side of the ring, metres."""
PASSES = 40
KEPT = 0.8
"""Share of the nearest pairs that count in a pass."""


def closed_head(makehuman: MakeHuman) -> tuple[FaceScene, FeaturePoints]:
    """The watertight head (metres) and its feature points; inner points have no surface and are left out."""
    mesh = _cut_and_capped(*_soma(makehuman))
    scene = FaceScene((Shape("head", mesh, Role.SKIN, (Material("skin", (0.78, 0.58, 0.48)),)),), name="closed_head")
    guide = _middle(makehuman)
    onto = _similarity(guide, mesh)
    return scene, FeaturePoints(_points(guide, onto, mesh))


def _soma(makehuman: MakeHuman) -> tuple[Floats, Ints]:
    vertices: list[list[float]] = []
    quads: list[list[int]] = []
    for line in makehuman.read("SOMA_wrap.obj").decode("utf-8").splitlines():
        kind, *rest = line.split() or [""]
        if kind == "v":
            vertices.append([float(x) for x in rest[:3]])
        elif kind == "f":
            quads.append([int(corner.split("/")[0]) - 1 for corner in rest])
    return np.array(vertices), np.array(quads, dtype=np.int32)


def _cut_and_capped(vertices: Floats, quads: Ints) -> PolyMesh:
    """The part above the neck ring, closed by a fan around the middle of the ring."""
    ring = edge_ring(quads, *NECK_RING)
    inside = _side_of(quads, set(ring), int(np.argmin(np.linalg.norm(vertices - NOSE, axis=1))))
    kept = quads[np.isin(quads, list(inside)).any(axis=1)]
    ids = np.unique(kept)
    new = np.full(len(vertices), -1, dtype=np.int32)
    new[ids] = np.arange(ids.size)
    edges = {(a, b) for q in kept.tolist() for a, b in zip(q, q[1:] + q[:1], strict=True)}
    loop = list(zip(ring, ring[1:] + ring[:1], strict=True))
    turned = [(b, a) if (a, b) in edges else (a, b) for a, b in loop]
    middle = vertices[ring].mean(axis=0)
    faces = [*new[kept].tolist(), *([int(new[a]), int(new[b]), ids.size] for a, b in turned)]
    return PolyMesh.from_faces(np.vstack([vertices[ids], middle]), faces)


def _side_of(quads: Ints, ring: set[int], seed: int) -> set[int]:
    neighbours: dict[int, set[int]] = defaultdict(set)
    for quad in quads.tolist():
        for a, b in zip(quad, quad[1:] + quad[:1], strict=True):
            neighbours[a].add(b)
            neighbours[b].add(a)
    found, front = {seed}, [seed]
    while front:
        new = neighbours[front.pop()] - found - ring
        found |= new
        front.extend(new)
    return found


def _middle(makehuman: MakeHuman) -> Head:
    """The phenotype that SOMA wraps: all races and both sexes evenly, between child and young adult."""
    mixture: dict[tuple[str, str], float] = {}
    for race in ("caucasian", "asian", "african"):
        for sex in ("female", "male"):
            for age in ("child", "young"):
                for key, weight in macro(race, sex, age, 1.0 / 12.0).items():
                    mixture[key] = mixture.get(key, 0.0) + weight
    head = build_head(makehuman, mixture, "middle")
    lower_lip = {key: point for key, point in lip_points(head).items() if key in ("2.3", "2.8", "2.9")}
    return replace(head, placed={**lid_points(head), **lower_lip})


def _visible(head: Head) -> Ints:
    """Vertices of the face and skull: no lining of the mouth, no neck."""
    skin = head.scene.shape("skin").mesh
    quads = skin.indices.reshape(-1, 4)[skin_materials(head) == SKIN]
    used = np.unique(quads)
    above: Ints = used[skin.vertices[used, 1] > head.positions["2.1"][1]]
    return above


def _similarity(head: Head, mesh: PolyMesh) -> tuple[float, Floats, Floats]:
    """Scale, rotation (3, 3) and translation (3,) that lay the head on the mesh."""
    from scipy.spatial import cKDTree

    rows = _visible(head)
    points = head.parts["skin"][rows]
    normals = head.scene.shape("skin").mesh.vertex_normals()[rows]
    top = np.array([1, 2])
    scale, rotation = 0.1, np.eye(3)
    move = np.zeros(3)
    move[top] = mesh.vertices[:, top].max(axis=0) - scale * points[:, top].max(axis=0)
    tree = cKDTree(mesh.vertices)
    for step in range(PASSES):
        moved = scale * points @ rotation.T + move
        if step < PASSES - 4:
            partner = mesh.vertices[tree.query(moved)[1]]
        else:
            partner = nearest_facing(moved, normals @ rotation.T, mesh).carry(mesh.vertices)
        away = np.linalg.norm(partner - moved, axis=1)
        near = away <= np.quantile(away, KEPT)
        scale, rotation, move = fit_similarity(points[near], partner[near])
    return scale, rotation, move


def fit_similarity(points: Floats, partners: Floats) -> tuple[float, Floats, Floats]:
    """Least-squares similarity from (n, 3) points to their partners (S. Umeyama, 1991)."""
    mean, goal = points.mean(axis=0), partners.mean(axis=0)
    left, size, right = np.linalg.svd((partners - goal).T @ (points - mean))
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    rotation = (left * sign) @ right
    scale = float((size * sign).sum() / ((points - mean) ** 2).sum())
    return scale, rotation, goal - scale * rotation @ mean


def _points(head: Head, onto: tuple[float, Floats, Floats], mesh: PolyMesh) -> dict[str, FeaturePoint]:
    scale, rotation, move = onto
    found = {}
    for key, point in head.points.items():
        place = scale * rotation @ head.positions[key] + move
        if point.shape is None:
            found[key] = replace(FeaturePoint.free(place), source=point.source)
        elif point.shape == "skin":
            source = head.scene.shape(point.shape).mesh
            normal = rotation @ (np.asarray(point.weights) @ source.vertex_normals()[list(point.vertices)])
            if key in FORWARD:
                normal = np.array([0.0, 0.0, 1.0])
            found[key] = nearest_facing(place[None], normal[None], mesh).feature_point(0, "head")
    for key, upper, lower in (("3.5", "3.1", "3.3"), ("3.6", "3.2", "3.4")):
        lids = [np.asarray(found[k].weights) @ mesh.vertices[list(found[k].vertices)] for k in (upper, lower)]
        found[key] = _seen_from_front(mesh, 0.5 * (lids[0] + lids[1]))
    return found


def _seen_from_front(mesh: PolyMesh, place: Floats) -> FeaturePoint:
    """The point of the surface that is seen at (x, y) looking along -Z."""
    corners = mesh.vertices[mesh.triangles]
    flat = corners[:, :, :2] - place[:2]
    a, b, c = flat[:, 0], flat[:, 1], flat[:, 2]
    parts = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)], axis=1)
    total = parts.sum(axis=1)
    hit = np.flatnonzero((parts >= 0.0).all(axis=1) & (total > 0.0))
    weights = parts[hit] / total[hit, None]
    front = int(np.argmax((weights * corners[hit, :, 2]).sum(axis=1)))
    vertices = mesh.triangles[hit[front]].tolist()
    return FeaturePoint("head", tuple(vertices), tuple(weights[front].tolist()))


def _cross(a: Floats, b: Floats) -> Floats:
    area: Floats = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return area


FORWARD = ("2.2", "2.3", "2.6", "2.7", "2.8", "2.9", "3.1", "3.2", "3.3", "3.4")
"""Points whose own normal looks into an opening that this head does not have: taken to skin that faces forward."""
