"""Deformation transfer programs that anybody can have, each called where its files and dialogs end.

Nothing of them is part of this product: they run from checkouts that the user has made. Each is given a mesh, the same
mesh in other poses, and the correspondence of every triangle with itself.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import io
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from types import ModuleType
from typing import Any

import numpy as np

from benchmarks.deformation import Case
from fba.arrays import Floats

NOT_NEEDED = (
    *("config", "render", "render.plot", "pywavefront", "yaml", "tqdm", "plotly", "plotly.graph_objs"),
    *("mayavi", "mayavi.mlab", "joblib"),
)
"""What the programs import for files, progress and viewers, and what loads their examples."""

SMALL = ("1k",)
USUAL = ("5k", "20k")


@dataclass(frozen=True)
class Mapped:
    """What a program found: (n, poses, 3) offsets, and the processor seconds that it took."""

    offsets: Floats
    seconds: float


@dataclass(frozen=True)
class Program:
    """A deformation transfer program.

    Attributes
    ----------
    name : as its repository is called.
    file : a file that tells its checkout.
    run : given the case and a number of poses; the current folder is the checkout.
    anew : poses from which all are reckoned, where each pose costs as much as the first; 0 = all are asked for.
    sizes : of sheets that it gets through.
    """

    name: str
    file: str
    run: Callable[[Case, int], Mapped]
    anew: int = 0
    sizes: tuple[str, ...] = USUAL


def checkouts(folder: Path) -> Iterator[tuple[Program, Path]]:
    """Programs that are there."""
    for program in PROGRAMS:
        for place in sorted(folder.iterdir()):
            if (place / program.file).exists():
                yield program, place


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
    except (ModuleNotFoundError, ValueError):
        return False


def _stub(name: str) -> ModuleType:
    """A module that has every name asked of it, and does nothing; `tqdm.tqdm` hands its argument through."""

    class Anything(ModuleType):
        def __getattr__(self, key: str) -> Any:
            if key.startswith("__"):
                raise AttributeError(key)
            return lambda some=(), *_, **__: some

    return Anything(name)


def _phases(case: Case, poses: int) -> Mapped:
    phase4 = importlib.import_module("phase4")
    moved = [case.vertices + case.motions[:, k] for k in range(poses)]
    pairs = [(k, k) for k in range(len(case.triangles))]
    start = process_time()
    done = phase4.deformation_transfer(case.vertices, case.triangles, moved, case.vertices, case.triangles, pairs)
    spent = process_time() - start
    return Mapped(np.stack([np.asarray(v) - case.vertices for v in done], axis=1), spent)


def _transformation(case: Case, poses: int) -> Mapped:
    meshlib, transformation = (importlib.import_module(name) for name in ("meshlib", "transformation"))
    rest = [meshlib.Mesh(case.vertices.copy(), case.triangles) for _ in range(2)]
    pairs = np.repeat(np.arange(len(case.triangles))[:, None], 2, axis=1)
    moved = [meshlib.Mesh(case.vertices + case.motions[:, k], case.triangles) for k in range(poses)]
    start = process_time()
    way = transformation.Transformation(*rest, pairs)
    done = [way(mesh) for mesh in moved]
    spent = process_time() - start
    n = len(case.vertices)
    return Mapped(np.stack([mesh.vertices[:n] - case.vertices for mesh in done], axis=1), spent)


def _dtrans(case: Case, poses: int) -> Mapped:
    """A program in C: reads poses as OBJ and writes them; both are counted, because it does nothing without."""
    program = next((p for p in map(Path.absolute, map(Path, BUILT)) if _starts(p)), None)
    if program is None:
        raise FileNotFoundError(f"it is not built: compile it to {BUILT[0]}")
    n, t = len(case.vertices), len(case.triangles)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "pairs").write_text(f"{t}\n" + "".join(f"{k}, {k}, 0.0\n" for k in range(t)))
        faces = "".join(
            "f {0}//{0} {1}//{1} {2}//{2}\n".format(*triangle) for triangle in (case.triangles + 1).tolist()
        )
        names = ["rest", *(f"pose{k}" for k in range(poses))]
        moved = [case.vertices, *(case.vertices + case.motions[:, k] for k in range(poses))]
        for name, vertices in zip(names, moved, strict=True):
            rows = "".join("v {:.12f} {:.12f} {:.12f}\n".format(*place) for place in vertices.tolist())
            (folder / name).write_text(rows + faces)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([program, "rest", *names[:1], "pairs", *names[1:]], cwd=folder, check=True, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = [_vertices(folder / f"out_{k}.obj", n) for k in range(poses)]
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Mapped(np.stack([v - case.vertices for v in done], axis=1), spent)


def _starts(program: Path) -> bool:
    try:
        subprocess.run([program], capture_output=True, check=False)
    except OSError:
        return False
    return True


def _vertices(path: Path, count: int) -> Floats:
    lines = (line for line in path.read_text().splitlines() if line.startswith("v "))
    return np.array([line.split()[1:4] for line in lines], dtype=np.float64)[:count]


def _notebook(case: Case, poses: int) -> Mapped:
    """The steps of the program's notebook, with its own weights; numba's compilation is not counted."""
    dt = importlib.import_module("local_packages.deformationTransfer")
    from scipy.sparse.linalg import spsolve

    n, v, f = len(case.vertices), case.vertices, case.triangles
    dt.compute_v4(v, f)
    start = process_time()
    fourth = dt.compute_v4(v, f)
    inverse = dt.compute_V_inverse(v, f, fourth)
    smooth, smooth_right = dt.makeEs_ATA_ATc(v, f, inverse)
    same, same_right = dt.makeEi_ATA_ATc(v, f, inverse)
    pairs = [[k, k] for k in range(len(f))]
    wanted = dt.makeEd_A(pairs, v, f, inverse)
    square = np.dot(wanted.T, wanted)
    done = []
    for k in range(poses):
        turns = dt.make_source_rotation_matrix(v, f, fourth, v + case.motions[:, k], f)
        right = dt.makeEd_ATc(pairs, turns, wanted)
        solved = spsolve(square + 0.01 * same + 0.01 * smooth, right + 0.01 * same_right + 0.01 * smooth_right)
        done.append(solved[: 3 * n].reshape(n, 3) - v)
    return Mapped(np.stack(done, axis=1), process_time() - start)


def _lsqr(case: Case, poses: int) -> Mapped:
    main = importlib.import_module("main")
    v, f = case.vertices, case.triangles.astype(np.int64) + 1
    pairs = [np.array([k]) for k in range(len(f))]
    start = process_time()
    done = [main.deformation_transfer(v, f, v, f, v + case.motions[:, k], f, pairs)[0] - v for k in range(poses)]
    return Mapped(np.stack(done, axis=1), process_time() - start)


BUILT = ("build/dtrans", "dtrans/run", "bin/dtrans")
"""Where the C program may lie in its checkout; docs/benchmarks.md says how to compile it."""

PROGRAMS = (
    Program("Golevka/deformation-transfer", "dtrans/dt_equation.c", _dtrans),
    Program("huseyinbayoglu/Deformation-Transfer-python-implemention", "phase4.py", _phases),
    Program("mickare/Deformation-Transfer-for-Triangle-Meshes", "transformation.py", _transformation, anew=4),
    Program(
        "vasiliskatr/deformation_transfer_ARkit_blendshapes",
        "local_packages/deformationTransfer.py",
        _notebook,
        3,
        SMALL,
    ),
    Program("ziyeshanwai/python-deformation-transfer", "Face_Marker.mat", _lsqr, anew=2, sizes=SMALL),
)
