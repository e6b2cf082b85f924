from __future__ import annotations

import numpy as np
import pytest
from literal_player import mesh_displacements, turned_scene

from fat import AnimatableFace, FaceDefTransform, FaceMotion
from fat.build import build_tables, face_motions
from fba import FaceScene, Fapu, FeaturePoints, PolyMesh, Shape, fap
from fba.errors import FaceDefTablesError

FAPU = Fapu(irisd0=0.11, es0=0.63, ens0=0.41, mns0=0.19, mw0=0.5)


def motion(scene: FaceScene, number: int, value: int, seed: int, scale: float = 0.1, select: int = 1) -> FaceMotion:
    rng = np.random.default_rng(seed)
    offsets = {s.name: scale * rng.normal(size=(s.mesh.vertex_count, 3)) for s in scene.shapes}
    return FaceMotion(f"motion_{number}", number, select, value, offsets)


@pytest.mark.parametrize("values", [(1080,), (-300,), (-700, -300), (-900, 400), (-900, -1, 7, 1080)])
def test_motions_come_back_at_every_border(values: tuple[int, ...]) -> None:
    scene = turned_scene()
    given = [motion(scene, 5, v, seed) for seed, v in enumerate(values)]
    tables = build_tables(scene, FAPU, given)
    face = AnimatableFace(scene, FeaturePoints({}), tables, FAPU)
    back = {m.value: m for m in face_motions(face)}
    for wanted in given:
        for name, offsets in wanted.offsets.items():
            assert np.abs(back[wanted.value].offsets[name] - offsets).max() < 2e-7 * np.abs(offsets).max() * 3


@pytest.mark.parametrize("value", [-1000.0, -300.0, 0.0, 250.0, 1500.0])
def test_a_border_reproduces_the_motion_by_the_standards_equation(value: float) -> None:
    mesh = PolyMesh.from_faces(np.zeros((4, 3)), [[0, 1, 2], [1, 2, 3]])
    scene = FaceScene((Shape("skin", mesh),))
    at_minus, at_plus = np.full((4, 3), -0.02), np.full((4, 3), 0.05)
    tables = build_tables(
        scene,
        FAPU,
        [FaceMotion("n", 19, 1, -300, {"skin": at_minus}), FaceMotion("p", 19, 1, 250, {"skin": at_plus})],
    )
    found = mesh_displacements(tables.tables[0].meshes[0], FAPU.irisd0 / 1024, value, 4)
    expected = at_minus * value / -300 if value < 0 else at_plus * value / 250
    assert found == pytest.approx(expected, rel=1e-6)


def test_only_negative_values_get_a_mirrored_interval_that_every_reading_agrees_on() -> None:
    scene = turned_scene()
    (mesh, *_) = build_tables(scene, FAPU, [motion(scene, 12, -400, 0)]).tables[0].meshes
    assert mesh.interval_borders.tolist() == [-400, 0, 400]
    assert np.array_equal(mesh.displacements[:, 0], -mesh.displacements[:, 1])


def test_high_level_tables_have_the_unit_one() -> None:
    scene = turned_scene()
    tables = build_tables(scene, FAPU, [motion(scene, 1, 63, 0, select=10), motion(scene, 2, 63, 1, select=6)])
    assert [t.name for t in tables] == ["viseme_aa", "expression_surprise"]
    lone = tables.tables[0].meshes[-1]
    assert lone.shape == "lone"
    expected = motion(scene, 1, 63, 0).offsets["lone"] / 63
    assert lone.displacements[:, 0] == pytest.approx(expected, rel=1e-6)


def test_still_vertices_are_left_out_but_small_motions_keep_theirs() -> None:
    scene = FaceScene((turned_scene().shapes[0],))
    offsets = np.zeros((80, 3))
    offsets[:4, 1] = [0.1, 5e-6, 7e-6, 1e-9]
    (table,) = build_tables(scene, FAPU, [FaceMotion("m", 3, 1, 1080, {"skin": offsets})])
    assert table.meshes[0].coord_index.tolist() == [0, 2]
    small = np.zeros((80, 3))
    small[:4, 2] = [1e-4, 2e-6, 2e-8, 5e-9]
    (table,) = build_tables(scene, FAPU, [FaceMotion("m", 3, 1, 1, {"skin": small})])
    assert table.meshes[0].coord_index.tolist() == [0, 1, 2], "relative to the motion where that is smaller"
    (table,) = build_tables(scene, FAPU, [FaceMotion("m", 3, 1, 1080, {"skin": offsets})], threshold=0.0)
    assert table.meshes[0].coord_index.tolist() == [0, 1, 2, 3]
    assert not build_tables(scene, FAPU, [FaceMotion("m", 3, 1, 1080, {"skin": offsets * 0})]).tables


def test_transforms_join_the_tables() -> None:
    scene = turned_scene()
    turn = FaceDefTransform("eye_yaw", rotation_def=(0, 1, 0, 1))
    tables = build_tables(scene, FAPU, [motion(scene, 3, 1080, 0)], {(23, 1): [turn], (3, 1): [turn]})
    assert [(t.fap_id, len(t.meshes), len(t.transforms)) for t in tables] == [(3, 3, 1), (23, 0, 1)]


def test_angles_use_the_angle_unit() -> None:
    scene = turned_scene()
    (table,) = build_tables(scene, FAPU, [motion(scene, 47, 30000, 0)])
    lone = table.meshes[-1]
    assert fap(47).unit == "AU"
    assert lone.displacements[:, 0] * 0.3 == pytest.approx(motion(scene, 47, 1, 0).offsets["lone"], rel=1e-6)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"fap_id": None}, "no FAP"),
        ({"fap_id": 69}, "no FAP"),
        ({"value": 0}, "value 0"),
        ({"offsets": {"nose": np.zeros((4, 3))}}, "no shape 'nose'"),
        ({"offsets": {"skin": np.zeros((4, 3))}}, "offsets of shape"),
        ({"offsets": {"skin": np.full((80, 3), np.nan)}}, "not finite"),
        ({"offsets": {"skin": np.full((80, 3), 1e300)}}, "too large"),
    ],
)
def test_bad_motions_are_refused(change: dict, words: str) -> None:
    fields = {"name": "m", "fap_id": 3, "select": 1, "value": 1080, "offsets": {"skin": np.ones((80, 3))}, **change}
    with pytest.raises(FaceDefTablesError, match=words):
        build_tables(turned_scene(), FAPU, [FaceMotion(**fields)])


def test_two_motions_at_one_value_are_refused() -> None:
    scene = turned_scene()
    with pytest.raises(FaceDefTablesError, match="two motions for open_jaw"):
        build_tables(scene, FAPU, [motion(scene, 3, 1080, 0), motion(scene, 3, 1080, 1)])
