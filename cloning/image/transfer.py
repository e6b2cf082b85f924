"""The change of luminance by which the target's tents follow the source's."""

from __future__ import annotations

import numpy as np

from cloning.image.color import Planes
from cloning.image.grid import differences, motion_rows, tent_equations, tents, wanted_differences
from cloning.image.parts import parts
from cloning.image.solve import PixelSystem, around
from fba.arrays import Bools


class TentTransfer:
    """Vertex tents over the pixels of one target; the matrix is that of the first expression.

    Parameters
    ----------
    domain : (h, w) the pixels that may change; not the two outermost rows and columns.
    height : of one level of luminance, in pixels.
    """

    def __init__(self, domain: Bools, height: float) -> None:
        self._domain, self._height = domain, np.float32(height)
        self._at = around(domain)
        self._system: PixelSystem | None = None

    def change(self, target: Planes, neutral: Planes, expression: Planes, mask: Planes) -> tuple[Planes, int]:
        """Find what the target's luminance changes by.

        Parameters
        ----------
        target, neutral, expression : (h, w) registered luminances.
        mask : (h, w) 0..1, how much a pixel follows the source; where 0 its tent is asked to stay.

        Returns
        -------
        (h, w), and the steps of the iteration: 0 where the matrix is factored.

        Raises
        ------
        CloningError
            If an iteration does not converge.
        """
        target, neutral, expression = (self._height * plane for plane in (target, neutral, expression))
        if self._system is None:
            self._system = PixelSystem(self._domain, self._coefficients(target))
        found, steps = self._system.solve(self._wanted(target, neutral, expression, mask))
        found /= self._height
        return found, steps

    def _coefficients(self, target: Planes) -> Planes:
        """(2, 4, n) of the equations of the target's tents."""
        return np.concatenate(
            [tent_equations(tents(differences(target, self._at[part])))[0] for part in parts(len(self._at))], axis=2
        )

    def _wanted(self, target: Planes, neutral: Planes, expression: Planes, mask: Planes) -> Planes:
        """(4, n) changes of the differences in the rings."""
        out = np.empty((4, len(self._at)), np.float32)
        for part in parts(len(self._at)):
            at = self._at[part]
            share, ring = mask.take(at), differences(target, at)
            still, moved = differences(neutral, at), differences(expression, at)
            here = tents(ring)
            x, y, z = motion_rows(tents(still), tents(moved))
            motion = share * x, share * y, share * z + (1.0 - share)
            near = ring + share * (moved - still)
            np.subtract(wanted_differences(here, motion, near), ring, out=out[:, part])
        return out
