"""Turning faces of any axes, units and handedness: found rightly, given back exactly."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations, product
from pathlib import Path

import numpy as np
import pytest

from fba.errors import LandmarkError
from fba.fapu import FAPU_POINTS
from fba.feature_points import FeaturePoint, FeaturePoints, feature_point_definitions
from fba.landmark_checks import LEFT_POINTS, check_points
from fba.mesh import PolyMesh
from fba.orientation import orient, to_file_order, turn_scene
from fba.scene import FaceScene, Frame, Shape, Transform
from fba.units import guess_unit
from formats.landmarks import read_landmarks
from formats.obj import read

ALL_AXES = [
    np.array(signs)[:, None] * np.eye(3)[list(order)]
    for order in permutations(range(3))
    for signs in product((1.0, -1.0), repeat=3)
]


@pytest.fixture(scope="module", params=["makehuman", "ict"])
def face(request: pytest.FixtureRequest, shared: Path) -> tuple[FaceScene, FeaturePoints]:
    mesh = {"makehuman": "makehuman/base.obj", "ict": "ict-facekit/generic_neutral_mesh.obj"}[request.param]
    scene = read(shared / "faces" / mesh)
    return scene, read_landmarks(shared / "landmarks" / f"{request.param}.json", scene)


def in_file(
    face: tuple[FaceScene, FeaturePoints], axes: np.ndarray, *, scale: float = 1.0, reverse: bool = False
) -> tuple[FaceScene, FeaturePoints]:
    """The face as a file with other axes would hold it: axes maps inside vectors to the file's."""
    scene, points = face
    turn = Frame(axes)
    shape = scene.shapes[0]
    mesh = replace(shape.mesh, vertices=turn.from_file(shape.mesh.vertices * scale), normals=None)
    if reverse:
        mesh = mesh.reversed()
    moved = {
        k: replace(p, point=tuple((turn.from_file(np.array(p.point) * scale)).tolist())) if p.point else p
        for k, p in points.items()
    }
    return replace(scene, roots=(replace(shape, mesh=mesh),)), FeaturePoints(moved)


def swapped(points: FeaturePoints) -> FeaturePoints:
    known = feature_point_definitions()
    return FeaturePoints({(known[k].counterpart or k): p for k, p in points.items()})


def test_upright_face_is_left_alone(face: tuple[FaceScene, FeaturePoints]) -> None:
    scene, points, findings = orient(*face)
    assert scene is face[0]
    assert findings == []
    assert points["7.1"] == face[1]["7.1"]


@pytest.mark.parametrize(
    "axes", ALL_AXES, ids=lambda a: "".join("-+"[int(r.sum() > 0)] + "xyz"[np.abs(r).argmax()] for r in a)
)
def test_all_48_axes_are_found_and_given_back_exactly(face: tuple[FaceScene, FeaturePoints], axes: np.ndarray) -> None:
    """Mirrored ones keep their index order, as an exporter that flips one axis leaves them."""
    filed = in_file(face, axes)
    scene, points, findings = orient(*filed)
    assert np.array_equal(scene.frame.axes, axes.T)
    assert not scene.frame.reversed_winding
    assert np.array_equal(scene.world_neutral(), face[0].world_neutral())
    assert np.array_equal(scene.shapes[0].mesh.indices, face[0].shapes[0].mesh.indices)
    assert points["7.1"].point == pytest.approx(face[1]["7.1"].point, abs=0)
    back = to_file_order(scene, scene.world_neutral())
    assert back.tobytes() == filed[0].world_neutral().tobytes()
    assert ("left-handed" in [f.code for f in findings]) == (np.linalg.det(axes) < 0)


@pytest.mark.parametrize("axes", [ALL_AXES[0], ALL_AXES[12], ALL_AXES[-3]])
def test_inside_out_polygons_are_reversed(face: tuple[FaceScene, FeaturePoints], axes: np.ndarray) -> None:
    if np.linalg.det(axes) < 0:
        axes = -axes
    filed = in_file(face, axes, reverse=True)
    scene, _, findings = orient(*filed)
    assert scene.frame.reversed_winding
    assert "inside-out" in [f.code for f in findings]
    assert np.array_equal(scene.shapes[0].mesh.indices, face[0].shapes[0].mesh.indices)
    again, _, more = orient(scene, face[1])
    assert again is scene
    assert more == []


@pytest.mark.parametrize("axes", ALL_AXES[::5])
def test_exchanged_sides_are_refused_not_read_as_a_mirror(
    face: tuple[FaceScene, FeaturePoints], axes: np.ndarray
) -> None:
    if np.linalg.det(axes) < 0:
        axes = -axes
    scene, points = in_file(face, axes)
    with pytest.raises(LandmarkError, match="exchange"):
        orient(scene, swapped(points))


@pytest.mark.parametrize("pair", [("3.7", "3.12"), ("8.3", "8.4"), ("3.5", "3.6"), ("4.5", "4.6")])
def test_one_exchanged_pair_is_named(face: tuple[FaceScene, FeaturePoints], pair: tuple[str, str]) -> None:
    scene, points = in_file(face, ALL_AXES[20] * np.linalg.det(ALL_AXES[20]))
    left, right = pair
    with pytest.raises(LandmarkError, match=f"{left}/{right}".replace(".", r"\.")):
        orient(scene, points.with_points({left: points[right], right: points[left]}))


@pytest.mark.parametrize("pair", [("3.1", "3.3"), ("8.1", "8.2"), ("9.15", "2.2"), ("10.1", "10.5"), ("3.7", "3.11")])
def test_upper_and_lower_exchanged_is_named(face: tuple[FaceScene, FeaturePoints], pair: tuple[str, str]) -> None:
    scene, points = face
    one, other = pair
    with pytest.raises(LandmarkError, match="must lie"):
        orient(scene, points.with_points({one: points[other], other: points[one]}))


@pytest.mark.parametrize("scale", [1e5, 1e-3, 1e-8])
def test_units_do_not_matter(face: tuple[FaceScene, FeaturePoints], scale: float) -> None:
    axes = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    scene, _, findings = orient(*in_file(face, axes, scale=scale))
    assert np.array_equal(scene.frame.axes, axes.T)
    assert np.array_equal(scene.world_neutral(), face[0].world_neutral() * scale)
    assert [f.code for f in findings] == ["axes"]


@pytest.mark.parametrize("axes", ALL_AXES[::7])
def test_points_of_the_fapus_alone_are_enough(face: tuple[FaceScene, FeaturePoints], axes: np.ndarray) -> None:
    scene, points = in_file(face, axes)
    turned, _, _ = orient(scene, FeaturePoints({k: points[k] for k in FAPU_POINTS}))
    assert np.array_equal(turned.frame.axes, axes.T)


@pytest.mark.parametrize(("angle", "axis"), [(20.0, 0), (25.0, 1), (-30.0, 2)])
def test_tilt_is_told(face: tuple[FaceScene, FeaturePoints], angle: float, axis: int) -> None:
    scene, points = face
    turn = np.eye(3)
    a, b = (axis + 1) % 3, (axis + 2) % 3
    turn[a, a] = turn[b, b] = np.cos(np.radians(angle))
    turn[b, a], turn[a, b] = np.sin(np.radians(angle)), -np.sin(np.radians(angle))
    shape = scene.shapes[0]
    tilted = replace(scene, roots=(replace(shape, mesh=shape.mesh.with_vertices(shape.mesh.vertices @ turn.T)),))
    moved = points.with_points({"7.1": FeaturePoint.free(turn @ np.array(points["7.1"].point))})
    turned, _, findings = orient(tilted, moved)
    assert turned.frame.identity
    message = next(f.message for f in findings if f.code == "tilted")
    name, sign = {0: ("pitch", -1), 1: ("yaw", 1), 2: ("roll", 1)}[axis]
    told = float(message.split(name)[1].split()[0])
    assert told == pytest.approx(sign * angle, abs=5.0 if axis == 0 else 0.6)


def test_transforms_are_conjugated_and_given_back_exactly() -> None:
    rng = np.random.default_rng(5)
    mesh = PolyMesh.from_faces(rng.normal(size=(6, 3)), [[0, 1, 2, 3], [3, 4, 5]])
    inner = Transform(
        "inner", (Shape("a", mesh),), (0.3, -2.0, 0.7), (0.2, -0.5, 0.9, 1.1), (1.0, 2.0, 3.0),
        (0.6, 0.1, -0.2, 0.4), (0.5, 0.25, -1.0),
    )  # fmt: skip
    scene = FaceScene((Transform("outer", (inner,), rotation=(0.0, 1.0, 0.0, 0.3)), Shape("b", mesh)))
    for axes in ALL_AXES:
        turned = turn_scene(scene, axes)
        assert np.allclose(turned.world_neutral(), scene.world_neutral() @ axes.T, atol=1e-14)
        assert np.allclose(turned.frame.to_file(turned.world_neutral()), scene.world_neutral(), atol=1e-14)
        back = turn_scene(turned, axes.T)
        assert back.frame.identity
        for one, two in zip(back.transforms, scene.transforms, strict=True):
            assert replace(one, children=()) == replace(two, children=())
        for one, two in zip(back.shapes, scene.shapes, strict=True):
            assert one.mesh.vertices.tobytes() == two.mesh.vertices.tobytes()


def test_candide_is_inside_out(shared: Path) -> None:
    scene = read(shared / "faces/candide3/candide3.obj")
    v = scene.shapes[0].mesh.vertices
    used = scene.shapes[0].mesh.used_vertices

    def nearest(x: float, y: float) -> FeaturePoint:
        away = np.hypot(v[:, 0] - x, v[:, 1] - y) + np.where(used, 0.0, 9.0)
        return FeaturePoint("face", (int(np.argmin(away)),), (1.0,))

    tip = int(np.argmax(np.where(used, v[:, 2], -9.0)))
    places = {"3.7": (0.41, 0.2), "3.11": (0.16, 0.2), "8.3": (0.2, -0.45), "4.3": (0.3, 0.36), "5.3": (0.35, -0.1)}
    points = {k: nearest(*xy) for k, xy in places.items()}
    known = feature_point_definitions()
    points |= {str(known[k].counterpart): nearest(-x, y) for k, (x, y) in places.items()}
    points["9.3"] = FeaturePoint("face", (tip,), (1.0,))
    turned, _, findings = orient(scene, FeaturePoints(points))
    assert turned.frame.identity
    assert turned.frame.reversed_winding
    assert [f.code for f in findings] == ["inside-out"]


def test_off_centre_points_are_a_warning(face: tuple[FaceScene, FeaturePoints]) -> None:
    scene, points = face
    findings = check_points(scene, points.with_points({"9.3": points["9.1"], "8.1": points["8.5"]}))
    assert [f.code for f in findings] == ["off-centre"]
    assert check_points(scene, points) == []


def test_missing_points_are_named(face: tuple[FaceScene, FeaturePoints]) -> None:
    scene, points = face
    with pytest.raises(LandmarkError, match="eyes and of the mouth"):
        orient(scene, FeaturePoints({"9.3": points["9.3"]}))


def test_left_points_name_one_of_each_pair() -> None:
    known = feature_point_definitions()
    both = {i for i, d in known.items() if d.counterpart}
    others = {str(known[i].counterpart) for i in LEFT_POINTS}
    assert set(LEFT_POINTS) | others == both
    assert not set(LEFT_POINTS) & others


@pytest.mark.parametrize(("es0", "unit"), [(0.615, "decimetres"), (6.2, "centimetres"), (0.06, "metres"), (1e5, None)])
def test_units_are_guessed(es0: float, unit: str | None) -> None:
    assert guess_unit(es0) == unit
