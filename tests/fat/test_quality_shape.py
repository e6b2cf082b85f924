"""Tears, bends and what moves at the feature points without a FAP, on motions whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from fat.conformance import widening
from fat.folds import largest_fold
from fat.held_out import NAMED, held_out_error, misplaced, uneven
from fat.quality import flips, roughness, turned_over
from fat.tearing import SHORT, SLACK, angles, bending, hinges, jumps, reach, stretching
from fba import PolyMesh
from fba.feature_points import feature_point_definitions


def strip(count: int = 20, step: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    """A strip of triangles along x: vertices and edges along it."""
    x = np.arange(count) * step
    return np.stack([x, 0 * x, 0 * x], axis=1), np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)


def test_skin_that_slides_along_itself_tears_though_no_edge_across_gets_longer() -> None:
    vertices, edges = strip()
    offsets = np.zeros_like(vertices)
    offsets[10:, 1] = 0.06
    steep = jumps(vertices, edges.astype(np.int32), offsets)
    assert np.flatnonzero(steep).tolist() == [9]
    assert steep[9] == pytest.approx(0.06 / (0.1 + SLACK))


def test_a_motion_that_changes_evenly_is_as_steep_on_any_mesh() -> None:
    for step in (0.05, 0.1, 0.5):
        vertices, edges = strip(20, step)
        steep = jumps(vertices, edges.astype(np.int32), 0.3 * vertices[:, [1, 0, 2]])
        assert steep == pytest.approx(np.full(19, 0.3 * step / (step + SLACK)))


@pytest.mark.parametrize("degrees", [5.0, 90.0, 170.0])
def test_a_hinge_bends_by_the_angle_that_its_flap_turns(degrees: float) -> None:
    vertices = np.array([[0.0, 0, 0], [0, 1, 0], [-1, 0.5, 0], [1, 0.5, 0]])
    bends = hinges(np.array([[0, 1, 2], [1, 0, 3]], np.int32))
    turn = np.radians(degrees)
    offsets = np.zeros((4, 3))
    offsets[3] = np.array([np.cos(turn), 0.5, np.sin(turn)]) - vertices[3]
    rest = angles(vertices, bends)
    assert bending(rest, angles(vertices + offsets, bends)) == pytest.approx([degrees])
    rigid = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    assert bending(rest, angles(vertices @ rigid.T, bends)) == pytest.approx([0.0], abs=1e-6)


def test_a_cylinder_bends_as_sharply_on_any_mesh() -> None:
    for count in (20, 60):
        turn = np.linspace(0.0, 1.0, count)
        flat, round_ = (
            np.concatenate([np.stack([x, 0 * x + y, z], axis=1) for y in (0.0, 0.1)])
            for x, z in ((turn, 0 * turn), (np.sin(turn), np.cos(turn)))
        )
        quads = [[k, k + 1, count + k + 1, count + k] for k in range(count - 1)]
        bends = hinges(PolyMesh.from_faces(flat, quads).triangles)
        across = bends[np.abs(flat[bends[:, 0], 0] - flat[bends[:, 1], 0]) < 1e-9]
        change = bending(angles(flat, across), angles(round_, across))
        # Both triangles reach a third of a step each; the facets of a cylinder turn by a step's angle.
        assert np.radians(change) / reach(flat, across) == pytest.approx(np.full(count - 2, 1.5), rel=0.01)


def test_a_tiny_edge_stretches_little() -> None:
    assert stretching(np.array([1.0, 0.0]), np.array([2.0, SHORT])) == pytest.approx(
        [np.log(2.0), np.log(2.0)], rel=0.01
    )
    assert stretching(np.array([2.0]), np.array([1.0])) == pytest.approx([np.log(2.0)], rel=0.01)


def test_a_fold_is_as_large_as_the_triangles_that_touch_along_edges() -> None:
    grid = np.array([[x, y, 0.0] for y in range(3) for x in range(3)])
    side_by_side = np.array([[0, 1, 4], [0, 4, 3], [4, 5, 8]], np.int32)  # the third touches at a corner only
    assert largest_fold(grid, side_by_side) == pytest.approx(1.0)
    assert largest_fold(0.1 * grid, side_by_side[2:]) == pytest.approx(0.1 * np.sqrt(0.5))
    assert largest_fold(grid, side_by_side[:0]) == 0.0


def test_a_point_on_one_side_only_lies_off_its_counterparts_mirror_image() -> None:
    rng = np.random.default_rng(5)
    pairs = {k: c for k, d in feature_point_definitions().items() if (c := d.counterpart) is not None and k < c}
    places = {}
    for one, other in pairs.items():
        x, y, z = rng.uniform(0.1, 1.0, 3)
        places |= {one: np.array([x, y, z]), other: np.array([-x, y, z])}
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turned = {k: turn @ p + [5.0, 6.0, 7.0] for k, p in places.items()}
    assert max(uneven(turned).values()) < 1e-9, "a face may be turned and stand aside"
    width = np.mean([np.linalg.norm(places[a] - places[b]) for a, b in (("3.7", "3.11"), ("3.8", "3.12"))])
    turned["8.3"] = turned["8.3"] + turn @ [0.0, 0.6 * width, 0.0]
    off = uneven(turned)
    assert {k for k, v in off.items() if v > 0.3} == {"8.3", "8.4"}
    assert off["8.3"] == pytest.approx(0.6, abs=0.05)
    assert uneven({k: turned[k] for k in ("3.7", "3.11", "3.8", "3.12")}) == {}


def test_roughness_is_read_where_it_is_asked() -> None:
    _, edges = strip()
    offsets = np.ones((20, 3))
    offsets[15] = 2.0
    head = np.arange(20) < 10
    assert roughness(edges.astype(np.int32), offsets, head) == pytest.approx(0.0)
    assert roughness(edges.astype(np.int32), offsets, ~head) > 0.1


def test_only_edges_of_two_triangles_that_agree_are_hinges() -> None:
    assert len(hinges(np.array([[0, 1, 2]], np.int32))) == 0
    assert len(hinges(np.array([[0, 1, 2], [0, 1, 3]], np.int32))) == 0, "wound against each other"
    assert len(hinges(np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]], np.int32))) == 0, "three at one edge"


def test_the_triangles_that_turn_over_are_named() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 0, 0], [6, 0, 0], [5, 1, 0]])
    triangles = np.array([[3, 4, 5], [0, 1, 2]], np.int32)
    offsets = np.zeros((6, 3))
    offsets[2] = [0, -1.5, 0.2]
    moving, turned = turned_over(vertices, triangles, offsets)
    assert (moving, turned.tolist()) == (1, [1])
    assert flips(vertices, triangles, offsets) == 100.0


@pytest.mark.parametrize("middle", [(0.0, 0.0), (0.02, -0.03)])
def test_a_ring_widens_across_the_gaze_wherever_its_middle_lies(middle: tuple[float, float]) -> None:
    angle = np.arange(7) * 0.5  # half a ring
    way = np.stack([np.cos(angle), np.sin(angle), np.zeros(7)], axis=1)
    rim = 0.1 * way + [*middle, -0.02]
    sunk = 0.03 * way + [0.0, 0.0, -0.04]
    assert widening(rim, sunk, np.array([0.0, 0.0, 1.0])) == pytest.approx(0.03)
    assert widening(rim, -sunk, np.array([0.0, 0.0, 1.0])) == pytest.approx(-0.03)


def test_a_rim_of_one_vertex_goes_off_the_pupils_point() -> None:
    found = widening(np.array([[0.1, 0.0, -0.01]]), np.array([[0.03, 0.0, -0.01]]), np.array([0.0, 0.0, 2.0]))
    assert found == pytest.approx(0.03)


def test_held_out_points_are_those_that_no_fap_names() -> None:
    assert "4.1" in NAMED
    assert "9.12" not in NAMED
    up = np.array([0.0, 0.1, 0.0])
    same = ({"9.12": up, "4.1": up}, {"9.12": 2 * up, "4.1": 99 * up})
    assert held_out_error([same], 1.0, 2.0) == (0.0, "9.12")
    off = ({"9.12": up, "2.12": 3 * up}, {"9.12": 1.4 * up, "2.12": 3 * up})
    assert held_out_error([off], 1.0, 1.0) == (pytest.approx(0.1), "9.12")
    assert held_out_error([({"9.12": 0 * up}, {"9.12": up})], 1.0, 1.0) == (0.0, None)


def test_a_point_is_misplaced_by_what_all_others_say() -> None:
    rng = np.random.default_rng(2)
    keys = ["3.7", "3.11", "3.8", "3.12", *(f"2.{k}" for k in range(1, 15)), *(f"9.{k}" for k in range(1, 16))]
    source = {k: rng.normal(size=3) for k in keys}
    linear = np.eye(3) + 0.2 * rng.normal(size=(3, 3))
    target = {k: linear @ p + [3.0, 2.0, 1.0] for k, p in source.items()}
    assert max(misplaced(source, target).values()) < 1e-9, "an affine change is no error"
    width = np.mean([np.linalg.norm(target[a] - target[b]) for a, b in (("3.7", "3.11"), ("3.8", "3.12"))])
    target["9.5"] = target["9.5"] + [0.0, 0.7 * width, 0.0]
    off = misplaced(source, target)
    assert max(off, key=lambda k: off[k]) == "9.5"
    assert off["9.5"] == pytest.approx(0.7)
    assert misplaced({k: source[k] for k in keys[:5]}, target) == {}
