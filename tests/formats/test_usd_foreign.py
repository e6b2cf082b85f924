"""Stages that other programs wrote, here by hand in the ways that the schemas allow."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

from fba import FaceScene, Shape, Transform
from fba.errors import InputFileError, UnsupportedFeatureError
from formats import usd

QUAD = """
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 1, 0)]
    int[] faceVertexCounts = [4, 3]
    int[] faceVertexIndices = [0, 1, 2, 3, 1, 4, 2]
"""


def _read(path: Path, text: str) -> FaceScene:
    path.write_text("#usda 1.0\n" + text.replace(" }", "\n}"))
    found = usd.read(path)
    assert isinstance(found, FaceScene)
    return found


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "foreign.usda"


OPS = {
    "translate and euler": "double3 xformOp:translate = (1, 2, 3)\nfloat3 xformOp:rotateXYZ = (10, 20, 30)\n"
    'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]',
    "mirror": 'double3 xformOp:scale = (-1, 2, 3)\nuniform token[] xformOpOrder = ["xformOp:scale"]',
    "maya pivots": "double3 xformOp:translate = (1, 2, 3)\ndouble3 xformOp:translate:rotatePivot = (4, 5, 6)\n"
    "double xformOp:rotateY = 30\n"
    'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:translate:rotatePivot", "xformOp:rotateY", '
    '"!invert!xformOp:translate:rotatePivot"]',
    "sheared matrix": "matrix4d xformOp:transform = ((1, 0.5, 0, 0), (0.1, 2, 0, 0), (0, 0.3, -1, 0), (7, 8, 9, 1))\n"
    'uniform token[] xformOpOrder = ["xformOp:transform"]',
    "flat matrix": "matrix4d xformOp:transform = ((1, 0.5, 0, 0), (0, 2, 0, 0), (0, 0, 0, 0), (7, 8, 9, 1))\n"
    'uniform token[] xformOpOrder = ["xformOp:transform"]',
    "only samples": "double3 xformOp:translate.timeSamples = { 3: (1, 2, 3), 4: (9, 9, 9) }\n"
    'uniform token[] xformOpOrder = ["xformOp:translate"]',
}


@pytest.mark.parametrize("what", OPS)
def test_any_affine_ops_become_a_transform(path: Path, what: str) -> None:
    scene = _read(path, f'def Xform "top" {{ def Xform "head" {{ {OPS[what]}\n def Mesh "skin" {{ {QUAD} }} }} }}')
    (transform,) = scene.roots
    assert isinstance(transform, Transform)
    stage = Usd.Stage.Open(str(path))
    time = Usd.TimeCode(3) if what == "only samples" else Usd.TimeCode.Default()
    matrix = UsdGeom.Xformable(stage.GetPrimAtPath("/top/head")).ComputeLocalToWorldTransform(time)
    assert np.allclose(scene.world_matrix("skin"), np.array(matrix).T, rtol=0, atol=1e-12)
    again = path.with_name("again.usdc")
    usd.write(scene, again)
    found = usd.read(again)
    assert isinstance(found, FaceScene)
    assert np.allclose(found.world_vertices("skin"), scene.world_vertices("skin"), rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("ops", "error"),
    [
        (
            "matrix4d xformOp:transform = ((1, 0, 0, 0.5), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))\n"
            'uniform token[] xformOpOrder = ["xformOp:transform"]',
            "not affine",
        ),
        ('uniform token[] xformOpOrder = ["!resetXformStack!"]', "resets"),
    ],
)
def test_what_no_transform_can_say_is_refused(path: Path, ops: str, error: str) -> None:
    with pytest.raises(UnsupportedFeatureError, match=error):
        _read(path, f'def Xform "top" {{ def Xform "head" {{ {ops}\n def Mesh "skin" {{ {QUAD} }} }} }}')


def test_polygons_names_units_and_up_axis(path: Path) -> None:
    scene = _read(
        path,
        '(\nupAxis = "Z"\nmetersPerUnit = 1\n)\n'
        f'def Xform "a" {{ def Xform "Head" {{ def Mesh "Head" {{ {QUAD} }} }} }}\n'
        f'def Mesh "b" {{ uniform token orientation = "leftHanded"\n {QUAD} }}\n'
        f'def Mesh "helper" {{ uniform token purpose = "guide"\n {QUAD} }}\n',
    )
    assert [s.name for s in scene.shapes] == ["Head", "b"]
    assert [t.name for t in scene.transforms] == ["Head_2"]
    assert scene.meters_per_unit == 1.0
    assert scene.shape("Head").mesh.face(0).tolist() == [0, 1, 2, 3]
    assert scene.shape("b").mesh.face(0).tolist() == [3, 2, 1, 0]
    again = path.with_name("again.usda")
    usd.write(scene, again)
    assert UsdGeom.GetStageUpAxis(Usd.Stage.Open(str(again))) == "Z"


@pytest.mark.parametrize(
    ("interpolation", "values", "expected"),
    [
        ("vertex", 5, [0, 1, 2, 3, 1, 4, 2]),
        ("varying", 5, [0, 1, 2, 3, 1, 4, 2]),
        ("faceVarying", 7, [0, 1, 2, 3, 4, 5, 6]),
        ("uniform", 2, [0, 0, 0, 0, 1, 1, 1]),
        ("constant", 1, [0, 0, 0, 0, 0, 0, 0]),
    ],
)
def test_uv_and_normals_in_every_interpolation(
    path: Path, interpolation: str, values: int, expected: list[int]
) -> None:
    uv = ", ".join(f"({i}, {i + 0.5})" for i in range(values))
    normals = ", ".join(f"({i}, 0, 1)" for i in range(values))
    scene = _read(
        path,
        f'def Mesh "skin" {{ {QUAD} texCoord2f[] primvars:UVMap = [{uv}] ( interpolation = "{interpolation}" )\n'
        f'normal3f[] normals = [{normals}] ( interpolation = "{interpolation}" ) }}',
    )
    mesh = scene.shape("skin").mesh
    assert mesh.texcoords is not None
    assert mesh.texcoord_indices is not None
    assert mesh.normals is not None
    assert mesh.texcoords[mesh.texcoord_indices][:, 0].tolist() == expected
    assert mesh.normals[mesh.normal_indices][:, 0].tolist() == expected


def test_materials_of_the_mesh_and_of_subsets(path: Path) -> None:
    path.write_text(f'#usda 1.0\ndef Mesh "skin" {{ {QUAD} }}')
    stage = Usd.Stage.Open(str(path))
    skin = stage.GetPrimAtPath("/skin")
    colors = {"whole": (1, 0, 0), "part": (0, 0.5, 0)}
    bound = {}
    for name, color in colors.items():
        material = UsdShade.Material.Define(stage, f"/{name}")
        shader = UsdShade.Shader.Define(stage, f"/{name}/s")
        shader.CreateIdAttr("UsdPreviewSurface")
        shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*color))
        material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
        bound[name] = material
    UsdShade.MaterialBindingAPI.Apply(skin).Bind(bound["whole"])
    stage.Save()
    scene = usd.read(path)
    assert isinstance(scene, FaceScene)
    assert [m.diffuse for m in scene.shapes[0].materials] == [(1, 0, 0)]
    assert scene.shapes[0].mesh.face_materials is None
    subset = UsdShade.MaterialBindingAPI(skin).CreateMaterialBindSubset("sub", [1])
    UsdShade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(bound["part"])
    stage.Save()
    del stage, skin, bound, material, shader, subset
    scene = usd.read(path)
    assert isinstance(scene, FaceScene)
    assert [m.name for m in scene.shapes[0].materials] == ["whole", "part"]
    assert scene.shapes[0].mesh.face_materials is not None
    assert scene.shapes[0].mesh.face_materials.tolist() == [0, 1]


def test_instances_and_references_are_read(path: Path) -> None:
    path.with_name("eye.usda").write_text(
        f'#usda 1.0\n(defaultPrim = "e")\ndef Xform "e" {{ def Mesh "ball" {{ {QUAD}\n}}\n}}\n'
    )
    place = 'double3 xformOp:translate = ({}, 0, 0)\nuniform token[] xformOpOrder = ["xformOp:translate"]'
    eyes = "\n".join(
        f'def Xform "{name}" (instanceable = true\nreferences = @./eye.usda@) {{ {place.format(x)} }}'
        for name, x in (("left", 5), ("right", -5))
    )
    scene = _read(path, f'def Xform "face" {{ {eyes} }}')
    assert [s.name for s in scene.shapes] == ["ball", "ball_2"]
    assert scene.world_vertices("ball")[0].tolist() == [5, 0, 0]
    assert scene.world_vertices("ball_2")[0].tolist() == [-5, 0, 0]
    path.with_name("eye.usda").unlink()
    with pytest.raises(InputFileError, match=r"eye\.usda"):
        usd.read(path)


def test_a_mesh_without_points_is_no_shape(path: Path) -> None:
    empty = 'def Mesh "none" { point3f[] points = []\nint[] faceVertexCounts = []\nint[] faceVertexIndices = [] }'
    scene = _read(path, f'def Xform "top" {{ {empty}\n def Mesh "skin" {{ {QUAD} }} }}')
    assert [s.name for s in scene.shapes] == ["skin"]
    with pytest.raises(InputFileError, match="with polygons"):
        _read(path, f'def Xform "top" {{ {empty} }}')


def test_a_mesh_below_a_mesh_keeps_its_place(path: Path) -> None:
    move = 'double3 xformOp:translate = (0, 0, 4)\nuniform token[] xformOpOrder = ["xformOp:translate"]'
    scene = _read(path, f'def Mesh "a" {{ {QUAD} {move}\n def Mesh "b" {{ {QUAD} {move} }} }}')
    assert scene.world_vertices("a")[0].tolist() == [0, 0, 4]
    assert scene.world_vertices("b")[0].tolist() == [0, 0, 8]
    assert all(isinstance(node, Shape | Transform) for node, _ in scene.walk())
