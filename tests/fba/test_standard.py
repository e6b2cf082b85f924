"""The standard's tables: what must hold of them whatever their source."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from fba import EXPRESSIONS, VISEMES, Unit, fap, faps, feature_point_definitions, standard_feature_points
from fba.faps import Directionality
from fba.high_level import expression_weights, viseme_weights


def test_numbers_and_names_are_unique() -> None:
    assert [f.id for f in faps()] == list(range(1, 69))
    assert len({f.name for f in faps()}) == 68
    assert len(standard_feature_points()) == 84
    assert list(feature_point_definitions())[-1] == "11.6"
    assert "7.2" in feature_point_definitions()
    assert [v.id for v in VISEMES] == list(range(1, 15))
    assert [e.id for e in EXPRESSIONS] == list(range(1, 7))


def test_every_low_level_fap_has_a_unit_and_moves_a_known_point() -> None:
    for row in faps()[2:]:
        assert row.unit is not Unit.NONE
        assert row.feature_points
        assert all(p in feature_point_definitions() for p in row.feature_points)
        assert row.directionality in (Directionality.UNIDIRECTIONAL, Directionality.BIDIRECTIONAL)
        low, high = row.i_range
        assert low <= 0 < high
        if row.bidirectional:
            assert low == -high


def test_mirrored_faps_move_mirrored_points_in_mirrored_directions() -> None:
    points = feature_point_definitions()
    for row in faps():
        if row.mirror is None:
            continue
        other = fap(row.mirror)
        assert other.mirror == row.id
        assert other.unit is row.unit
        assert [points[p].counterpart for p in row.feature_points] == list(other.feature_points)
        if row.direction is not None:
            x, y, z = row.direction
            assert other.direction == (-x, y, z) or (x == 0.0 and other.direction == row.direction)


def test_counterparts_are_mutual() -> None:
    points = feature_point_definitions()
    for point in points.values():
        if point.counterpart is not None:
            assert points[point.counterpart].counterpart == point.id


def test_signs_of_the_rotations() -> None:
    assert fap("head_pitch").rotation_axis == (1.0, 0.0, 0.0)
    assert fap("yaw_l_eyeball").rotation_axis == (0.0, 1.0, 0.0)
    assert fap("shift_jaw").direction == (-1.0, 0.0, 0.0)
    assert fap("yaw_l_eyeball").i_range == (-153600, 153600)


def test_unknown_faps_are_refused() -> None:
    for wrong in (0, 69, -1):
        with pytest.raises(KeyError):
            fap(wrong)
    with pytest.raises(KeyError):
        fap("jaw_open")


def test_blending_by_the_standard() -> None:
    assert viseme_weights(1, 2, 21) == {1: 21.0, 2: 42.0}
    assert viseme_weights(4, 4, 10) == {4: 63.0}
    assert viseme_weights(0, 3, 63) == {}
    assert expression_weights(2, 10, 2, 5) == {2: 15.0}
    assert expression_weights(0, 63, 0, 63) == {}


def test_fap_table_agrees_with_the_collected_sources(shared: Path) -> None:
    text = (shared / "reference" / "faps.csv").read_text("utf-8")
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    for row in rows:
        ours = fap(int(row["fap"]))
        assert ours.name == row["name"]
        assert ours.unit == row["unit"].replace("na", "")
        assert ours.quantizer == int(row["quantizer_step_QP"])
        step = ours.quantizer
        assert ours.i_range == (int(row["i_frame_min_levels"]) * step, int(row["i_frame_max_levels"]) * step)
        if ours.direction is not None:
            np.testing.assert_array_equal(ours.direction, [float(c) for c in row["unit_vector_or_axis_xyz"].split()])
