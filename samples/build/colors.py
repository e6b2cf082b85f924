"""Which polygons of the skin are lips, and which line the mouth."""

from __future__ import annotations

import numpy as np

from fba.arrays import Bools, Ints
from samples.build.head import Head
from samples.build.masks import CONTOURS, Masks

SKIN, LIP, MOUTH = range(3)
"""Indices of the skin's materials."""

LIP_DEPTH = 0.8
"""How far the lips' colour goes into the mouth, in lip thicknesses."""


def skin_materials(head: Head) -> Ints:
    """Material (m,) of each polygon of the skin."""
    masks = Masks(head)
    mesh = head.scene.shape("skin").mesh
    lip = np.zeros(mesh.vertex_count, dtype=bool)
    for name in CONTOURS:
        lip |= _lip(masks, name)
    lip &= np.abs(mesh.vertices[:, 0]) <= head.positions["8.3"][0] * 1.001
    starts = mesh.offsets[:-1]
    out = np.zeros(mesh.face_count, dtype=np.int32)
    out[np.logical_or.reduceat(_inside_mouth(head, lip)[mesh.indices], starts)] = MOUTH
    out[np.logical_and.reduceat(lip[mesh.indices], starts)] = LIP
    return out


def _lip(masks: Masks, name: str) -> Bools:
    inner, outer, thick = masks.lip_distances(name)
    within = (inner + outer <= 1.35 * thick) | ((outer > inner) & (inner <= LIP_DEPTH * thick))
    lip: Bools = within & (masks[name] > 0.5)
    return lip


def _inside_mouth(head: Head, lip: Bools) -> Bools:
    """Vertices that are cut off from the face by the ring of the lips."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    mesh = head.scene.shape("skin").mesh
    edges = mesh.edges[~lip[mesh.edges].any(axis=1)]
    n = mesh.vertex_count
    label = connected_components(coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(n, n)))[1]
    face = label[head.points["9.3"].vertices[0]]
    sizes = np.bincount(label)
    inside: Bools = (label != face) & ~lip & (sizes[label] > 1)
    return inside
