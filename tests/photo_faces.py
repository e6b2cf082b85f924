"""Drawn faces with known points: pictures for the tests of expression analogy."""

from __future__ import annotations

import numpy as np

from cloning.image import Picture
from fba.arrays import Floats

HALF: dict[str, tuple[float, float]] = {
    "3.7": (0.75, 0.0), "3.11": (0.25, 0.0), "3.1": (0.5, -0.1), "3.3": (0.5, 0.1), "4.1": (0.2, -0.35),
    "4.3": (0.5, -0.45), "4.5": (0.85, -0.35), "8.3": (0.4, 1.1), "8.5": (0.2, 1.02), "8.10": (0.1, 0.99),
    "8.7": (0.2, 1.2), "2.4": (0.36, 1.1), "2.6": (0.18, 1.1), "2.8": (0.18, 1.1), "9.7": (0.1, 0.2),
    "11.3": (0.7, -0.9), "10.7": (1.1, 0.9), "10.9": (1.15, 0.0), "2.13": (0.95, 1.3), "2.11": (0.4, 1.65),
}  # fmt: skip
MIDDLE = {"8.1": (0.0, 1.0), "8.2": (0.0, 1.23), "2.2": (0.0, 1.1), "2.3": (0.0, 1.1), "2.1": (0.0, 1.75),
          "9.15": (0.0, 0.75), "9.12": (0.0, 0.35), "11.1": (0.0, -1.1)}  # fmt: skip
OTHER_SIDE = {"3.7": "3.12", "3.11": "3.8", "8.10": "8.9", "9.7": "9.6", "11.3": "11.2", "10.7": "10.8",
              "10.9": "10.10", "2.13": "2.14", "2.11": "2.12"}  # fmt: skip

SIZE = (120, 150)
UNIT, EYES = 32.0, (60.0, 60.0)
"""Pixels of an eye separation, and the middle between the eyes (x, y)."""


def layout() -> dict[str, tuple[float, float]]:
    """All points in eye separations, x to the subject's left (the picture's right), y down."""
    out = dict(MIDDLE)
    for name, (x, y) in HALF.items():
        group, _, index = name.partition(".")
        out[name] = (x, y)
        out[OTHER_SIDE.get(name) or f"{group}.{int(index) + 1}"] = (-x, y)
    return out


def points(moves: dict[str, tuple[float, float]] | None = None) -> dict[str, tuple[float, float]]:
    """Pixels of all points, some of them moved by so many eye separations."""
    moves = moves or {}
    return {
        name: (EYES[0] + UNIT * (x + moves.get(name, (0, 0))[0]), EYES[1] + UNIT * (y + moves.get(name, (0, 0))[1]))
        for name, (x, y) in layout().items()
    }


def pixels(light: float = 1.0, seed: int = 0) -> Floats:
    """A shaded face (h, w, 3) with smooth spots, eyes and lips, 0..255."""
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    u, v = (x - EYES[0]) / UNIT, (y - EYES[1]) / UNIT
    out = 150.0 * light - 25.0 * (u**2 + 0.4 * (v - 0.4) ** 2) + 0.0 * u
    rng = np.random.default_rng(seed)
    for cx, cy, high in zip(rng.uniform(-1, 1, 12), rng.uniform(-0.9, 1.6, 12), rng.uniform(-12, 12, 12), strict=True):
        out = out + high * np.exp(-((u - cx) ** 2 + (v - cy) ** 2) / 0.05)
    for side in (-0.5, 0.5):
        out = out - 70.0 * np.exp(-(((u - side) / 0.2) ** 4) - (v / 0.09) ** 2)
    lips = np.exp(-((u / 0.38) ** 4) - ((v - 1.1) / 0.1) ** 2)
    rgb = np.stack([out, 0.8 * out, 0.7 * out], axis=-1) - lips[..., None] * np.array([0.0, 30.0, 20.0])
    return np.clip(rgb, 0.0, 255.0)


def picture(rgb: Floats, moves: dict[str, tuple[float, float]] | None = None) -> Picture:
    """A picture with its points."""
    return Picture(np.clip(np.rint(rgb), 0, 255).astype(np.uint8), points(moves))


def wrinkle(rgb: Floats, high: float = -40.0) -> Floats:
    """The same picture with a crease on the forehead."""
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    u, v = (x - EYES[0]) / UNIT, (y - EYES[1]) / UNIT
    return rgb + (high * np.exp(-((u / 0.3) ** 2) - ((v + 0.6) / 0.06) ** 2))[..., None]
