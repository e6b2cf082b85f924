"""Faces to clone onto whose own motion is known, and one whose motion is not."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from benchmarks import identities
from benchmarks.kits import read_kit_points
from fba.feature_points import FeaturePoints
from fba.scene import FaceScene
from fba.shapes import ShapeSet
from formats import read_scene
from samples.build.phenotypes import decimated, known, phenotype_a, phenotype_b


@dataclass(frozen=True)
class Target:
    """A face to clone onto, and the truth where it is known.

    own : the truth and the source are ICT-FaceKit's, not MakeHuman's.
    """

    name: str
    scene: FaceScene
    points: FeaturePoints
    truth: ShapeSet | None
    own: bool = False


def targets(makehuman: object, faces: Path) -> Iterator[Target]:
    """Two phenotypes in another topology, their source topology, and ICT-FaceKit where the folder is there."""
    for name, build in (("phenotype_a", phenotype_a), ("phenotype_b", phenotype_b)):
        head = build(makehuman)  # type: ignore[arg-type]
        for kind, made in (("", known(head)), ("_dec", decimated(head))):
            yield Target(name + kind, made.scene, made.points, made.shapes())
    mesh = faces / "faces" / "ict-facekit" / "generic_neutral_mesh.obj"
    if mesh.exists():
        scene = read_scene(mesh)
        yield Target("ict", scene, read_kit_points(faces / "landmarks" / "ict.json", scene), None)


def other_identities(faces: Path) -> Iterator[Target]:
    """Another identity of ICT-FaceKit where the folder is there: in the kit's topology, and in another one."""
    if identities.kit_folder(faces).is_dir():
        head = identities.identity(faces)
        for name, made in (("ict_b", head), ("ict_b_dec", identities.decimated(head))):
            yield Target(name, made.scene, made.points, made.shapes(), own=True)
