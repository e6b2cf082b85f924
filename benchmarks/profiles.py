"""How well the published ARKit table holds on other faces: each shape against the FAPs that the table names for it.

    python -m benchmarks.profiles [--faces FOLDER] [--write]

A face is made animatable from its own shapes (`fba author`), so its FAPs are its own artist's. Printed are, for each
shape, what the published combination leaves over, and what the best combination for that face would. --write puts the
former into fat/profiles/data/arkit.csv.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from authoring.author import author
from benchmarks.kits import SHARED, arkit_shapes, read_kit_points
from fat.profiles import profile_table
from fba.arrays import Floats
from fba.feature_points import FeaturePoints
from fba.scene import FaceScene, Role
from fba.shapes import ShapeSet
from formats import read_scene
from formats.landmarks import read_landmarks
from formats.shapes import read_shapes
from samples.build.arkit_docs import put_tables
from samples.build.arkit_fit import Residual, residual, shape_to_faps
from samples.build.arkit_table import DATA, DOCS, FORWARD, read_rows, tables_in_words, write_rows
from samples.build.known_shapes import STILL, KnownShapes

RPM_POINTS = Path(__file__).resolve().parents[1] / "tests" / "data" / "rpm_brunette.fps.json"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--faces", type=Path, default=SHARED)
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    for known in known_faces(options.faces):
        table = {shape.name: dict(shape.faps) for shape in profile_table("arkit")}
        found = {name: residual(known, known.shapes[name], known.motion(table[name])) for name in known.shapes}
        print(f"{known.name:22}{'table':>12}{'':12}{'own fit':>12}\n{'':22}" + 2 * f"{'fp':>12}{'dense':>12}")
        for name, left in found.items():
            if not name.endswith("Right"):
                own = residual(known, known.shapes[name], known.motion(shape_to_faps(known, name)))
                print(f"{name:22}{left.fp:12.2f}{left.dense:12.2f}{own.fp:12.2f}{own.dense:12.2f}")
        if options.write:
            publish(known.name, found)


def known_faces(faces: Path) -> Iterator[KnownShapes]:
    """ICT-FaceKit and a Ready Player Me head with their own shapes, where their folders are there."""
    kit = faces / "faces" / "ict-facekit"
    if kit.is_dir():
        scene = read_scene(kit / "generic_neutral_mesh.obj")
        points = read_kit_points(faces / "landmarks" / "ict.json", scene)
        yield known_face("ict", scene, points, read_shapes(kit / "expressions.npz", scene))
    avatar = faces / "faces" / "rpm-brunette" / "brunette-t.glb"
    if avatar.exists():
        scene = read_scene(avatar)
        yield known_face("rpm", scene, read_landmarks(RPM_POINTS, scene), read_shapes(avatar, scene))


def known_face(name: str, scene: FaceScene, points: FeaturePoints, shapes: ShapeSet) -> KnownShapes:
    """A face animatable by its own shapes, and these shapes."""
    face, _ = author(scene, points, shapes)
    found = KnownShapes(name, face, arkit_shapes(shapes.names, face.scene.frame.from_file(shapes.deltas)))
    return replace(found, shapes={k: v for k, v in found.shapes.items() if _whole(found, k, v)})


def _whole(known: KnownShapes, name: str, offsets: Floats) -> bool:
    """The shape moves what it is about: some kits leave the eyeballs' turn to the program, or have no tongue."""
    part = known.seen
    if name.startswith("eyeLook"):
        part = known.of_role(Role.EYE_LEFT, Role.EYE_RIGHT)
    elif name == "tongueOut":
        part = known.of_role(Role.TONGUE)
    return float(np.abs(offsets[part]).max(initial=0.0)) > STILL * known.face.fapu.es0


def publish(name: str, found: dict[str, Residual]) -> None:
    """Put the residuals of one face beside the rows of arkit.csv, and into the documentation."""
    rows = read_rows(DATA / "arkit.csv")
    for row in rows:
        left = found.get(row["shape"])
        row[f"{name}_fp"] = "" if left is None else f"{left.fp:.2f}"
        row[f"{name}_dense"] = "" if left is None else f"{left.dense:.2f}"
    write_rows(DATA / "arkit.csv", FORWARD, rows)
    put_tables(DOCS, tables_in_words())


if __name__ == "__main__":
    main()
