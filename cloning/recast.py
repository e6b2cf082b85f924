"""The published form of vertex tents: a face whose skin is the target's shape in the source's topology.

Song et al. resample the target with the source's vertices and polygons, topology corrected (see `cloning.resampling`),
and deform that: their result is no longer the target's own mesh. Here it is a whole face again, so that it plays: the
target's eyes, teeth, tongue and feature points, around a skin with the source's polygons.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cloning.backends import SkinTransfer
from cloning.fill import HarmonicFill
from cloning.kinds import tell_parts
from cloning.labels import Labels
from cloning.parts import free_name
from cloning.prepare import PreparedFace
from cloning.resampling import Resampled, resample
from cloning.skin import SkinMap
from cloning.surface import build_surface
from cloning.vtc_image import bare_transfer
from fba.arrays import Bools, Floats, Ints
from fba.feature_points import FeaturePoint, FeaturePoints
from fba.findings import Finding
from fba.mesh import Material, PolyMesh
from fba.scene import Node, Role, Shape


def build_recast(source: PreparedFace, target: PreparedFace) -> tuple[PreparedFace, SkinTransfer]:
    """The target in the source's topology, and the paper's transfer to it."""
    copy = resample(source.skin, target.skin)
    face = recast_face(source, target, copy)
    kept = np.flatnonzero(copy.kept)
    return face, bare_transfer(source, face, copy, _selection(face, kept.astype(np.int32), len(copy.kept)))


def recast_face(source: PreparedFace, target: PreparedFace, copy: Resampled) -> PreparedFace:
    """Give a face the resampled skin instead of its own; all else stays."""
    old = set(target.skin.shapes)
    taken = {node.name for node, _ in target.scene.walk()} - old
    names = {name: free_name(name, taken) for name in source.skin.shapes}
    placed = source.skin.split(copy.vertices * target.fapu.es0)
    looks = [m for name in target.skin.shapes for m in target.scene.shape(name).materials]
    look = (Material("skin", diffuse=looks[0].diffuse),) if looks else ()
    shapes = []
    for (name, new), start in zip(names.items(), source.skin.starts, strict=False):
        whole = source.scene.shape(name).mesh
        mesh, ids = whole.submesh(copy.kept[start : start + whole.vertex_count])
        shapes.append(Shape(new, PolyMesh(placed[name][ids], mesh.indices, mesh.offsets), Role.SKIN, look))
    scene = replace(target.scene, roots=(*_without(target.scene.roots, old), *shapes), document=None)
    points = _points(source, target, copy.kept, names)
    skin = build_surface(scene, points, tuple(names.values()), target.fapu.es0)
    labels = Labels(
        source.labels.values[copy.kept], source.labels.sealed, source.labels.closed, source.labels.between[copy.kept]
    )
    said = Finding(
        "info",
        "source-topology",
        f"as published, the skin has the source's polygons in the target's shape: {int(copy.kept.sum())} of "
        f"{len(copy.kept)} vertices, without what lies behind other skin or has no place on the target",
        target.scene.name,
    )
    return PreparedFace(
        scene,
        points,
        target.fapu,
        skin,
        labels,
        (*target.findings, said),
        tell_parts(scene, skin, target.fapu.es0),
    )


def _without(nodes: tuple[Node, ...], names: set[str]) -> tuple[Node, ...]:
    """Nodes without these shapes; the others no longer share a vertex list with them."""
    return tuple(
        replace(node, vertex_ids=None)
        if isinstance(node, Shape)
        else replace(node, children=_without(node.children, names))
        for node in nodes
        if node.name not in names
    )


def _points(source: PreparedFace, target: PreparedFace, kept: Bools, names: dict[str, str]) -> FeaturePoints:
    """The target's feature points; those of its skin lie where the source's do, on vertices that are left."""
    skin = source.skin
    left = np.flatnonzero(kept)
    number = np.concatenate([[0], np.cumsum(kept)])
    found = dict(target.points)
    for key, point in target.points.items():
        if point.shape not in target.skin.shapes:
            continue
        if key not in skin.points:
            found[key] = FeaturePoint.free(target.place(key), point.source, point.confidence)
            continue
        vertices, weights = skin.points[key]
        weights = weights * kept[vertices]
        if weights.sum() < 0.5:
            nearest = np.argmin(np.linalg.norm(skin.vertices[left] - skin.positions[key], axis=1))
            vertices, weights = left[[nearest]].astype(np.int32), np.ones(1)
        shape = int(np.searchsorted(skin.starts, vertices[np.argmax(weights)], side="right")) - 1
        ids = number[vertices] - number[skin.starts[shape]]
        used = weights > 0.0
        found[key] = FeaturePoint(
            names[skin.shapes[shape]],
            tuple(int(i) for i in ids[used]),
            tuple(float(w) for w in weights[used] / weights.sum()),
            source=point.source,
            confidence=point.confidence,
        )
    return FeaturePoints(found)


def _selection(face: PreparedFace, kept: Ints, count: int) -> SkinMap:
    """The map that leaves redundant vertices out."""
    from scipy.sparse import csr_array

    n = len(kept)
    matrix = csr_array((np.ones(n), (np.arange(n), kept)), shape=(n, count))
    nothing = np.zeros(n, bool)
    fill = HarmonicFill(face.skin.vertices, face.skin.edges, nothing)
    exact: Floats = np.zeros(n)
    return SkinMap((), matrix, np.ones((n, 3)), fill, nothing, exact)
