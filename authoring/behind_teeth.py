"""A lowered tongue stays behind the lower front teeth: how far its tip must draw back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cloning.bodies import body
from cloning.prepare import PreparedFace
from fba.arrays import Floats
from fba.scene import Role

CELL = 0.015
"""The teeth are looked at from the front in squares of this size, in eye separations: a sixth of a front tooth."""

GAP = 0.015
"""The tongue keeps this far behind the teeth, in eye separations: a little less than a millimetre."""


@dataclass(frozen=True, eq=False)
class InnerSide:
    """Where the inner side of the lower front teeth is; lengths in eye separations.

    Attributes
    ----------
    corner : (2,) least x and least y of the grid.
    depth : (columns, rows) z, at each place the farthest back of the teeth there and above; inf over the teeth.
    """

    corner: Floats
    depth: Floats

    def in_front(self, places: Floats) -> Floats:
        """(n,) how far places (n, 3) must go back to be behind the teeth; negative where they need not."""
        columns, rows = self.depth.shape
        column, row = np.floor((places[:, :2] - self.corner) / CELL).T.astype(np.int64)
        beside = (column < 0) | (column >= columns) | (row >= rows)
        depth = self.depth[np.clip(column, 0, columns - 1), np.clip(row, 0, rows - 1)]
        lacking: Floats = np.where(beside, -np.inf, places[:, 2] + GAP - depth)
        return lacking


def inner_side(face: PreparedFace, behind: float) -> InnerSide | None:
    """The inner side of the lower teeth that lie farther in front than z = `behind`; None without such teeth."""
    teeth = body(face, Role.LOWER_TEETH)
    if teeth is None:
        return None
    corners = teeth.vertices[teeth.triangles] / face.fapu.es0
    places = _over(corners[(corners[:, :, 2] > behind).all(axis=1)])
    if not len(places):
        return None
    corner = places[:, :2].min(axis=0)
    cell = np.floor((places[:, :2] - corner) / CELL).astype(np.int64)
    depth = np.full(cell.max(axis=0) + 1, np.inf)
    np.minimum.at(depth, (cell[:, 0], cell[:, 1]), places[:, 2])
    return InnerSide(corner, np.minimum.accumulate(depth[:, ::-1], axis=1)[:, ::-1])


def _over(corners: Floats) -> Floats:
    """Places (m, 3) all over triangles (t, 3, 3), no farther from each other than half a cell."""
    if not len(corners):
        return np.zeros((0, 3))
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    steps = np.maximum(np.ceil(2.0 * longest / CELL), 1.0).astype(np.int64)
    found = []
    for count in np.unique(steps):
        a, b = (part.ravel() / count for part in np.meshgrid(np.arange(count + 1), np.arange(count + 1)))
        inside = a + b <= 1.0 + 1e-9
        shares = np.stack([1.0 - a - b, a, b], axis=1)[inside]
        found.append(np.einsum("sk,tkc->tsc", shares, corners[steps == count]).reshape(-1, 3))
    return np.concatenate(found)
