"""The main job on shipped samples: clone, export, play, draw, measure."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from multiprocessing import active_children, get_context
from pathlib import Path
from types import FrameType

from cloning import clone_with_report
from fat.conformance import conformance
from fat.face import AnimatableFace
from fba.findings import Finding
from fba.mesh import PolyMesh
from formats import read_face, read_scene, write
from formats.fap import read_fap
from formats.landmarks import landmarks_beside, read_landmarks
from samples import sample
from studio.playback import draw_frames
from studio.sheet import contact_sheet, save_png

HEADS = ("quad_head.obj", "tri_head.obj", "closed_head.obj")


@dataclass(frozen=True, slots=True)
class DemoRow:
    """What the demo reports of one head.

    worst_own : largest relative error of a FAP's own feature point.
    fp_error : relative error of all feature points over all motions, beside the source.
    seconds : for cloning alone.
    """

    head: str
    vertices: int
    polygons: str
    tables: int
    worst_own: float
    fp_error: float
    seconds: float
    findings: tuple[Finding, ...]
    files: tuple[Path, ...]


def run_demo(folder: Path, tell: Callable[[str, float], None]) -> list[DemoRow]:
    """Clone the shipped source onto every shipped head and write everything into `folder`.

    The heads are worked on side by side, one process each, as many as there are cores.

    Raises
    ------
    OutputFileError
        If the folder cannot be written.
    """
    workers = min(len(HEADS), os.cpu_count() or 1)
    # One thread each: the threads of several numerical libraries would wait for each other's cores.
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    # Spawned, not forked: a forked graphics context does not work.
    with _one_interrupt(), ProcessPoolExecutor(workers, get_context("spawn"), initializer=_end_quietly) as pool:
        try:
            with _deaf_to_interrupts():
                waiting = [pool.submit(make_head, name, folder) for name in HEADS]
            for done, one in enumerate(as_completed(waiting), start=1):
                one.result()
                tell(f"{done} of {len(HEADS)} heads", done / len(HEADS))
            return [one.result() for one in waiting]
        except BaseException:
            for process in active_children():
                # More than once: a worker that is told while at one head would go on with the next.
                while process.is_alive():
                    process.terminate()
                    process.join(0.1)
            raise


@contextmanager
def _one_interrupt() -> Iterator[None]:
    """Hear the first Ctrl-C alone: a second one would stop the tidying up, and the heads would be finished first."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def leave(_number: int, _frame: FrameType | None) -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Start processes that do not hear Ctrl-C themselves: their parent ends them."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _end_quietly() -> None:
    """Let a worker take its unfinished files away when its parent ends it."""

    # Loaded now: OpenUSD prints what is raised while it loads.
    import_module("formats.usd.writer")

    def leave(_number: int, _frame: FrameType | None) -> None:
        raise SystemExit

    signal.signal(signal.SIGTERM, leave)


def make_head(name: str, folder: Path) -> DemoRow:
    """Do everything for one shipped head."""
    source = read_face("default")
    path = sample(f"faces/{name}")
    stem = path.stem
    scene = read_scene(path)
    points_path = landmarks_beside(path)
    points = None if points_path is None else read_landmarks(points_path, scene)
    start = time.perf_counter()
    face, report = clone_with_report(source, scene, points)
    seconds = time.perf_counter() - start
    files = tuple(folder / f"{stem}{suffix}" for suffix in (".wrl", ".usda", ".gif", ".png"))
    write(face, files[0])
    write(face, files[1])
    stream, _ = read_fap(sample("streams/demo.fap"))
    draw_frames(face, stream, files[2], 300, lambda _stage, _share: None)
    save_png(contact_sheet(source, face, title=stem), files[3])
    return DemoRow(
        stem,
        face.scene.vertex_count,
        _polygons(scene.shapes[0].mesh),
        len(face.tables),
        _worst_own(face),
        report.measures.get("fp_error_after", 0.0),
        seconds,
        tuple(report.findings),
        files,
    )


def _worst_own(face: AnimatableFace) -> float:
    return max((c.relative_error for c in conformance(face)), default=0.0)


def _polygons(mesh: PolyMesh) -> str:
    quads = int((mesh.arities == 4).sum())
    triangles = int((mesh.arities == 3).sum())
    return " + ".join(f"{n:,} {what}" for n, what in ((quads, "quads"), (triangles, "triangles")) if n)
