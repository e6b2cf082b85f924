"""Points, alignment, triangles, masks, colours and ratios of photographs."""

from __future__ import annotations

import numpy as np
import pytest
from photo_faces import EYES, SIZE, UNIT, layout, points
from scipy import ndimage
from scipy.spatial import Delaunay

from cloning.image.align import fit_similarity_2d
from cloning.image.color import RGB_FROM_YUV, YUV_FROM_RGB, is_grey, to_rgb, to_yuv
from cloning.image.eri import correlation, ratio_image
from cloning.image.mask import BORDER, REACH, contour, depth_within, face_mask, mouth_opening, region_share, smooth
from cloning.image.points import REQUIRED, face_points, moved_points, refined, to_array, turned
from cloning.image.sampler import Sampler
from cloning.image.warp import covered, label_pixels, mapped, ring_around, triangulate
from cloning.interpolate import TriangleMesh2D
from fba.errors import LandmarkError

NAMES = list(layout())
WHOLE = (slice(0, SIZE[1]), slice(0, SIZE[0]))


def test_every_colour_survives_yuv() -> None:
    rgb = np.random.default_rng(0).integers(0, 256, (64, 64, 3)).astype(np.uint8)
    assert (to_rgb(to_yuv(rgb)) == rgb).all()
    assert pytest.approx(np.eye(3)) == YUV_FROM_RGB @ RGB_FROM_YUV
    assert YUV_FROM_RGB[1:].sum(axis=1) == pytest.approx(0.0)
    assert not is_grey(rgb)
    assert is_grey(np.repeat(rgb[..., :1], 3, axis=2))


def test_alignment_finds_turn_scale_and_shift_but_no_mirror() -> None:
    places = np.random.default_rng(1).uniform(0, 100, (6, 2))
    turn = 1.7 * np.array([[np.cos(0.4), -np.sin(0.4)], [np.sin(0.4), np.cos(0.4)]])
    found = fit_similarity_2d(places, places @ turn.T + [3.0, -8.0])
    assert found.apply(places) == pytest.approx(places @ turn.T + [3.0, -8.0])
    assert found.scale == pytest.approx(1.7)
    assert found.inverse().apply(found.apply(places)) == pytest.approx(places)
    mirrored = fit_similarity_2d(places, places * [-1.0, 1.0])
    assert np.abs(mirrored.apply(places) - places * [-1.0, 1.0]).max() > 10.0


def test_missing_points_are_named() -> None:
    bare = {n: p for n, p in points().items() if n not in ("8.3", "2.1")}
    with pytest.raises(LandmarkError, match=r"points 8\.3, 2\.1 are missing"):
        face_points(points(), bare)
    with pytest.raises(LandmarkError, match="pixels apart"):
        face_points({name: (x / 10, y / 10) for name, (x, y) in points().items()})


def test_points_of_the_same_face_move_as_they_did() -> None:
    smile = points({"8.3": (0.1, -0.1), "8.4": (-0.1, -0.1), "4.3": (0.0, -0.1), "11.1": (0.3, 0.3)})
    found = moved_points(points(), smile, points(), NAMES)
    still = {"11.1": points()["11.1"]}
    assert to_array(found, NAMES) == pytest.approx(to_array(smile | still, NAMES))


def test_alignment_does_not_change_the_motion() -> None:
    """The source's pictures may be turned, larger and elsewhere, each in its own way."""
    smile = points({"8.3": (0.1, -0.1), "8.4": (-0.1, -0.1), "2.1": (0.0, 0.2)})
    other = {name: (2.0 * x + 300.0, 2.0 * y + 10.0) for name, (x, y) in smile.items()}
    turned_source = {name: (-1.5 * y + 400.0, 1.5 * x) for name, (x, y) in points().items()}
    found = moved_points(turned_source, other, points(), NAMES)
    assert to_array(found, NAMES) == pytest.approx(to_array(smile, NAMES))
    assert turned(turned_source, other, NAMES) == pytest.approx(0.0, abs=1e-9)


def test_a_blink_closes_a_larger_eye() -> None:
    shut = {n: (0.0, d) for n, d in (("3.1", 0.15), ("3.2", 0.15), ("3.3", -0.05), ("3.4", -0.05))}
    target = points({"3.1": (0.0, -0.05), "3.2": (0.0, -0.05), "3.3": (0.0, 0.05), "3.4": (0.0, 0.05)})
    found = moved_points(points(), points(shut), target, NAMES)
    for upper, lower in (("3.1", "3.3"), ("3.2", "3.4")):
        assert found[upper][1] == pytest.approx(found[lower][1], abs=0.02 * UNIT)


def test_labels_are_those_of_exact_location() -> None:
    moved = refined(points({"2.3": (0.0, 0.2), "8.2": (0.0, 0.2), "2.1": (0.0, 0.15)}))
    mesh = triangulate(moved, refined(points()), SIZE)
    labels = label_pixels(mesh, WHOLE)
    pixels = covered(labels, np.ones(labels.shape, bool), WHOLE)
    at = np.stack([pixels.x, pixels.y], axis=1)
    exact = TriangleMesh2D(mesh.places, mesh.triangles).locate(at)
    assert exact.inside.all()
    goals = np.concatenate([to_array(refined(points()), mesh.names), mesh.ring])
    places = mapped(mesh.affine(goals), pixels)
    wanted = np.einsum("nk,nkd->dn", exact.weights, goals[mesh.triangles[exact.triangles]])
    agreed = np.abs(places - wanted).max(axis=0) < 1e-6
    # Only where triangles of the lips overlap may another one win.
    assert agreed.mean() > 0.999
    assert np.abs(places - wanted).max() < 1.0


def test_the_ring_surrounds_the_face_and_stays_in_the_picture() -> None:
    face = to_array(points(), NAMES)
    ring = ring_around(face, SIZE)
    assert (ring >= 0).all()
    assert (ring <= np.array(SIZE) - 1).all()
    assert (ring.min(axis=0) <= face.min(axis=0)).all()
    assert (ring.max(axis=0) >= face.max(axis=0)).all()


def test_brows_do_not_pull_at_the_hair() -> None:
    sides = {"temple left": (1.05, -0.45), "outline left": (1.15, 0.2), "4.5": (0.88, -0.5), "11.3": (0.75, -0.95)}
    right = {"temple left": "temple right", "outline left": "outline right", "4.5": "4.6", "11.3": "11.2"}
    face = points() | {n: (EYES[0] + UNIT * x, EYES[1] + UNIT * y) for n, (x, y) in sides.items()}
    face |= {right[n]: (EYES[0] - UNIT * x, EYES[1] + UNIT * y) for n, (x, y) in sides.items()}
    face = {n: p for n, p in face.items() if n not in ("10.9", "10.10")}
    raised = face | {n: (face[n][0], face[n][1] - 0.05 * UNIT) for n in ("4.5", "4.6")}
    mesh = triangulate(refined(raised), refined(face), SIZE)
    brows = [i for i, name in enumerate(mesh.names) if name in ("4.5", "4.6")]
    ring = np.arange(len(mesh.names), len(mesh.places))
    touching = np.isin(mesh.triangles, brows).any(axis=1)
    assert touching.any()
    assert not np.isin(mesh.triangles[touching], ring).any()


def test_the_mask_is_soft_and_ends_inside_the_face() -> None:
    mask = face_mask(points(), WHOLE)
    x, y = np.rint(points()["9.12"]).astype(int)
    assert mask[y, x] == 1.0
    for name in ("2.1", "11.1", "10.9"):
        x, y = np.rint(points()[name]).astype(int)
        assert mask[y, x] == 0.0
    assert np.abs(np.diff(mask, axis=0)).max() < 0.4
    assert ((mask > 0) & (mask < 1)).any()


def test_how_far_a_mouth_is_open() -> None:
    assert mouth_opening(points()) == pytest.approx(0.0)
    assert mouth_opening(points({"2.3": (0.0, 0.2)})) == pytest.approx(0.2 / 0.8)
    assert mouth_opening(points({"2.3": (0.0, -0.1)})) == 0.0


def test_a_shrunk_picture_does_not_alias() -> None:
    stripes = np.tile([0.0, 200.0], (40, 20))
    middle = np.array([[10.0, 10.5, 11.0], [20.0, 20.0, 20.0]])
    assert np.ptp(Sampler(stripes).at(middle)) > 150.0
    assert Sampler(stripes, shrink=6.0).at(middle) == pytest.approx(100.0, abs=1.0)


@pytest.mark.parametrize("order", [1, 3])
def test_pictures_are_read_as_scipy_reads_them(order: int) -> None:
    """Within, on whole pixels, on the last row and column, and beyond the border."""
    rng = np.random.default_rng(11)
    plane = (255.0 * rng.random((2, 40, 31))).astype(np.float32)
    places = np.concatenate([rng.uniform(-6.0, 46.0, (2, 20000)), rng.integers(-2, 42, (2, 200))], axis=1)
    for found, one in zip(Sampler(plane, order).at(places), plane, strict=True):
        ready = ndimage.spline_filter(one, order, mode="nearest") if order > 1 else one
        wanted = ndimage.map_coordinates(ready, places[::-1], order=order, mode="nearest", prefilter=False)
        assert found == pytest.approx(wanted, abs=2e-4)


def test_ratio_images() -> None:
    rng = np.random.default_rng(3)
    face = 80.0 + 20.0 * rng.random((50, 60))
    assert ratio_image(face, face, 30.0) == pytest.approx(1.0)
    assert correlation(face, face, 3.0) == pytest.approx(1.0)
    other = 80.0 + 20.0 * rng.random((50, 60))
    assert correlation(face, other, 3.0).mean() < 0.5
    raw = (other + 4.0) / (face + 4.0)
    mixed = 0.8 * face + 0.2 * other
    smoothed = np.std(ratio_image(face, mixed, 50.0)) / np.std((mixed + 4.0) / (face + 4.0))
    assert smoothed < 0.5 < np.std(ratio_image(face, other, 50.0)) / np.std(raw)


def test_the_region_of_the_face_covers_its_points_and_fades_around_them() -> None:
    corners = contour(points())
    share = region_share(points(), UNIT, WHOLE)
    depth = depth_within(corners, WHOLE)
    assert share == pytest.approx(smooth((depth / UNIT + REACH + BORDER) / BORDER), abs=1e-5)
    for x, y in points().values():
        assert share[round(y), round(x)] == 1.0
    within = TriangleMesh2D(corners, Delaunay(corners).simplices)
    rows, columns = np.indices(SIZE[::-1]).reshape(2, -1)
    inside = within.locate(np.stack([columns, rows], axis=1).astype(float)).inside.reshape(SIZE[::-1])
    assert (share[inside] == 1.0).all()
    assert (share[ndimage.distance_transform_edt(~inside) > 1.6 * (REACH + BORDER) * UNIT] == 0.0).all()
    soft = (share > 0) & (share < 1)
    assert soft.any()
    assert not (soft & inside).any()


def test_a_contour_without_points_is_that_of_the_mean_face() -> None:
    bare = {name: points()[name] for name in REQUIRED}
    full, guessed = (region_share(places, UNIT, WHOLE) for places in (points(), bare))
    both = ((full > 0.5) & (guessed > 0.5)).sum() / ((full > 0.5) | (guessed > 0.5)).sum()
    assert both > 0.75
