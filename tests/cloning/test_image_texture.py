"""Texture of the source's skin stays on the source's skin."""

from __future__ import annotations

import numpy as np
import pytest

from cloning.image.texture import without_foreign_texture

UNIT = 60.0
SIZE = 120


def stubble(seed: int) -> np.ndarray:
    return 15.0 * np.random.default_rng(seed).standard_normal((SIZE, SIZE))


def crease() -> np.ndarray:
    y = np.arange(SIZE)[:, None] - SIZE / 2
    return np.repeat(-50.0 * np.exp(-((y / 2.5) ** 2)), SIZE, axis=1)


def test_a_displaced_beard_is_left_out_and_a_crease_on_smooth_skin_is_kept() -> None:
    smooth = np.full((SIZE, SIZE), 120.0) + 0.3 * stubble(1) / 15.0
    bearded = smooth + stubble(2)
    displaced = smooth + np.roll(stubble(2), 3, axis=1)
    found = without_foreign_texture(bearded, displaced, smooth, UNIT)
    assert np.std(found - bearded) < 0.35 * np.std(displaced - bearded)
    found = without_foreign_texture(smooth, smooth + crease(), 0.8 * smooth, UNIT)
    assert np.abs(found - smooth - crease()).max() < 1.0


def test_a_face_keeps_all_of_its_own_texture() -> None:
    bearded = 120.0 + stubble(3)
    displaced = np.roll(bearded, 3, axis=1)
    assert without_foreign_texture(bearded, displaced, bearded, UNIT) == pytest.approx(displaced, abs=1e-6)
