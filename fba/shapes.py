"""Named morph targets of one mesh in the file's own vertex order, with or without a FAP meaning."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Floats, frozen
from fba.errors import MeshError


@dataclass(frozen=True, eq=False)
class ShapeSet:
    """Free expressions.

    Attributes
    ----------
    names : K unique names.
    neutral : (N, 3) float64, file's own axes, units and vertex order.
    deltas : (K, N, 3) float64, target minus neutral.
    """

    names: tuple[str, ...]
    neutral: Floats
    deltas: Floats

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "names", tuple(self.names))
        put(self, "neutral", frozen(self.neutral, np.float64, (-1, 3)))
        put(self, "deltas", frozen(self.deltas, np.float64))
        if self.deltas.shape != (len(self.names), len(self.neutral), 3):
            raise MeshError(
                f"{len(self.names)} morph targets over {len(self.neutral)} vertices need deltas of shape "
                f"{(len(self.names), len(self.neutral), 3)}, not {self.deltas.shape}"
            )
        if len(set(self.names)) != len(self.names):
            raise MeshError("two morph targets have the same name")
        if not np.all(np.isfinite(self.deltas)):
            raise MeshError("the morph targets hold values that are not finite numbers")
