"""What a construction is: one FAP's motion made from the feature points of a face, without any modelled shape."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from cloning.prepare import PreparedFace
from fba.arrays import Floats

Offsets = dict[str, Floats]
"""Shape name -> (n, 3) world offsets, inside axes, mesh units; absent shapes stay still."""


@dataclass(frozen=True, slots=True)
class Construction:
    """How one FAP is made on any face.

    Attributes
    ----------
    fap_id : the FAP.
    borders : the interval borders but 0, increasing; negative ones where the FAP is bidirectional.
    needs : feature points without which it cannot be made.
    make : (face, border) -> accumulated offsets at that border.
    """

    fap_id: int
    borders: tuple[int, ...]
    needs: tuple[str, ...]
    make: Callable[[PreparedFace, int], Offsets]
