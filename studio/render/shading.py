"""The light of the studio, written once for both renderers.

All directions are view directions (+X right, +Y up, +Z towards the camera), so that a face is lit the same from
every side. Colours are multiplied in linear light; pictures are stored with gamma 2, which is within 2 % of
sRGB and only a square root. Numbers were chosen by looking at the shared heads.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fba.arrays import Floats32

UInt8 = NDArray[np.uint8]

SAMPLES = 2
"""Samples for each pixel in each direction (supersampling)."""


def _unit(x: float, y: float, z: float) -> tuple[float, float, float]:
    length = (x * x + y * y + z * z) ** 0.5
    return x / length, y / length, z / length


KEY = _unit(-0.50, 0.55, 0.70)
KEY_COLOR = (0.84, 0.80, 0.74)
KEY_WRAP = 0.15
FILL = _unit(0.80, 0.05, 0.55)
FILL_COLOR = (0.17, 0.19, 0.22)
RIM = _unit(0.55, 0.45, -0.35)
RIM_COLOR = (0.40, 0.42, 0.46)
SKY = (0.27, 0.28, 0.31)
GROUND = (0.17, 0.14, 0.13)
HALF = _unit(KEY[0], KEY[1], KEY[2] + 1.0)
INSIDE = (0.30, 0.16, 0.15)
"""What the back of a surface (the inside of a mask, of a mouth) keeps of its colour."""

PUPIL = 0.36
"""Radius of the pupil, in iris radii."""
LIMBUS = 0.82
EDGE = 0.07
"""Softness of the iris's edges, in iris radii."""

BYTES = np.uint32(0x00FF00FF)
SIEVE = (0, 2, 3, 1)
"""The order in which a pixel's four samples (left to right, top to bottom) are set as opacity grows."""

BACKGROUND_TOP = (248, 248, 250)
BACKGROUND_BOTTOM = (222, 224, 229)


def shade(attributes: Floats32, facing: Floats32) -> Floats32:
    """Light pixels.

    Parameters
    ----------
    attributes : (7, p) interpolated normal (any length), linear albedo, gloss.
    facing : (p,) 1 where the front of the triangle is seen, -1 for its back.

    Returns
    -------
    (3, p) linear light.
    """
    normal = attributes[:3]
    length = np.sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2])
    nx, ny, nz = normal * (facing / np.maximum(length, np.float32(1e-12)))
    front = facing > 0
    key = _lambert(nx, ny, nz, KEY, KEY_WRAP)
    fill = _lambert(nx, ny, nz, FILL, 0.0)
    rim = _lambert(nx, ny, nz, RIM, 0.0)
    edge = np.float32(1) - np.clip(nz, 0, 1)
    rim *= edge * edge * front
    shine = _lambert(nx, ny, nz, HALF, 0.0)
    for _ in range(4):
        shine *= shine
    shine *= attributes[6] * front
    up = np.float32(0.5) + np.float32(0.5) * ny
    out = np.empty((3, normal.shape[1]), dtype=np.float32)
    for k in range(3):
        light = np.float32(KEY_COLOR[k]) * key + np.float32(FILL_COLOR[k]) * fill
        light += np.float32(SKY[k] - GROUND[k]) * up + np.float32(GROUND[k])
        light += np.float32(RIM_COLOR[k]) * rim
        light *= attributes[3 + k]
        if not front.all():
            light *= np.where(front, np.float32(1), np.float32(INSIDE[k]))
        out[k] = light + shine
    return out


def _lambert(nx: Floats32, ny: Floats32, nz: Floats32, light: tuple[float, float, float], wrap: float) -> Floats32:
    x, y, z = (np.float32(c / (1.0 + wrap)) for c in light)
    out: Floats32 = nx * x + ny * y + nz * z
    if wrap:
        out += np.float32(wrap / (1.0 + wrap))
    np.maximum(out, 0, out=out)
    return out


def paint_iris(albedo: Floats32, directions: Floats32, angle: float, color: tuple[float, float, float]) -> Floats32:
    """Linear albedo of eyeball pixels.

    Parameters
    ----------
    albedo : (3, p) of the white of the eye.
    directions : (3, p) interpolated rest directions, see `Iris`.
    angle, color : of the iris.
    """
    length = np.sqrt(np.einsum("ip,ip->p", directions, directions))
    cosine = directions[2] / np.maximum(length, np.float32(1e-12))
    radius = np.sqrt(np.maximum(np.float32(1) - cosine, 0) / np.float32(1.0 - np.cos(angle)))
    white = _step(radius, 1.0)
    black = np.float32(1) - _step(radius, PUPIL)
    ring = _step(radius, LIMBUS, 0.16)
    tone = (np.float32(1.15) - np.float32(0.35) * radius) * (np.float32(1) - np.float32(0.62) * ring)
    tone *= np.float32(1) - np.float32(0.97) * black
    out = np.empty_like(albedo)
    for k in range(3):
        out[k] = albedo[k] * white + np.float32(color[k] ** 2) * tone * (np.float32(1) - white)
    return out


def _step(radius: Floats32, at: float, softness: float = EDGE) -> Floats32:
    t = np.clip((radius - np.float32(at - softness)) * np.float32(0.5 / softness), 0, 1)
    smooth: Floats32 = t * t * (np.float32(3) - np.float32(2) * t)
    return smooth


def tint_by_decal(albedo: Floats32, u: Floats32, v: Floats32, image: UInt8) -> None:
    """Multiply a decal into the linear albedo (3, p) of pixels, in place; u, v are (p,)."""
    height, width = image.shape[:2]
    column = np.floor(u * np.float32(width)).astype(np.int32)
    row = np.floor(v * np.float32(height)).astype(np.int32)
    inside = np.flatnonzero((column >= 0) & (column < width) & (row >= 0) & (row < height))
    texel = image[row[inside], column[inside]].astype(np.float32) * np.float32(1 / 255)
    albedo[:, inside] *= (texel * texel).T


def sieve(x: NDArray[np.int64], y: NDArray[np.int64], quarters: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which samples a surface of so many quarters opacity sets; x, y count samples from the upper left."""
    return np.asarray(SIEVE)[(x & 1) + 2 * (y & 1)] < quarters


def encode(linear: Floats32) -> UInt8:
    """Linear light to 8 bits with gamma 2."""
    return np.asarray(np.sqrt(np.clip(linear, 0, 1)) * np.float32(255) + np.float32(0.5)).astype(np.uint8)


def resolve(samples: UInt8) -> UInt8:
    """Average the samples of each pixel over the background.

    Parameters
    ----------
    samples : (2h, 2w, 4) uint8; colour is black and alpha 0 where nothing was hit, else alpha is 255.

    Returns
    -------
    (h, w, 3) uint8.
    """
    height, width = samples.shape[0] // SAMPLES, samples.shape[1] // SAMPLES
    packed = np.ascontiguousarray(samples).view(np.uint32)[..., 0]
    total = np.empty((height, width, 4), dtype=np.uint16)
    # Two bytes of each colour at a time, each with room for the sum of four.
    for k, half in enumerate((packed & BYTES, packed >> np.uint32(8) & BYTES)):
        rows = half[0::2] + half[1::2]
        total[..., k::2] = np.ascontiguousarray(rows[:, 0::2] + rows[:, 1::2]).view(np.uint16).reshape(height, width, 2)
    out = ((total[..., :3] + np.uint16(2)) >> np.uint16(2)).astype(np.uint8)
    alpha = total[..., 3]
    backdrop = background(height)
    np.copyto(out, backdrop[:, None].astype(np.uint8), where=(alpha == 0)[..., None])
    row, column = np.nonzero((alpha > 0) & (alpha < 4 * 255))
    part = total[row, column].astype(np.uint32)
    blend = part[:, :3] * np.uint32(255) + (np.uint32(4 * 255) - part[:, 3:]) * backdrop[row]
    out[row, column] = (blend + np.uint32(510)) // np.uint32(1020)
    return out


def background(height: int) -> NDArray[np.uint32]:
    """(h, 3) colours of the backdrop, row by row."""
    t = np.linspace(0.0, 1.0, height)[:, None] if height > 1 else np.zeros((1, 1))
    return np.rint(np.array(BACKGROUND_TOP) * (1 - t) + np.array(BACKGROUND_BOTTOM) * t).astype(np.uint32)
