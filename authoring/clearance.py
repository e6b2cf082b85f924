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

EASE = 0.15
"""Radii over which skin begins to give way: where it came into contact all at once, a crease would show."""

BESIDE = (0.96, 1.0)
"""Skin so far beside the middle, in parts of the ball with its clearance, passes over to skin that is beside it: the
corners of the lids are nearer, at 0.85."""

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
        (lacking, beside), (at_rest, _) = (_lacking(ball, spot, keep) for spot in (place, local))
        width = np.clip(-at_rest, 0.0, EASE * size)
        lifted = np.maximum(_soft(lacking, width) - _soft(np.minimum(at_rest, 0.0), width), 0.0)
        held = _share(clear, BURIED) * (1.0 - _share(beside, BESIDE))
        out[moving[near], 2] += held * lifted / es0
    return out


def _lacking(ball: Ball, spots: Floats, keep: Floats) -> tuple[Floats, Floats]:
    """How far spots (m, 3) must go forward to be off the ball by a clearance (m,), and how far beside it they are.

    Returns
    -------
    lacking : (m,) negative where nothing lacks.
    beside : (m,) distance from the middle across the view; 1 at the edge of ball and clearance.
    """
    needed = ball.radius(spots) * (1.0 + keep)
    flat = np.hypot(spots[:, 0], spots[:, 1])
    lacking: Floats = np.sqrt(np.maximum(needed**2 - flat**2, 0.0)) - spots[:, 2]
    return lacking, flat / needed


def _share(value: Floats, ends: tuple[float, float]) -> Floats:
    """From 0 at the first end to 1 at the second."""
    share: Floats = np.clip((value - ends[0]) / (ends[1] - ends[0]), 0.0, 1.0)
    return share


def _soft(value: Floats, width: Floats) -> Floats:
    """The value above 0 and 0 below, without a kink: rounded over a width."""
    rounded: Floats = 0.5 * (value + np.sqrt(value**2 + width**2))
    return rounded


_BALLS: WeakKeyDictionary[PreparedFace, list[Ball]] = WeakKeyDictionary()
