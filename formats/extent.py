"""Scenes whose coordinates are too large to be measured."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from fba.arrays import Floats
from fba.errors import MeshError

FARTHEST = 1e30
"""Products of coordinates stay finite up to here, and single precision holds them; no unit of length needs more."""


def require_near(positions: Iterable[Floats]) -> None:
    """Refuse vertices (n, 3) in world coordinates that lie out of all bounds.

    Raises
    ------
    MeshError
        If a coordinate is no finite number or beyond `FARTHEST`.
    """
    for vertices in positions:
        bad = ~(np.abs(vertices) <= FARTHEST).all(axis=1)
        if bad.any():
            vertex = int(np.argmax(bad))
            place = ", ".join(f"{x:.3g}" for x in vertices[vertex])
            raise MeshError(f"vertex {vertex} of a shape lies at ({place}), out of all bounds; check scales and units")
