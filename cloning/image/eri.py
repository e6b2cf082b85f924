"""Expression ratio images (Liu, Shan and Zhang 2001): the baseline, which multiplies instead of solving."""

from __future__ import annotations

import numpy as np

from cloning.image.color import Planes

WIDTHS = (0.01, 0.02, 0.04)
"""Standard deviations of the filter where the source's two pictures agree worst, middling and best, in eye separations;
between them the filtered ratios are blended. Where they disagree is the expression, whose creases shall stay sharp;
where they agree nothing happens, and the ratio holds noise and errors of registration. The paper gives this rule, with
one minus the correlation as weight, but no widths."""

WINDOW = 0.06
"""Half the side of the window over which the correlation is taken, in eye separations."""

DARK = 4.0
"""Added to both luminances of a ratio, in levels: black pixels have no ratio."""


def ratio_image(neutral: Planes, expression: Planes, unit: float) -> Planes:
    """The ratio of two registered luminances (h, w), filtered the more the better they agree.

    Parameters
    ----------
    unit : the eye separation in pixels.
    """
    from scipy import ndimage

    ratio = (expression + DARK) / (neutral + DARK)
    steps = np.clip(correlation(neutral, expression, WINDOW * unit), 0.0, 1.0) * (len(WIDTHS) - 1)
    out = np.zeros_like(ratio)
    for k, width in enumerate(WIDTHS):
        out += np.maximum(1.0 - np.abs(steps - k), 0.0) * ndimage.gaussian_filter(ratio, width * unit, mode="nearest")
    return out


def correlation(one: Planes, other: Planes, half: float) -> Planes:
    """Normalised cross-correlation of two planes in a square window around each pixel; 1 where both are flat."""
    from scipy import ndimage

    side = 2 * max(round(half), 1) + 1

    def mean(plane: Planes) -> Planes:
        found: Planes = ndimage.uniform_filter(plane, side, mode="nearest")
        return found

    a, b = mean(one), mean(other)
    noise = 1.0
    va = np.maximum(mean(one * one) - a * a, 0.0) + noise
    vb = np.maximum(mean(other * other) - b * b, 0.0) + noise
    found: Planes = (mean(one * other) - a * b + noise) / np.sqrt(va * vb)
    return found
