"""The centre of rotation of eyes that are not whole balls."""

from __future__ import annotations

import numpy as np

from cloning.parts import eye_center
from fba.arrays import Floats

CENTER = np.array([0.3, 1.6, 0.1])


def ball(least: float) -> Floats:
    """A sphere of radius 2 around CENTER, only where z is above a height."""
    angles = np.linspace(0.0, np.pi, 13)
    turns = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    rings = [[2.0 * np.sin(a) * np.cos(t), 2.0 * np.sin(a) * np.sin(t), 2.0 * np.cos(a)] for a in angles for t in turns]
    places = CENTER + np.array(rings)
    return places[places[:, 2] >= CENTER[2] + least - 1e-9]


def test_whole_balls_and_half_balls_turn_about_their_middle() -> None:
    assert np.allclose(eye_center(ball(-2.0), None), CENTER)
    half = ball(0.0)
    back = np.repeat(CENTER[None], 24, axis=0)
    assert np.allclose(eye_center(np.concatenate([half, back]), CENTER + np.array([0.0, 0.0, 2.0])), CENTER)


def test_a_flat_disc_turns_about_the_middle_of_its_box() -> None:
    disc = ball(-2.0) * [1.0, 1.0, 0.0]
    assert np.allclose(eye_center(disc, None), CENTER * [1.0, 1.0, 0.0])
