"""MakeHuman's head subdivided where its face shows and moves: its own polygons are coarse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fat.quality import mirror_map
from fba.arrays import Bools, Ints
from fba.feature_points import FeaturePoint
from samples.build.colors import LIP, MOUTH, skin_materials
from samples.build.crop import HeadCrop, Part
from samples.build.fairing import Fairing
from samples.build.head import Head
from samples.build.makehuman import ARKIT_UNITS
from samples.build.refine import refine
from samples.build.surface import nearest_facing
from samples.build.symmetry import CLOSE, mirrored_points, mirrored_polygons

MOVES = 0.02
"""Polygons that some face unit moves farther than this (ES0) become finer ..."""
LONG = 0.06
"""... if they have a longer edge than this (ES0), or belong to the lips; those around the lids are small already."""
SOCKET = 0.99
"""Skin nearer to the centre of an eyeball than this (radii) lines the socket and stays coarse."""
LIPS = ("2.2", "2.3", "2.4", "2.5", "2.6", "2.7", "2.8", "2.9", *(f"8.{k}" for k in range(1, 11)))
LIDS = ("3.1", "3.2", "3.3", "3.4", "3.7", "3.8", "3.11", "3.12")
"""Feature points along the lips and the lids."""
EYE_SEGMENTS = 32


def fine(head: Head) -> Head:
    """The same head with finer skin and tongue, its feature points on the new surface; it must be symmetric."""
    shapes = dict(head.crop.shapes)
    for name, steps in (("skin", levels(head)), ("tongue", None)):
        part = shapes[name]
        chosen = np.ones(part.mesh.face_count, dtype=np.int32) if steps is None else steps
        mesh, matrix = refine(part.mesh, chosen)
        shapes[name] = Part(part.ids, mirrored_polygons(mesh), matrix)
    finer = replace(head, crop=HeadCrop(shapes), eye_segments=EYE_SEGMENTS)
    placed = _points(head, finer)
    skin = shapes["skin"].mesh.with_vertices(finer.parts["skin"])
    lips, lids = (tuple(placed[key] for key in rim) for rim in (LIPS, LIDS))
    fairing = Fairing(skin, lips, lids, head.fapu.es0)
    return replace(finer, placed=placed, fairing=fairing)


def levels(head: Head) -> Ints:
    """Steps of subdivision (m,) for each polygon of the skin."""
    mesh, es0 = head.scene.shape("skin").mesh, head.fapu.es0
    starts = mesh.offsets[:-1]
    moves = np.zeros(mesh.vertex_count, dtype=bool)
    for unit in ARKIT_UNITS:
        moves |= np.linalg.norm(head.unit(unit)["skin"], axis=1) > MOVES * es0
    following = np.arange(mesh.indices.size) + 1
    following[mesh.offsets[1:] - 1] = starts
    sides = mesh.vertices[mesh.indices[following]] - mesh.vertices[mesh.indices]
    long = np.maximum.reduceat(np.linalg.norm(sides, axis=1), starts) > LONG * es0
    materials = skin_materials(head)
    lining = np.logical_and.reduceat(_socket(head)[mesh.indices], starts) | (materials == MOUTH)
    chosen: Bools = np.logical_or.reduceat(moves[mesh.indices], starts) & (long | (materials == LIP)) & ~lining
    return chosen.astype(np.int32)


def _socket(head: Head) -> Bools:
    skin = head.parts["skin"]
    inside = np.zeros(len(skin), dtype=bool)
    for center, radius in head.eye_centers.values():
        inside |= np.linalg.norm(skin - center, axis=1) < SOCKET * radius
    return inside


def _points(head: Head, finer: Head) -> dict[str, FeaturePoint]:
    """Points at a vertex stay there, others go to the nearest place of the finer surface that faces the same way."""
    found: dict[str, FeaturePoint] = {}
    for key, point in head.points.items():
        if point.shape not in finer.crop.shapes:
            continue
        weights, mesh = np.asarray(point.weights), head.scene.shape(point.shape).mesh
        if weights.max() > 1.0 - 1e-9:
            found[key] = FeaturePoint(point.shape, (point.vertices[int(np.argmax(weights))],), (1.0,))
            continue
        vertices = list(point.vertices)
        normal = weights @ mesh.vertex_normals()[vertices]
        finer_mesh = finer.crop.shapes[point.shape].mesh.with_vertices(finer.parts[point.shape])
        place = nearest_facing(head.positions[key][None], normal[None] / np.linalg.norm(normal), finer_mesh)
        found[key] = place.feature_point(0, point.shape)
    mirrors = {s: mirror_map(finer.parts[s], CLOSE) for s in finer.crop.shapes if not s.startswith("lashes")}
    return mirrored_points(found, mirrors)
