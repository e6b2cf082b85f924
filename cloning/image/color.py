"""Luminance and chroma: the YUV matrix of ITU-R BT.601, on the stored (gamma coded) values.

Y = 0.299 R + 0.587 G + 0.114 B, U = 0.492 (B - Y), V = 0.877 (R - Y); all in the range of the input, 0..255. The way
back is the exact inverse of this matrix.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fba.arrays import Bools

UInt8 = NDArray[np.uint8]

Planes = NDArray[np.floating[Any]]
"""Luminance, chroma or masks of pixels. Four bytes a pixel are exact enough for eight bits, and twice as fast."""

LUMA = np.array([0.299, 0.587, 0.114])
YUV_FROM_RGB = np.stack([LUMA, 0.492 * (np.array([0.0, 0.0, 1.0]) - LUMA), 0.877 * (np.array([1.0, 0.0, 0.0]) - LUMA)])
RGB_FROM_YUV = np.linalg.inv(YUV_FROM_RGB)


def to_yuv(rgb: UInt8 | Planes) -> Planes:
    """(h, w, 3) colours 0..255 to (3, h, w) planes Y, U, V.

    >>> to_yuv(np.full((1, 1, 3), 200, np.uint8)).round(9).ravel().tolist()
    [200.0, 0.0, 0.0]
    """
    return np.tensordot(YUV_FROM_RGB, np.asarray(rgb, np.float64), axes=(1, 2))


def luminance(rgb: UInt8) -> Planes:
    """(h, w) Y of (h, w, 3) colours."""
    found: Planes = rgb @ LUMA
    return found


def to_rgb(yuv: Planes) -> UInt8:
    """(3, ...) planes to (..., 3) uint8 colours, rounded; what no screen can show is clipped channel by channel."""
    rgb = RGB_FROM_YUV.astype(yuv.dtype) @ yuv.reshape(3, -1)
    np.clip(np.rint(rgb, out=rgb), 0.0, 255.0, out=rgb)
    return np.ascontiguousarray(rgb.astype(np.uint8).T).reshape(*yuv.shape[1:], 3)


def relit(one: Planes, other: Planes, skin: Bools) -> float:
    """Median ratio of two registered luminances (h, w) over the skin, as a logarithm: 0 in one light.

    An expression changes part of a face, another light or exposure most of it.
    """
    at = np.flatnonzero(skin)
    if not len(at):
        return 0.0
    first, second = (np.maximum(plane.ravel().take(at), 1.0) for plane in (one, other))
    return float(np.median(np.abs(np.log(first / second))))


def is_grey(rgb: UInt8) -> bool:
    """True where red, green and blue agree in every pixel."""
    return bool((rgb[..., 0] == rgb[..., 1]).all() and (rgb[..., 1] == rgb[..., 2]).all())
