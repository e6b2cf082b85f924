"""The faces that stand in for the papers' own, which are not public."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from authoring.author import author
from benchmarks.kits import read_kit_points
from cloning.prepare import PreparedFace, prepare
from fat.face import AnimatableFace
from fat.rig import unrig
from formats import read_face, read_scene
from formats.shapes import read_shapes
from samples import sample
from studio.compared_faces import Model, read_model

HEADS = ("quad_head", "tri_head")


@dataclass(frozen=True)
class Cast:
    """Faces that anybody may show; those of the folder only where it is there.

    folder : with ``faces/ict-facekit``, ``faces/soma`` and ``landmarks/ict.json``.
    """

    folder: Path

    @cached_property
    def grid(self) -> list[Model]:
        """The grids' faces, the shipped source first: ICT-FaceKit moves by its own shapes, the others are plain."""
        found = [read_model("default"), *(read_model(str(sample(f"faces/{name}.obj"))) for name in HEADS)]
        kit = self.folder / "faces" / "ict-facekit"
        if kit.is_dir():
            scene = read_scene(kit / "generic_neutral_mesh.obj")
            points = read_kit_points(self.folder / "landmarks" / "ict.json", scene)
            face, _ = author(scene, points, read_shapes(kit / "expressions.npz", scene))
            found.append(Model("ict-facekit", str(kit), face, face.feature_points))
        soma = sorted((self.folder / "faces" / "soma").glob("*.obj"))
        if soma:
            found.append(read_model(str(soma[0])))
        return found

    @cached_property
    def grid_face(self) -> AnimatableFace:
        """The shipped source."""
        return read_face("default")

    @cached_property
    def source(self) -> PreparedFace:
        """The shipped source, ready for cloning: dense."""
        return prepare(unrig(self.grid_face), self.grid_face.feature_points, "source")

    @cached_property
    def target(self) -> PreparedFace:
        """The shipped decimated head: coarse triangles."""
        model = self.grid[2]
        assert not isinstance(model.neutral, AnimatableFace)
        assert model.points is not None
        return prepare(model.neutral, model.points, "target")

    source_name = "shipped source"
    target_name = "tri_head"
