"""The report says met where a bar is met, reads its own page, and asks other programs for the same work."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.deformation import sheet
from benchmarks.report import bars, tables
from benchmarks.report.__main__ import chosen
from benchmarks.report.against import changed_fidelity, fidelity_rows
from benchmarks.report.bars import BARS, Bar
from benchmarks.report.heads import sized, with_middles
from benchmarks.report.paired import beyond_noise, compared
from benchmarks.report.peers import _all_poses
from benchmarks.report.programs import Mapped, Program, checkouts, imported_from
from benchmarks.report.summary import summary
from benchmarks.report.then_and_now import NONE, bars_table, fidelity_changes, section
from fba.mesh import PolyMesh

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


def test_bars_are_read_from_a_page_of_an_earlier_state() -> None:
    found = bars.fidelity_values(fidelity_rows(DOCUMENT))
    assert found == {"truth, fit": 0.2, "truth, others": 0.22, "before, same": 0.02, "before, other": 0.06}
    assert bars.fidelity_values(fidelity_rows("nothing")) == {}


def test_changes_on_known_faces_are_told_by_size() -> None:
    then = fidelity_rows(DOCUMENT)
    now = [{**row, "truth": row["truth"] + 0.05} if row["backend"] == "dt" and "truth" in row else row for row in then]
    now = [{**row, "fp_before": 0.0} if row["target"] == "ict" else row for row in now]
    changes = changed_fidelity(then, now, 0.01)
    assert [(c["backend"], c["target"], c["measure"]) for c in changes[:1]] == [("fit", "ict", "fp_before")]
    assert len(changes) == 5
    text = fidelity_changes(changes)
    assert "1 better, 4 worse" in text
    assert "| truth error, visible skin | dt | phenotype_a_dec | 0.210 | 0.260 | **worse** |" in text
    assert "none moved by" in fidelity_changes(changed_fidelity(then, then, 0.01))


def test_bars_then_and_now_leave_out_the_clock() -> None:
    then = {"truth, fit": 0.15, "whole clone": 20.0, "lip gap, MNS": 0.005, "flips, %": 0.1, "flips, %, source": 0.0}
    assert bars_table(then, {}) == []
    (text,) = bars_table(then, {**then, "truth, fit": 0.17, "whole clone": 5.0, "lip gap, MNS": 0.004})
    assert "| truth error, other topology, `fit` | 0.15 | 0.17 | **worse** |" in text
    assert "| lip gap, MNS | 0.005 | 0.004 | better |" in text
    assert "fba clone" not in text
    assert len(text.splitlines()) == 2 + 3


def test_ratios_are_medians_of_pairs_and_noise_is_told() -> None:
    laps = [(10.0, 8.0), (20.0, 10.0), (10.0, 9.0)]
    found = compared([({"whole": a, "old": 1.0}, {"whole": b}) for a, b in laps])
    assert found == {"whole": {"then": 10.0, "now": 9.0, "ratio": 0.8, "least": 0.5, "largest": 0.9, "pairs": 3}}
    assert beyond_noise(found["whole"])
    assert not beyond_noise({"ratio": 0.8, "least": 0.7, "largest": 1.1, "pairs": 3})
    assert not beyond_noise({"ratio": 0.97, "least": 0.96, "largest": 0.98, "pairs": 3})
    assert not beyond_noise({"ratio": 0.8, "least": 0.8, "largest": 0.8, "pairs": 1})
    pairs = {"fit": found, "stages": {"write .wrl": found["whole"], "vertices": found["whole"]}}
    text = tables.turn_table(pairs, 0.05)
    assert "| **whole** | 10.00 to 9.00 **x 0.80** |" in text
    assert "| write .wrl | 10.00 to 9.00 **x 0.80** |" in text
    assert "vertices" not in text


def test_the_section_of_an_earlier_state_names_it() -> None:
    assert section({}) == NONE
    row = {"then": 10.0, "now": 8.0, "ratio": 0.8, "least": 0.7, "largest": 0.9, "pairs": 3}
    old = {"commit": "abc1234", "date": "2026-01-01", "pairs": {"fit": {"whole": row}}, "fidelity": [], "values": {}}
    assert "Commit abc1234 of 2026-01-01" in section({"against": old})
    assert "| against itself | commit abc1234 of 2026-01-01: whole clone 10.0 s, now 8.0 s (x 0.80)" in summary(
        {"against": old}, ""
    )


def test_the_summary_takes_the_papers_seconds_from_their_page() -> None:
    page = """
<!-- vtc-times -->
| correspondence, seconds (paper: 1.5) | 0.50 |
| one motion of 88, milliseconds (paper: 1,100) | 11 |
<!-- end vtc-times -->
<!-- xiang-1 -->
| tri_head | 2,856 | 5,598 | 4.0 |
| default | 11,079 | 21,954 | - |
<!-- end xiang-1 -->
"""
    text = summary({}, page)
    assert "VTC in 3D 3.0 to 100, a whole individual 30 to 30" in text
    assert "papers" not in summary({}, "")


def test_parts_are_chosen() -> None:
    assert chosen("stages,clones", False, False, False) == ["clones", "stages"]
    assert "fidelity" not in chosen(None, False, False, False)
    assert {"fidelity", "cross", "against"} <= set(chosen(None, False, True, True))
    with pytest.raises(SystemExit, match="no part nonsense"):
        chosen("nonsense", False, False, False)


def test_bars_are_read_from_the_parts() -> None:
    row = {"frames/s, head at rest, 4-byte numbers": 3000.0, "read .wrl": 0.2, "motions": 0.1, "memory": 300.0}
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
    assert found["frames/s, 20k"] == 3000.0
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


def test_middles_keep_a_mesh_closed() -> None:
    mesh = sized("20k").scene.shapes[0].mesh
    more = with_middles(mesh, 500)
    assert more.vertex_count == mesh.vertex_count + 500
    corners = more.triangles
    edges = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    _, count = np.unique(edges, axis=0, return_counts=True)
    assert set(count) == {2}
    plain = PolyMesh.from_faces(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]), np.array([[0, 1, 2, 3]]))
    assert np.allclose(with_middles(plain, 1).vertices[4], (0.5, 0.5, 0.0))


def test_a_program_that_starts_anew_is_reckoned_from_some_poses() -> None:
    case = sheet(4, 4)

    def run(_: object, poses: int) -> Mapped:
        return Mapped(case.motions[:, :poses], 5.0 + 2.0 * poses)

    found = _all_poses(Program("x", "x", run, anew=3), case)
    assert found.seconds == 5.0 + 2.0 * 88
    assert found.offsets.shape[1] == 3


def test_a_checkout_is_found_and_asked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place = tmp_path / "some-checkout"
    place.mkdir()
    (place / "phase4.py").write_text(PHASE4)
    ((program, found),) = checkouts(tmp_path)
    assert found == place
    case = sheet(12, 11)
    with imported_from(place):
        offsets = program.run(case, 3).offsets
    assert np.allclose(offsets - 1.0, case.motions[:, :3])
    assert "phase4" not in sys.modules
    assert "plotly.graph_objs" not in sys.modules
    assert str(place) not in sys.path
    assert capsys.readouterr().out == ""
