"""A curved, uneven square sheet and smooth motions of it, for the tests of what copies local shape."""

from __future__ import annotations

import numpy as np

from fba.arrays import Floats, Ints


def cells(n: int) -> Ints:
    """(m, 4) quadrangles of an n x n grid."""
    corner = np.arange(n * n).reshape(n, n)
    four = np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]], axis=-1)
    return four.reshape(-1, 4).astype(np.int32)


def halves(n: int) -> Ints:
    """(2 m, 3) halves of its quadrangles."""
    four = cells(n)
    return np.concatenate([four[:, [0, 1, 2]], four[:, [0, 2, 3]]])


def grid(n: int, seed: int, rough: float = 0.15) -> Floats:
    """A curved, uneven square of n x n vertices."""
    random = np.random.default_rng(seed)
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-1.0, 1.0, n), np.linspace(-1.0, 1.0, n), indexing="ij"))
    vertices = np.stack([x, y, 0.4 * np.cos(2.0 * x) * np.cos(y)], axis=1)
    inside = np.abs(vertices[:, :2]).max(axis=1, keepdims=True) < 0.999
    uneven: Floats = vertices + inside * rough / n * random.normal(size=vertices.shape)
    return uneven


def offsets(vertices: Floats, count: int, seed: int) -> Floats:
    """(n, K, 3) smooth motions that rest at the border."""
    random = np.random.default_rng(seed)
    border = np.clip(2.0 - 2.0 * np.abs(vertices[:, :2]).max(axis=1), 0.0, 1.0)
    waves = np.sin(vertices @ random.normal(size=(3, count)) * 2.0)
    moved: Floats = (border[:, None] * waves)[:, :, None] * random.normal(size=(count, 3)) * 0.3
    return moved


def held_border(vertices: Floats) -> Floats:
    held: Floats = (np.abs(vertices[:, :2]).max(axis=1) > 0.999).astype(float)
    return held
