"""Every fault is seen by its own measure, and by no unrelated one."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.measures import FAULTS, Bench, Fault, bench
from studio.measures import BY_CODE, MEASURES
from studio.verdicts import Place, Reading, judge
from studio.worst_places import CELL, worst_places


@pytest.fixture(scope="module")
def good() -> Bench:
    return bench()


@pytest.mark.parametrize("fault", FAULTS, ids=lambda f: f.name.replace(" ", "-"))
def test_a_fault_fails_its_measure_and_no_unrelated_one(good: Bench, fault: Fault) -> None:
    failed = {code for code, v in good.check(fault.spoil(good)).items() if v.failed}
    assert failed - (set(fault.kin) - {fault.its}) == ({fault.its} if fault.its else set())


def test_the_worst_place_is_drawn_for_what_fails(good: Bench) -> None:
    by_name = {f.name: f for f in FAULTS}
    face = by_name["lid left open by a fifth"].spoil(good)
    found = good.check(face)
    few = [v for v in found.values() if v.code in ("lid-gap", "still")]
    assert [v.word for v in few] == ["good", "FAIL"]
    picture = worst_places(face, few, good.face)
    assert picture.width > 2 * CELL[0]
    assert CELL[1] < picture.height < 2 * CELL[1], "one row, for the measure that fails"
    finding = found["lid-gap"].finding()
    assert (finding.severity, finding.code, finding.where) == ("error", "lid-gap", "at point 3.1")
    assert "eyes stay open after a blink: 0.2 IRISD" in finding.message


def test_limits_are_read_beside_the_source() -> None:
    cases = {
        ("still", 0.0015, 0.0): "fair",
        ("still", 0.003, None): "FAIL",
        ("still", 0.003, 0.0029): "good",
        ("flips", 0.9, None): "not judged",
        ("flips", 0.9, 0.65): "fair",
        ("flips", 0.9, 0.55): "FAIL",
        ("tear", 0.49, 0.1): "fair",
        ("tear", 1.2, 0.5): "FAIL",
        ("seams", 1.0, 0.0): "FAIL",
        ("seams", 0.0, 0.0): "good",
    }
    for (code, value, source), word in cases.items():
        found = judge(code, [Reading(value, source)])
        assert found is not None
        assert found.word == word, (code, value, source)
    assert judge("still", []) is None
    nothing = judge("still", [Reading(0.0, None, "open_jaw at +600", Place((3, 1, 600)))])
    assert nothing is not None
    assert (nothing.where, nothing.place) == ("", Place())


def test_a_coarser_mesh_is_as_rough_as_its_edges_are_long() -> None:
    fine, coarse = (judge("noise", [Reading(0.4, 0.05, coarser=c)]) for c in (1.0, 2.5))
    assert fine is not None
    assert coarse is not None
    assert (fine.word, coarse.word) == ("FAIL", "good")
    assert coarse.limit == pytest.approx(2.5 * 0.05 * 2.5**2)


def test_the_worst_reading_is_the_one_that_exceeds_its_own_limit_most() -> None:
    bad = Reading(0.5, 0.1, "b", Place((4, 1, 200)))
    found = judge("lip-depth", [Reading(3.0, 2.9, "a"), bad, Reading(0.2, 0.2, "c")])
    assert found is not None
    assert (found.where, found.place.motion) == ("b", (4, 1, 200))


def test_every_measure_is_explained() -> None:
    assert len(BY_CODE) == len(MEASURES)
    for measure in MEASURES:
        assert measure.what
        assert measure.origin
        assert measure.good <= measure.fail
        assert np.isfinite(measure.fail)
        assert (measure.rule == "times") == (measure.floor > 0.0)
