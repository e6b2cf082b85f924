"""Rules for FAPs that fight: what meets, what is shared, and what must never change."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fat import AnimatableFace, FaceDefMesh, FaceDefTable, FaceDefTables, Player
from fat.combine import RULES, Combination
from fat.quality import flips
from fba import FaceScene, FapStream, Fapu, FeaturePoint, FeaturePoints, PolyMesh, Shape, fap
from fba.errors import FapStreamError
from formats import read_face

FAPU = Fapu(irisd0=0.1, es0=0.6, ens0=0.45, mns0=0.2, mw0=0.5)
GAP = 0.02
PLACES = {
    "2.1": (0.0, -0.6),
    "2.2": (0.0, GAP / 2),
    "2.3": (0.0, -GAP / 2),
    "2.4": (0.24, 0.0),
    "2.6": (0.1, GAP / 2),
    "2.8": (0.1, -GAP / 2),
    "3.1": (0.3, 0.55),
    "3.3": (0.3, 0.45),
    "4.1": (0.15, 0.8),
    "4.2": (-0.15, 0.8),
    "8.1": (0.0, 0.08),
    "8.2": (0.0, -0.08),
    "8.3": (0.25, 0.0),
}
NUMBER = {key: k for k, key in enumerate(PLACES)}
HAIR = 0.02 * (PLACES["3.1"][1] - PLACES["3.3"][1])
"""By how much closed lids overlap, so that their curved rims leave no slit."""

JAW_OPENS = 0.9
"""Share of the chin's way that the lower lip goes along in the small face."""


def one_point(number: int, borders: tuple[int, ...] = (-600, 0, 600), **more: float) -> FaceDefTable:
    """A table that moves the FAP's own point by its amount, and other points by shares of it."""
    shares = {fap(number).feature_points[0]: 1.0, **{k.replace("p", "").replace("_", "."): v for k, v in more.items()}}
    slopes = np.zeros((len(shares), len(borders) - 1, 3))
    for row, share in enumerate(shares.values()):
        for interval, border in enumerate(borders[1:]):
            slopes[row, interval] = np.array(fap(number).direction) * share * (1 if border > 0 else -1)
    return FaceDefTable(number, 1, (FaceDefMesh("skin", borders, [NUMBER[k] for k in shares], slopes),))


def small_face(tie: float = 1.0, contour_tie: float = 0.0) -> AnimatableFace:
    """A mouth and an eye of single points; corners tied by `tie`, contours by `contour_tie`."""
    vertices = np.array([(x, y, 0.0) for x, y in PLACES.values()])
    mesh = PolyMesh.from_faces(vertices, [[0, 1, 2]])
    points = FeaturePoints({k: FeaturePoint("skin", (n,), (1.0,)) for k, n in NUMBER.items()})
    carried = {"p2_3": JAW_OPENS, "p8_2": JAW_OPENS, "p2_8": JAW_OPENS}
    squint = FaceDefMesh("skin", (0, 63), [NUMBER["3.3"]], np.array([[[0.0, 0.04 / 63, 0.0]]]))
    tables = (
        one_point(3, (0, 1080), **carried),
        one_point(4, p8_1=contour_tie),
        one_point(51, p2_2=contour_tie),
        one_point(5, (-1000, 0, 200, 600)),
        one_point(52),
        one_point(8),
        one_point(10),
        one_point(6, p8_3=tie),
        one_point(53, p2_4=tie),
        one_point(19, (-400, 0, 256, 512, 1024)),
        one_point(21, (0, 300, 600)),
        one_point(37),
        one_point(38),
        FaceDefTable(2, 1, (squint,)),
    )
    return AnimatableFace(FaceScene((Shape("skin", mesh),)), points, FaceDefTables(tables), FAPU)


def moved(face: AnimatableFace, faps: dict[int, float], rules: tuple[str, ...] | None = None, **high: tuple) -> dict:
    """Feature point -> (x, y, z) at FAP values."""
    world = Player(face, rules=rules).pose(faps, **high).world_shapes()
    return face.feature_points.positions(face.scene, world)


def amount(face: AnimatableFace, faps: dict[int, float], number: int, rules: tuple[str, ...] | None = None) -> float:
    """How far a FAP's own point goes along its direction, in FAP units."""
    key = fap(number).feature_points[0]
    way = moved(face, faps, rules)[key] - face.feature_points.positions(face.scene)[key]
    return float(way @ fap(number).direction) / face.fapu.unit(fap(number).unit)


@cache
def source() -> AnimatableFace:
    return read_face("default")


def test_tied_corners_do_not_double() -> None:
    face = small_face()
    assert amount(face, {6: 300, 53: 300}, 6, ()) == pytest.approx(600)
    for values in ({6: 300, 53: 300}, {6: 300, 53: 100}, {6: 50, 53: 300}, {6: -200, 53: -300}):
        larger = max(values.values(), key=abs)
        assert amount(face, values, 6) == pytest.approx(larger)
        assert amount(face, values, 53) == pytest.approx(larger)


def test_opposite_signs_of_tied_corners_add() -> None:
    assert amount(small_face(), {6: 300, 53: -100}, 6) == pytest.approx(200)


def test_half_tied_corners_keep_the_larger_exact() -> None:
    face = small_face(tie=0.5)
    assert amount(face, {6: 300, 53: 300}, 6) == pytest.approx(300)
    assert amount(face, {6: 300, 53: 200}, 6) == pytest.approx(300)
    assert amount(face, {6: 100, 53: 200}, 53) == pytest.approx(200)


@pytest.mark.parametrize("tie", [0.0, 0.04])
def test_corners_that_are_not_tied_are_left_alone(tie: float) -> None:
    face = small_face(tie)
    values = {6: 300, 53: 200}
    np.testing.assert_array_equal(Player(face).pose(values).world(), Player(face, rules=()).pose(values).world())


def test_a_tie_of_one_direction_only_is_none() -> None:
    face = small_face()
    lone = [one_point(53) if t.fap_id == 53 else t for t in face.tables]
    half = AnimatableFace(face.scene, face.feature_points, FaceDefTables(tuple(lone)), FAPU)
    assert amount(half, {6: 300, 53: 200}, 53) == pytest.approx(500)


def test_lids_meet_and_do_not_cross() -> None:
    face = small_face()
    for values in ({19: 1024, 21: 500}, {19: 700, 21: 500}, {19: 1024, 21: 1024}):
        crossed = moved(face, values, ())
        assert crossed["3.1"][1] < crossed["3.3"][1] - 0.01
        met = moved(face, values)
        assert met["3.3"][1] - met["3.1"][1] == pytest.approx(HAIR, abs=1e-8)


def test_lids_that_do_not_meet_are_left_alone() -> None:
    face = small_face()
    for values in ({19: 400, 21: 500}, {19: 1024, 21: -300}, {19: -300, 21: 600}):
        assert amount(face, values, 19) == pytest.approx(values[19])
        assert amount(face, values, 21) == pytest.approx(values[21])


def test_lids_leave_room_for_an_expression() -> None:
    squinted = moved(small_face(), {19: 1024}, expression=(1, 63, 0, 0))
    assert squinted["3.3"][1] - squinted["3.1"][1] == pytest.approx(HAIR, abs=1e-8)
    assert squinted["3.3"][1] == pytest.approx(PLACES["3.3"][1] + 0.04 * 1.0, abs=1e-8)


def test_brows_squeeze_the_skin_between_them_to_half_its_width() -> None:
    face = small_face()
    meet = 0.5 * 0.3 * 1024 / FAPU.es0
    assert amount(face, {37: 100, 38: 100}, 37) == pytest.approx(100)
    squeezed = moved(face, {37: 400, 38: 400})
    assert squeezed["4.1"][0] == pytest.approx(0.075)
    assert squeezed["4.2"][0] == pytest.approx(-0.075)
    assert amount(face, {37: meet + 50, 38: 25}, 37) == pytest.approx((meet + 25) * (meet + 50) / (meet + 75))
    assert amount(face, {37: -400, 38: -400}, 38) == pytest.approx(-400)


def test_lips_meet_in_contact() -> None:
    face = small_face()
    crossed = moved(face, {4: 300, 5: 300}, ())
    assert crossed["2.2"][1] < crossed["2.3"][1] - 0.5 * GAP
    met = moved(face, {4: 300, 5: 300})
    assert met["2.2"][1] == pytest.approx(met["2.3"][1], abs=1e-8)


def test_an_open_jaw_makes_room_for_the_lips() -> None:
    face = small_face()
    opened = 0.9 * 200 + GAP * 1024 / FAPU.mns0
    values = {3: 200, 4: 100, 5: 150}
    assert opened > 250
    assert amount(face, values, 4) == pytest.approx(100)
    met = moved(face, {3: 200, 4: 200, 5: 300})
    assert met["2.2"][1] == pytest.approx(met["2.3"][1], abs=1e-8)
    assert amount(face, {3: 200, 4: 200, 5: 300}, 4) == pytest.approx(200 * opened / 500)


def test_what_one_lip_does_beyond_the_other_stays() -> None:
    face = small_face()
    alone, both = moved(face, {4: 500}), moved(face, {4: 500, 5: 100})
    assert alone["2.3"][1] - alone["2.2"][1] == pytest.approx(500 * FAPU.mns0 / 1024 - GAP)
    assert both["2.3"][1] - both["2.2"][1] == pytest.approx(400 * FAPU.mns0 / 1024 - GAP)


def test_the_outer_contour_goes_along_with_shared_lips() -> None:
    face = small_face()
    both = {4: 400, 51: 400, 5: 400, 52: 400}
    assert moved(face, both, ("lids",))["8.1"][1] < moved(face, both, ("lids",))["2.3"][1]
    found = moved(face, both)
    assert found["8.1"][1] > found["2.2"][1] >= found["2.3"][1] - 1e-8
    assert found["2.3"][1] > found["8.2"][1]
    assert found["8.1"][1] - found["2.2"][1] == pytest.approx(PLACES["8.1"][1] - PLACES["2.2"][1])
    assert amount(face, {4: 400, 51: -100, 5: 400}, 51) == pytest.approx(-100)


def test_tied_contours_do_not_double_and_still_meet() -> None:
    face = small_face(contour_tie=1.0)
    assert amount(face, {4: -300, 51: -300}, 4) == pytest.approx(-300)
    assert amount(face, {4: 300, 51: 300}, 4) == pytest.approx(300)


def test_rules_are_chosen_by_name() -> None:
    face = small_face()
    values = {6: 300, 53: 300, 19: 1024, 21: 500}
    only = moved(face, values, ("corners",))
    assert only["3.1"][1] < only["3.3"][1]
    assert only["2.4"][0] == pytest.approx(moved(face, {6: 300})["2.4"][0])
    assert Combination(face, None).rules == RULES
    with pytest.raises(FapStreamError, match="no combination rule 'teeth'; the rules are corners"):
        Player(face, rules=("teeth",))


def test_frames_and_poses_are_combined_alike() -> None:
    face = small_face()
    values = {4: 300, 5: 300, 6: 300, 53: 200, 19: 1024, 21: 500}
    stream = FapStream.build(25, 3, {k: np.array([0, v, v // 2]) for k, v in values.items()})
    player = Player(face)
    (batch,) = player.world_frames(stream)
    np.testing.assert_array_equal(batch[0], face.scene.world_neutral())
    np.testing.assert_allclose(batch[1], player.pose(values).world(), atol=1e-12)
    np.testing.assert_allclose(batch[2], player.pose({k: v // 2 for k, v in values.items()}).world(), atol=1e-12)


COMBINED = (3, 4, 5, 6, 8, 10, 19, 21, 37, 38, 51, 52, 53)


@settings(max_examples=150, deadline=None)
@given(
    st.lists(st.integers(-600, 600), min_size=len(COMBINED), max_size=len(COMBINED)),
    st.sampled_from(COMBINED),
    st.sampled_from([0.0, 0.4, 1.0]),
)
def test_a_small_change_of_a_value_is_a_small_change_of_the_face(given: list[int], which: int, tie: float) -> None:
    face = small_face(tie, tie)
    values = dict(zip(COMBINED, given, strict=True))
    near = {**values, which: values[which] + 0.01}
    step = np.abs(Player(face).pose(near).world() - Player(face).pose(values).world()).max()
    # No rule answers to a change of a value with more than a few times as much.
    assert step <= 4 * 0.01 * FAPU.mw0 / 1024


def test_a_fap_alone_and_neutral_are_bit_identical() -> None:
    face = source()
    combination = Combination(face)
    ends = [(k, v) for k, t in enumerate(face.tables) if t.fap_id > 2 for v in (*fap(t.fap_id).i_range, -77, 77, 300)]
    values = np.zeros((len(ends) + 1, len(face.tables)))
    for row, (column, value) in enumerate(ends):
        values[row, column] = value
    np.testing.assert_array_equal(combination(values), values)
    np.testing.assert_array_equal(Player(face).pose().world(), face.scene.world_neutral())


def test_feature_points_of_another_mesh_have_no_rules() -> None:
    face = small_face()
    foreign = FeaturePoints({k: FeaturePoint("skin", (999,), (1.0,)) for k in ("2.2", "8.3", "3.1", "4.1")})
    other = replace(face, feature_points=foreign)
    values = {6: 300, 53: 300, 19: 1024, 21: 500}
    np.testing.assert_array_equal(Player(other).pose(values).world(), Player(face, rules=()).pose(values).world())


def test_the_given_values_are_not_written_to() -> None:
    face = source()
    values = np.full((2, len(face.tables)), 300.0)
    values.flags.writeable = False
    assert not np.array_equal(Combination(face)(values), values)


@pytest.mark.parametrize("pair", [(6, 53), (12, 59), (7, 54), (13, 60)])
def test_the_sources_corners_driven_twice_look_driven_once(pair: tuple[int, int]) -> None:
    face = source()
    inner, outer = pair
    once, twice = amount(face, {inner: 300}, inner), amount(face, {inner: 300, outer: 300}, inner)
    assert once == pytest.approx(300, rel=0.005)
    assert twice == pytest.approx(300, rel=0.02)


def raised_mouth() -> dict[int, float]:
    """Figure 13 of Facial Motion Cloning, on both sides."""
    lips = dict.fromkeys((4, 5, 8, 9, 10, 11, 51, 52, 55, 56, 57, 58), -400)
    return {3: 800, 6: 150, 7: 150, 53: 150, 54: 150, **lips, **dict.fromkeys(range(31, 37), 300)}


def test_the_published_combination_tears_no_lip() -> None:
    face = source()
    world = Player(face).pose(raised_mouth()).world_shapes()
    at = face.feature_points.positions(face.scene, world)
    for upper_outer, upper, lower, lower_outer in (
        ("8.1", "2.2", "2.3", "8.2"),
        ("8.5", "2.6", "2.8", "8.7"),
        ("8.6", "2.7", "2.9", "8.8"),
    ):
        assert at[upper_outer][1] > at[upper][1] > at[lower][1] > at[lower_outer][1]
    assert at["8.3"][0] >= at["2.4"][0] > at["2.6"][0] > at["2.2"][0] > at["2.7"][0] > at["2.5"][0] >= at["8.4"][0]
    skin = face.scene.shape("skin").mesh
    offsets = world["skin"] - face.scene.world_vertices("skin")
    assert flips(face.scene.world_vertices("skin"), skin.triangles, offsets) <= 0.5


def test_all_brows_together_fold_no_more_than_alone() -> None:
    face = source()
    skin = face.scene.shape("skin").mesh
    rest = face.scene.world_vertices("skin")
    folded = {}
    for name, faps in (("left", {37: 300}), ("both", {37: 300, 38: 300}), ("all", dict.fromkeys(range(31, 39), 300))):
        offsets = Player(face).pose(faps).world_shapes()["skin"] - rest
        folded[name] = flips(rest, skin.triangles, offsets)
    assert folded["both"] <= min(0.1, folded["left"])
    assert folded["all"] <= 0.5


def test_all_lips_pressed_together_on_the_source_meet() -> None:
    face = source()
    pressed = dict.fromkeys((4, 8, 9, 5, 10, 11, 51, 55, 56, 52, 57, 58), 300)
    at, crossed = moved(face, pressed), moved(face, pressed, ())
    for upper, lower in (("2.2", "2.3"), ("2.6", "2.8"), ("2.7", "2.9")):
        assert crossed[lower][1] - crossed[upper][1] > 0.5 * face.fapu.mns0
        assert abs(at[lower][1] - at[upper][1]) < 0.02 * face.fapu.mns0
