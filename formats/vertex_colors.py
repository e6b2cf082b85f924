"""Vertex colours between files that write them as a screen shows them (sRGB) and scenes, which hold linear light."""

from __future__ import annotations

import numpy as np

from fba.arrays import Floats
from fba.scene import FaceScene


def scene_colors(shown: Floats | None) -> dict[str, Floats]:
    """The vertex attributes of colours (N, 3 or more) of a screen; none where they are not between 0 and 1."""
    if shown is None or shown.shape[1] < 3 or not ((shown >= 0.0) & (shown <= 1.0)).all():
        return {}
    values = shown[:, :3]
    return {"color": np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)}


def shown_colors(scene: FaceScene) -> Floats | None:
    """(N, 3) colours of a screen, white where a vertex has none; None for a scene without colours."""
    linear = scene.vertex_attributes.get("color")
    if linear is None:
        return None
    values = np.clip(np.nan_to_num(linear[:, :3], nan=1.0), 0.0, 1.0)
    shown: Floats = np.where(values <= 0.0031308, 12.92 * values, 1.055 * values ** (1.0 / 2.4) - 0.055)
    return shown.round(6)
