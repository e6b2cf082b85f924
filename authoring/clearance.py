"""Skin that is moved around the eyes stays in front of the eyeballs."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np

from cloning.eyeballs import Ball, balls
from cloning.prepare import PreparedFace
from fba.arrays import Floats

LAYER = 0.08
"""Clearance up to this, in radii of the eyeball, is kept wholly: about the thickness of a lid."""

GIVES = 0.15
"""Thicker skin, of brows and cheeks, gives way to this share of what it has above the layer."""

FAR = 3.0
"""Skin that comes no nearer to the eyeball's middle than this, in radii, is not looked at."""

BURIED = (-0.06, -0.02)
"""The back of a lid that lies less deep in the eyeball at rest than the second clearance, in radii, gets no deeper;
what is deeper than the first one may go where it likes, for nobody sees it."""

BEHIND = -0.1
"""Skin farther behind the middle of the eyeball than this, in radii, is beside it and cannot come in front."""


def before_eyeballs(face: PreparedFace, field: Floats) -> Floats:
    """A field (n, 3) in eye separations, pushed forward where skin would sink into an eyeball.

    Height and width, which feature points around the eyes are measured in, stay as they are. Skin keeps most of the
    clearance that it has at rest; what lies inside the eyeball at rest may stay there, but gets hardly deeper.
    """
    if face not in _BALLS:
        _BALLS[face] = balls(face)
    es0 = face.fapu.es0
    out = field.copy()
    moving = np.flatnonzero(np.any(field != 0.0, axis=1))
    rest, moved = es0 * face.skin.vertices[moving], es0 * (face.skin.vertices + field)[moving]
    for ball in _BALLS[face]:
        local, place = rest - ball.center, moved - ball.center
        size = float(np.median(ball.radii))
        near = (np.linalg.norm(place, axis=1) < FAR * size) & (local[:, 2] > 0.0) & (place[:, 2] > BEHIND * size)
        local, place = local[near], place[near]
        clear = ball.clearance(local)
        keep = np.minimum(clear, LAYER) + GIVES * np.clip(clear - LAYER, 0.0, 1.0)
        needed = ball.radius(place) * (1.0 + keep)
        flat = place[:, 0] ** 2 + place[:, 1] ** 2
        front = np.sqrt(np.maximum(needed**2 - flat, 0.0))
        lifted = np.where(flat < needed**2, np.maximum(front - place[:, 2], 0.0), 0.0)
        held = np.clip((clear - BURIED[0]) / (BURIED[1] - BURIED[0]), 0.0, 1.0)
        out[moving[near], 2] += held * lifted / es0
    return out


_BALLS: WeakKeyDictionary[PreparedFace, list[Ball]] = WeakKeyDictionary()
