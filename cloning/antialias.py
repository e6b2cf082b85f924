"""Keep a dense source from aliasing on a coarse target: average the motion over a small area of the target."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Floats, Ints

SUPPORT = 0.02
"""Size of the filter in alignment space (Facial Motion Cloning, section "Antialiasing")."""

DENSER = 1.5
"""A source aliases where its edges are shorter than the target's by this factor."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Extra sample points around vertices.

    Attributes
    ----------
    owners : (s,) the vertex that a sample is averaged into.
    points, normals : (s, 3).
    """

    owners: Ints
    points: Floats
    normals: Floats


def edge_samples(
    points: Floats, normals: Floats, edges: Ints, labels: Ints, source_spacing: Floats, support: float = SUPPORT
) -> Samples:
    """Samples along a target's own edges, at most `support` and at most half an edge away from their vertex.

    Only vertices whose edges are much longer on the whole than the source's around their place get samples, along
    the longer ones (a dense source on a coarse target aliases; the reverse cannot, nor does the same mesh), and only
    along edges that stay inside one label.

    Parameters
    ----------
    points, normals : (n, 3) target vertices in alignment space.
    edges : (e, 2).
    labels : (n,) labels of the target's vertices.
    source_spacing : (n,) length of the source's edges around the place of each vertex.
    """
    ends = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    spacing = np.bincount(edges.ravel(), np.repeat(ends, 2), len(points))
    coarse = spacing > DENSER * source_spacing * np.bincount(edges.ravel(), minlength=len(points))
    both = np.concatenate([edges, edges[:, ::-1]])
    both = both[labels[both[:, 0]] == labels[both[:, 1]]]
    owner, other = both[:, 0], both[:, 1]
    step = points[other] - points[owner]
    length = np.linalg.norm(step, axis=1)
    kept = coarse[owner] & (length > DENSER * source_spacing[owner]) & (length > 1e-9)
    owner, other, step, length = owner[kept], other[kept], step[kept], length[kept]
    share = np.minimum(0.5, support / length)[:, None]
    turned = normals[owner] * (1.0 - share) + normals[other] * share
    size = np.maximum(np.linalg.norm(turned, axis=1, keepdims=True), 1e-12)
    return Samples(owner.astype(np.int32), points[owner] + share * step, turned / size)


def circle_samples(points: Floats, support: float = SUPPORT, count: int = 8) -> Floats:
    """(n, count, 2) points on circles around 2D points: the published filter, with the point itself beside them."""
    angles = 2.0 * np.pi * np.arange(count) / count
    around: Floats = points[:, None, :] + support * np.stack([np.cos(angles), np.sin(angles)], axis=1)[None]
    return around
