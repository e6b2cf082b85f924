"""Expressions carried between drawn faces whose answers are known."""

from __future__ import annotations

import numpy as np
import pytest
from photo_faces import EYES, UNIT, picture, pixels, points, wrinkle

from cloning.image import METHODS, Analogy, AnalogyResult, Method, Picture, parts
from cloning.image import solve as solving
from cloning.image.color import to_yuv
from cloning.image.mask import BORDER, REACH, contour, depth_within
from fba.errors import LandmarkError

OPEN = {
    "2.3": (0.0, 0.25), "2.8": (0.0, 0.2), "2.9": (0.0, 0.2), "8.2": (0.0, 0.25), "8.7": (0.0, 0.2), "8.8": (0.0, 0.2),
    "2.1": (0.0, 0.2),
}  # fmt: skip


def transfer(
    source: Picture, expression: Picture, target: Picture, method: Method = "vtc", teeth: bool = True
) -> AnalogyResult:
    return Analogy(source, target, [expression.points], method, teeth).apply(expression)


def forehead(result: AnalogyResult | Picture) -> np.ndarray:
    x, y = int(EYES[0]), int(EYES[1] - 0.6 * UNIT)
    return to_yuv(result.rgb)[0][y - 5 : y + 6, x - 8 : x + 9]


@pytest.mark.parametrize("method", METHODS)
def test_no_expression_changes_nothing(method: Method) -> None:
    source, target = picture(pixels()), picture(pixels(0.8, seed=5))
    assert (transfer(source, source, target, method).rgb == target.rgb).all()


def test_a_crease_is_carried_over_and_the_surroundings_are_untouched() -> None:
    source, target = picture(pixels()), picture(pixels(0.9, seed=5))
    truth = picture(wrinkle(pixels(0.9, seed=5)))
    result = transfer(source, picture(wrinkle(pixels())), target)
    before = np.abs(forehead(target) - forehead(truth)).mean()
    assert np.abs(forehead(result) - forehead(truth)).mean() < 0.15 * before
    assert (result.rgb[~result.changed] == target.rgb[~result.changed]).all()
    assert 0.2 < result.changed.mean() < 0.8
    corner = result.changed[:20, :10]
    assert not corner.any()


@pytest.mark.parametrize("method", METHODS)
def test_a_face_given_its_own_expression_shows_it(method: Method) -> None:
    source = picture(pixels())
    moves = {"4.1": (0.0, -0.06), "4.2": (0.0, -0.06), "8.3": (0.05, -0.04), "8.4": (-0.05, -0.04)}
    expression = picture(wrinkle(pixels(seed=0)), moves)
    result = transfer(source, expression, source, method)
    assert np.abs(forehead(result) - forehead(expression)).max() < (1.6 if method == "vtc" else 14.0)


def test_large_pictures_come_out_as_small_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    source, target, expression = picture(pixels()), picture(pixels(0.9, seed=5)), picture(wrinkle(pixels()))
    direct = transfer(source, expression, target)
    monkeypatch.setattr(solving, "DIRECT", 10)
    iterated = transfer(source, expression, target)
    assert direct.steps == 0 < iterated.steps
    assert np.abs(direct.luminance - iterated.luminance).max() < 0.2


def test_pictures_come_out_the_same_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    source, target, expression = picture(pixels()), picture(pixels(0.9, seed=5)), picture(wrinkle(pixels()), OPEN)
    whole = transfer(source, expression, target)
    monkeypatch.setattr(parts, "LONG", 1000)
    found = transfer(source, expression, target)
    assert (found.changed == whole.changed).all()
    assert found.luminance == pytest.approx(whole.luminance, abs=1e-3)


def test_one_preparation_serves_many_expressions() -> None:
    source, target = picture(pixels()), picture(pixels(0.9, seed=5))
    first, second = picture(wrinkle(pixels())), picture(wrinkle(pixels(), 25.0), OPEN)
    analogy = Analogy(source, target, [first.points, second.points])
    alone = transfer(source, first, target)
    analogy.apply(second)
    found = analogy.apply(first)
    assert np.abs(forehead(found) - forehead(alone)).max() <= 2.0
    with pytest.raises(LandmarkError, match="missing"):
        analogy.apply(Picture(first.rgb, {"8.1": (1.0, 1.0)}))


def test_what_opens_shows_the_source_unless_it_shall_not() -> None:
    source, target = picture(pixels()), picture(pixels(0.9, seed=5))
    shown = pixels()
    y, x = int(EYES[1] + 1.22 * UNIT), int(EYES[0])
    shown[y - 3 : y + 4, x - 8 : x + 9] = (60.0, 220.0, 90.0)
    expression = picture(shown, OPEN)
    with_teeth, without = (transfer(source, expression, target, teeth=teeth) for teeth in (True, False))
    assert with_teeth.teeth
    assert not without.teeth
    assert with_teeth.rgb[y, x] == pytest.approx((60, 220, 90), abs=6)
    assert np.abs(without.rgb[y, x].astype(float) - (60, 220, 90)).max() > 40


def _chin_over_stripes() -> tuple[np.ndarray, int]:
    """A face whose chin has a dark edge, before stripes and a plain neck; and the row of the edge in the middle."""
    rgb = pixels()
    whole = (slice(0, rgb.shape[0]), slice(0, rgb.shape[1]))
    depth = depth_within(contour(points()), whole)
    y, x = np.indices(depth.shape)
    rgb[depth < 0] = 150.0
    rgb[(depth < 0) & ((x // 2 % 2 == 0) & (abs(x - EYES[0]) > 0.5 * UNIT))] = 20.0
    rgb[(abs(depth) <= 1.0) & (y > EYES[1])] = 10.0
    return rgb, round(points()["2.1"][1])


@pytest.mark.parametrize("drop", [0.2, -0.12])
def test_a_jaw_moves_over_the_neck_and_nothing_else_does(drop: float) -> None:
    """Stripes around the face stay as they are, and a risen chin leaves no edge behind."""
    rgb, edge = _chin_over_stripes()
    source, target = picture(pixels()), picture(rgb)
    jaw = dict.fromkeys(("2.1", "2.11", "2.12"), (0.0, drop))
    result = transfer(source, picture(pixels(), jaw), target)
    still, moved = (contour(points(moves)) for moves in ({}, jaw))
    reach = (REACH + BORDER) * UNIT
    whole = (slice(0, rgb.shape[0]), slice(0, rgb.shape[1]))
    outside = np.maximum(depth_within(still, whole), depth_within(moved, whole)) < -reach
    assert 0.3 < outside.mean() < 0.8
    assert (result.rgb[outside] == target.rgb[outside]).all()
    assert not result.changed[outside].any()
    column = to_yuv(result.rgb)[0][:, int(EYES[0])]
    dark = np.flatnonzero(column[edge - 12 : edge + 12] < 60.0) + edge - 12
    assert dark.size
    assert dark.mean() == pytest.approx(edge + drop * UNIT, abs=1.5)
    assert np.ptp(dark) <= 4


def test_grey_targets_stay_grey() -> None:
    grey = np.repeat(pixels(0.9, seed=5)[..., :1], 3, axis=2)
    shown = pixels()
    result = transfer(picture(pixels()), picture(shown, OPEN), picture(grey))
    assert result.teeth
    assert np.ptp(result.rgb.astype(int), axis=2).max() == 0
