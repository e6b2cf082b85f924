"""The parts of the report, each of which can be measured alone."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.clone_speed import median
from benchmarks.cross_kit import Agreement, mean
from benchmarks.fidelity import DOCUMENTED
from benchmarks.report.against import ROOT, against
from benchmarks.report.heads import SIZES
from benchmarks.report.paired import Side, paired
from benchmarks.report.processes import measured, medians
from cloning import backends

CLONED = ("fit", "dt", "vtc", "fmc")
COMPILED = ("fit", "vtc")
"""The default, and the one with the largest systems to solve."""
HEAD = "quad_head"
"""The shipped head of 20,000 vertices."""
QUICK_SIZES = ("5k", "20k")


@dataclass(frozen=True)
class Run:
    """How the parts are measured.

    Attributes
    ----------
    runs : processes, or turns, of which medians are taken; one at the largest size.
    faces : folder of faces whose truth is known; it may be missing.
    peers : folder of checkouts, or None.
    revision : an earlier commit, or None.
    write : documents of the parts are written too.
    quick : few and small.
    """

    runs: int
    faces: Path
    peers: Path | None = None
    revision: str | None = None
    write: bool = False
    quick: bool = False

    @property
    def sizes(self) -> Sequence[str]:
        return QUICK_SIZES if self.quick else tuple(SIZES)

    @property
    def cloned(self) -> Sequence[str]:
        return CLONED[:1] if self.quick else CLONED

    def times(self, size: str) -> int:
        return 1 if size == list(SIZES)[-1] else self.runs


def clones(run: Run) -> Any:
    """Whole clones from file to file."""
    return [{"head": HEAD, "backend": name, **median(HEAD, name, run.runs)} for name in run.cloned]


def stages(run: Run) -> Any:
    """Every stage at every size."""
    module = "benchmarks.report.stages"
    return {size: medians([measured(module, size) for _ in range(run.times(size))]) for size in run.sizes}


def transfers(run: Run) -> Any:
    """Every backend at every size."""
    module = "benchmarks.report.transfers"
    return {
        name: {size: medians([measured(module, size, name) for _ in range(run.times(size))]) for size in run.sizes}
        for name in (b.name for b in backends())
    }


def beside(run: Run) -> Any:
    """Public programs, as far as they and what they are measured on can be had."""
    sizes = QUICK_SIZES[: 1 if run.quick else 2]
    folder = "" if run.peers is None else str(run.peers)
    return measured("benchmarks.report.peers", str(run.faces), folder, ",".join(sizes), str(run.runs))


def fast(run: Run) -> Any:
    """With the extra ``fast`` (now) and without it (then), by turns; empty where numba is not installed."""
    try:
        import numba  # noqa: F401
    except ImportError:
        return {}
    sides = Side(setting={"FBA_FAST": "0"}), Side(setting={"FBA_FAST": "1"})
    # What the first run compiles lies on disk afterwards; the median leaves that one out.
    return by_turns(sides, run, run.cloned[:1] if run.quick else COMPILED)


def by_turns(sides: tuple[Side, Side], run: Run, names: Sequence[str]) -> dict[str, dict[str, dict[str, float]]]:
    """Whole clones by some backends, and the stages at 20k, on two sides."""
    found = {}
    for name in names:
        found[name] = paired(*sides, run.runs, "benchmarks.clone_speed", "--once", HEAD, name)
    then = sides[0].folder or ROOT
    if not run.quick and (then / "benchmarks" / "report" / "stages.py").exists():
        found["stages"] = paired(*sides, run.runs, "benchmarks.report.stages", "20k")
    return found


def earlier(run: Run) -> Any:
    """An earlier state of the product, by turns with this one, and what it had measured."""
    return against(run.revision, lambda sides: by_turns(sides, run, run.cloned)) if run.revision else {}


def faithful(run: Run) -> Any:
    """What is measured on shipped faces, and detected points."""
    return measured("benchmarks.report.faithful", str(run.faces))


def pictures(run: Run) -> Any:
    """The analogy of pictures."""
    return medians([measured("benchmarks.report.pictures") for _ in range(run.runs)])


def playback(run: Run) -> Any:
    """A player beside a plain loop."""
    return measured("benchmarks.report.player")


def formats(run: Run) -> Any:
    """Every format, there and back."""
    return measured("benchmarks.format_speed", "--json", "--rounds", "1" if run.quick else "2")


def compact(run: Run) -> Any:
    """What a clone leaves out by default."""
    return measured("benchmarks.report.compact")


def fidelity(run: Run) -> Any:
    """Every backend where the truth is known."""
    rows = _told("benchmarks.fidelity", run, "--makehuman", str(run.faces / "faces" / "makehuman"))
    kept = ("target", "backend", "published", *DOCUMENTED)
    return [{k: _short(row[k]) for k in kept if k in row} for row in rows]


def cross(run: Run) -> Any:
    """Every backend between kits of different artists: means over the shapes."""
    found = _told("benchmarks.cross_kit", run)["pairs"]
    return {
        pair: {
            name: {"shapes": len(shapes), **{k: _short(v) for k, v in vars(_mean(shapes)).items()}}
            for name, shapes in by_name.items()
        }
        for pair, by_name in found.items()
    }


def _mean(shapes: Mapping[str, Mapping[str, float]]) -> Agreement:
    return mean({name: Agreement(**row) for name, row in shapes.items()})


def _told(module: str, run: Run, *arguments: str) -> Any:
    """What a benchmark with documents of its own writes as JSON."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "found.json"
        command = [sys.executable, "-m", module, "--faces", str(run.faces), "--json", str(path), *arguments]
        subprocess.run([*command, *(["--write"] if run.write else [])], check=True, stdout=sys.stderr)
        return json.loads(path.read_text("utf-8"))


def _short(value: Any) -> Any:
    return round(value, 4) if isinstance(value, float) else value


PARTS: dict[str, Callable[[Run], Any]] = {
    "clones": clones,
    "stages": stages,
    "transfers": transfers,
    "fast": fast,
    "peers": beside,
    "against": earlier,
    "pictures": pictures,
    "playback": playback,
    "formats": formats,
    "compact": compact,
    "faithful": faithful,
    "fidelity": fidelity,
    "cross": cross,
}
QUICK = ("clones", "stages", "peers", "against", "pictures", "playback")
TRUTH = ("fidelity", "cross")
"""Measured when they are asked for; nothing in them depends on the machine."""
