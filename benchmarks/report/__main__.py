"""One report of speed, memory and fidelity, beside public programs, the papers, and an earlier state of the product.

    python -m benchmarks.report [--write] [--peers DIR] [--fidelity] [--against [REV]] [--faces FOLDER]
                                [--runs N] [--parts NAMES] [--quick]

A shipped head at about 5,000, 20,000 and 100,000 vertices goes through every stage and every backend; whole clones are
timed from file to file; `trimesh` fits a template in the same run, and every deformation transfer program of which
DIR holds a checkout maps motion in the same run. Seconds are those of the processor, on one thread; each row is a
process of its own, medians of --runs of them (one at the largest size). What is compared runs by turns, A B A B, and
ratios are medians of those of the pairs. Without --fidelity the parts are left out whose numbers do not depend on the
machine: all backends on all faces whose truth is known, and between kits of different artists (minutes each).
--against lays a commit beside this state (REV; without it the last one that is a week old): its code runs by turns
with today's, and what it had measured stands beside what is measured now. FOLDER holds faces whose truth is known;
without it there is no peer's fit, and points are detected on the shipped heads alone.

--write puts the tables into docs/benchmarks.md and the numbers into docs/benchmarks.json; --parts measures some parts
anew and takes the others from there; --parts "" writes the tables alone. --quick: two sizes, one run, the fastest
backend, a few minutes; it only prints.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from benchmarks.fidelity import document_table
from benchmarks.kits import SHARED
from benchmarks.report import bars, tables, then_and_now, truth_tables
from benchmarks.report.against import week_old
from benchmarks.report.parts import PARTS, QUICK, TRUTH, Run
from benchmarks.report.processes import ONE_THREAD
from benchmarks.report.reasons import REASONS
from benchmarks.report.summary import summary
from samples.build.arkit_docs import put_tables

DOCS = Path(__file__).resolve().parents[2] / "docs"
NUMBERS = DOCS / "benchmarks.json"
AGO = "a week"


def main() -> None:
    # Without compiled loops, as most people have it; the part "fast" has both.
    os.environ.update({**ONE_THREAD, "FBA_FAST": "0"})
    options = parser().parse_args()
    revision = week_old() if options.against == AGO else options.against
    run = Run(
        1 if options.quick else options.runs, options.faces, options.peers, revision, options.write, options.quick
    )
    known = {} if options.quick else numbers()
    for part in chosen(options.parts, options.quick, options.fidelity, revision is not None):
        print(f"# {part}", file=sys.stderr, flush=True)
        found = PARTS[part](run)
        known = {**(numbers() if options.write else known), part: found, "machine": machine()}
        if options.write:
            NUMBERS.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")
    shown = written(known, (DOCS / "papers.md").read_text("utf-8"))
    print("\n".join(shown.values()))
    if options.write:
        put_tables(DOCS / "benchmarks.md", shown)


def parser() -> argparse.ArgumentParser:
    """The options."""
    found = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    what = found.add_mutually_exclusive_group()
    what.add_argument("--write", action="store_true")
    what.add_argument("--quick", action="store_true")
    found.add_argument("--peers", type=Path, help="folder of checkouts")
    found.add_argument("--fidelity", action="store_true")
    found.add_argument("--against", nargs="?", const=AGO, metavar="REV")
    found.add_argument("--faces", type=Path, default=SHARED)
    found.add_argument("--runs", type=int, default=3)
    found.add_argument("--parts", help=f"names, by commas: {', '.join(PARTS)}")
    return found


def chosen(parts: str | None, quick: bool, fidelity: bool, against: bool) -> list[str]:
    """The parts to measure, in the order in which they run."""
    if parts is not None:
        asked = set(filter(None, parts.split(",")))
        if not asked <= set(PARTS):
            raise SystemExit(f"there is no part {', '.join(sorted(asked - set(PARTS)))}; parts are {', '.join(PARTS)}")
    else:
        asked = set(QUICK if quick else PARTS) - set(TRUTH if quick or not fidelity else ())
    return [part for part in PARTS if part in asked and (part != "against" or against)]


def numbers() -> dict[str, Any]:
    """What was measured before."""
    known: dict[str, Any] = json.loads(NUMBERS.read_text("utf-8")) if NUMBERS.exists() else {}
    return known


def written(found: dict[str, Any], papers: str) -> dict[str, str]:
    """The tables of all parts that are known."""
    makers = {
        "clones": tables.clone_table,
        "stages": tables.stage_table,
        "transfers": tables.transfer_table,
        "fast": lambda pairs: tables.turn_table(pairs, then_and_now.SECONDS),
        "peers": tables.peer_table,
        "playback": tables.playback_table,
        "formats": tables.format_table,
        "compact": tables.compact_table,
        "fidelity": document_table,
        "cross": truth_tables.cross_table,
    }
    made = {part: make(found[part]) for part, make in makers.items() if found.get(part)}
    if "fidelity" in made:
        made["overview"] = truth_tables.overview(found["fidelity"])
    made["summary"] = summary(found, papers)
    made["bars"] = bars.table(bars.values(found), REASONS)
    made["against"] = then_and_now.section(found)
    order = ("summary", "bars", "overview")
    return {name: made[name] for name in (*(n for n in order if n in made), *(n for n in made if n not in order))}


def machine() -> dict[str, str]:
    """What the numbers were measured on and with."""
    packages = {}
    for name in ("numpy", "scipy", "numba"):
        try:
            packages[name] = version(name)
        except PackageNotFoundError:
            packages[name] = "not installed"
    return {**packages, "python": platform.python_version(), "processors": str(os.cpu_count())}


if __name__ == "__main__":
    main()
