"""Landmark files: every way to say where a point is, round trips, and errors that name the point."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fba.closest import TriangleSearch, closest_on_triangles
from fba.errors import FbaError, InputFileError, LandmarkError
from fba.feature_points import FeaturePoint, FeaturePoints
from fba.mesh import PolyMesh
from fba.orientation import orient
from fba.scene import FaceScene, Role, Shape
from formats.landmarks import landmarks_beside, read_landmarks, write_landmarks
from formats.obj import read

PENTAGON = PolyMesh.from_faces(
    [[0, 0, 0], [2, 0, 0], [3, 1, 0], [2, 2, 0], [0, 2, 0], [1, 1, 9]], [[0, 1, 2, 3, 4], [0, 1, 5]]
)
SCENE = FaceScene((Shape("face", PENTAGON),))


def place(tmp_path: Path, entry: object, scene: FaceScene = SCENE, key: str = "9.3") -> np.ndarray:
    path = tmp_path / "p.fps.json"
    path.write_text(json.dumps({"format": "fba-landmarks/1", "points": {key: entry}}))
    return read_landmarks(path, scene).positions(scene)[key]


@pytest.fixture(scope="module", params=["makehuman", "ict"])
def face(request: pytest.FixtureRequest, shared: Path) -> tuple[FaceScene, FeaturePoints, Path]:
    mesh = {"makehuman": "makehuman/base.obj", "ict": "ict-facekit/generic_neutral_mesh.obj"}[request.param]
    scene, path = read(shared / "faces" / mesh), shared / "landmarks" / f"{request.param}.json"
    return scene, read_landmarks(path, scene), path


def test_plain_files_give_the_positions_they_state(face: tuple[FaceScene, FeaturePoints, Path]) -> None:
    scene, points, path = face
    at = points.positions(scene)
    stated = json.loads(path.read_text())
    assert len(points) == len(stated) == 83
    assert points["7.1"].shape is None
    for key, entry in stated.items():
        assert np.abs(at[key] - entry.get("pos", entry.get("point"))).max() < 1.1e-5, key


def test_written_points_read_back_at_the_same_places(
    face: tuple[FaceScene, FeaturePoints, Path], tmp_path: Path
) -> None:
    scene, points, _ = face
    axes = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    shape = scene.shapes[0]
    turned_file = replace(shape, mesh=shape.mesh.with_vertices(shape.mesh.vertices @ axes.T).reversed())
    free = FeaturePoint.free(axes @ np.array(points["7.1"].point))
    turned, moved, _ = orient(replace(scene, roots=(turned_file,)), points.with_points({"7.1": free}))
    assert turned.frame.reversed_winding
    for one, own in ((scene, points), (turned, moved)):
        write_landmarks(own, one, tmp_path / "a.fps.json")
        again = read_landmarks(tmp_path / "a.fps.json", one)
        at, back = own.positions(one), again.positions(one)
        assert set(at) == set(back)
        assert max(np.abs(at[k] - back[k]).max() for k in at) < 1e-14 * np.abs(one.world_neutral()).max()
    # The file's numbers mean the same on the file as it lies on disk, unturned.
    plain = replace(scene, roots=(turned_file,))
    at = read_landmarks(tmp_path / "a.fps.json", plain).positions(plain)
    assert max(np.abs(turned.frame.to_file(moved.positions(turned)[k]) - at[k]).max() for k in at) < 1e-14


def test_split_scenes_write_what_the_whole_file_understands(
    face: tuple[FaceScene, FeaturePoints, Path], tmp_path: Path
) -> None:
    scene, points, path = face
    mesh = scene.shapes[0].mesh
    labels = mesh.components() % 2
    parts = [mesh.submesh(labels == k) for k in (1, 0)]
    split = replace(scene, roots=tuple(Shape(f"s{k}", m, vertex_ids=i) for k, (m, i) in enumerate(parts)))
    own = read_landmarks(path, split)
    assert len({p.shape for p in own.values()}) == 3
    write_landmarks(own, split, tmp_path / "a.fps.json")
    at = points.positions(scene)
    for one in (scene, split):
        back = read_landmarks(tmp_path / "a.fps.json", one).positions(one)
        assert max(np.abs(at[k] - back[k]).max() for k in at) < 1e-14 * np.abs(mesh.vertices).max()


def test_positions_snap_back_to_the_surface(face: tuple[FaceScene, FeaturePoints, Path], tmp_path: Path) -> None:
    scene, points, _ = face
    at = points.positions(scene)
    text = {"format": "fba-landmarks/1", "points": {k: {"position": v.tolist()} for k, v in at.items()}}
    (tmp_path / "a.json").write_text(json.dumps(text))
    again = read_landmarks(tmp_path / "a.json", scene)
    assert [k for k, p in again.items() if p.shape is None] == ["7.1"]
    back = again.positions(scene)
    assert max(np.abs(at[k] - back[k]).max() for k in at) < 1e-12


def test_every_form_of_a_place(tmp_path: Path) -> None:
    v = PENTAGON.vertices
    assert place(tmp_path, {"vertex": 4}).tolist() == v[4].tolist()
    assert np.allclose(place(tmp_path, {"face": 0, "barycentric": [0.2] * 5}), v[:5].mean(axis=0))
    assert np.allclose(place(tmp_path, {"shape": "face", "face": 0, "barycentric": [0, 0.5, 0.5]}), (v[1] + v[2]) / 2)
    assert np.allclose(place(tmp_path, {"vertices": [5, 0], "barycentric": [0.25, 0.75]}), 0.25 * v[5])
    assert np.allclose(place(tmp_path, {"position": [1.5, 1.0, -0.01]}), [1.5, 1.0, 0.0])
    assert place(tmp_path, {"position": [7.0, 70.0, 0.1]}, key="7.1").tolist() == [7.0, 70.0, 0.1]
    assert place(tmp_path, {"position": [7.0, 70.0, 0.1]}, key="11.5").tolist() == [7.0, 70.0, 0.1]


def test_source_and_confidence_travel(tmp_path: Path) -> None:
    points = FeaturePoints(
        {"9.3": FeaturePoint("face", (0, 1, 2), (0.5, 0.25, 0.25), source="detected", confidence=0.4)}
    )
    write_landmarks(points, SCENE, tmp_path / "a.json")
    back = read_landmarks(tmp_path / "a.json", SCENE)["9.3"]
    assert (back.source, back.confidence) == ("detected", 0.4)
    assert json.loads((tmp_path / "a.json").read_text())["points"]["9.3"]["face"] == 0


def test_points_lie_on_the_skin_but_pupils_on_the_nearest(tmp_path: Path) -> None:
    flat = PolyMesh.from_faces([[0, 0, 0], [100, 0, 0], [0, 100, 0]], [[0, 1, 2]])
    skin = Shape("skin", flat, Role.SKIN)
    eye = Shape("eye", flat.with_vertices(flat.vertices + np.array([0, 0, 1.0])), Role.EYE_LEFT)
    scene = FaceScene((skin, eye))
    assert place(tmp_path, {"position": [20, 20, 0.9]}, scene, "3.7")[2] == pytest.approx(0.0)
    assert place(tmp_path, {"position": [20, 20, 0.9]}, scene, "3.5")[2] == pytest.approx(1.0)
    assert place(tmp_path, {"position": [20, 20, 0.2]}, scene, "3.5")[2] == pytest.approx(0.0)
    assert place(tmp_path, {"shape": "eye", "vertex": 1}, scene)[2] == 1.0
    assert place(tmp_path, {"shape": "eye_left", "vertex": 1}, scene)[2] == 1.0
    assert place(tmp_path, {"vertex": 4}, scene).tolist() == [100, 0, 1]


@pytest.mark.parametrize(
    ("entry", "says"),
    [
        ({"vertex": 6}, "9.3: vertex 6 is out of range; the file has 6"),
        ({"vertex": -1}, "whole numbers"),
        ({"vertex": True}, "whole numbers"),
        ({"vertex": 1.5}, "whole numbers"),
        ({"vertex": 10**30}, "whole numbers"),
        ({"face": 2, "barycentric": [1, 0, 0]}, "face 2 is out of range; there are 2"),
        ({"face": 0}, "no 'barycentric'"),
        ({"face": 0, "barycentric": [0.5, 0.5]}, "2 barycentric weights for 5 corners"),
        ({"face": 0, "barycentric": [0.5, 0.25, 0.2]}, "add up to 0.95"),
        ({"face": 0, "barycentric": [1.5, -0.25, -0.25]}, "negative"),
        ({"vertices": [0, 1, 2], "barycentric": [1, 0]}, "2 barycentric weights for 3"),
        ({"vertices": [], "barycentric": []}, "whole numbers"),
        ({"position": [1, 2]}, "3 finite numbers"),
        ({"position": [1, 2, 10**400]}, "3 finite numbers"),
        ({"position": [1, 1, 40]}, "off the surface"),
        ({"vertex": 1, "position": [0, 0, 0]}, "needs one of.*vertex and position"),
        ({}, "needs one of"),
        ([1, 2], "must be an object"),
        ({"vertex": 1, "confidence": 2}, "confidence"),
        ({"vertex": 1, "source": 2}, "source"),
        ({"vertex": 1, "shape": 2}, "name of a shape"),
    ],
)
def test_bad_places_are_named(tmp_path: Path, entry: object, says: str) -> None:
    with pytest.raises(LandmarkError, match=says):
        place(tmp_path, entry)


def test_unknown_points_shapes_and_shared_vertices(tmp_path: Path) -> None:
    with pytest.raises(LandmarkError, match=r"no feature point '9\.99'"):
        place(tmp_path, {"vertex": 1}, key="9.99")
    two = FaceScene((Shape("a", PENTAGON), Shape("b", PENTAGON)))
    with pytest.raises(LandmarkError, match="no shape 'c'; the file has a, b"):
        place(tmp_path, {"vertex": 1, "shape": "c"}, two)
    with pytest.raises(LandmarkError, match="several shapes"):
        place(tmp_path, {"vertices": [1, 7], "barycentric": [0.5, 0.5]}, two)
    with pytest.raises(LandmarkError, match="name the 'shape'"):
        place(tmp_path, {"face": 1, "barycentric": [1, 0, 0]}, two)


@pytest.mark.parametrize(
    ("text", "error", "says"),
    [
        ("", InputFileError, "empty"),
        ("{", InputFileError, "not a landmark file"),
        ("[]", InputFileError, "must be an object"),
        ("[" * 100000, InputFileError, "nested"),
        ('{"9.3": {"vertex": 1}, "9.3": {"vertex": 2}}', InputFileError, "given twice"),
        ('{"9.3": {"pos": [NaN, 0, 0]}}', InputFileError, "NaN"),
        ('{"format": "fba-landmarks/2", "points": {}}', LandmarkError, "fba-landmarks/2"),
        ('{"points": {}}', LandmarkError, "format"),
        ('{"format": "fba-landmarks/1", "points": []}', LandmarkError, "points"),
        ("{}", LandmarkError, "no feature points"),
        ('{"asset": {"version": "2.0"}}', LandmarkError, "no feature point 'asset'"),
    ],
)
def test_bad_files_are_explained(tmp_path: Path, text: str, error: type[FbaError], says: str) -> None:
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(error, match=says):
        read_landmarks(tmp_path / "a.json", SCENE)


def test_landmarks_beside(tmp_path: Path) -> None:
    for name in ("head.obj", "head.wrl.gz", "my.head.usda"):
        assert landmarks_beside(tmp_path / name) is None
    (tmp_path / "head.fps.json").write_text("{}")
    (tmp_path / "my.head.fps.json").write_text("{}")
    assert landmarks_beside(tmp_path / "head.obj") == tmp_path / "head.fps.json"
    assert landmarks_beside(tmp_path / "head.wrl.gz") == tmp_path / "head.fps.json"
    assert landmarks_beside(tmp_path / "my.head.usda") == tmp_path / "my.head.fps.json"


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.sampled_from(["face", "x", "9.3"]),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(
        st.sampled_from(["face", "vertex", "vertices", "barycentric", "bary", "position", "pos", "point", "shape"]),
        inner, max_size=4,
    ),
    max_leaves=8,
)  # fmt: skip


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(entry=JSON, plain=st.booleans(), key=st.sampled_from(["9.3", "7.1", "3.5", "0.0"]))
def test_any_json_is_read_or_refused(tmp_path: Path, entry: object, plain: bool, key: str) -> None:
    document = {key: entry} if plain else {"format": "fba-landmarks/1", "points": {key: entry}}
    (tmp_path / "a.json").write_text(json.dumps(document))
    try:
        points = read_landmarks(tmp_path / "a.json", SCENE)
    except FbaError:
        return
    assert np.isfinite(points.positions(SCENE)[key]).all()


GOOD = (
    b'{"format": "fba-landmarks/1", "points": '
    b'{"9.3": {"face": 0, "barycentric": [0.5, 0.25, 0.25]}, "3.5": {"vertex": 2}}}'
)


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(start=st.integers(0, len(GOOD)), length=st.integers(0, 8), new=st.binary(max_size=8))
def test_damaged_bytes_are_read_or_refused(tmp_path: Path, start: int, length: int, new: bytes) -> None:
    (tmp_path / "a.json").write_bytes(GOOD[:start] + new + GOOD[start + length :])
    try:
        points = read_landmarks(tmp_path / "a.json", SCENE)
    except FbaError:
        return
    assert all(np.isfinite(p).all() for p in points.positions(SCENE).values())


COORDINATE = st.floats(-1e3, 1e3, allow_nan=False)
POINT = st.tuples(COORDINATE, COORDINATE, COORDINATE)


@settings(max_examples=200, deadline=None)
@given(corners=st.lists(POINT, min_size=3, max_size=3), point=POINT)
def test_closest_point_of_a_triangle_beats_a_fine_grid(
    corners: list[tuple[float, ...]], point: tuple[float, ...]
) -> None:
    triangle, target = np.array(corners), np.array(point)
    weights, squared = closest_on_triangles(triangle[None], target)
    assert (weights >= 0).all()
    assert weights.sum() == pytest.approx(1.0)
    found = np.linalg.norm(weights[0] @ triangle - target)
    size = 1.0 + np.abs(triangle).max() + np.abs(target).max()
    assert found == pytest.approx(np.sqrt(squared[0]), abs=1e-6 * size)
    i, j = np.meshgrid(np.arange(21), np.arange(21))
    grid = np.stack([i, j, 20 - i - j], axis=-1).reshape(-1, 3) / 20
    best = np.linalg.norm(grid[(grid >= 0).all(axis=1)] @ triangle - target, axis=1).min()
    assert found <= best + 1e-6 * size


def test_search_agrees_with_brute_force() -> None:
    rng = np.random.default_rng(1)
    vertices, triangles = rng.normal(size=(200, 3)), rng.integers(0, 200, size=(500, 3))
    search = TriangleSearch(vertices, triangles)
    for point in rng.normal(size=(50, 3)) * 2:
        triangle, weights, distance = search.closest(point)
        assert distance == pytest.approx(np.sqrt(closest_on_triangles(vertices[triangles], point)[1].min()))
        assert np.linalg.norm(weights @ vertices[triangles[triangle]] - point) == pytest.approx(distance)
