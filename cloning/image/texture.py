"""Fine texture that only the source has, a beard or freckles, is kept off the target.

Two pictures of one person never lie on each other to the pixel, so where the skin has texture their difference holds it
twice, there and displaced. Vertex tents would print it on the target, whose skin has nothing to correspond to.
"""

from __future__ import annotations

import numpy as np

from cloning.image.color import Planes

FINE = 0.1
"""Half the side of the window beyond which changes count as shades, not as texture, in eye separations: a third of an
eye. Stubble, moustaches and brows are finer."""

DOUBT = 2.0
"""A fine change is believed as far as its power exceeds so many times that of the source's own texture: a texture that
lies on a displaced copy of itself differs by twice its power."""

NOISE = 1.0
"""Power of the noise of a picture, in levels squared: below it nothing is texture."""


def without_foreign_texture(neutral: Planes, expression: Planes, target: Planes, unit: float) -> Planes:
    """The expression without the fine changes that come from texture which the target does not share.

    Texture that both have in the same place, like edges of lips and brows, is no reason for doubt: a face given its own
    expression keeps all of it.

    Parameters
    ----------
    neutral, expression, target : (h, w) registered luminances.
    unit : the eye separation in pixels.
    """
    half = FINE * unit
    change = expression - neutral
    coarse = _smooth(change, half)
    fine, own, other = change - coarse, neutral - _smooth(neutral, half), target - _smooth(target, half)
    power, own_power, other_power, shared = (
        _mean(plane, half) + np.float32(NOISE) for plane in (fine * fine, own * own, other * other, own * other)
    )
    agreed = np.maximum(shared, 0.0) ** 2 / (own_power * other_power)
    believed = np.clip(1.0 - DOUBT * own_power * np.maximum(1.0 - agreed, 0.0) / power, 0.0, 1.0)
    out: Planes = neutral + coarse + believed * fine
    return out


def _mean(plane: Planes, half: float) -> Planes:
    from scipy import ndimage

    found: Planes = ndimage.uniform_filter(plane, 2 * max(round(half), 1) + 1, mode="nearest")
    return found


def _smooth(plane: Planes, half: float) -> Planes:
    return _mean(_mean(plane, half), half)
