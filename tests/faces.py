"""Small faces with everything that a format has to carry."""

from __future__ import annotations

import numpy as np

from fat import AnimatableFace, FaceDefMesh, FaceDefTable, FaceDefTables, FaceDefTransform, TransformField
from fba import FaceScene, Fapu, FeaturePoint, FeaturePoints, Frame, Material, PolyMesh, Role, Shape, Transform


def skin_mesh() -> PolyMesh:
    """Eight vertices; a quad, two triangles and a pentagon; uv with a seam, two groups, two materials."""
    vertices = [
        [-1.0, -1.0, 0.1],
        [1.0, -1.0, 0.1],
        [1.0, 0.0, 1 / 3],
        [-1.0, 0.0, 0.3],
        [0.7, 1.1, 0.2],
        [-0.7, 1.1, 0.2],
        [0.0, 1.6, -0.1],
        [0.0, -1.5, -0.2],
    ]
    faces = [[0, 1, 2, 3], [7, 1, 0], [3, 2, 4], [3, 4, 6, 5, 0]]
    mesh = PolyMesh.from_faces(vertices, faces)
    corners = mesh.indices.size
    return PolyMesh(
        mesh.vertices,
        mesh.indices,
        mesh.offsets,
        texcoords=np.stack([np.arange(9) / 9, np.arange(9) / 10], axis=1),
        texcoord_indices=np.arange(corners, dtype=np.int32) % 9,
        face_groups=np.array([0, 0, 1, 1], dtype=np.int32),
        group_names=("lower", "upper"),
        face_materials=np.array([0, 1, 0, 1], dtype=np.int32),
    )


def ball_mesh(scale: float) -> PolyMesh:
    """An octahedron."""
    corners = scale * np.concatenate([np.eye(3), -np.eye(3)])
    faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    return PolyMesh.from_faces(corners, faces)


def small_scene(frame: Frame | None = None) -> FaceScene:
    """Skin, two eyes below nested transforms, teeth; all below a head transform."""
    eyes = tuple(
        Transform(
            f"eye_{side}_yaw",
            (
                Transform(
                    f"eye_{side}_pitch",
                    (Shape(f"eye_{side}", ball_mesh(0.2), role, (Material("eye", (0.9, 0.9, 0.95)),)),),
                    rotation=(1.0, 0.0, 0.0, 0.05),
                ),
            ),
            translation=(x, 0.4, 0.1),
        )
        for side, x, role in (("left", 0.4, Role.EYE_LEFT), ("right", -0.4, Role.EYE_RIGHT))
    )
    skin = Shape(
        "skin",
        skin_mesh(),
        Role.SKIN,
        (Material("face", (0.8, 0.6, 0.5), shininess=0.3, texture="face.png"), Material("lips", (0.7, 0.3, 0.3))),
    )
    teeth = Shape("teeth", ball_mesh(0.15), Role.LOWER_TEETH, (Material("teeth", (1.0, 1.0, 0.9)),))
    head = Transform("head", (skin, *eyes, teeth), translation=(0.1, 0.2, 0.3), center=(0.0, -1.0, 0.1))
    return FaceScene((head,), frame or Frame(), 0.1, "small")


def small_face(frame: Frame | None = None) -> AnimatableFace:
    """`small_scene` with tables: one interval, several, both signs, rotations, a viseme and an expression."""
    random = np.random.default_rng(7)

    def mesh(shape: str, borders: list[int], index: list[int]) -> FaceDefMesh:
        slopes = random.normal(size=(len(index), len(borders) - 1, 3)).astype(np.float32)
        return FaceDefMesh(shape, np.array(borders), np.array(index), slopes)

    tables = (
        FaceDefTable(3, 1, (mesh("skin", [0, 400, 1080], [0, 1, 7]), mesh("teeth", [0, 1080], list(range(6)))), ()),
        FaceDefTable(5, 1, (mesh("skin", [-1860, -400, 0, 600], [2, 3]),)),
        FaceDefTable(23, 1, (), (FaceDefTransform("eye_left_yaw", rotation_def=(0.0, 1.0, 0.0, 1.0)),)),
        FaceDefTable(24, 1, (), (FaceDefTransform("eye_right_yaw", rotation_def=(0.0, 1.0, 0.0, 1.0)),)),
        FaceDefTable(25, 1, (), (FaceDefTransform("eye_left_pitch", rotation_def=(-1.0, 0.0, 0.0, 1.0)),)),
        FaceDefTable(
            14,
            1,
            (mesh("skin", [-500, 0, 500], [1]),),
            (FaceDefTransform("head", TransformField.TRANSLATION, translation_def=(0.001, 0.0, -0.002)),),
        ),
        FaceDefTable(1, 1, (mesh("skin", [0, 63], [0, 1]),)),
        FaceDefTable(2, 6, (mesh("skin", [0, 63], [4, 5, 6]), mesh("teeth", [0, 63], [2]))),
    )
    points = FeaturePoints(
        {
            "2.1": FeaturePoint("skin", (0, 1, 7), (0.25, 0.25, 0.5), source="detected", confidence=0.75),
            "3.5": FeaturePoint("eye_left", (2,), (1.0,)),
            "7.1": FeaturePoint.free(np.array([0.1, -1.25, -0.5])),
        }
    )
    scene = small_scene(frame)
    return AnimatableFace(
        scene,
        points,
        FaceDefTables(tables),
        Fapu(0.2, 0.8, 0.7, 0.3, 0.9),
        {"open_jaw": "practical", "made by": "hand"},
    )


def assert_same_scene(found: FaceScene, wanted: FaceScene) -> None:
    """Every node, mesh, material and frame is the same; the scenes' names and documents may differ."""
    assert np.array_equal(found.frame.axes, wanted.frame.axes)
    assert found.frame.reversed_winding == wanted.frame.reversed_winding
    assert found.meters_per_unit == wanted.meters_per_unit
    pairs = list(zip(found.walk(), wanted.walk(), strict=True))
    for (a, above_a), (b, above_b) in pairs:
        assert (a.name, [t.name for t in above_a]) == (b.name, [t.name for t in above_b])
        if isinstance(b, Transform):
            assert isinstance(a, Transform)
            for name in ("translation", "rotation", "scale", "scale_orientation", "center"):
                assert getattr(a, name) == getattr(b, name), (b.name, name)
            continue
        assert isinstance(a, Shape)
        assert (a.role, a.materials) == (b.role, b.materials)
        assert_same_array(a.vertex_ids, b.vertex_ids)
        assert a.mesh.group_names == b.mesh.group_names
        for name in PolyMesh.__dataclass_fields__:
            if name != "group_names":
                assert_same_array(getattr(a.mesh, name), getattr(b.mesh, name), f"{b.name} {name}")


def assert_same_array(found: np.ndarray | None, wanted: np.ndarray | None, where: str = "") -> None:
    """Both absent, or equal in type and every value."""
    assert (found is None) == (wanted is None), where
    if found is not None and wanted is not None:
        assert found.dtype == wanted.dtype, where
        assert np.array_equal(found, wanted), where


def assert_same_face(found: AnimatableFace, wanted: AnimatableFace) -> None:
    """The same scene, tables, feature points, FAPUs and notes, exactly."""
    assert_same_scene(found.scene, wanted.scene)
    assert found.fapu == wanted.fapu
    assert dict(found.notes) == dict(wanted.notes)
    assert found.feature_points == wanted.feature_points
    assert [t.key for t in found.tables] == [t.key for t in wanted.tables]
    for a, b in zip(found.tables, wanted.tables, strict=True):
        assert a.transforms == b.transforms
        assert [m.shape for m in a.meshes] == [m.shape for m in b.meshes]
        for x, y in zip(a.meshes, b.meshes, strict=True):
            for name in ("interval_borders", "coord_index", "displacements"):
                assert_same_array(getattr(x, name), getattr(y, name), f"{b.name} {name}")
