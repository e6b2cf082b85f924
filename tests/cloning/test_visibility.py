"""Which vertices of a skin can be seen from outside."""

from __future__ import annotations

import numpy as np
import pytest

from cloning.prepare import prepare
from cloning.surface import build_surface
from cloning.visibility import _front, _views, visible
from fat import AnimatableFace
from fba import FaceScene, FeaturePoints, PolyMesh, Shape
from fba.arrays import Bools, Floats, Ints


def ball(radius: float, steps: int = 48) -> tuple[Floats, Ints]:
    """Points on circles around an upright axis, and triangles that look outward."""
    turn, rise = np.meshgrid(
        np.arange(2 * steps) * np.pi / steps, np.linspace(0.01, np.pi - 0.01, steps), indexing="ij"
    )
    places = radius * np.stack([np.sin(rise) * np.sin(turn), np.cos(rise), np.sin(rise) * np.cos(turn)], axis=2)
    index = np.arange(2 * steps * steps).reshape(2 * steps, steps)
    a, b = index[:, :-1].ravel(), index[:, 1:].ravel()
    c, d = np.roll(index, -1, axis=0)[:, 1:].ravel(), np.roll(index, -1, axis=0)[:, :-1].ravel()
    return places.reshape(-1, 3), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def seen(vertices: Floats, triangles: Ints, directions: int = 14) -> Bools:
    scene = FaceScene((Shape("skin", PolyMesh.from_faces(vertices, triangles)),))
    return visible(build_surface(scene, FeaturePoints({}), ["skin"], 1.0), directions)


def test_what_lies_inside_is_hidden() -> None:
    (outer, triangles), (inner, _) = ball(1.0), ball(0.8)
    found = seen(np.concatenate([outer, inner]), np.concatenate([triangles, triangles + len(outer)]))
    front = outer[:, 2] > 0.0
    assert found[: len(outer)][front].all()
    assert not found[len(outer) :].any()
    assert seen(inner, triangles)[front].all(), "there is nothing around it now"
    assert not seen(outer, triangles[:, ::-1]).any(), "the inside of a wall"


def test_a_hole_lets_a_view_in() -> None:
    (outer, triangles), (inner, _) = ball(1.0), ball(0.9)
    hole = outer[triangles].mean(axis=1)[:, 2] > 0.9
    found = seen(np.concatenate([outer, inner]), np.concatenate([triangles[~hole], triangles + len(outer)]))
    inside = found[len(outer) :]
    assert inside[inner[:, 2] > 0.8].all()
    assert not inside[inner[:, 2] < 0.6].any()


def test_what_is_not_drawn_would_change_nothing(source: AnimatableFace) -> None:
    skin = prepare(source.scene, source.feature_points, "source").skin
    found, all_ = np.zeros(skin.vertex_count, bool), np.arange(skin.vertex_count, dtype=np.int32)
    corners = np.ascontiguousarray(skin.triangles.T)
    for view in _views(14):
        side = np.cross([0.0, 1.0, 0.0], view)
        side /= np.linalg.norm(side)
        flat = skin.vertices @ np.stack([side, np.cross(view, side)], axis=1)
        depth = skin.vertices @ view
        found |= (depth > _front(flat, depth, corners, all_, 384)) & (skin.normals @ view > 0.05)
    assert np.array_equal(visible(skin), found)
    assert 0.3 < found.mean() < 0.95


@pytest.mark.parametrize("directions", [1, 3, 14])
def test_more_views_see_more(directions: int) -> None:
    vertices, triangles = ball(1.0)
    found = seen(vertices, triangles, directions)
    assert found[vertices[:, 2] > 0.3].all()
    assert found.mean() == pytest.approx({1: 0.38, 3: 0.67, 14: 0.99}[directions], abs=0.01)
    assert found[vertices[:, 2] < -0.9].any() == (directions == 14), "three are from the front"
