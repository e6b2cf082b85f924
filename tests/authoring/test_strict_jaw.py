"""An open_jaw that leaves the lips: on the shipped source and on a face made by hand."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from authoring.open_jaw import CONTOURS, strict
from fat import AnimatableFace, FaceDefMesh, FaceDefTable, FaceDefTables, Player
from fat.open_jaw import open_jaw_mode
from fat.quality import flips
from fat.validate import validate
from fba import FaceScene, Fapu, FeaturePoint, FeaturePoints, PolyMesh, Shape
from fba.errors import FaceDefTablesError, LandmarkError
from formats import read_face

LIPS = {key for contour in CONTOURS for key in contour}


@cache
def pair() -> tuple[AnimatableFace, AnimatableFace]:
    face = read_face("default")
    return face, strict(face)


def moved(face: AnimatableFace, value: float) -> dict[str, np.ndarray]:
    """Offsets of the feature points, in MNS units."""
    rest = face.feature_points.positions(face.scene)
    at = face.feature_points.positions(face.scene, Player(face).pose({3: value}).world_shapes())
    return {k: (at[k] - rest[k]) / face.fapu.mns0 * 1024 for k in rest}


@pytest.mark.parametrize("value", [40, 300, 600, 1080])
def test_the_lips_stay_and_the_chin_goes_as_before(value: int) -> None:
    practical, made = pair()
    before, after = moved(practical, value), moved(made, value)
    assert before["2.3"][1] < -0.5 * value
    for key in LIPS & after.keys():
        np.testing.assert_allclose(after[key], 0.0, atol=1e-6, err_msg=key)
    np.testing.assert_allclose(after["2.1"], before["2.1"], rtol=1e-6, atol=1e-6)
    assert after["2.1"][1] == pytest.approx(-value, rel=0.005)


def test_teeth_and_tongue_go_as_before_and_other_tables_are_the_same() -> None:
    practical, made = pair()
    old, new = (Player(f).pose({3: 600}).local for f in pair())
    for shape in practical.scene.shapes:
        if shape.name != practical.feature_points["2.1"].shape:
            np.testing.assert_array_equal(old[shape.name], new[shape.name])
    assert [t for t in made.tables if t.fap_id != 3] == [t for t in practical.tables if t.fap_id != 3]


def test_closed_lips_over_a_dropped_chin_fold_nothing() -> None:
    practical, made = pair()
    name = str(practical.feature_points["2.1"].shape)
    rest = practical.scene.world_vertices(name)
    triangles = practical.scene.shape(name).mesh.triangles
    folded = [flips(rest, triangles, Player(f).pose({3: 600}).world_shapes()[name] - rest) for f in pair()]
    assert folded[1] <= max(folded[0], 0.1)
    assert [f for f in validate(made) if f.severity == "error"] == []


def test_lip_faps_still_open_the_mouth() -> None:
    _, made = pair()
    points = made.feature_points
    at = points.positions(made.scene, Player(made).pose({3: 400, 5: -400, 10: -400, 11: -400}).world_shapes())
    assert at["2.2"][1] - at["2.3"][1] == pytest.approx(400 / 1024 * made.fapu.mns0, rel=0.05)


def test_strict_twice_is_strict_once() -> None:
    practical, made = pair()
    assert (open_jaw_mode(practical), open_jaw_mode(made)) == ("practical", "strict")
    assert made.notes["open_jaw"] == "strict"
    assert strict(made) is made
    unsaid = strict(replace(made, notes={}))
    assert unsaid.notes["open_jaw"] == "strict"
    assert unsaid.tables is made.tables


def hand_made(without: str = "") -> AnimatableFace:
    """A flat strip of skin from the mouth down to the chin; all of it goes down with the jaw."""
    rows = 13
    vertices = np.array([[x, -0.1 * k, 0.0] for k in range(rows) for x in (-0.3, 0.0, 0.3)])
    faces = [[3 * k + c, 3 * k + 3 + c, 3 * k + 4 + c, 3 * k + 1 + c] for k in range(rows - 1) for c in (0, 1)]
    mesh = PolyMesh.from_faces(vertices, faces)
    places = {"2.5": 0, "2.2": 1, "2.4": 2, "2.3": 4, "2.1": 3 * (rows - 1) + 1}
    points = FeaturePoints({k: FeaturePoint("skin", (v,), (1.0,)) for k, v in places.items() if k != without})
    slopes = np.tile([0.0, -1.0, 0.0], (len(vertices), 1, 1))
    table = FaceDefTable(3, 1, (FaceDefMesh("skin", (0, 600), np.arange(len(vertices)), slopes),))
    return AnimatableFace(
        FaceScene((Shape("skin", mesh),)), points, FaceDefTables((table,)), Fapu(0.1, 0.6, 0.4, 0.2, 0.6)
    )


def test_the_jaw_fades_out_steadily_from_chin_to_lips() -> None:
    face = hand_made()
    made = strict(face)
    ratio = (Player(made).pose({3: 500}).local["skin"] - face.scene.world_neutral())[1::3, 1]
    ratio = ratio / (Player(face).pose({3: 500}).local["skin"] - face.scene.world_neutral())[1::3, 1]
    assert ratio[:2].tolist() == [0.0, 0.0]
    assert ratio[-1] == pytest.approx(1.0)
    assert np.all(np.diff(ratio[1:]) > 0.0)


def test_what_is_missing_is_named() -> None:
    with pytest.raises(LandmarkError, match=r"a strict open_jaw needs .* 2\.4"):
        strict(hand_made(without="2.4"))
    face = hand_made()
    with pytest.raises(FaceDefTablesError, match="no table for FAP 3"):
        strict(replace(face, tables=FaceDefTables()))
