"""The main job on shipped samples: clone, export, play, draw, measure."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

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

    seconds : for cloning alone. worst_own : largest relative error of a FAP's own feature point.
    """

    head: str
    vertices: int
    polygons: str
    tables: int
    worst_own: float
    seconds: float
    findings: tuple[Finding, ...]
    files: tuple[Path, ...]


def run_demo(folder: Path, tell: Callable[[str, float], None]) -> list[DemoRow]:
    """Clone the shipped source onto every shipped head and write everything into `folder`.

    Raises
    ------
    OutputFileError
        If the folder cannot be written.
    """
    source = read_face("default")
    stream, _ = read_fap(sample("streams/demo.fap"))
    rows = []
    for index, name in enumerate(HEADS):
        path = sample(f"faces/{name}")
        stem = path.stem

        step = _Steps(tell, stem, index)
        step("cloning", 0.0)
        scene = read_scene(path)
        points_path = landmarks_beside(path)
        points = None if points_path is None else read_landmarks(points_path, scene)
        start = time.perf_counter()
        face, report = clone_with_report(source, scene, points)
        seconds = time.perf_counter() - start
        files = [folder / f"{stem}.wrl", folder / f"{stem}.usda", folder / f"{stem}.gif", folder / f"{stem}.png"]
        step("writing", 0.3)
        write(face, files[0])
        write(face, files[1])
        step("playing", 0.5)
        draw_frames(face, stream, files[2], 300, step.playing)
        step("drawing the sheet", 0.8)
        save_png(contact_sheet(source, face, title=stem), files[3])
        rows.append(
            DemoRow(
                stem,
                face.scene.vertex_count,
                _polygons(scene.shapes[0].mesh),
                len(face.tables),
                _worst_own(face),
                seconds,
                tuple(report.findings),
                tuple(files),
            )
        )
    return rows


@dataclass(frozen=True, slots=True)
class _Steps:
    """Progress of one head as a share of the whole demo."""

    tell: Callable[[str, float], None]
    head: str
    index: int

    def __call__(self, what: str, share: float) -> None:
        self.tell(f"{self.head}: {what}", (self.index + share) / len(HEADS))

    def playing(self, _what: str, share: float) -> None:
        self("playing", 0.5 + 0.3 * share)


def _worst_own(face: AnimatableFace) -> float:
    return max((c.relative_error for c in conformance(face)), default=0.0)


def _polygons(mesh: PolyMesh) -> str:
    quads = int((mesh.arities == 4).sum())
    triangles = int((mesh.arities == 3).sum())
    return " + ".join(f"{n:,} {what}" for n, what in ((quads, "quads"), (triangles, "triangles")) if n)
