"""How far a picture of a face is from the truth: luminances within the mask."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from cloning.image import AnalogyResult
from cloning.image.color import Planes, UInt8, to_yuv
from cloning.image.mask import face_mask
from fba.arrays import Floats


@dataclass(frozen=True)
class Errors:
    """Errors of a picture's luminance within some pixels.

    Attributes
    ----------
    mean : mean absolute error, levels.
    psnr : dB.
    ssim : mean structural similarity.
    """

    mean: float
    psnr: float
    ssim: float

    def __str__(self) -> str:
        return f"mean {self.mean:5.2f}  PSNR {self.psnr:5.2f} dB  SSIM {self.ssim:.4f}"


def errors(found: UInt8, truth: UInt8, where: Planes) -> Errors:
    """Compare two pictures where a mask is not zero."""
    a, b = to_yuv(found)[0], to_yuv(truth)[0]
    at = where > 0
    square = float(((a - b)[at] ** 2).mean())
    psnr = 10.0 * np.log10(255.0**2 / square) if square > 0 else np.inf
    return Errors(float(np.abs(a - b)[at].mean()), float(psnr), float(structural_similarity(a, b)[at].mean()))


def structural_similarity(a: Floats, b: Floats) -> Floats:
    """The SSIM map of two luminances (Wang et al. 2004): Gaussian window of 1.5 pixels, K1 = 0.01, K2 = 0.03."""

    def smooth(plane: Floats) -> Floats:
        return np.asarray(ndimage.gaussian_filter(plane, 1.5, truncate=3.5))

    ma, mb = smooth(a), smooth(b)
    va, vb, cov = smooth(a * a) - ma * ma, smooth(b * b) - mb * mb, smooth(a * b) - ma * mb
    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    return (2 * ma * mb + c1) * (2 * cov + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2))


def face_region(result: AnalogyResult) -> Planes:
    """The mask of the target's face with its expression."""
    height, width = result.rgb.shape[:2]
    named = {name: place for name, place in result.points.items() if ":" not in name}
    return face_mask(named, (slice(0, height), slice(0, width)))


def mean_errors(found: Sequence[Errors]) -> Errors:
    """The mean of each measure."""
    return Errors(*(float(np.mean([getattr(e, k) for e in found])) for k in ("mean", "psnr", "ssim")))
