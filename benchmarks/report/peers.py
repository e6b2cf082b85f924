"""Public programs in the same run, each beside ours on the same work, by turns.

    python -m benchmarks.report.peers FACES CHECKOUTS SIZES RUNS

prints rows as JSON; CHECKOUTS may be "". `trimesh.registration` comes from the package index; deformation transfer
programs from checkouts that the user has made, see `benchmarks.report.programs`.
"""

from __future__ import annotations

import contextlib
import json
import statistics
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.deformation import MOTIONS, Case, errors, reduced, sheet
from benchmarks.report.processes import seconds
from benchmarks.report.programs import Mapped, Program, checkouts, imported_from
from benchmarks.template_fit import METHODS, STEPS, build_task
from fba.arrays import Floats
from samples.build.makehuman import open_makehuman

OURS = "elastic, bending"
SHEETS = {"1k": (32, 32), "5k": (71, 71), "20k": (142, 141)}
"""Rows and columns of the sheets that motion is mapped on."""


def main() -> None:
    faces, folder, sizes, runs = sys.argv[1:]
    known = Path(faces) / "faces" / "makehuman"
    rows = fits(known, sizes.split(","), int(runs)) if known.is_dir() else []
    if folder:
        rows += transfers(Path(folder).resolve(), sizes.split(","), int(runs))
    print(json.dumps(rows))


def fits(makehuman: Path, sizes: Sequence[str], runs: int) -> list[dict[str, Any]]:
    """Template fits beside trimesh's registrations: seconds, ratio, and the error against the truth in eye widths."""
    known = open_makehuman(makehuman)
    rows: list[dict[str, Any]] = []
    for size in sizes:
        task = build_task(known, STEPS[size])
        for name in (n for n in METHODS if n.startswith("trimesh")):
            found: dict[str, Floats] = {}
            laps: list[tuple[float, float]] = []
            for _ in range(runs):
                laps.append(
                    (
                        seconds(lambda t=task, f=found: f.update(ours=METHODS[OURS](t))),  # type: ignore[misc]
                        seconds(lambda t=task, f=found, n=name: f.update(peer=METHODS[n](t))),  # type: ignore[misc]
                    )
                )
            off = {
                who: float((np.linalg.norm(v - task.truth, axis=1)[task.face] / task.eye_width).mean())
                for who, v in found.items()
            }
            work = f"template fit, {task.template.vertex_count:,} vertices"
            rows.append({"work": work, "peer": name, **_medians(laps), "our error": off["ours"], "error": off["peer"]})
    return rows


def transfers(folder: Path, sizes: Sequence[str], runs: int) -> list[dict[str, Any]]:
    """Deformation transfer, a sheet mapped on itself, beside each program of which the folder holds a checkout."""
    rows: list[dict[str, Any]] = []
    for program, place in checkouts(folder):
        for size in (s for s in program.sizes if s in sizes or s not in STEPS):
            case = sheet(*SHEETS[size])
            with imported_from(place), contextlib.chdir(place):
                try:
                    rows.append(_beside(program, case, runs))
                except Exception as error:  # Foreign code may fail in any way: a result too.
                    rows.append({"work": _work(case), "peer": program.name, "failed": repr(error)})
    return rows


def _work(case: Case) -> str:
    return f"deformation transfer, {MOTIONS} motions, {len(case.vertices):,} vertices"


def _beside(program: Program, case: Case, runs: int) -> dict[str, Any]:
    """One program and ours, by turns."""
    found: dict[str, Floats] = {}
    laps: list[tuple[float, float]] = []
    for _ in range(runs):
        mine = seconds(lambda: found.update(ours=reduced(case)))
        theirs = _all_poses(program, case)
        laps.append((mine, theirs.seconds))
    truth = case.motions[:, : theirs.offsets.shape[1]]
    # Programs that hold no vertex leave the place open: a constant is taken off.
    free = theirs.offsets - (theirs.offsets - truth).mean(axis=0)
    return {
        "work": _work(case),
        "peer": program.name + (f" (reckoned from {program.anew} poses)" if program.anew else ""),
        **_medians(laps),
        "our error": errors(found["ours"], case.motions)["largest"],
        "error": errors(free, truth)["largest"],
    }


def _all_poses(program: Program, case: Case) -> Mapped:
    """All poses; of a program that starts anew with each, the time of all reckoned from one and from some."""
    if not program.anew:
        return program.run(case, MOTIONS)
    one, some = program.run(case, 1), program.run(case, program.anew)
    each = (some.seconds - one.seconds) / (program.anew - 1)
    return Mapped(some.offsets, one.seconds + each * (MOTIONS - 1))


def _medians(laps: Sequence[tuple[float, float]]) -> dict[str, float]:
    """Medians of our seconds, theirs, and of the ratios of each pair."""
    return {
        "ours": statistics.median(a for a, _ in laps),
        "seconds": statistics.median(b for _, b in laps),
        "ratio": statistics.median(b / a for a, b in laps),
    }


if __name__ == "__main__":
    main()
