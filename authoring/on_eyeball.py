"""Lids that lie on an eyeball stay clear of it while they or the ball move."""

from __future__ import annotations

import numpy as np

from authoring.spread import smoothstep
from cloning.eyeballs import Ball, balls
from cloning.prepare import PreparedFace
from fba.arrays import Floats

LAYER = 0.02
"""A lid clears the ball by no more than this, in radii; by less where it is nearer at rest."""

GRAZED = 0.15
"""Skin that a moving ball only grazes, with less than this share of its radius, is not pushed all its way."""


def keep_clear(face: PreparedFace, ball: Ball, skin: Floats, shift: Floats | float = 0.0) -> None:
    """Push offsets (n, 3) of the skin forward where it would come nearer to the eyeball than it rests; heights stay.

    Parameters
    ----------
    skin : in eye separations; changed in place, where it moves.
    shift : (3,) by which the ball itself moves, in eye separations.
    """
    es0 = face.fapu.es0
    moved = np.any(skin[ball.vertices] != 0.0, axis=1)
    vertices = ball.vertices[moved]
    local = ball.rest[moved] - ball.center
    place = local + es0 * (skin[vertices] - shift)
    needed = ball.radius(place) * (1.0 + np.minimum(ball.clearance(local), LAYER))
    front = np.sqrt(np.maximum(needed**2 - place[:, 0] ** 2 - place[:, 1] ** 2, 0.0))
    before = (local[:, 2] > 0.0) & (place[:, 2] + es0 * np.max(shift) > 0.0)
    push = np.where(before, np.maximum(front - place[:, 2], 0.0), 0.0) / es0
    if np.any(shift):
        push *= smoothstep((1.0 - np.hypot(place[:, 0], place[:, 1]) / needed) / GRAZED)
    skin[vertices, 2] += push


def eyeball(face: PreparedFace, pupil: str) -> Ball | None:
    """The eyeball behind a pupil, 3.5 or 3.6; None where it is no mesh of its own."""
    place = face.place(pupil)
    near = [b for b in balls(face) if np.linalg.norm(b.center - place) < 2.0 * float(np.median(b.radii))]
    return near[0] if near else None
