"""What every renderer can do, and what all of them need: depths and projections."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from fba.arrays import Floats
from fba.errors import FbaError
from studio.render.camera import Camera
from studio.render.drawable import Drawable
from studio.render.shading import UInt8


class RendererError(FbaError):
    """The renderer that was asked for does not work on this machine, or there is none of this name."""


class Renderer(Protocol):
    """Draws triangles.

    Attributes
    ----------
    name : "egl" or "software", with the reason in brackets where it stands in for another one.
    """

    name: str

    def render(self, drawables: Sequence[Drawable], camera: Camera, width: int, height: int) -> UInt8:
        """Return a picture, (height, width, 3) uint8, on the neutral backdrop."""
        ...


def depth_range(drawables: Sequence[Drawable], camera: Camera) -> tuple[float, float]:
    """View depths of the nearest and the farthest vertex, widened a little."""
    toward = camera.rotation()[2]
    depths = [d.vertices @ toward for d in drawables if len(d.vertices)]
    if not depths:
        return 1.0, -1.0
    middle = float(np.asarray(camera.target) @ toward)
    near, far = max(float(d.max()) for d in depths) - middle, min(float(d.min()) for d in depths) - middle
    margin = 0.01 * (near - far) + 1e-6 * camera.half_height
    return near + margin, far - margin


def project(vertices: Floats, matrix: Floats) -> tuple[Floats, Floats]:
    """Clip coordinates divided by w, (n, 3), and w, (n,)."""
    clip = vertices @ matrix[:, :3].T + matrix[:, 3]
    w = clip[:, 3]
    return clip[:, :3] / np.where(np.abs(w) > 1e-12, w, 1e-12)[:, None], w
