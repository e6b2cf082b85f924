"""How exactly feature points are found: against known ones, from unposed starts, and on faces of every kind.

    python -m benchmarks.landmarks [--faces FOLDER] [--only NAMES] [--ways NAMES] [--pose] [--sheets FOLDER]
                                   [--json FILE]

Known are the shipped heads, two MakeHuman phenotypes as they are and in another topology, a whole MakeHuman body and
ICT-FaceKit. Errors in eye widths. Ways: auto; xiang (the published detector), xiang-once (the
same without the step that deforms the source and detects again); clicks (auto with six given points, which do not
count). --pose turns, tilts, scales and shifts every file first and winds it inside out. Faces without known points
show their confidence only; --sheets draws them.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from cloning.detect import detect_points
from cloning.detect.confidence import HALF, LOW
from cloning.detect.xiang import LANDMARKS
from cloning.prepare import PreparedFace, prepare
from fba.arrays import Floats
from fba.errors import LandmarkError
from fba.feature_points import FeaturePoints
from fba.orientation import orient
from fba.scene import FaceScene
from formats import read_face, read_scene
from formats.landmarks import read_landmarks
from samples import sample
from samples.build.makehuman import open_makehuman
from samples.build.phenotypes import decimated, phenotype_a, phenotype_b
from samples.build.phenotypes import known as known_head
from studio.landmark_sheet import landmark_sheet
from studio.sheet import save_png

SHARED = Path(__file__).resolve().parents[2] / "shared"
CLICKS = ("9.3", "2.1", "8.3", "8.4", "3.7", "3.12")
WAYS = ("auto", "xiang", "xiang-once", "clicks")
TILT = 12.0
"""Degrees by which a posed head is tilted besides other axes."""
JAW = ("2.13", "2.14")
GROUPS = {
    "the 20": LANDMARKS,
    "lips, lids": tuple(f"2.{k}" for k in range(2, 10))
    + tuple(f"8.{k}" for k in range(1, 11))
    + tuple(f"3.{k}" for k in (1, 2, 3, 4, 7, 8, 9, 10, 11, 12, 13, 14)),
    "face": ("2", "3", "4", "5", "8", "9"),
    "vague": (*JAW, "10", "11"),
    "all": (*JAW, "2", "3", "4", "5", "8", "9", "10", "11"),
}
"""Single points or whole groups; points on eyeballs, teeth and tongue count nowhere. Vague are corners of the jaw,
ears and skull, which two people would not place at one spot: of the groups they count in "all" alone."""
BAR = (0.08, 0.25)
"""Mean and maximum, in eye widths, that all points of a face should reach."""
INSIDE = ("3.5", "3.6", "9.8", "9.9", "9.10", "9.11")
WRONG = 0.25
"""Eye widths: a point farther off than this should have been marked as unsure."""


@dataclass(frozen=True)
class Known:
    """A face, and its feature points where they are known."""

    name: str
    scene: FaceScene
    truth: FeaturePoints | None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--faces", type=Path, default=SHARED)
    parser.add_argument("--only", default="", help="names of faces, by commas")
    parser.add_argument("--ways", default="auto", help=", ".join(WAYS))
    parser.add_argument("--pose", action="store_true")
    parser.add_argument("--sheets", type=Path)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    face = read_face("default")
    source = prepare(face.scene, face.feature_points, "source")
    names = [n for n in options.only.split(",") if n]
    rows = []
    print(
        f"{'face':22}{'way':11}{'score':>6}{'s':>6}  "
        + "".join(f"{name + ' mean/max':>22}" for name in GROUPS)
        + "   bar"
    )
    for known in faces(options.faces, names):
        shown = posed(known) if options.pose else known
        for way in options.ways.split(","):
            row = measure(shown, source, way, options.sheets)
            if row is not None:
                rows.append(row)
                print(line(row), flush=True)
    for way in options.ways.split(","):
        print(calibration([row for row in rows if row["way"] == way], way))
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n")


def faces(folder: Path, names: Sequence[str]) -> Iterator[Known]:
    """The shipped heads, and every face of the folder; only those named, if any are."""
    for name in ("tri_head", "quad_head", "closed_head"):
        if names and name not in names:
            continue
        path = sample(f"faces/{name}.obj")
        scene = read_scene(path)
        yield Known(name, scene, read_landmarks(path.with_name(f"{name}.fps.json"), scene))
    yield from phenotypes(folder, names)
    truths = {"generic_neutral_mesh": "ict.json", "base": "makehuman.json"}
    for path in sorted((folder / "faces").glob("*/*.obj")):
        name = path.parent.name if len(list(path.parent.glob("*.obj"))) == 1 else path.stem
        if names and name not in names:
            continue
        scene = read_scene(path)
        truth = folder / "landmarks" / truths[path.stem] if path.stem in truths else None
        yield Known(name, scene, None if truth is None else read_landmarks(truth, scene))


def phenotypes(folder: Path, names: Sequence[str]) -> Iterator[Known]:
    """Two MakeHuman phenotypes, as they are and decimated to another topology."""
    files = folder / "faces" / "makehuman"
    for name, build in (("phenotype_a", phenotype_a), ("phenotype_b", phenotype_b)):
        wanted = [kind for kind in ("", "_dec") if not names or name + kind in names]
        if not wanted or not files.exists():
            continue
        head = build(open_makehuman(files))
        for kind in wanted:
            made = decimated(head, names=()) if kind else known_head(head, ())
            yield Known(name + kind, made.scene, made.points)


def posed(known: Known) -> Known:
    """The same face with gaze along x, up along z, tilted, in another unit, far away, wound inside out."""
    angle = np.radians(TILT)
    tilt = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    turn = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]) @ tilt

    def moved(vertices: Floats) -> Floats:
        there: Floats = 0.02 * vertices @ turn.T + np.array([3.0, -7.0, 11.0])
        return there

    shapes = {
        s.name: replace(s, mesh=s.mesh.with_vertices(moved(s.mesh.vertices)).reversed()) for s in known.scene.shapes
    }
    truth = known.truth
    if truth is not None:
        truth = FeaturePoints({key: p for key, p in truth.items() if p.shape is not None})
    return Known(known.name, known.scene.map_shapes(shapes), truth)


def measure(known: Known, source: PreparedFace, way: str, sheets: Path | None) -> dict[str, object] | None:
    """Detect, compare and draw; None where clicks are asked for, but nothing is known."""
    given = None
    if way == "clicks":
        if known.truth is None:
            return None
        given = FeaturePoints({key: known.truth[key] for key in CLICKS})
    start = process_time()
    row: dict[str, object] = {"face": known.name, "way": way}
    try:
        found = detect_points(known.scene, source, given, detector="auto" if way == "clicks" else way)
    except LandmarkError as error:
        return {**row, "refused": str(error), "seconds": process_time() - start}
    row |= {"score": found.score, "seconds": process_time() - start, "uncertain": [f.message for f in found.findings]}
    if sheets is not None:
        sheets.mkdir(parents=True, exist_ok=True)
        scene, points, _ = orient(known.scene, found.points)
        save_png(landmark_sheet(scene, points, known.name), sheets / f"{known.name}_{way}.png")
    if known.truth is not None:
        off = errors(known.scene, found.points, known.truth, () if given is None else CLICKS)
        row["errors"], row["confidence"] = off, {key: found.points[key].confidence for key in off}
        far = [key for key, value in off.items() if value > WRONG]
        row["wrong"], row["unsaid"] = len(far), sum(found.points[key].confidence >= 0.5 for key in far)
    return row


def errors(scene: FaceScene, found: FeaturePoints, truth: FeaturePoints, without: tuple[str, ...]) -> dict[str, float]:
    """Distance from the truth of each point on the skin, in eye widths."""
    at, wanted = found.positions(scene), truth.positions(scene)
    width = 0.5 * sum(np.linalg.norm(wanted[a] - wanted[b]) for a, b in (("3.7", "3.11"), ("3.8", "3.12")))
    counted = [key for key in at if key in wanted and key not in without and key not in INSIDE]
    return {key: float(np.linalg.norm(at[key] - wanted[key]) / width) for key in counted if key[:2] != "6."}


def calibration(rows: Sequence[Mapping[str, Any]], way: str) -> str:
    """What the confidence of a way is worth, over all points whose place is known."""
    known = [row for row in rows if "errors" in row]
    pairs = np.array([(row["confidence"][key], off) for row in known for key, off in row["errors"].items()])
    pairs = pairs.reshape(-1, 2)
    sure = pairs[:, 0] >= LOW
    low, high = pairs[~sure], pairs[sure]
    return (
        f"{way}: of {len(low)} points with a confidence < 0.5 {int((low[:, 1] > HALF).sum())} are off by more than "
        f"{HALF:g}; of {len(high)} others {int((high[:, 1] > HALF).sum())}, and "
        f"{int((high[:, 1] > WRONG).sum())} by more than {WRONG:g}"
    )


def line(row: Mapping[str, object]) -> str:
    """One row of the table."""
    start = f"{row['face']:22}{row['way']:11}"
    if "refused" in row:
        return f"{start}refused: {row['refused']}"
    text = f"{start}{row['score']:6.2f}{row['seconds']:6.1f}  "
    off = row.get("errors")
    if not isinstance(off, dict):
        return text
    for name in GROUPS:
        values = [v for key, v in off.items() if belongs(key, name)]
        text += f"{np.mean(values):15.3f}/{max(values):.3f} "
    reached = all(value <= bar for value, bar in zip((np.mean(values), max(values)), BAR, strict=True))
    text += " reached" if reached else " missed "
    good = sum(off[key] < 0.08 for key in LANDMARKS if key in off)
    return f"{text}  {good} of the 20 < 8 %; {row['wrong']} points > {WRONG:g}, {row['unsaid']} of them not said"


def belongs(key: str, group: str) -> bool:
    """Whether a feature point counts in a group."""
    ids = GROUPS[group]
    return key in ids or (key.split(".")[0] in ids and (key not in JAW))


if __name__ == "__main__":
    main()
