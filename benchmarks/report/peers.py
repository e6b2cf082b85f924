"""Public programs in the same run, each beside ours on the same work.

`trimesh.registration` comes from the package index. Deformation transfer programs are taken from checkouts that the
user has made, one folder each; they are called where their file dialogs end and before their viewers begin.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import io
import statistics
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from benchmarks.deformation import MOTIONS, Case, errors, reduced, sheet
from benchmarks.report.processes import seconds
from benchmarks.template_fit import METHODS, STEPS, build_task
from fba.arrays import Floats
from samples.build.makehuman import open_makehuman

OURS = "elastic, bending"
SHEETS = {"5k": (71, 71), "20k": (142, 141)}
"""Rows and columns of the sheets that motion is mapped on."""

NOT_NEEDED = ("config", "render", "render.plot", "pywavefront", "yaml", "tqdm", "plotly", "plotly.graph_objs")
"""What the programs import for files, progress and viewers, and what loads their examples."""

FEW = 4
"""Poses that a program is asked for which starts anew with each; the rest is reckoned from them."""


@dataclass(frozen=True)
class Program:
    """A deformation transfer program in Python.

    Attributes
    ----------
    name : as its repository is called.
    file : a file that tells its checkout.
    anew : it factors its matrix at every pose.
    run : given the case and a number of poses: the (n, poses, 3) offsets that it finds.
    """

    name: str
    file: str
    anew: bool
    run: Callable[[Case, int], Floats]


def fits(makehuman: Path, sizes: list[str]) -> list[dict[str, Any]]:
    """Template fits beside trimesh's registrations: seconds, ratio, and the error against the truth in eye widths."""
    known = open_makehuman(makehuman)
    rows: list[dict[str, Any]] = []
    for size in sizes:
        task = build_task(known, STEPS[size])
        runs = 3 if size == "5k" else 1
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
            rows.append(
                {
                    "work": f"template fit, {task.template.vertex_count:,} vertices",
                    "peer": name,
                    "ours": statistics.median(a for a, _ in laps),
                    "seconds": statistics.median(b for _, b in laps),
                    "ratio": statistics.median(b / a for a, b in laps),
                    "our error": off["ours"],
                    "error": off["peer"],
                }
            )
    return rows


def transfers(folder: Path, sizes: list[str]) -> list[dict[str, Any]]:
    """Deformation transfer, a sheet mapped on itself, beside each program of which the folder holds a checkout."""
    rows: list[dict[str, Any]] = []
    for program, place in checkouts(folder):
        for size in sizes:
            case = sheet(*SHEETS[size])
            with imported_from(place), contextlib.chdir(place):
                try:
                    rows.append(_beside(program, case))
                except Exception as error:  # Foreign code may fail in any way: a result too.
                    rows.append(
                        {"work": f"{len(case.vertices):,} vertices", "peer": program.name, "failed": repr(error)}
                    )
    return rows


def checkouts(folder: Path) -> Iterator[tuple[Program, Path]]:
    """Programs that are there."""
    for program in PROGRAMS:
        for found in sorted(folder.glob(f"*/{program.file}")):
            yield program, found.parent


@contextlib.contextmanager
def imported_from(place: Path) -> Iterator[None]:
    """Let a checkout's modules be imported by their own names, without the parts that only read files or draw."""
    before = set(sys.modules)
    stubs = [name for name in NOT_NEEDED if not _there(name)]
    for name in stubs:
        sys.modules[name] = _stub(name)
    sys.path.insert(0, str(place))
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            yield
    finally:
        sys.path.remove(str(place))
        for name in set(sys.modules) - before:
            if name in stubs or str(getattr(sys.modules[name], "__file__", "")).startswith(str(place)):
                del sys.modules[name]


def _there(name: str) -> bool:
    try:
        return importlib.util.find_spec(name) is not None
    except ModuleNotFoundError:
        return False


def _stub(name: str) -> ModuleType:
    """A module that has every name asked of it, and does nothing; `tqdm.tqdm` hands its argument through."""

    class Anything(ModuleType):
        def __getattr__(self, key: str) -> Any:
            if key.startswith("__"):
                raise AttributeError(key)
            return lambda some=(), *_, **__: some

    return Anything(name)


def _beside(program: Program, case: Case) -> dict[str, Any]:
    """One program and ours, by turns."""
    n = len(case.vertices)
    found: dict[str, Floats] = {}
    laps: list[tuple[float, float]] = []
    for _ in range(1 if program.anew else 3):
        mine = seconds(lambda: found.update(ours=reduced(case)))
        if program.anew:
            one = seconds(lambda: found.update(peer=program.run(case, 1)))
            some = seconds(lambda: found.update(peer=program.run(case, FEW)))
            theirs = one + (some - one) / (FEW - 1) * (MOTIONS - 1)
        else:
            theirs = seconds(lambda: found.update(peer=program.run(case, MOTIONS)))
        laps.append((mine, theirs))
    poses = found["peer"].shape[1]
    truth = case.motions[:, :poses]
    # Programs that hold no vertex leave the place open: a constant is taken off.
    free = found["peer"] - (found["peer"] - truth).mean(axis=0)
    return {
        "work": f"deformation transfer, {MOTIONS} motions, {n:,} vertices",
        "peer": program.name + (f" (reckoned from {FEW} poses)" if program.anew else ""),
        "ours": statistics.median(a for a, _ in laps),
        "seconds": statistics.median(b for _, b in laps),
        "ratio": statistics.median(b / a for a, b in laps),
        "our error": errors(found["ours"], case.motions)["largest"],
        "error": errors(free, truth)["largest"],
    }


def _phases(case: Case, poses: int) -> Floats:
    phase4 = importlib.import_module("phase4")
    moved = [case.vertices + case.motions[:, k] for k in range(poses)]
    pairs = [(k, k) for k in range(len(case.triangles))]
    done = phase4.deformation_transfer(case.vertices, case.triangles, moved, case.vertices, case.triangles, pairs)
    return np.stack([np.asarray(v) - case.vertices for v in done], axis=1)


def _transformation(case: Case, poses: int) -> Floats:
    meshlib, transformation = (importlib.import_module(name) for name in ("meshlib", "transformation"))
    rest = [meshlib.Mesh(case.vertices.copy(), case.triangles) for _ in range(2)]
    pairs = np.repeat(np.arange(len(case.triangles))[:, None], 2, axis=1)
    way = transformation.Transformation(*rest, pairs)
    done = [way(meshlib.Mesh(case.vertices + case.motions[:, k], case.triangles)) for k in range(poses)]
    n = len(case.vertices)
    return np.stack([mesh.vertices[:n] - case.vertices for mesh in done], axis=1)


PROGRAMS = (
    Program("huseyinbayoglu/Deformation-Transfer-python-implemention", "phase4.py", False, _phases),
    Program("mickare/Deformation-Transfer-for-Triangle-Meshes", "transformation.py", True, _transformation),
)
