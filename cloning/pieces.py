"""The connected pieces of a scene, and the names that its file gives them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cloning.surface import seam_links
from fba.arrays import Floats, Ints
from fba.scene import FaceScene, Shape

MOSTLY = 0.8
"""A group or material names a piece where this share of the piece's polygons has it."""


@dataclass(frozen=True, eq=False)
class Pieces:
    """All connected pieces of a scene, seams closed inside each shape.

    Attributes
    ----------
    of_vertex : shape name -> (n,) number of the piece of each vertex.
    vertices : world vertices of each piece.
    names : what the file calls each piece, in lower-case words: its shape, group and material.
    """

    of_vertex: Mapping[str, Ints]
    vertices: Sequence[Floats]
    names: Sequence[str]


def find_pieces(scene: FaceScene) -> Pieces:
    """Take a scene apart; seams where borders meet at the same places are closed inside each shape."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    of_vertex: dict[str, Ints] = {}
    vertices: list[Floats] = []
    names: list[str] = []
    for shape in scene.shapes:
        world = scene.world_vertices(shape.name)
        scale = max(float(np.ptp(world, axis=0).max()), 1e-30)
        links = seam_links(world / scale, shape.mesh.indices, shape.mesh.offsets)
        mesh = shape.mesh
        first = np.repeat(mesh.indices[mesh.offsets[:-1]], mesh.arities)
        a = np.concatenate([first, links[:, 0]])
        b = np.concatenate([mesh.indices, links[:, 1]])
        n = mesh.vertex_count
        count, labels = connected_components(coo_array((np.ones(len(a)), (a, b)), shape=(n, n)), directed=False)
        of_vertex[shape.name] = labels + len(vertices)
        order = np.argsort(labels, kind="stable")
        stops = np.cumsum(np.bincount(labels, minlength=count))[:-1]
        vertices += [world[ids] for ids in np.split(order, stops)]
        names += _names(shape, labels, count)
    return Pieces(of_vertex, vertices, names)


def count_pieces(scene: FaceScene) -> int:
    """How many connected pieces of polygons a scene has, seams closed."""
    of_vertex = find_pieces(scene).of_vertex
    return sum(len(np.unique(of_vertex[s.name][s.mesh.used_vertices])) for s in scene.shapes)


def words(name: str) -> str:
    """A name in lower-case words.

    >>> words("Wolf3D_EyeLeft")
    'wolf3 d eye left'
    """
    return " ".join(re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", name).lower().replace("_", " ").replace("-", " ").split())


def _names(shape: Shape, labels: Ints, count: int) -> list[str]:
    """The words for each piece of a shape."""
    mesh = shape.mesh
    if not mesh.face_count:
        return [words(shape.name)] * count
    owner = labels[mesh.indices[mesh.offsets[:-1]]]
    found = [[shape.name] for _ in range(count)]
    for of_face, called in (
        (mesh.face_groups, mesh.group_names),
        (mesh.face_materials, tuple(m.name for m in shape.materials)),
    ):
        if of_face is None or not called:
            continue
        known = of_face >= 0
        pairs, sizes = np.unique(np.stack([owner[known], of_face[known]]), axis=1, return_counts=True)
        whole = np.bincount(owner, minlength=count)
        for (piece, group), size in zip(pairs.T.tolist(), sizes.tolist(), strict=True):
            if size >= MOSTLY * whole[piece] and group < len(called):
                found[piece].append(called[group])
    if mesh.face_materials is None and len(shape.materials) == 1:
        for some in found:
            some.append(shape.materials[0].name)
    return [" ".join(map(words, some)) for some in found]
