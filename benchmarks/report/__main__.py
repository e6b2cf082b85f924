"""One report of speed, memory and fidelity, beside public programs and beside what is asked.

    python -m benchmarks.report [--write] [--quick] [--peers DIR] [--fidelity] [--faces FOLDER] [--parts NAMES]

A shipped head at about 5,000, 20,000 and 85,000 vertices goes through every stage and every backend; whole clones are
timed from file to file; `trimesh` fits a template in the same run, and every deformation transfer program of which
DIR holds a checkout maps motion in the same run. Seconds are those of the processor, on one thread; each row is a
process of its own, medians of --runs of them (one at the largest size). FOLDER (as in `benchmarks.fidelity`) holds
faces whose truth is known; without it there is no peer's fit, and points are detected on the shipped heads alone.
--fidelity measures all backends against that truth first, which takes a quarter of an hour; without it the bars are
read from the table that is there. --quick: the two smaller sizes, one run. --write puts the tables into
docs/benchmarks.md and the numbers into docs/benchmarks.json; --parts measures some parts anew and takes the others
from there; --parts "" writes the tables alone.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

from benchmarks.clone_speed import median
from benchmarks.report import bars, tables
from benchmarks.report.heads import SIZES
from benchmarks.report.processes import ONE_THREAD, measured, medians
from benchmarks.report.reasons import REASONS
from cloning import backends
from samples.build.arkit_docs import put_tables

DOCS = Path(__file__).resolve().parents[2] / "docs"
SHARED = Path(__file__).resolve().parents[3] / "shared"
NUMBERS = DOCS / "benchmarks.json"
CLONED = ("fit", "dt", "vtc", "fmc")
PARTS = ("clones", "stages", "transfers", "peers", "faithful", "pictures")


def main() -> None:
    os.environ.update(ONE_THREAD)
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--peers", type=Path, help="folder of checkouts")
    parser.add_argument("--fidelity", action="store_true")
    parser.add_argument("--faces", type=Path, default=SHARED)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--parts", default=",".join(PARTS), help="names, by commas")
    options = parser.parse_args()
    if options.fidelity:
        command = [sys.executable, "-m", "benchmarks.fidelity", "--faces", str(options.faces)]
        command += ["--makehuman", str(options.faces / "faces" / "makehuman"), *(["--write"] if options.write else [])]
        subprocess.run(command, check=True)
    sizes = list(SIZES)[: 2 if options.quick else None]
    runs = 1 if options.quick else options.runs
    known = numbers()
    for part in filter(None, options.parts.split(",")):
        print(f"# {part}", file=sys.stderr, flush=True)
        found = measure(part, sizes, runs, options.faces, options.peers)
        known = {**numbers(), part: found, "machine": machine()} if options.write else {**known, part: found}
        if options.write:
            NUMBERS.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")
    document = DOCS / "benchmarks.md"
    shown = written(known, document.read_text("utf-8"))
    print("\n".join(shown.values()))
    if options.write:
        put_tables(document, shown)


def numbers() -> dict[str, Any]:
    """What was measured before."""
    known: dict[str, Any] = json.loads(NUMBERS.read_text("utf-8")) if NUMBERS.exists() else {}
    return known


def measure(part: str, sizes: list[str], runs: int, faces: Path, peers: Path | None) -> Any:
    """The numbers of one part."""
    times = {size: runs if size != list(SIZES)[-1] else 1 for size in sizes}
    if part == "clones":
        return [{"head": "quad_head", "backend": b, **median("quad_head", b, runs)} for b in CLONED]
    if part == "stages":
        module = "benchmarks.report.stages"
        return {size: medians([measured(module, size) for _ in range(times[size])]) for size in sizes}
    if part == "transfers":
        module = "benchmarks.report.transfers"
        return {
            b.name: {size: medians([measured(module, size, b.name) for _ in range(times[size])]) for size in sizes}
            for b in backends()
        }
    if part == "peers":
        return beside(faces, peers, sizes[:2])
    return measured(f"benchmarks.report.{part}", *([str(faces)] if part == "faithful" else []))


def beside(faces: Path, peers: Path | None, sizes: list[str]) -> list[dict[str, Any]]:
    """Public programs, as far as they and what they are measured on can be had."""
    from benchmarks.report.peers import fits, transfers

    known = faces / "faces" / "makehuman"
    rows = fits(known, sizes) if known.exists() else []
    return rows if peers is None else rows + transfers(peers.resolve(), sizes)


def written(found: dict[str, Any], document: str) -> dict[str, str]:
    """The tables of all parts that are known."""
    values = bars.fidelity_values(document) | bars.values(found)
    makers = {
        "clones": tables.clone_table,
        "stages": tables.stage_table,
        "transfers": tables.transfer_table,
        "peers": tables.peer_table,
    }
    made = {part: make(found[part]) for part, make in makers.items() if part in found}
    return {"bars": bars.table(values, REASONS), **made}


def machine() -> dict[str, str]:
    """What the numbers were measured on and with."""
    packages = {name: version(name) for name in ("numpy", "scipy")}
    return {**packages, "python": platform.python_version(), "processors": str(os.cpu_count())}


if __name__ == "__main__":
    main()
