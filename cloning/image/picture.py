"""What goes into an analogy of pictures, and what comes out."""

from __future__ import annotations

from dataclasses import dataclass

from cloning.image.color import Planes, UInt8
from cloning.image.points import Places
from fba.arrays import Bools


@dataclass(frozen=True, eq=False)
class Picture:
    """A photograph with its feature points.

    Attributes
    ----------
    rgb : (h, w, 3) uint8.
    points : name -> (x, y), see `cloning.image.points`.
    """

    rgb: UInt8
    points: Places


@dataclass(frozen=True, eq=False)
class AnalogyResult:
    """The target with the source's expression.

    Attributes
    ----------
    rgb : (h, w, 3) uint8; where `changed` is False bit-identical to the target.
    luminance : (h, w) before rounding and clipping.
    changed : (h, w) True where, in the face's region, the warp moved a pixel or the mask let it change.
    points : where the target's points are now.
    steps : of the iteration; 0 where the matrix is factored.
    teeth : True where the source's mouth was shown.
    turned : how much the source's head turned between its pictures: see `cloning.image.points.turned`.
    relit : how different the light of the source's two pictures is: see `cloning.image.color.relit`.
    """

    rgb: UInt8
    luminance: Planes
    changed: Bools
    points: dict[str, tuple[float, float]]
    steps: int
    teeth: bool
    turned: float
    relit: float
