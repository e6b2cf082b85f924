"""The report says met where a bar is met, reads its own page, and asks other programs for the same work."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.deformation import sheet
from benchmarks.report import bars, tables
from benchmarks.report.bars import BARS, Bar
from benchmarks.report.heads import sized
from benchmarks.report.peers import checkouts, imported_from

DOCUMENT = """
<!-- fidelity -->
| | phenotype_a | phenotype_a_dec | phenotype_b | phenotype_b_dec | ict |
|---|---|---|---|---|---|
| **truth error, visible skin** | | | | | |
| fit | 0.1 | 0.2 | 0.3 | 0.15 | - |
| dt | 0.1 | 0.21 | 0.3 | 0.1 | - |
| fmc | 0.1 | 0.1 | 0.3 | 0.1 | - |
| vtc | 0.1 | 0.1 | 0.3 | 0.22 | - |
| **feature points, before correction** | | | | | |
| fit | 0.01 | 0.05 | 0.02 | 0.04 | 0.06 |
<!-- end fidelity -->
"""

PHASE4 = """
import plotly.graph_objs as go
def deformation_transfer(rest, triangles, moved, target, faces, pairs):
    assert pairs[0] == (0, 0) and len(pairs) == len(faces)
    print("this program talks")
    return [m + 1.0 for m in moved]
"""


def test_verdicts() -> None:
    low = Bar("x", "x", must=1.0, aim=0.5)
    assert [low.verdict(v) for v in (0.5, 0.51, 1.0, 1.01)] == ["aim met", "met", "met", "**missed**"]
    high = Bar("x", "x", must=10.0, aim=50.0, more=True)
    assert [high.verdict(v) for v in (60.0, 49.0, 9.0)] == ["aim met", "met", "**missed**"]
    beyond = Bar("x", "x", 1.0, 0.5, above="source")
    assert beyond.value({"x": 3.0, "source": 2.5}) == 0.5
    assert beyond.value({"x": 1.0, "source": 2.5}) == 0.0
    assert beyond.value({}) is None


def test_every_bar_has_a_row_and_a_reason_where_it_fails() -> None:
    text = bars.table({"whole clone": 21.0}, {"whole clone": "too much to do"})
    assert len(text.splitlines()) == len(BARS) + 2
    assert text.count("not measured") == len(BARS) - 1
    (row,) = (line for line in text.splitlines() if "fba clone" in line)
    assert row.endswith("| 20 | 6 | 21 | **missed** | too much to do |")


def test_bars_are_read_from_the_table_of_truth() -> None:
    found = bars.fidelity_values(DOCUMENT)
    assert found == {"truth, fit": 0.2, "truth, others": 0.22, "before, same": 0.02, "before, other": 0.06}
    assert bars.fidelity_values("nothing") == {}


def test_bars_are_read_from_the_parts() -> None:
    row = {"frames/s, head at rest": 3000.0, "read .wrl": 0.2, "motions": 0.1, "memory": 300.0}
    other = {**row, "memory": 340.0}
    found = bars.values(
        {
            "clones": [{"backend": "dt", "whole": 11.0}, {"backend": "fit", "whole": 9.0}],
            "stages": {"20k": row},
            "peers": [{"work": f"template fit, {n} vertices", "ours": s} for n, s in (("4,326", 0.7), ("17,259", 2.3))],
            "transfers": {"fmc": {"20k": row}, "dt": {"20k": other}},
        }
    )
    assert found["whole clone"] == 9.0
    assert found["memory, 20k"] == 340.0
    assert found["motions, dt, 20k"] == 0.1
    assert (found["fit, 5k"], found["fit, 20k"]) == (0.7, 2.3)


def test_growth() -> None:
    rows = {str(n): {"vertices": float(n), "fit": 1e-6 * n**1.5} for n in (5000, 20000, 85000)}
    assert np.isclose(tables.exponent(rows, "fit"), 1.5)
    assert "| fit | 0.35 | 2.83 | 24.78 | 1.50 |" in tables.stage_table(rows)


def test_a_subdivided_head_keeps_its_points() -> None:
    small, large = sized("5k"), sized("20k")
    assert large.scene.vertex_count > 3.9 * small.scene.vertex_count
    before, after = (head.points.positions(head.scene) for head in (small, large))
    width = np.linalg.norm(before["3.5"] - before["3.6"])
    assert max(float(np.linalg.norm(after[key] - place)) for key, place in before.items()) < 0.03 * width


def test_a_checkout_is_found_and_asked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place = tmp_path / "some-checkout"
    place.mkdir()
    (place / "phase4.py").write_text(PHASE4)
    ((program, found),) = checkouts(tmp_path)
    assert found == place
    case = sheet(12, 11)
    with imported_from(place):
        offsets = program.run(case, 3)
    assert np.allclose(offsets - 1.0, case.motions[:, :3])
    assert "phase4" not in sys.modules
    assert "plotly.graph_objs" not in sys.modules
    assert str(place) not in sys.path
    assert capsys.readouterr().out == ""
