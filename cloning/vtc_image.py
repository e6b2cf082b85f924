"""Vertex tents by way of the mesh image: the paper's own correspondence.

The target is resampled in the source's topology (see `cloning.resampling`), deforms there tent by tent, and takes the
target's own vertices along. The default mode tells sides of lips and lids apart, and has feature points and amounts as
MPEG-4 wants them. Published mode counts every tent the same and corrects nothing; its result in the paper's form, with
the source's polygons, is `cloning.recast`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cloning.align import anchor_ids
from cloning.backends import SkinTransfer
from cloning.local_transfer import BareTransfer, carrying_map, goal_transfer
from cloning.mesh_image import AROUND
from cloning.prepare import PreparedFace
from cloning.resampling import Polygons, Resampled, resample
from cloning.shape_solver import ShapeTransfer
from cloning.skin import SkinMap
from cloning.surface import Surface
from cloning.template.correspondence import correspond
from cloning.tents import tent_transfer
from fba.arrays import Floats, Ints


def build_transfer(source: PreparedFace, target: PreparedFace, as_published: bool) -> SkinTransfer:
    """Prepare vertex tents over the mesh image between two faces."""
    if as_published:
        return build_published(source, target)
    skin = source.skin
    copy = resample(skin, target.skin)
    labels = source.labels.values, target.labels.values
    places = correspond(copy.vertices, copy.triangles, target.skin, labels=labels)
    skin_map = carrying_map(target.skin, places, without=target.labels.between)
    vertices, seen = _placed(copy, skin), _seen(skin, target.skin, copy)

    def factor(held: Floats, rows: Any) -> ShapeTransfer:
        return tent_transfer(skin.vertices, vertices, copy.polygons, held, seen @ rows, links=skin.links)

    return goal_transfer(source, target, skin_map, factor, _measures(copy))


def _seen(source: Surface, target: Surface, copy: Resampled) -> Any:
    """(k, k) sparse diagonal: 1 for feature points that have goals on the copy, 0 for those that it does not show.

    Hidden points (inner lips, lower lids) would pull at what lies before them, which moves in another way.
    """
    from scipy.sparse import diags_array

    hidden = source.point_matrix(anchor_ids(source, target)) @ (~copy.kept).astype(float)
    return diags_array((np.asarray(hidden).ravel() == 0.0).astype(float))


def build_published(source: PreparedFace, target: PreparedFace) -> BareTransfer:
    """The paper's transfer, carried back to the target's own vertices."""
    copy = resample(source.skin, target.skin)
    places = correspond(copy.vertices, copy.triangles, target.skin, farthest=np.inf, least_facing=-1.0)
    return bare_transfer(source, target, copy, carrying_map(target.skin, places))


def bare_transfer(source: PreparedFace, target: PreparedFace, copy: Resampled, skin_map: SkinMap) -> BareTransfer:
    """The paper's transfer to a resampled target.

    Parameters
    ----------
    skin_map : from the vertices of the copy, one for each of the source's, to those of the target.
    """
    skin = source.skin
    # Moving the target onto the source is the same as moving the source onto the target.
    turn = copy.alignment.rotation.T / copy.alignment.scale
    vertices = _placed(copy, skin)

    def factor(reach: Floats) -> ShapeTransfer:
        held = _anchors(skin, copy, reach)
        return tent_transfer(skin.vertices @ turn.T, vertices, copy.polygons, held, links=skin.links, uniform=True)

    measures = {**skin_map.health(), **_measures(copy)}
    return BareTransfer(source, target, skin_map, factor, measures, {"image_columns": AROUND}, turn)


def _placed(copy: Resampled, skin: Surface) -> Floats:
    """(n, 3) the copy's vertices, equal on both sides of a seam."""
    if not len(skin.links):
        return copy.vertices
    weights = skin.place_sums @ copy.kept.astype(float)
    mean = (skin.place_sums @ (copy.vertices * copy.kept[:, None])) / np.maximum(weights, 1.0)[:, None]
    placed: Floats = mean[skin.places]
    return placed


def _anchors(skin: Surface, copy: Resampled, reach: Floats) -> Floats:
    """(n,) 1 for vertices that never move, for the quietest of each part where all move, and for redundant ones."""
    part = _parts(skin, copy.polygons)
    held: Floats = np.where(reach == 0.0, 1.0, 0.0)
    quietest = np.lexsort((reach, part))
    held[quietest[np.unique(part[quietest], return_index=True)[1]]] = 1.0
    return held


def _parts(skin: Surface, polygons: Polygons) -> Ints:
    """(n,) number of the connected part, seams closed; a redundant vertex is one of its own."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    indices, offsets = polygons
    first = np.repeat(indices[offsets[:-1]], np.diff(offsets))
    a, b = np.concatenate([first, skin.links[:, 0]]), np.concatenate([indices, skin.links[:, 1]])
    n = skin.vertex_count
    found: Ints = connected_components(coo_array((np.ones(len(a)), (a, b)), shape=(n, n)), directed=False)[1]
    return found


def _measures(copy: Resampled) -> dict[str, float]:
    return {"redundant_share": float(1.0 - copy.kept.mean())}
