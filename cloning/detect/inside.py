"""Feature points inside the mouth: teeth and tongue are pieces of their own where a file has them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cloning.detect.head import Head
from cloning.parts import LOWER_TEETH, TONGUE, UPPER_TEETH
from cloning.similarity import fit_similarity
from cloning.surface import Surface
from cloning.template.closest import TriangleSearch
from fba.arrays import Floats, Ints

AROUND = ("2.1", "2.2", "2.3", "2.4", "2.5", "2.10", "8.1", "8.2", "9.15")
"""Points of the mouth by which the source's teeth are laid into the target's."""

FARTHEST = 0.15
"""Teeth are at most this far from where the source's would be, in eye separations; measured 0.03 to 0.13."""

TONGUE_FARTHEST = 0.1
"""The same for a tongue; measured 0.03 to 0.05, while teeth are 0.13 and more from a tongue's place."""

LARGEST = 1.6
"""Teeth, gums and tongue of one face are smaller than this, in eye separations; hair and clothes are larger."""


def inner_points(head: Head, skin: Surface, places: Mapping[str, Floats]) -> dict[str, tuple[Ints, Floats]]:
    """Place the points of teeth and tongue where there are pieces for them.

    Parameters
    ----------
    skin : the source's; its positions hold the points inside too.
    places : points found on the target's skin.

    Returns
    -------
    Vertices of the whole surface and weights of each point found.
    """
    pieces = _pieces(head, places)
    wanted = [key for key in (*UPPER_TEETH, *LOWER_TEETH, *TONGUE) if key in skin.positions]
    if not len(pieces) or not wanted:
        return {}
    way = fit_similarity(np.array([skin.positions[i] for i in AROUND]), np.array([places[i] for i in AROUND]))
    goals = dict(zip(wanted, way.apply(np.array([skin.positions[i] for i in wanted])), strict=True))
    found: dict[str, tuple[Ints, Floats]] = {}
    free = dict(pieces)
    # The upper teeth are the highest piece near their place; what is left holds the lower ones, then the tongue.
    for ids, farthest in ((UPPER_TEETH, FARTHEST), (LOWER_TEETH, FARTHEST), (TONGUE, TONGUE_FARTHEST)):
        some = [key for key in ids if key in goals]
        rows = [(_misfit(head, triangles, [goals[i] for i in some]), number) for number, triangles in free.items()]
        if not some or not rows or min(rows)[0] > farthest:
            continue
        number = min(rows)[1]
        search = TriangleSearch(head.whole.vertices, free.pop(number))
        near = search.closest(np.array([goals[i] for i in some]))
        for k, key in enumerate(some):
            found[key] = (search.triangles[near.triangles[k]], near.weights[k])
    return found


def _pieces(head: Head, places: Mapping[str, Floats]) -> dict[int, Ints]:
    """Triangles of each piece inside the mouth, by number of the piece."""
    piece = head.whole.components()
    taken = np.zeros(head.whole.vertex_count, bool)
    taken[head.vertices] = True
    for ball in head.eyeballs:
        if ball is not None:
            taken[ball.vertices] = True
    low, high = float(places["2.1"][1]) - 0.1, float(places["9.15"][1]) + 0.1
    front = max(float(places["8.1"][2]), float(places["8.2"][2]))
    owner = piece[head.whole.triangles[:, 0]]
    found = {}
    order = np.argsort(piece, kind="stable")
    groups = np.split(order, np.cumsum(np.bincount(piece))[:-1])
    for number, ids in enumerate(groups):
        if len(ids) < 8 or taken[ids].any():
            continue
        box = head.whole.vertices[ids]
        middle, size = 0.5 * (box.min(axis=0) + box.max(axis=0)), np.ptp(box, axis=0)
        inside = abs(middle[0]) < 0.2 and low < middle[1] < high and box[:, 2].max() < front
        if inside and 0.2 < size.max() < LARGEST and (owner == number).any():
            found[number] = head.whole.triangles[owner == number]
    return found


def _misfit(head: Head, triangles: Ints, goals: list[Floats]) -> float:
    """Mean distance of a piece from where its points should be."""
    return float(TriangleSearch(head.whole.vertices, triangles).closest(np.array(goals)).distances.mean())
