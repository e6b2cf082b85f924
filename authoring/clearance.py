"""Skin that is moved around the eyes stays in front of the eyeballs."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np

from cloning.eyeballs import Ball, balls
from cloning.prepare import PreparedFace
from fba.arrays import Floats

LAYER = 0.08
"""No more than this clearance is kept, in radii of the eyeball: about the thickness of a lid."""

BEHIND = -0.1
"""Skin farther behind the middle of the eyeball than this, in radii, is beside it and cannot come in front."""


def before_eyeballs(face: PreparedFace, field: Floats) -> Floats:
    """A field (n, 3) in eye separations, pushed forward where skin would sink into an eyeball.

    Height and width, which feature points around the eyes are measured in, stay as they are. Skin keeps the clearance
    that it has at rest, up to a thin layer; what lies inside the eyeball at rest may stay there.
    """
    if face not in _BALLS:
        _BALLS[face] = balls(face)
    es0 = face.fapu.es0
    out = field.copy()
    for ball in _BALLS[face]:
        moves = np.any(field[ball.vertices] != 0.0, axis=1)
        if not moves.any():
            continue
        vertices, local = ball.vertices[moves], ball.rest[moves] - ball.center
        place = local + es0 * field[vertices]
        keep = np.minimum(ball.clearance(local), LAYER)
        needed = ball.radius(place) * (1.0 + keep)
        flat = place[:, 0] ** 2 + place[:, 1] ** 2
        front = np.sqrt(np.maximum(needed**2 - flat, 0.0))
        near = (keep > 0.0) & (flat < needed**2) & (local[:, 2] > 0.0) & (place[:, 2] > BEHIND * needed)
        out[vertices, 2] += np.where(near, np.maximum(front - place[:, 2], 0.0), 0.0) / es0
    return out


_BALLS: WeakKeyDictionary[PreparedFace, list[Ball]] = WeakKeyDictionary()
