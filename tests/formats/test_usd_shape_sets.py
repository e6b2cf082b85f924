from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faces import assert_same_scene, small_face, small_scene
from pxr import Usd, UsdGeom, UsdSkel

from fat.evaluate import Player
from fba import FaceScene, Frame, PolyMesh, Shape, ShapeSet
from fba.errors import InputFileError, MeshError
from formats import read_scene, usd
from formats.usd.validate import validate_stage

Z_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
MIRRORED = np.diag([-1.0, 1.0, 1.0])


def _shapes(scene: FaceScene) -> ShapeSet:
    neutral = scene.frame.to_file(scene.world_neutral())
    deltas = np.random.default_rng(5).normal(size=(3, *neutral.shape)) / 10
    deltas[0, 3:] = 0.0
    deltas[2] = 0.0
    return ShapeSet(("smile", "8 odd näme", "still"), neutral, deltas)


@pytest.mark.parametrize("extension", ["usda", "usdc"])
@pytest.mark.parametrize("axes", [np.eye(3), Z_UP, MIRRORED])
def test_free_expressions_read_back(tmp_path: Path, extension: str, axes: np.ndarray) -> None:
    scene = small_scene(Frame(axes))
    shapes = _shapes(scene)
    path = tmp_path / f"shapes.{extension}"
    usd.write_shape_set(scene, shapes, path)
    found = usd.read_shape_set(path)
    assert found is not None
    assert found.names == shapes.names
    assert np.array_equal(found.neutral, shapes.neutral)
    assert np.allclose(found.deltas, shapes.deltas, rtol=0, atol=1e-7)
    again = usd.read(path)
    assert isinstance(again, FaceScene)
    assert_same_scene(again, scene)


def test_the_files_own_vertex_order_is_kept(tmp_path: Path) -> None:
    triangle = PolyMesh.from_faces(np.eye(3), [[0, 1, 2]])
    scene = FaceScene((Shape("a", triangle, vertex_ids=[5, 0, 2]), Shape("b", triangle, vertex_ids=[1, 4, 3])))  # type: ignore[arg-type]
    shapes = _shapes(scene)
    usd.write_shape_set(scene, shapes, tmp_path / "ids.usda")
    found = usd.read_shape_set(tmp_path / "ids.usda")
    assert found is not None
    assert np.array_equal(found.neutral, shapes.neutral)
    assert np.allclose(found.deltas, shapes.deltas, rtol=0, atol=1e-7)


def test_an_expression_has_one_token_on_all_meshes(tmp_path: Path) -> None:
    scene = small_scene()
    neutral = scene.world_neutral()
    deltas = np.zeros((3, *neutral.shape))
    deltas[0, 0] = 1.0
    deltas[1] = 1.0
    deltas[2] = 2.0
    shapes = ShapeSet(("a b", "a_b", "group_lower"), neutral, deltas)
    usd.write_shape_set(scene, shapes, tmp_path / "names.usda")
    stage = Usd.Stage.Open(str(tmp_path / "names.usda"))
    listed = {
        p.GetName(): UsdSkel.BindingAPI(p).GetBlendShapesAttr().Get() for p in stage.Traverse() if p.IsA(UsdGeom.Mesh)
    }
    assert list(listed["skin"] or ()) == ["a_b", "a_b_2", "group_lower"]
    assert list(listed["teeth"] or ()) == ["a_b_2", "group_lower"]
    found = usd.read_shape_set(tmp_path / "names.usda")
    assert found is not None
    assert found.names == shapes.names
    assert np.allclose(found.deltas, deltas, rtol=0, atol=1e-6)
    (tmp_path / "face.png").write_bytes(b"")
    assert validate_stage(tmp_path / "names.usda") == []


def test_real_expressions_read_back(tmp_path: Path, shared: Path) -> None:
    scene = read_scene(shared / "faces" / "ict-facekit" / "generic_neutral_mesh.obj")
    stored = np.load(shared / "faces" / "ict-facekit" / "expressions.npz")
    names = tuple(str(n) for n in stored["names"][:12])
    shapes = ShapeSet(names, scene.frame.to_file(scene.world_neutral()), stored["deltas"][:12].astype(np.float64))
    path = tmp_path / "ict.usdc"
    usd.write_shape_set(scene, shapes, path)
    assert validate_stage(path) == []
    found = usd.read_shape_set(path)
    assert found is not None
    assert found.names == names
    assert np.array_equal(found.neutral, shapes.neutral)
    largest = float(np.abs(shapes.deltas).max())
    assert np.abs(found.deltas - shapes.deltas).max() <= 1e-6 * largest
    again = usd.read(path)
    assert isinstance(again, FaceScene)
    assert_same_scene(again, scene)


def test_the_tables_of_a_face_are_free_expressions_as_well(tmp_path: Path) -> None:
    face = small_face(Frame(Z_UP))
    usd.write(face, tmp_path / "face.usdc")
    found = usd.read_shape_set(tmp_path / "face.usdc")
    assert found is not None
    jaw = found.deltas[found.names.index("open_jaw")]
    world = Player(face).pose({3: 1080}).world() - face.scene.world_neutral()
    assert np.allclose(jaw, face.scene.frame.to_file(world), atol=1e-6)


def test_a_file_without_blend_shapes_has_none(tmp_path: Path) -> None:
    usd.write(small_scene(), tmp_path / "plain.usda")
    assert usd.read_shape_set(tmp_path / "plain.usda") is None


def test_shapes_of_other_programs(tmp_path: Path) -> None:
    path = tmp_path / "other.usda"
    text = """#usda 1.0
def Mesh "m" ( prepend apiSchemas = ["SkelBindingAPI"] )
{
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0)]
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    uniform token[] skel:blendShapes = ["dense", "sparse"]
    rel skel:blendShapeTargets = [</m/a>, </m/b>]
    double3 xformOp:scale = (2, 2, 2)
    uniform token[] xformOpOrder = ["xformOp:scale"]
    def BlendShape "a" { uniform vector3f[] offsets = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
    }
    def BlendShape "b" { uniform vector3f[] offsets = [(0, 0, 3)]
    uniform int[] pointIndices = [1]
    }
}
"""
    path.write_text(text)
    found = usd.read_shape_set(path)
    assert found is not None
    assert found.names == ("dense", "sparse")
    assert np.array_equal(found.neutral, [[0, 0, 0], [2, 0, 0], [2, 2, 0]])
    assert np.array_equal(found.deltas[0], 2 * np.eye(3))
    assert np.array_equal(found.deltas[1], [[0, 0, 0], [0, 0, 6], [0, 0, 0]])
    for old, new in (("[1]", "[7]"), ("</m/a>, ", ""), ("</m/a>", "</m>"), ("(0, 1, 0), (0, 0, 1)", "(0, 1, 0)")):
        path.write_text(text.replace(old, new, 1))
        with pytest.raises(InputFileError):
            usd.read_shape_set(path)


def test_shapes_for_another_mesh_are_refused(tmp_path: Path) -> None:
    scene = small_scene()
    shapes = _shapes(scene)
    short = replace(shapes, neutral=shapes.neutral[1:], deltas=shapes.deltas[:, 1:])
    with pytest.raises(MeshError, match="do not fit"):
        usd.write_shape_set(scene, short, tmp_path / "shapes.usda")
    assert not list(tmp_path.iterdir())
