"""Framing, colours and paint of whole faces."""

from __future__ import annotations

import numpy as np
import pytest

from fat import AnimatableFace
from fba import FaceScene, FeaturePoints, Material, PolyMesh, Role, Shape
from fba.feature_points import FeaturePoint
from formats import read_face
from studio.render import Camera, Figure, Style, frame_face, make_renderer, render_pose
from studio.render.camera import Camera as CameraClass
from studio.render.colors import NATURAL, eye_iris, is_clear, opacity, shape_colors, sphere_center
from studio.render.occlusion import ambient_occlusion, sphere_directions
from studio.render.protocol import project

SQUARE = [[0, 1, 2, 3]]
CORNERS = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]]


@pytest.fixture(scope="module")
def face() -> AnimatableFace:
    return read_face("default")


def shape(role: Role = Role.OTHER, name: str = "thing", materials: tuple[Material, ...] = (), **more: object) -> Shape:
    mesh = PolyMesh(np.array(CORNERS), np.arange(4), np.array([0, 4]), **more)  # type: ignore[arg-type]
    return Shape(name, mesh, role, materials)


def seen(camera: Camera, point: np.ndarray, width: int = 100, height: int = 100) -> np.ndarray:
    """Where a point falls in the picture: (x, y) with (-1, -1) lower left and (1, 1) upper right."""
    return project(np.atleast_2d(point), camera.clip_matrix(width, height, 10.0, -10.0))[0][0, :2]


def test_camera_puts_the_target_in_the_middle_from_every_side() -> None:
    for yaw in (-60.0, 0.0, 35.0):
        camera = CameraClass((1.0, 2.0, 3.0), 2.0, 1.0, yaw=yaw, pitch=12.0)
        assert np.allclose(seen(camera, np.array([1.0, 2.0, 3.0])), 0.0)


def test_camera_fits_its_frame_into_any_picture() -> None:
    camera = CameraClass((0.0, 0.0, 0.0), 2.0, 1.0, distance=None)
    assert np.allclose(seen(camera, np.array([1.0, 2.0, 0.0]), 100, 200), [1.0, 1.0])
    assert np.allclose(seen(camera, np.array([1.0, 2.0, 0.0]), 200, 200), [0.5, 1.0])
    assert np.allclose(seen(camera, np.array([1.0, 2.0, 0.0]), 100, 400), [1.0, 0.5])


def test_camera_walks_to_the_subjects_left_and_up() -> None:
    camera = CameraClass((0.0, 0.0, 0.0), 1.0, 1.0, distance=None)
    nose, left_ear, crown = np.array([0, 0, 0.5]), np.array([0.5, 0, 0]), np.array([0, 0.5, 0])
    assert np.allclose(seen(camera, left_ear), [0.5, 0.0])
    assert np.allclose(seen(camera.turned(90.0), left_ear), [0.0, 0.0])
    assert np.allclose(seen(camera.turned(90.0), nose), [-0.5, 0.0])
    assert np.allclose(seen(camera.turned(0.0, 90.0), crown), [0.0, 0.0])
    assert np.allclose(seen(camera.turned(0.0, 90.0), nose), [0.0, -0.5])


def test_face_is_framed_from_above_the_eyes_to_below_the_chin(face: AnimatableFace) -> None:
    camera = frame_face(face.scene, face.feature_points)
    places = face.feature_points.positions(face.scene)
    eyes, chin = seen(camera, (places["3.5"] + places["3.6"]) / 2), seen(camera, places["2.1"])
    assert abs(eyes[0]) < 0.02
    assert -0.2 < eyes[1] < 0.3
    assert -0.9 < chin[1] < -0.5
    for point in ("10.7", "10.8", "10.9", "10.10", "2.10"):  # ears and chin
        if point in places:
            assert np.abs(seen(camera, places[point])).max() < 1.0


def test_framing_is_of_the_face_whatever_its_size_and_place(face: AnimatableFace) -> None:
    """Without feature points the eyeballs do: much the same frame."""
    with_points = frame_face(face.scene, face.feature_points)
    without = frame_face(face.scene)
    assert without.half_height == pytest.approx(with_points.half_height, rel=0.15)
    assert np.abs(np.subtract(without.target, with_points.target)).max() < 0.15 * with_points.half_height


def test_framing_of_a_bare_mesh_shows_all_of_it() -> None:
    mesh = PolyMesh.from_faces(np.array(CORNERS) * 7.0 + 100.0, SQUARE)
    camera = frame_face(FaceScene((Shape("a", mesh, Role.SKIN),)))
    for vertex in mesh.vertices:
        assert np.abs(seen(camera, vertex)).max() <= 1.0
    assert frame_face(FaceScene(())).half_height > 0


def test_colours_come_from_role_name_or_material() -> None:
    assert tuple(shape_colors(shape(Role.SKIN))) == NATURAL[Role.SKIN]
    assert tuple(shape_colors(shape(Role.TONGUE))) == NATURAL[Role.TONGUE]
    assert tuple(shape_colors(shape(Role.OTHER))) == NATURAL[Role.OTHER]
    assert max(shape_colors(shape(Role.OTHER, "lashes_left"))) < 0.3
    green = Material("paint", (0.1, 0.7, 0.2))
    assert tuple(shape_colors(shape(Role.SKIN, materials=(green,)))) == green.diffuse
    assert tuple(shape_colors(shape(Role.SKIN, materials=(Material("default"),)))) == NATURAL[Role.SKIN]


def test_largest_shape_without_role_is_taken_for_skin_where_there_is_none() -> None:
    big = PolyMesh.from_faces(CORNERS, [[0, 1, 2], [0, 2, 3]])
    scene = FaceScene((shape(name="bolt"), Shape("figure_12", big)))
    assert [d.color.tolist() for d in Figure(scene, style=Style(occlusion=False)).drawables()] == [
        list(NATURAL[Role.OTHER]),
        list(NATURAL[Role.SKIN]),
    ]


def test_faces_of_several_materials_keep_their_own_colours() -> None:
    mesh = PolyMesh(
        np.array([*CORNERS, [3.0, 1.0, 0.0], [3.0, -1.0, 0.0]]),
        np.array([0, 1, 2, 3, 1, 5, 4, 2]),
        np.array([0, 4, 8]),
        face_materials=np.array([1, 0]),
    )
    red, blue = Material("red", (0.9, 0.1, 0.1)), Material("blue", (0.1, 0.1, 0.9))
    colors = shape_colors(Shape("eye", mesh, Role.EYE_LEFT, (red, blue)))
    assert colors.tolist() == [list(blue.diffuse)] * 2 + [list(red.diffuse)] * 2
    assert eye_iris(FaceScene((Shape("eye", mesh, Role.EYE_LEFT),)), Shape("eye", mesh, Role.EYE_LEFT), colors) is None


def test_parts_of_one_mesh_are_told_apart_by_names_of_groups_and_materials() -> None:
    vertices = np.array([*CORNERS, [3.0, 1.0, 0.0], [3.0, -1.0, 0.0]])
    corners, offsets, kinds = np.array([0, 1, 2, 3, 1, 5, 4, 2]), np.array([0, 4, 8]), np.array([0, 1])
    grouped = PolyMesh(vertices, corners, offsets, face_groups=kinds, group_names=("Head", "EyeLeft"))
    dressed = PolyMesh(vertices, corners, offsets, face_materials=kinds)
    shapes = (
        Shape("all", grouped, Role.SKIN),
        Shape("all", dressed, Role.SKIN, (Material("M_Face"), Material("M_ScleraLeft"))),
    )
    for one in shapes:
        skin, eye = shape_colors(one)[[0, 2]]
        assert tuple(skin) == NATURAL[Role.SKIN]
        assert tuple(eye) == NATURAL[Role.EYE_LEFT]


def test_films_over_the_eye_are_not_drawn_and_lashes_are_thin() -> None:
    assert is_clear(shape(name="EyeOcclusion"))
    assert is_clear(shape(materials=(Material("Cornea", transparency=0.0),)))
    assert is_clear(shape(materials=(Material("glass", transparency=1.0),)))
    assert not is_clear(shape(materials=(Material("half", transparency=0.5),)))
    assert opacity(shape(name="lashes_left")) < 0.5
    assert opacity(shape(materials=(Material("half", transparency=0.5),))) == 0.5


def test_eye_centre_is_found_from_a_cap_of_the_ball() -> None:
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(200, 3))
    directions[:, 2] = np.abs(directions[:, 2]) + 0.5
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    center = np.array([3.0, -2.0, 10.0])
    assert np.allclose(sphere_center(center + 0.3 * directions), center, atol=1e-6)


def test_open_sky_over_a_plane_in_a_pit_and_under_a_roof() -> None:
    grid = np.linspace(-1.0, 1.0, 21)
    x, z = (a.ravel() for a in np.meshgrid(grid, grid, indexing="ij"))
    floor = np.stack([x, np.zeros_like(x), z], axis=1)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(20), np.arange(20), indexing="ij"))
    a = i * 21 + j
    triangles = np.concatenate([np.stack([a, a + 1, a + 21], 1), np.stack([a + 1, a + 22, a + 21], 1)]).astype(np.int32)
    up = np.broadcast_to([0.0, 1.0, 0.0], floor.shape)
    open_sky = ambient_occlusion([(floor, triangles)], [up], np.zeros(3), 1.5)[0]
    assert open_sky.min() > 0.95
    roof = floor + np.array([0.0, 0.4, 0.0])
    shaded, above = ambient_occlusion([(floor, triangles), (roof, triangles)], [up, up], np.zeros(3), 1.5)
    middle = np.hypot(x, z) < 0.3
    assert shaded[middle].max() < 0.25
    assert above.min() > 0.95


def test_directions_are_even() -> None:
    directions = sphere_directions(48)
    assert np.allclose(np.linalg.norm(directions, axis=1), 1.0)
    assert np.abs(directions.mean(axis=0)).max() < 0.02


def test_brows_and_lips_are_painted_where_the_feature_points_are(face: AnimatableFace) -> None:
    renderer = make_renderer("software")
    bare = Figure(face.scene, face.feature_points, Style(features=False)).draw(size=(200, 200), renderer=renderer)
    figure = Figure.of_face(face)
    painted = figure.draw(size=(200, 200), renderer=renderer)
    changed = np.abs(painted.astype(int) - bare).max(axis=2) > 8
    places = face.feature_points.positions(face.scene)

    def at(point: np.ndarray) -> bool:
        x, y = seen(figure.camera, point, 200, 200)
        return bool(changed[int((1 - y) * 100), int((1 + x) * 100)])

    assert at(places["4.3"])
    assert at(places["4.4"])
    assert at((places["8.2"] + places["2.3"]) / 2)
    assert not at(places["9.3"])
    assert not at(places["2.1"])
    assert 0.005 < changed.mean() < 0.06


def test_picture_follows_the_pose(face: AnimatableFace) -> None:
    renderer = make_renderer("software")
    figure = Figure.of_face(face)
    neutral = figure.draw(size=(120, 120), renderer=renderer)
    assert np.array_equal(neutral, figure.draw({}, (120, 120), renderer=renderer))
    skin = face.scene.with_role(Role.SKIN)[0]
    moved = {skin.name: figure.neutral[skin.name] - np.array([0.0, 0.0, figure.camera.half_height])}
    assert not np.array_equal(neutral, figure.draw(moved, (120, 120), renderer=renderer))
    assert np.array_equal(neutral, Figure.of_face(face).draw(size=(120, 120), renderer=renderer))


def test_eyes_have_dark_pupils(face: AnimatableFace) -> None:
    figure = Figure.of_face(face, Style(natural=True))
    picture = figure.draw(size=(240, 240), renderer=make_renderer("software"))
    places = face.feature_points.positions(face.scene)
    for point in ("3.5", "3.6"):
        x, y = seen(figure.camera, places[point], 240, 240)
        row, column = int((1 - y) * 120), int((1 + x) * 120)
        assert picture[row - 2 : row + 3, column - 2 : column + 3].sum(axis=2).min() < 150


def test_render_pose_of_a_flat_scene() -> None:
    mesh = PolyMesh.from_faces(CORNERS, SQUARE)
    scene = FaceScene((Shape("a", mesh, Role.SKIN, (Material("blue", (0.1, 0.2, 0.9)),)),))
    picture = render_pose(scene, size=(30, 20), style=Style(smooth=False), renderer=make_renderer("software"))
    assert picture.shape == (20, 30, 3)
    assert picture[10, 15, 2] > picture[10, 15, 0] + 80


def test_points_without_a_mouth_paint_brows_only() -> None:
    points = FeaturePoints({"4.1": FeaturePoint.free(np.array([0.1, 0.5, 0.0]))})
    mesh = PolyMesh.from_faces(CORNERS, SQUARE)
    figure = Figure(FaceScene((Shape("a", mesh, Role.SKIN),)), points)
    assert figure.drawables()[0].decal is None
