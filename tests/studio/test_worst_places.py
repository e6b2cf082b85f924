"""Skin that hides a place is cut open, and nothing else."""

from __future__ import annotations

import numpy as np

from studio.render.camera import Camera
from studio.render.drawable import Decal, Drawable
from studio.worst_places import opened


def test_only_what_is_before_the_place_is_cut() -> None:
    corners = np.array([[-0.1, -0.1, 0.0], [0.1, -0.1, 0.0], [0.0, 0.1, 0.0]])
    before, aside, behind = (corners + np.array(way) for way in ((0, 0, 0.5), (1.0, 0, 0.5), (0, 0, -0.5)))
    vertices = np.concatenate([before, aside, behind])
    triangles = np.arange(9).reshape(3, 3)
    uv = np.arange(18.0).reshape(3, 3, 2)
    decal = Decal(np.zeros((2, 2, 3), np.uint8), uv)
    skin = Drawable(vertices, triangles, np.eye(3), decal=decal)
    front = Camera((0.0, 0.0, 0.0), 1.0, 1.0)
    cut = opened(skin, front, 0.3)
    assert cut.triangles.tolist() == triangles[1:].tolist()
    assert cut.color.tolist() == np.eye(3)[1:].tolist()
    assert cut.decal is not None
    assert cut.decal.uv.tolist() == uv[1:].tolist()
    from_behind = opened(skin, front.turned(180.0), 0.3)
    assert from_behind.triangles.tolist() == triangles[:2].tolist()
    assert opened(skin, front, 0.0).triangles.tolist() == triangles.tolist()
