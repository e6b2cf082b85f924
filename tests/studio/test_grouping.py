"""Findings of one kind are told in one line, the worst first, and nothing is lost that is alone."""

from __future__ import annotations

from dataclasses import replace

from fat.conformance import FapConformance
from fat.fap_quality import FapQuality
from fba.findings import Finding
from studio.grouping import FEW, NAMED, grouped

GOOD = FapQuality(31, 1, "raise_l_i_eyebrow", 200, 300, None, 0.01, 33, 0.0, 0.1, 1.2, 0, 0.0, 0.0)
ROWS = [replace(GOOD, name=f"fap{n}", flips_at_limit=0.5 + 0.1 * n) for n in (3, 1, 4, 2, 5)]


def failures(rows: list[FapQuality]) -> list[Finding]:
    return [f for row in rows for f in row.failures()]


def test_many_of_a_kind_are_one_line_with_the_worst_first() -> None:
    other = Finding("warning", "noise", "motion is rough", "viseme_aa")
    (together, last) = grouped([*failures(ROWS), other], ROWS, [])
    assert (together.severity, together.code, together.where) == ("error", "fap-flips-at-limit", "")
    assert together.message == (
        "more than 0.5 % of the moving triangles turn over as far as the table goes, in 5 motions: "
        "fap5 at +200 (1.00 %), fap4 at +200 (0.90 %), fap3 at +200 (0.80 %) and 2 more"
    )
    assert last == other


def test_few_of_a_kind_are_told_one_by_one_and_kinds_apart() -> None:
    few = failures(ROWS[:FEW])
    seams = replace(GOOD, name="seam", parted=2)
    assert grouped([*few, *seams.failures()], [*ROWS, seams], []) == [*few, *seams.failures()]
    three = grouped(failures(ROWS[:NAMED]), ROWS, [])
    assert len(three) == 1
    assert "more" not in three[0].message.removeprefix("more")


def test_faps_that_miss_their_amount_are_one_line() -> None:
    faps = [FapConformance(n, f"fap{n}", "2.1", "translation", 100, 100 + n, 0.0, float(n)) for n in range(3, 20)]
    errors = [Finding("error", "own-fp", "too far", f"FAP {f.fap_id}") for f in faps]
    (line,) = grouped(errors, [], faps)
    assert line.severity == "error"
    assert line.message.endswith(
        "in 17 motions: fap19 at +100 (19.00 %), fap18 at +100 (18.00 %), fap17 at +100 (17.00 %) and 14 more"
    )
