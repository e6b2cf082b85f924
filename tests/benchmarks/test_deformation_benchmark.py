"""The two systems that the benchmark of deformation transfer compares do the same work."""

from __future__ import annotations

import numpy as np

from benchmarks.deformation import errors, full, reduced, sheet


def test_both_systems_give_a_mesh_its_own_motion_again() -> None:
    case = sheet(14, 13)
    for found in (reduced(case), full(case)):
        row = errors(found, case.motions)
        assert row["below 0.1%"] == 1.0
        assert row["largest"] < 1e-8


def test_errors_are_seen() -> None:
    case = sheet(14, 13)
    off = case.motions.copy()
    off[:, ::2] *= 1.01
    row = errors(off, case.motions)
    assert np.isclose(row["largest"], 0.01)
    assert row["below 0.1%"] < 0.6
    assert row["below 2.0%"] == 1.0
