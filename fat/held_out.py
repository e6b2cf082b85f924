"""Feature points that nobody corrects: do they move as on the source, and are all points where they belong?

A clone's motion is corrected at the feature points that FAPs name, so these prove little. The others are held out.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from fba.arrays import Floats
from fba.faps import faps
from fba.feature_points import feature_point_definitions

NAMED = frozenset(f.feature_points[0] for f in faps() if f.feature_points)
"""The points that a FAP names."""

EYES = (("3.7", "3.11"), ("3.8", "3.12"))

FEWEST = 12
"""A face warps by this many points at least."""


def held_out_error(
    motions: Iterable[tuple[Mapping[str, Floats], Mapping[str, Floats]]], source_es0: float, target_es0: float
) -> tuple[float, str | None]:
    """Relative error of motions at the points that no FAP names, and the point that is farthest off in all.

    Parameters
    ----------
    motions : pairs of a motion on source and target: feature point -> offset (3,); see
        `fat.quality.feature_point_motion`.
    source_es0, target_es0 : eye separations, in which both are compared.

    Returns
    -------
    Sum of the differences' lengths over the sum of the source's; 0 and None where all are still.
    """
    off: dict[str, float] = {}
    total = 0.0
    for source, target in motions:
        keys = sorted(source.keys() & target.keys() - NAMED)
        theirs, mine = (np.reshape([m[k] for k in keys], (-1, 3)) for m in (source, target))
        apart = np.linalg.norm(mine / target_es0 - theirs / source_es0, axis=1)
        for key, value in zip(keys, apart.tolist(), strict=True):
            off[key] = off.get(key, 0.0) + value
        total += float(np.linalg.norm(theirs, axis=1).sum()) / source_es0
    worst = max(sorted(off), key=lambda k: off[k], default=None)
    return (sum(off[k] for k in sorted(off)) / total, worst) if total > 0.0 else (0.0, None)


def misplaced(source: Mapping[str, Floats], target: Mapping[str, Floats]) -> dict[str, float]:
    """How far each feature point lies from where all others say, in eye widths.

    Parameters
    ----------
    source, target : feature point -> neutral position (3,).

    Returns
    -------
    Point -> distance from its place in the smoothest warp (thin plate in space, ``|r|``) that takes the source's
    other points to the target's. Empty if fewer than FEWEST points, or no eye corners, are common.
    """
    common = sorted(k for k in source if k in target)
    widths = [float(np.linalg.norm(target[a] - target[b])) for a, b in EYES if a in target and b in target]
    if len(common) < FEWEST or not widths:
        return {}
    places, goals = (np.array([given[k] for k in common]) for given in (source, target))
    center, size = places.mean(axis=0), float(np.ptp(places, axis=0).max())
    places = (places - center) / size
    n = len(common)
    away = np.linalg.norm(places[:, None] - places[None], axis=2)
    plane = np.column_stack([np.ones(n), places])
    system = np.block([[away, plane], [plane.T, np.zeros((4, 4))]])
    # Leaving point k out moves the prediction there off its goal by its weight over its entry of the inverse.
    inverse = np.linalg.pinv(system)
    weights = inverse[:n, :n] @ goals
    off = np.linalg.norm(weights, axis=1) / np.maximum(np.abs(np.diag(inverse)[:n]), 1e-300)
    width = float(np.mean(widths))
    return {key: float(value) / width for key, value in zip(common, off, strict=True)}


def uneven(places: Mapping[str, Floats]) -> dict[str, float]:
    """How far each feature point lies from the mirror image of its counterpart, in eye widths.

    Parameters
    ----------
    places : feature point -> neutral position (3,).

    Returns
    -------
    Point -> distance, the same for both of a pair. The mirror is the plane that suits all pairs best, so that a face
    that is turned or stands aside is no worse. Empty if fewer than FEWEST points have a counterpart, or no eye
    corners are given.
    """
    other = {k: feature_point_definitions()[k].counterpart for k in sorted(places)}
    keys = [k for k, mate in other.items() if mate in places]
    widths = [float(np.linalg.norm(places[a] - places[b])) for a, b in EYES if a in places and b in places]
    if len(keys) < FEWEST or not widths:
        return {}
    here, there = (np.array([places[k or ""] for k in some]) for some in (keys, [other[k] for k in keys]))
    # The plane's normal is what most ways from a point to its counterpart have in common.
    ways = there - here
    normal = np.linalg.eigh(ways.T @ ways)[1][:, -1]
    middle = np.median((here + there) @ normal) / 2.0
    mirrored = there - 2.0 * ((there @ normal) - middle)[:, None] * normal
    off = np.linalg.norm(here - mirrored, axis=1) / float(np.mean(widths))
    return dict(zip(keys, off.tolist(), strict=True))


__all__ = ["NAMED", "held_out_error", "misplaced", "uneven"]
