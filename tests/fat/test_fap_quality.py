"""The measures of one FAP on motions whose answer is known, and the limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fat.fap_quality import (
    APART,
    SLACK,
    FapQuality,
    independent_motion,
    mirrored,
    parted,
    stretch,
    sunk,
)
from fba import Fapu, fap, faps

FAPU = Fapu(irisd0=0.1, es0=0.6, ens0=0.4, mns0=0.2, mw0=0.5)
GOOD = FapQuality(31, 1, "raise_l_i_eyebrow", 200, 300, None, 0.01, 33, 0.0, 0.1, 1.2, 0, 0.0, 0.0)


def test_an_edge_that_is_left_behind_stretches() -> None:
    vertices = np.array([[0.0, 0, 0], [0.1, 0, 0], [0.2, 0, 0]])
    edges = np.array([[0, 1], [1, 2]])
    offsets = np.array([[0.0, 0, 0], [0, 0, 0], [0.4, 0, 0]])
    assert stretch(vertices, edges, offsets) == pytest.approx((0.5 + SLACK) / (0.1 + SLACK))
    assert stretch(vertices, edges, np.ones((3, 3))) == pytest.approx(1.0)
    assert stretch(vertices, edges[:0], offsets) == 1.0


def test_a_shrinking_edge_is_no_tear_and_a_tiny_one_hardly_counts() -> None:
    vertices = np.array([[0.0, 0, 0], [0.1, 0, 0], [0.1001, 0, 0]])
    assert stretch(vertices, np.array([[0, 1]]), np.array([[0.09, 0, 0], [0, 0, 0], [0, 0, 0]])) == 1.0
    tiny = stretch(vertices, np.array([[1, 2]]), np.array([[0, 0, 0], [0, 0, 0], [0.001, 0, 0]]))
    assert 1.0 < tiny < 1.2


def test_copies_along_a_seam_must_stay_together() -> None:
    offsets = np.zeros((6, 3))
    offsets[[0, 3]] = 0.3
    offsets[4] = [0, 2 * APART, 0]
    offsets[5] = [0, 0.5 * APART, 0]
    assert parted(np.array([[0, 3], [1, 4], [2, 5]]), offsets) == 1
    assert parted(np.zeros((0, 2), np.int32), offsets) == 0


def test_penetration_counts_what_gets_into_the_ball() -> None:
    before = np.array([0.05, 0.0, -0.015, -0.3, 0.2, 0.2, 0.2, 0.2])
    after = np.array([-0.03, -0.019, -0.036, -0.9, 0.2, 0.2, 0.2, 0.2])
    assert np.flatnonzero(sunk(before, after)).tolist() == [0, 2]
    assert not sunk(before, before).any()
    assert not len(sunk(before[:0], after[:0]))


def test_every_mirror_is_its_own_inverse_and_reflects_the_motion() -> None:
    for f in faps()[2:]:
        other, value = mirrored(f.id, 100)
        assert mirrored(other, value) == (f.id, 100)
        if f.direction is not None:
            reflected = 100 * np.array(f.direction) * [-1, 1, 1]
            np.testing.assert_array_equal(reflected, value * np.array(fap(other).direction))
    assert mirrored(49, 40000) == (49, -40000)
    assert mirrored(47, 60000) == (47, 60000)
    assert mirrored(1, 63) == (1, 63)


def test_cross_talk_of_a_fap_with_a_direction() -> None:
    brow = 100 * FAPU.unit(fap(31).unit)
    motion = {"4.1": np.array([0.0, brow, 0]), "4.3": np.array([0.0, -0.2 * brow, 0]), "4.5": np.zeros(3)}
    share, other = independent_motion(fap(31), motion, FAPU, brow)
    assert share == pytest.approx(0.2)
    assert other == 33


def test_cross_talk_of_a_rotation_is_a_share_of_the_largest_motion() -> None:
    motion = {"6.1": np.array([0.0, 0.03, 0]), "6.3": np.array([0.0, 0.3, 0])}
    share, other = independent_motion(fap(47), motion, FAPU, 0.3)
    assert share == pytest.approx(0.1)
    assert other == 44


def test_what_carries_everything_has_no_cross_talk() -> None:
    motion = {"4.1": np.ones(3)}
    assert independent_motion(fap(49), motion, FAPU, 1.0) == (None, None)
    assert independent_motion(fap(1), motion, FAPU, 1.0) == (None, None)
    assert independent_motion(fap(31), {"4.1": np.zeros(3)}, FAPU, 0.0) == (None, None)


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"cross_talk": 0.06}, "fap-cross-talk"),
        ({"flips": 0.2}, "fap-flips"),
        ({"flips_at_limit": 0.6}, "fap-flips-at-limit"),
        ({"stretch": 5.5}, "fap-tear"),
        ({"parted": 1}, "fap-seam"),
        ({"through": 1}, "fap-lining"),
        ({"penetration": 0.3}, "fap-penetration"),
    ],
)
def test_each_limit_has_its_own_finding(change: dict[str, float], code: str) -> None:
    assert GOOD.passed
    assert GOOD.failures() == []
    bad = replace(GOOD, **change)
    assert not bad.passed
    assert bad.severity > 1.0 > GOOD.severity
    (finding,) = bad.failures()
    assert (finding.severity, finding.code, finding.where) == ("error", code, "raise_l_i_eyebrow at +200")
    assert bad.failures(bad) == []
    (told,) = bad.failures(GOOD)
    assert (told.severity, told.code) == ("warning", code)


def test_a_clone_that_is_hardly_worse_than_its_source_is_not_told() -> None:
    source = replace(GOOD, cross_talk=0.30)
    assert replace(GOOD, cross_talk=0.304).failures(source) == []
    assert [f.code for f in replace(GOOD, cross_talk=0.31).failures(source)] == ["fap-cross-talk"]


def test_a_viseme_may_turn_a_few_triangles_over_but_not_many() -> None:
    viseme = replace(GOOD, fap_id=1, name="viseme_PP", value=63, limit=63, flips=0.4, flips_at_limit=0.4)
    assert viseme.passed
    assert [f.code for f in replace(viseme, flips=0.6, flips_at_limit=0.6).failures()] == ["fap-flips-at-limit"]


def test_sides_that_differ_are_told_but_pass() -> None:
    lopsided = replace(GOOD, asymmetry=0.2)
    assert lopsided.passed
    assert [f.code for f in lopsided.remarks()] == ["fap-asymmetry"]
    assert not lopsided.remarks(lopsided), "the source has it, too"
    assert GOOD.remarks() == []
    assert replace(lopsided, fap_id=2).remarks() == []


def test_rows_are_plain_data() -> None:
    data = GOOD.to_dict()
    assert data["cross_talk"] == 0.01
    assert data["own_error"] is None
    assert data["passed"] is True
