"""Every kind of face: cloned onto as `fba clone` does it, with no feature points given, measured and drawn.

    python -m benchmarks.faces [--faces FOLDER] [--only NAMES] [--backend NAME] [--sheets FOLDER] [--json FILE]
                               [--write]

A face in which no face is found is a row too, and a second one with some given points (tests/data/NAME.fps.json).
Each face has a process of its own, so that its memory can be told. --sheets draws every face; --write puts the table
into docs/faces.md and beside it the pictures of those faces whose licence lets anybody show them.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import re
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from time import process_time

import numpy as np
from PIL import Image

from benchmarks.fidelity import back_of_head
from benchmarks.known_faces import targets
from benchmarks.landmarks import SHARED, errors
from cloning import CloneReport, clone_with_report
from cloning.backends import DEFAULT_BACKEND
from cloning.pieces import count_pieces, find_pieces
from cloning.prepare import prepare
from fat.build import face_motions
from fat.evaluate import Player
from fat.face import AnimatableFace
from fat.quality import LIP_PAIRS, feature_point_motion, lip_gap_change, opening_change
from fba.errors import FbaError
from fba.feature_points import FeaturePoint, FeaturePoints
from fba.mesh import PolyMesh
from fba.scene import FaceScene, Role
from formats import read, read_face, read_scene, write
from formats.landmarks import read_landmarks
from samples import sample
from samples.build.arkit_docs import put_tables
from samples.build.makehuman import open_makehuman
from studio.fidelity import Fidelity, fidelity
from studio.inputs import scene_of
from studio.landmark_sheet import marked
from studio.render import Figure, make_renderer
from studio.sheet import PosePick, Sheet, save_png

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs" / "faces.md"
POINTS = ROOT / "tests" / "data"
SHIPPED = ("tri_head", "quad_head", "closed_head")
OTHER_FILES = ("candide3/candide3.wfm", "rpm-brunette/brunette-t.glb", "greta/greta_face.mesh")
"""Files of the folder that are not OBJ."""
HELPERS = r"\b(joint|helper)\b(?!.*lash)"
"""Pieces of MakeHuman's base mesh that are moulds for clothes and marks of joints: cloned, but not drawn."""
NOT_NEUTRAL = ("eyeBlink_L", "jawOpen", "mouthSmile_L")
"""Other poses of a face of the folder."""

POSES = (
    PosePick("neutral"),
    PosePick("jaw open", {3: 900}),
    PosePick("smile", expression=(1, 63, 0, 0)),
    PosePick("blink", {19: 1024, 20: 1024}),
    PosePick("surprise", expression=(6, 63, 0, 0)),
    PosePick("viseme O", viseme=(13, 0, 63)),
    PosePick("brows", {31: 120, 32: 120, 33: 140, 34: 140, 35: 100, 36: 100}),
)
WIDTH = 200
DOT = 2
COLORS = 200
"""Of a written picture: few enough for a small file."""

SHOWN = (
    *SHIPPED,
    "makehuman",
    "phenotype_a_dec",
    "phenotype_b_dec",
    "soma",
    "ict-facekit",
    "mediapipe-canonical",
    "lee-perry-smith",
)
"""CC0, Apache-2.0, MIT, and CC BY (named in the document): these may be shown by anybody."""

IN_CONTACT = 0.01
"""MNS; lips that part by less in the source stay in contact."""
EARS = (65, 66, 67, 68)


@dataclass(frozen=True)
class Case:
    """A face file, where its feature points truly are (file axes), and points given to the detector.

    hidden : names of pieces that are not drawn, see `cloning.pieces.words`.
    """

    name: str
    path: Path
    truth: FeaturePoints | None = None
    given: Path | None = None
    hidden: str = "(?!)"


@dataclass(frozen=True)
class Row:
    """One line of the table; measures are absent where the face was refused or lacks what they need."""

    name: str
    refused: str = ""
    vertices: int = 0
    pieces: int = 0
    points: tuple[float, float] | None = None
    before: float = 0.0
    after: float = 0.0
    flips: float = 0.0
    lips: float = 0.0
    lids: float | None = None
    drift: float = 0.0
    seconds: float = 0.0
    megabytes: float = 0.0
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = field(default=(), repr=False)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--faces", type=Path, default=SHARED)
    parser.add_argument("--only", default="", help="names of faces, by commas")
    parser.add_argument("--backend", default=DEFAULT_BACKEND)
    parser.add_argument("--sheets", type=Path)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    names = [n for n in options.only.split(",") if n]
    shown = DOCS.parent / "images" / "faces" if options.write else None
    rows = []
    print(HEADING)
    with tempfile.TemporaryDirectory() as folder:
        for case in cases(options.faces, Path(folder), names):
            with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as own:
                drawn = [f for f in (options.sheets, shown if case.name in SHOWN else None) if f is not None]
                row = own.submit(run, case, options.backend, drawn).result()
            rows.append(row)
            print(line(row), flush=True)
    if options.json:
        options.json.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n")
    if options.write:
        put_tables(DOCS, {"faces": "".join(f"{text}\n" for text in (*TABLE_HEAD, *map(table_line, rows)))})


def cases(folder: Path, scratch: Path, names: Sequence[str]) -> Iterator[Case]:
    """All faces; those that need given points come twice."""
    for case in _all(folder, scratch, names):
        if not names or case.name in names:
            yield case
            given = POINTS / f"{case.path.parent.name}.fps.json"
            if given.exists() and case.truth is None and case.path.suffix == ".obj":
                yield replace(case, name=f"{case.name} + points", given=given)


def _all(folder: Path, scratch: Path, names: Sequence[str]) -> Iterator[Case]:
    for name in SHIPPED:
        path = sample(f"faces/{name}.obj")
        scene = read_scene(path)
        yield Case(name, path, _free(scene, read_landmarks(path.with_name(f"{name}.fps.json"), scene)))
    for path in sorted((folder / "faces").glob("*/*.obj")):
        if path.stem not in NOT_NEUTRAL:
            known_points = {"ict-facekit": "ict.json", "makehuman": "makehuman.json"}.get(path.parent.name)
            truth = None
            if known_points is not None:
                scene = read_scene(path)
                truth = _free(scene, read_landmarks(folder / "landmarks" / known_points, scene))
            yield Case(path.parent.name, path, truth, hidden=HELPERS if path.parent.name == "makehuman" else "(?!)")
    for name in OTHER_FILES:
        yield Case(Path(name).name, folder / "faces" / name)
    phenotypes = ("phenotype_a_dec", "phenotype_b_dec")
    if not names or set(names) & set(phenotypes):
        for target in targets(open_makehuman(folder / "faces" / "makehuman"), folder):
            if target.name in phenotypes:
                path = scratch / f"{target.name}.obj"
                write(target.scene, path)
                yield Case(target.name, path, _free(target.scene, target.points))


def _free(scene: FaceScene, points: FeaturePoints) -> FeaturePoints:
    return FeaturePoints({key: FeaturePoint.free(place) for key, place in points.positions(scene).items()})


def run(case: Case, backend: str, sheets: Sequence[Path]) -> Row:
    """Clone onto one face, measure and draw it."""
    source = read_face("default")
    try:
        found = read(case.path)
    except FbaError as error:
        return Row(case.name, _reason(error))
    scene = scene_of(found)
    row = Row(case.name, vertices=scene.vertex_count, pieces=count_pieces(scene))
    start = process_time()
    try:
        given = None if case.given is None else read_landmarks(case.given, scene)
        face, report = clone_with_report(source, found, given, backend=backend)
    except FbaError as error:
        return replace(row, refused=_reason(error), seconds=process_time() - start)
    row = replace(row, seconds=process_time() - start, megabytes=_peak_megabytes())
    row = _measured(row, case, scene, source, face, report)
    if sheets:
        picture = sheet(face, case).quantize(COLORS, dither=Image.Dither.NONE)
        for folder in sheets:
            folder.mkdir(parents=True, exist_ok=True)
            save_png(picture, folder / f"{re.sub(r'[^a-z0-9]+', '_', case.name.lower()).strip('_')}.png")
    return row


def _reason(error: FbaError) -> str:
    """The first sentence of a message, without the file's folder."""
    first = re.split(r"(?<=[a-z0-9'])[.;:] (?=[A-Z]|known)", str(error).replace("\n", " "))[0]
    return re.sub(r"\S*/", "", first)


def _peak_megabytes() -> float:
    """What this process had in memory at most."""
    found = re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())
    return float(found[1]) / 1024.0 if found else float("nan")


def _measured(
    row: Row, case: Case, scene: FaceScene, source: AnimatableFace, face: AnimatableFace, report: CloneReport
) -> Row:
    beside = fidelity(face, source)
    assert isinstance(beside, Fidelity)
    points = None
    if case.truth is not None:
        inside = face.feature_points.positions(face.scene)
        detected = [key for key, p in face.feature_points.items() if p.source == "detected"]
        back = {key: FeaturePoint.free(face.scene.frame.to_file(inside[key])) for key in detected}
        off = errors(scene, FeaturePoints(back), case.truth, ())
        points = float(np.mean(list(off.values()))), max(off.values())
    return replace(
        row,
        points=points,
        before=report.measures["fp_error_before"],
        after=report.measures["fp_error_after"],
        flips=beside.flips_mean - beside.source_flips_mean,
        lids=beside.lid_gap,
        lips=contact_change(face, source),
        drift=drift(face) - drift(source),
        warnings=tuple(f"{f.code}: {f.message}" for f in report.warnings()),
        notes=tuple(f"{f.code}: {f.message}" for f in report.findings if f.severity == "info"),
    )


def contact_change(face: AnimatableFace, source: AnimatableFace) -> float:
    """How far the lips part, in MNS, in motions that keep the source's lips in contact."""
    mine = {(m.fap_id, m.select, m.value): m for m in face_motions(face)}
    worst = 0.0
    for theirs in face_motions(source):
        key = (theirs.fap_id, theirs.select, theirs.value)
        motion = feature_point_motion(source.feature_points, theirs.offsets)
        apart = max(abs(gap) for gap in opening_change(motion, LIP_PAIRS).values()) / source.fapu.mns0
        if key in mine and apart < IN_CONTACT:
            here = feature_point_motion(face.feature_points, mine[key].offsets)
            worst = max(worst, lip_gap_change(motion, source.fapu, here, face.fapu))
    return worst


def drift(face: AnimatableFace) -> float:
    """Largest motion behind the ears relative to the largest anywhere, over all motions but the ears' own."""
    prepared = prepare(face.scene, face.feature_points, "target")
    motions = (m.offsets for m in face_motions(face) if m.fap_id not in EARS)
    return max((back_of_head(prepared, prepared.skin.join(m) / face.fapu.es0) for m in motions), default=0.0)


def sheet(face: AnimatableFace, case: Case) -> Image.Image:
    """Poses side by side; the neutral one with the feature points that face the viewer."""
    player, renderer = Player(face), make_renderer()
    figure = Figure(_without(face.scene, case.hidden), face.feature_points)
    held = {table.key for table in face.tables}
    poses = [pose for pose in POSES if pose.tables() <= held]
    pictures = []
    for pose in poses:
        shapes = player.pose(pose.faps, pose.viseme, pose.expression).world_shapes()
        pictures.append(figure.draw(shapes, (WIDTH, round(1.2 * WIDTH)), renderer=renderer))
    places = face.feature_points.positions(face.scene)
    shown = [key for key in places if not key.startswith(("6.", "7.", "9.8", "9.9", "9.10", "9.11", "10."))]
    pictures[0] = marked(pictures[0], face.feature_points, places, shown, figure.camera, figure, DOT, False)
    made = Sheet(case.name)
    made.add_row("", pictures, [pose.caption for pose in poses])
    return made.image()


def _without(scene: FaceScene, hidden: str) -> FaceScene:
    """The scene without the polygons of pieces of these names; all vertices stay."""
    pieces = find_pieces(scene)
    gone = np.array([re.search(hidden, name) is not None for name in pieces.names])
    change = {}
    for shape in scene.with_role(Role.OTHER):
        mesh = shape.mesh
        kept = np.flatnonzero(~gone[pieces.of_vertex[shape.name][mesh.indices[mesh.offsets[:-1]]]])
        if len(kept) < mesh.face_count:
            faces = [mesh.face(int(f)) for f in kept]
            change[shape.name] = replace(shape, mesh=PolyMesh.from_faces(mesh.vertices, faces), materials=())
    return scene.map_shapes(change)


HEADING = (
    f"{'face':24}{'vertices':>9}{'pieces':>7}{'points':>14}{'before':>8}{'after':>8}{'flips':>7}{'lids':>7}{'lips':>7}"
    f"{'drift':>7}{'s':>6}{'MB':>6}  warnings"
)
TABLE_HEAD = (
    "| face | vertices | pieces | points, mean / max | before | after | flips | lids | lips | drift | s | MB "
    "| warnings |",
    "|---|---|---|---|---|---|---|---|---|---|---|---|---|",
)


def cells(row: Row) -> tuple[str, ...]:
    """What stands in the columns after the pieces."""
    points = "" if row.points is None else f"{row.points[0]:.3f} / {row.points[1]:.3f}"
    lids = "" if row.lids is None else f"{row.lids:.3f}"
    numbers = (f"{row.before:.3f}", f"{row.after:.4f}", f"{row.flips:+.2f}", lids, f"{row.lips:.3f}")
    return points, *numbers, f"{row.drift:.4f}", f"{row.seconds:.1f}", f"{row.megabytes:.0f}", str(len(row.warnings))


def line(row: Row) -> str:
    """One row for the terminal."""
    start = f"{row.name:24}{row.vertices:9}{row.pieces:7}"
    if row.refused:
        return f"{start}  refused: {row.refused}"
    widths = (14, 8, 8, 7, 7, 7, 7, 6, 6, 4)
    text = start + "".join(f"{cell:>{width}}" for cell, width in zip(cells(row), widths, strict=True))
    return text + "  " + ", ".join(w.split(":")[0] for w in row.warnings)


def table_line(row: Row) -> str:
    """One row for the documentation."""
    size = (row.name, f"{row.vertices or ''}", f"{row.pieces or ''}")
    if row.refused:
        return f"| {' | '.join(size)} | refused: {row.refused} |" + 9 * " |"
    return f"| {' | '.join((*size, *cells(row)))} |"


if __name__ == "__main__":
    main()
