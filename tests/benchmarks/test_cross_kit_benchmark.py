"""The measures between two artists' shapes, on motions whose answers are known."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.cross_kit import Agreement, Kit, agreement, best_scale, cosine, floor, mean, overlap, shapes_table
from fba.orientation import to_file_order
from formats import read_scene
from formats.landmarks import read_landmarks
from samples import sample


@pytest.fixture(scope="module")
def kit() -> Kit:
    """A head with a push outwards on its left half, and 0.8 of its mirror image on the right."""
    path = sample("faces/closed_head.obj")
    scene = read_scene(path)
    places = to_file_order(scene, scene.world_neutral())
    middle = 0.5 * (places[:, 0].min() + places[:, 0].max())
    half = 0.5 * np.ptp(places[:, 0])
    across = (places[:, 0] - middle) / half
    push = 0.05 * half * np.clip(across, 0.0, None)[:, None] ** 2 * np.array([1.0, 0.5, 0.2])
    back = 0.8 * 0.05 * half * np.clip(-across, 0.0, None)[:, None] ** 2 * np.array([-1.0, 0.5, 0.2])
    shapes = {"cheekSquintLeft": push, "cheekSquintRight": back}
    return Kit("head", scene, read_landmarks(path.with_suffix(".fps.json"), scene), shapes)


def test_a_scaled_motion_differs_in_nothing_but_its_scale(kit: Kit) -> None:
    offsets = kit.on_skin(kit.shapes["cheekSquintLeft"])
    found = agreement(kit, 0.5 * offsets, offsets)
    assert (found.cosine, found.scale, found.overlap) == (pytest.approx(1.0), pytest.approx(2.0), 1.0)
    assert found.points == pytest.approx(0.5)
    assert found.points_cosine == pytest.approx(1.0)


def test_left_mirrored_against_right_finds_the_smaller_side(kit: Kit) -> None:
    (found,) = floor(kit).values()
    assert found.cosine > 0.995
    assert found.scale == pytest.approx(0.8, abs=0.01)
    assert found.overlap > 0.95
    assert found.points == pytest.approx(0.25, abs=0.02)


def test_points_that_stay_still_are_not_compared(kit: Kit) -> None:
    offsets = kit.on_skin(kit.shapes["cheekSquintLeft"])
    still = offsets.copy()
    still[kit.face.skin.point_matrix(list(kit.face.skin.points)).sum(axis=0) > 0.0] = 0.0
    found = agreement(kit, offsets, still)
    assert np.isnan(found.points)
    assert 0.8 < found.cosine < 1.0


def test_fields_with_nothing_in_common() -> None:
    one, other = np.zeros((4, 3)), np.zeros((4, 3))
    one[:2, 0], other[2:, 0] = 1.0, 1.0
    assert (cosine(one, other), best_scale(one, other), overlap(one, other)) == (0.0, 0.0, 0.0)
    assert cosine(one, 0.0 * one) == best_scale(0.0 * one, one) == 0.0


def test_small_moves_are_not_part_of_the_moving_region() -> None:
    one, other = np.zeros((3, 3)), np.zeros((3, 3))
    one[:, 1], other[:, 1] = (1.0, 0.5, 0.09), (0.0, 2.0, 0.1)
    assert overlap(one, other) == 0.5


def test_means_leave_out_what_is_not_known_and_tables_say_so() -> None:
    found = {
        "jawOpen": Agreement(1.0, 2.0, 0.5, 0.25, 1.0),
        "cheekPuff": Agreement(0.5, 1.0, 0.5, float("nan"), float("nan")),
    }
    assert mean(found) == Agreement(0.75, 1.5, 0.5, 0.25, 1.0)
    assert "| cheekPuff | 0.50 / 1.00 / 0.50 / - / - |" in shapes_table({"a to b": {"fit": found}})
