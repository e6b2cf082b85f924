"""How faithful the backends are: measures on faces whose motion is known, and on one whose is not.

    python -m benchmarks.fidelity [--source mean|shipped] [--backends NAMES] [--makehuman FOLDER] [--faces FOLDER]
                                  [--sheets FOLDER] [--json FILE] [--write]

A MakeHuman head is cloned onto two other phenotypes, as they are and decimated to another topology, where its own
units are the truth (as they are, and scaled by FAPUs), and onto ICT-FaceKit, where no truth exists. The head is a mean
phenotype with MakeHuman's own units, so that nothing but cloning differs from the truth; or the shipped source's,
whose units are smoothed. ICT-FaceKit's generic face is cloned onto another of its identities, as it is and decimated,
where its own shapes are the truth. Each backend's default mode stands beside the published one. --write puts the
tables into docs/backends; docs/benchmarks.md takes the numbers from here (`benchmarks.report`).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from benchmarks import identities
from benchmarks.kits import SHARED
from benchmarks.known_faces import Target, other_identities, targets
from cloning import CloneReport, backends, clone_shapes
from cloning.fmc import scale_field
from cloning.prepare import PreparedFace, prepare
from cloning.visibility import visible
from fba.arrays import Floats
from fba.shapes import ShapeSet
from samples.build.arkit_docs import put_tables
from samples.build.makehuman import open_makehuman
from samples.build.phenotypes import KnownHead, known, phenotype_mean
from samples.build.source import source_head
from studio.render.figure import Figure

LIPS = (("2.2", "2.3"), ("2.6", "2.8"), ("2.7", "2.9"))
LIDS = {"eyeBlinkLeft": ("3.1", "3.3"), "eyeBlinkRight": ("3.2", "3.4")}
MOVING = 0.01
DOCS = Path(__file__).resolve().parents[1] / "docs"
DOCUMENTED = {
    "truth": "truth error, visible skin",
    "fapu_truth": "against the truth scaled by FAPUs",
    "fp_before": "feature points, before correction",
    "fp_after": "feature points, in the finished face",
    "lid": "lid gap after a blink, middle",
    "lid_worst": "lid gap after a blink, worst",
    "lip": "lip gap",
    "flips%": "flips, %",
    "still": "back of the head",
}
PAGES = {"vtc-image": "vtc"}
"""Backends that share a page with another one."""

SOURCES = {"mean": phenotype_mean, "shipped": source_head}
FACE_UNITS = ("eyeBlinkLeft", "mouthSmileLeft", "jawOpen", "browInnerUp", "mouthFunnel", "cheekPuff")


class Source:
    """A face that is cloned, with its shapes."""

    def __init__(self, head: KnownHead) -> None:
        self.head, self.shapes = head, head.shapes()
        self.prepared = prepare(head.scene, head.points, "source")
        print_row("source", "itself", own_measures(self.prepared, self.shapes))

    def cloned(self, target: Target, backend: str, as_published: bool) -> tuple[ShapeSet, dict[str, float]]:
        """The shapes on a target, and the measures of this clone."""
        cloned, report = clone_shapes(
            self.head.scene,
            self.head.points,
            self.shapes,
            target.scene,
            target.points,
            backend=backend,
            as_published=as_published,
        )
        return cloned, measure(self.prepared, self.shapes, target, cloned, report)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--source", choices=SOURCES, default="mean")
    parser.add_argument("--makehuman", type=Path, default=SHARED / "faces" / "makehuman")
    parser.add_argument("--faces", type=Path, default=SHARED)
    parser.add_argument("--sheets", type=Path)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--backends", default=",".join(b.name for b in backends()), help="names, by commas")
    options = parser.parse_args()
    makehuman = open_makehuman(options.makehuman)
    sources = {False: Source(known(SOURCES[options.source](makehuman)))}
    rows = []
    print(f"{'target':18}{'mode':16}" + "".join(f"{name:>11}" for name in HEADINGS))
    for target in (*targets(makehuman, options.faces), *other_identities(options.faces)):
        if target.own and True not in sources:
            sources[True] = Source(identities.generic(options.faces))
        for backend in options.backends.split(","):
            for as_published in (False, True):
                cloned, row = sources[target.own].cloned(target, backend, as_published)
                mode = f"{backend} published" if as_published else backend
                print_row(target.name, mode, row)
                rows.append({"target": target.name, "backend": backend, "published": as_published, **row})
                if options.sheets is not None:
                    draw(target, cloned, options.sheets / f"fidelity_{target.name}_{mode.replace(' ', '_')}.png")
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=2))
    if options.write:
        measured = options.backends.split(",")
        for name in measured:
            table = {"fidelity image" if name == "vtc-image" else "fidelity": backend_table(rows, name)}
            put_tables(DOCS / "backends" / f"{PAGES.get(name, name)}.md", table)


HEADINGS = (
    "fp_before",
    "fp_after",
    "truth",
    "fapu_truth",
    "truth_hid",
    "lid",
    "lid_worst",
    "lip",
    "flips%",
    "stretch",
    "still",
)


def document_table(rows: Sequence[Mapping[str, object]]) -> str:
    """The table of docs/benchmarks.md: one line for each backend and mode, one column for each target."""
    names = list(dict.fromkeys(str(row["target"]) for row in rows))
    modes = list(dict.fromkeys((str(row["backend"]), bool(row["published"])) for row in rows))
    cells = {(row["target"], row["backend"], row["published"]): row for row in rows}
    head = f"| | {' | '.join(names)} |\n|---|{'---|' * len(names)}\n"
    lines = []
    for measure, title in DOCUMENTED.items():
        lines.append(f"| **{title}** |{' |' * len(names)}")
        for backend, published in modes:
            found = [cells[name, backend, published].get(measure) for name in names]
            shown = " | ".join("-" if value is None else f"{value:.3f}" for value in found)
            lines.append(f"| {backend}{', published' if published else ''} | {shown} |")
    return head + "\n".join(lines) + "\n"


def backend_table(rows: Sequence[Mapping[str, object]], backend: str) -> str:
    """The table of one backend's page: default mode, in brackets as published."""
    names = list(dict.fromkeys(str(row["target"]) for row in rows))
    cells = {(row["target"], row["published"]): row for row in rows if row["backend"] == backend}
    lines = [f"| | {' | '.join(names)} |", f"|---|{'---|' * len(names)}"]
    for measure, title in DOCUMENTED.items():
        found = [(cells[name, False].get(measure), cells[name, True].get(measure)) for name in names]
        shown = " | ".join("-" if a is None else f"{a:.3f} [{b:.2f}]" for a, b in found)
        lines.append(f"| {title} | {shown} |")
    return "\n".join(lines) + "\n"


def print_row(target: str, mode: str, row: dict[str, float]) -> None:
    cells = "".join(f"{row[h]:11.4f}" if h in row else f"{'-':>11}" for h in HEADINGS)
    print(f"{target:18}{mode:16}{cells}")


def own_measures(face: PreparedFace, shapes: ShapeSet) -> dict[str, float]:
    """What the source itself has: lids after a blink, flips, stretch."""
    moved = [skin_offsets(face, shapes, k) for k in range(len(shapes.names))]
    lids = [lid_gaps(face, moved[shapes.names.index(name)], name) for name in LIDS]
    flips, stretch = zip(*(distortion(face, m) for m in moved), strict=True)
    return {
        "lid": float(np.mean([gap[0] for gap in lids])),
        "lid_worst": max(gap[1] for gap in lids),
        "flips%": 100.0 * float(np.mean(flips)),
        "stretch": float(np.mean(stretch)),
    }


def measure(
    source: PreparedFace, shapes: ShapeSet, target: Target, cloned: ShapeSet, report: CloneReport
) -> dict[str, float]:
    """All measures of one clone; lids, lips and what must rest are beside the source's own value."""
    face = prepare(target.scene, target.points, "target")
    mine = [skin_offsets(source, shapes, k) for k in range(len(shapes.names))]
    yours = [skin_offsets(face, cloned, k) for k in range(len(shapes.names))]
    row = {
        "fp_before": report.measures["fp_error_before"],
        "fp_after": report.measures["fp_error_after"],
    }
    lids, worst = [], []
    for name in LIDS:
        k = shapes.names.index(name)
        a, b = lid_gaps(source, mine[k], name), lid_gaps(face, yours[k], name)
        lids.append(abs(b[0] - a[0]))
        worst.append(b[1] - a[1])
    row["lid"], row["lid_worst"] = max(lids), max(worst)
    row["lip"] = max(
        float(np.abs(lip_gaps(face, b) - lip_gaps(source, a)).max()) for a, b in zip(mine, yours, strict=True)
    )
    flips, stretch = zip(*(distortion(face, m) for m in yours), strict=True)
    row["flips%"], row["stretch"] = 100.0 * float(np.mean(flips)), float(np.mean(stretch))
    resting = [max(back_of_head(f, m) for m in motions) for f, motions in ((source, mine), (face, yours))]
    row["still"] = max(resting[1] - resting[0], 0.0)
    if target.truth is not None:
        seen = visible(face.skin)
        real = [skin_offsets(face, target.truth, k) for k in range(len(shapes.names))]
        row["truth"] = float(np.mean([relative(b[seen], a[seen]) for a, b in zip(real, yours, strict=True)]))
        scale = scale_field(source, face)
        row["fapu_truth"] = float(
            np.mean([relative(b[seen], (scale * a)[seen]) for a, b in zip(real, yours, strict=True)])
        )
        row["truth_hid"] = float(np.mean([relative(b[~seen], a[~seen]) for a, b in zip(real, yours, strict=True)]))
    return row


def relative(found: Floats, truth: Floats) -> float:
    size = float(np.linalg.norm(truth))
    return float(np.linalg.norm(found - truth)) / size if size else 0.0


def skin_offsets(face: PreparedFace, shapes: ShapeSet, k: int) -> Floats:
    """Skin offsets of one shape, in eye separations."""
    frame = face.scene.frame
    return face.skin.join(face.scene.scatter(frame.from_file(shapes.deltas[k]))) / face.fapu.es0


def _at(face: PreparedFace, offsets: Floats, ids: list[str]) -> Floats:
    rows = face.skin.point_matrix(ids)
    found: Floats = rows @ (face.skin.vertices + offsets)
    return found


def lid_gaps(face: PreparedFace, offsets: Floats, name: str) -> tuple[float, float]:
    """Gap in the middle of the lids, and the largest along their edges, in IRISD."""
    from cloning.contours import CONTOURS, contour_places

    upper, lower = LIDS[name]
    iris = face.fapu.irisd0 / face.fapu.es0
    top, bottom = _at(face, offsets, [upper, lower])
    lines = {c.label: c for c in CONTOURS}
    pair = (3, 4) if upper == "3.1" else (5, 6)
    edges = [contour_places(face.skin, lines[k]) @ (face.skin.vertices + offsets) for k in pair]
    gaps = edges[0][:, 1] - edges[1][:, 1]
    return float(top[1] - bottom[1]) / iris, float(gaps.max()) / iris


def lip_gaps(face: PreparedFace, offsets: Floats) -> Floats:
    """How much the lips part or close at three places against the neutral face, in MNS."""
    ids = [i for pair in LIPS for i in pair]
    change = _at(face, offsets, ids) - _at(face, 0.0 * offsets, ids)
    gaps: Floats = (change[::2, 1] - change[1::2, 1]) * face.fapu.es0 / face.fapu.mns0
    return gaps


def distortion(face: PreparedFace, offsets: Floats) -> tuple[float, float]:
    """Share of moving triangles turned by more than 90 degrees, and the 99th percentile of |log edge ratio|."""
    triangles = face.skin.triangles
    size = np.linalg.norm(offsets, axis=1)
    moving = size[triangles].max(axis=1) > MOVING * max(float(size.max()), 1e-12)
    rest, moved = face.skin.vertices[triangles[moving]], (face.skin.vertices + offsets)[triangles[moving]]
    normals = [np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0]) for v in (rest, moved)]
    flipped = np.einsum("ij,ij->i", *normals) < 0
    sides = [np.linalg.norm(v - np.roll(v, 1, axis=1), axis=2) for v in (rest, moved)]
    ratio = np.abs(np.log(np.maximum(sides[1], 1e-9) / np.maximum(sides[0], 1e-9)))
    return float(flipped.mean()) if len(flipped) else 0.0, float(np.percentile(ratio, 99)) if ratio.size else 0.0


def back_of_head(face: PreparedFace, offsets: Floats) -> float:
    """Largest offset behind the ears, relative to the largest anywhere."""
    ear = face.skin.positions.get("10.3", face.skin.positions["7.1"])
    behind = face.skin.vertices[:, 2] < ear[2] - 0.1
    size = np.linalg.norm(offsets, axis=1)
    return float(size[behind].max(initial=0.0)) / max(float(size.max()), 1e-12)


def draw(target: Target, cloned: ShapeSet, path: Path) -> None:
    """A row of pictures, one for each of some units."""
    from PIL import Image

    face = prepare(target.scene, target.points, "target")
    figure = Figure(face.scene, face.points)
    pictures = []
    for name in FACE_UNITS:
        delta = face.scene.scatter(face.scene.frame.from_file(cloned.deltas[cloned.names.index(name)]))
        posed = {s.name: face.scene.world_vertices(s.name) + delta[s.name] for s in face.scene.shapes}
        pictures.append(figure.draw(posed, (320, 320)))
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.hstack(pictures)).save(path)


if __name__ == "__main__":
    main()
