from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from remade import bare, roleless, warped

from cloning import clone, clone_shapes, clone_with_report
from cloning.normalize import ratios
from cloning.prepare import prepare
from cloning.report import CloneReport
from cloning.target import target_points
from fat import AnimatableFace
from fat.build import face_motions
from fat.conformance import conformance
from fat.evaluate import Player
from fba import FaceScene, FeaturePoint, FeaturePoints, Frame, Role, ShapeSet
from fba.arrays import Floats
from fba.errors import CloningError, LandmarkError
from formats import read_scene
from samples import sample

FEW = (3, 5, 12, 19, 31)


@pytest.fixture(scope="module")
def cloned(source: AnimatableFace, wide: tuple[FaceScene, FeaturePoints]) -> tuple[AnimatableFace, CloneReport]:
    return clone_with_report(source, *wide)


def skin_motions(face: AnimatableFace) -> dict[tuple[str, int], Floats]:
    skin = face.scene.with_role(Role.SKIN)[0]
    rest = np.zeros((skin.mesh.vertex_count, 3))
    return {(m.name, m.value): m.offsets.get(skin.name, rest) for m in face_motions(face)}


def at_points(face: AnimatableFace, offsets: Floats, ids: list[str]) -> Floats:
    rows = [face.feature_points[i] for i in ids]
    return np.array([np.asarray(p.weights) @ offsets[list(p.vertices)] for p in rows])


def test_self_clone_reproduces_the_motion(source: AnimatableFace) -> None:
    scene, points = bare(source)
    face, _ = clone_with_report(source, scene, points)
    mine, yours = skin_motions(source), skin_motions(face)
    assert mine.keys() == yours.keys()
    error = [np.linalg.norm(yours[k] - v) / np.linalg.norm(v) for k, v in mine.items() if v.any()]
    assert np.mean(error) < 0.03
    assert max(error) < 0.12


def test_feature_points_move_exactly_as_their_fapu_says(
    source: AnimatableFace, cloned: tuple[AnimatableFace, CloneReport]
) -> None:
    face, report = cloned
    ids = [i for i, p in source.feature_points.items() if p.shape == source.scene.with_role(Role.SKIN)[0].name]
    scale = ratios(source.fapu, face.fapu, ids)
    missed = wanted = 0.0
    yours = skin_motions(face)
    for key, mine in skin_motions(source).items():
        goal = at_points(source, mine, ids) * scale
        missed += float(np.abs(at_points(face, yours[key], ids) - goal).sum())
        wanted += float(np.abs(goal).sum())
    assert missed / wanted < 0.005
    assert report.measures["fp_error_after"] < 0.002
    assert report.measures["fp_error_before"] < 0.05


def test_tongue_and_pupils_move_exactly_too(cloned: tuple[AnimatableFace, CloneReport]) -> None:
    """On a clone with other proportions the tongue bends by MW and MNS and rolls by the same angle; its warped pupils,
    which are no circles, grow by IRISD as nearly as they can."""
    results = {row.fap_id: row for row in conformance(cloned[0])}
    for number in (43, 44, 45, 46, 47):
        assert results[number].passed, results[number]
    for number in (29, 30):
        assert results[number].relative_error < 0.1, results[number]


def test_pupils_grow_right_where_their_points_are_beside_the_middle(source: AnimatableFace) -> None:
    """A detected point need not lie in the middle of the ring: the ring grows by IRISD all the same."""
    face = clone(source, read_scene(sample("faces/tri_head.obj")), faps=(29, 30))
    assert [row.passed for row in conformance(face)] == [True, True]


def test_neutral_is_untouched(
    wide: tuple[FaceScene, FeaturePoints], cloned: tuple[AnimatableFace, CloneReport]
) -> None:
    face, _ = cloned
    for before, after in zip(wide[0].shapes, face.scene.shapes, strict=True):
        assert before.mesh is after.mesh
        assert before.materials == after.materials
    pose = Player(face).pose().world_shapes()
    for shape in wide[0].shapes:
        assert np.array_equal(pose[shape.name], shape.mesh.vertices)


def test_static_skin_stays_exactly_static(source: AnimatableFace, cloned: tuple[AnimatableFace, CloneReport]) -> None:
    face, _ = cloned
    skin = face.scene.with_role(Role.SKIN)[0].mesh.vertices
    back = skin[:, 2] < face.feature_points.positions(face.scene)["7.1"][2] - 0.6 * face.fapu.es0
    ears = np.unique([v for i in range(1, 11) for v in face.feature_points[f"10.{i}"].vertices])
    assert back.sum() > 50
    mine = skin_motions(source)
    for (name, value), offsets in skin_motions(face).items():
        source_rest = mine[name, value]
        if not source_rest[back].any():
            assert not offsets[back].any(), name
        if not source_rest[ears].any():
            assert not offsets[ears].any(), name


def test_eyes_and_head_turn(cloned: tuple[AnimatableFace, CloneReport]) -> None:
    face, _ = cloned
    player = Player(face)
    rest, yaw = player.pose().world_shapes(), player.pose({23: 30000}).world_shapes()
    eye = face.scene.with_role(Role.EYE_LEFT)[0].name
    front = int(np.argmax(rest[eye][:, 2]))
    assert yaw[eye][front, 0] > rest[eye][front, 0] + 0.05 * face.fapu.es0, "yaw to the subject's left is +x"
    other = face.scene.with_role(Role.EYE_RIGHT)[0].name
    assert np.array_equal(rest[other], yaw[other])
    nod = player.pose({48: 30000}).world_shapes()
    tip = int(np.argmax(rest[face.scene.with_role(Role.SKIN)[0].name][:, 2]))
    skin = face.scene.with_role(Role.SKIN)[0].name
    assert nod[skin][tip, 1] < rest[skin][tip, 1], "positive pitch turns the head down"


def test_lower_teeth_are_rigid_and_follow_the_jaw(cloned: tuple[AnimatableFace, CloneReport]) -> None:
    face, _ = cloned
    teeth = face.scene.with_role(Role.LOWER_TEETH)[0]
    rest = face.scene.world_vertices(teeth.name)
    jaw = next(m for m in face_motions(face, [(3, 1)]) if m.value > 0)
    moved = rest + jaw.offsets[teeth.name]
    pairs = np.random.default_rng(0).integers(0, len(rest), (50, 2))
    before, after = (np.linalg.norm(v[pairs[:, 0]] - v[pairs[:, 1]], axis=1) for v in (rest, moved))
    assert np.allclose(before, after, atol=1e-5 * face.fapu.es0)
    assert jaw.offsets[teeth.name][:, 1].mean() < 0.0
    assert face.scene.with_role(Role.UPPER_TEETH)[0].name not in jaw.offsets


@pytest.mark.parametrize(
    ("axes", "factor"),
    [
        ([[1, 0, 0], [0, 0, 1], [0, -1, 0]], 1.0),
        ([[-1, 0, 0], [0, 1, 0], [0, 0, 1]], 1.0),
        ([[0, 0, 1], [0, 1, 0], [-1, 0, 0]], 1e5),
    ],
    ids=["z-up", "left-handed", "turned and 1e5 units"],
)
def test_axes_and_units_do_not_matter(
    source: AnimatableFace, wide: tuple[FaceScene, FeaturePoints], axes: list[list[int]], factor: float
) -> None:
    inside = np.array(axes, dtype=float)
    scene, points = wide
    away = warped(scene, points, lambda v: factor * (v @ inside))
    straight, _ = clone_with_report(source, scene, points, faps=FEW)
    turned, _ = clone_with_report(source, *away, faps=FEW)
    assert np.array_equal(turned.scene.frame.axes, inside)
    yours = skin_motions(turned)
    for key, mine in skin_motions(straight).items():
        difference = yours[key] / factor - mine
        assert np.linalg.norm(difference) < 1e-3 * np.linalg.norm(mine), key
        assert np.abs(difference).max() < 1e-2 * np.abs(mine).max(), key


def test_a_symmetric_target_moves_symmetrically(cloned: tuple[AnimatableFace, CloneReport]) -> None:
    from scipy.spatial import cKDTree

    face, _ = cloned
    skin = face.scene.with_role(Role.SKIN)[0].mesh.vertices
    flip = np.array([-1.0, 1.0, 1.0])
    away, other = cKDTree(skin).query(skin * flip)
    assert away.max() < 1e-3 * face.fapu.es0
    motions = skin_motions(face)
    for name in ("open_jaw", "thrust_jaw", "lower_t_midlip"):
        value = max(v for n, v in motions if n == name)
        offsets = motions[name, value]
        assert np.linalg.norm(offsets[other] * flip - offsets) / np.linalg.norm(offsets) < 0.03, name


def test_free_shapes_keep_names_order_and_axes(source: AnimatableFace, wide: tuple[FaceScene, FeaturePoints]) -> None:
    scene, points = bare(source)
    rest = {s.name: np.zeros((s.mesh.vertex_count, 3)) for s in scene.shapes}
    motions = [face_motions(source, [(fap, 1)])[-1] for fap in (3, 19)]
    deltas = np.stack([scene.gather({**rest, **m.offsets}) for m in motions])
    shapes = ShapeSet(("wide open", "winkⒶ"), scene.world_neutral(), deltas)
    plain, _ = clone_shapes(scene, points, shapes, *wide)
    assert plain.names == shapes.names
    assert np.array_equal(plain.neutral, wide[0].world_neutral())
    axes = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    turned_source = warped(scene, points, lambda v: v @ axes)
    turned = ShapeSet(shapes.names, turned_source[0].world_neutral(), deltas @ axes)
    again, _ = clone_shapes(*turned_source, turned, *wide)
    assert np.allclose(again.deltas, plain.deltas, atol=1e-3 * np.abs(plain.deltas).max())
    by_fap, _ = clone_with_report(source, *wide, faps=(3,), exact=True)
    jaw = skin_motions(by_fap)["open_jaw", motions[0].value]
    assert np.allclose(plain.deltas[0][: len(jaw)], jaw, atol=2e-5 * by_fap.fapu.es0)


def test_one_mesh_file_is_cut_into_its_parts(
    source: AnimatableFace, wide: tuple[FaceScene, FeaturePoints], cloned: tuple[AnimatableFace, CloneReport]
) -> None:
    from fba import PolyMesh, Shape

    scene, points = wide
    starts = np.cumsum([0] + [s.mesh.vertex_count for s in scene.shapes])
    place = {s.name: int(starts[k]) for k, s in enumerate(scene.shapes)}
    faces = [s.mesh.face(f) + place[s.name] for s in scene.shapes for f in range(s.mesh.face_count)]
    mesh = PolyMesh.from_faces(np.concatenate([s.mesh.vertices for s in scene.shapes]), faces)
    joined = FaceScene((Shape("all", mesh),), name="joined")
    moved = {
        k: p if p.shape is None else FeaturePoint("all", tuple(v + place[p.shape] for v in p.vertices), p.weights)
        for k, p in points.items()
    }
    face, report = clone_with_report(source, joined, FeaturePoints(moved), faps=FEW)
    assert not [f for f in report.findings if f.code.startswith("no-")]
    counts = {s.role: s.mesh.vertex_count for s in face.scene.shapes}
    for shape in scene.shapes:
        if shape.role is not Role.OTHER:
            assert counts[shape.role] == shape.mesh.vertex_count, shape.name
    assert np.array_equal(face.scene.world_neutral(), mesh.vertices), "the file's own vertex order is kept"
    whole, _ = cloned
    jaw = skin_motions(whole)["open_jaw", max(v for n, v in skin_motions(whole) if n == "open_jaw")]
    mine = face_motions(face, [(3, 1)])[-1]
    rest = {s.name: np.zeros((s.mesh.vertex_count, 3)) for s in face.scene.shapes}
    gathered = face.scene.gather({**rest, **mine.offsets})
    assert np.allclose(gathered[: len(jaw)], jaw, atol=1e-4 * face.fapu.es0)


def test_missing_parts_are_said(source: AnimatableFace, wide: tuple[FaceScene, FeaturePoints]) -> None:
    scene, points = wide
    skin = tuple(s for s in scene.shapes if s.role is Role.SKIN)
    kept = FeaturePoints({k: p for k, p in points.items() if p.shape in (None, skin[0].name)})
    pupils = {k: FeaturePoint.free(points.positions(scene)[k]) for k in ("3.5", "3.6")}
    alone = roleless(FaceScene(skin, name="mask"))
    face, report = clone_with_report(source, alone, kept.with_points(pupils), faps=(*FEW, 27, 28))
    codes = {f.code for f in report.warnings()}
    assert {"no-eye-left", "no-eye-right", "no-lower-teeth", "no-tongue"} <= codes
    assert face.tables.get(3) is not None
    assert {face.tables.get(n) for n in (23, 27, 28)} == {None}


def test_missing_feature_points(source: AnimatableFace, wide: tuple[FaceScene, FeaturePoints]) -> None:
    scene, points = wide
    without = FeaturePoints({k: p for k, p in points.items() if k != "8.3"})
    _, completed, findings = target_points(prepare(source.scene, source.feature_points, "source"), scene, without)
    assert completed["8.3"].source == "detected"
    assert "detected-points" in {f.code for f in findings}
    assert {k: completed[k] for k in without} == dict(without)
    fewer = FeaturePoints({k: p for k, p in points.items() if k not in ("7.1", "5.1", "3.5")})
    face, report = clone_with_report(source, scene, fewer, faps=FEW)
    assert {"derived-point", "missing-points"} <= {f.code for f in report.findings}
    assert face.feature_points["7.1"].source == "derived"


def test_exchanged_lips_are_refused(source: AnimatableFace, wide: tuple[FaceScene, FeaturePoints]) -> None:
    scene, points = wide
    exchanged = points.with_points({"2.2": points["2.3"], "2.3": points["2.2"]})
    with pytest.raises(LandmarkError, match=r"2\.2 lies on the lower lip"):
        clone_with_report(source, scene, exchanged, faps=FEW)


def test_an_animatable_target_brings_its_own_points(source: AnimatableFace) -> None:
    face, _ = clone_with_report(source, source, faps=(3,))
    assert {t.fap_id for t in face.tables} == {3}


def test_what_cannot_be_cloned(source: AnimatableFace, wide: tuple[FaceScene, FeaturePoints]) -> None:
    with pytest.raises(CloningError, match="no backend 'magic'"):
        clone_with_report(source, *wide, backend="magic")
    with pytest.raises(CloningError, match="no motion"):
        clone_with_report(replace(source, tables=type(source.tables)()), *wide)


def test_published_mode_runs_and_says_so(source: AnimatableFace, wide: tuple[FaceScene, FeaturePoints]) -> None:
    face, report = clone_with_report(source, *wide, as_published=True, faps=(3, 19, 23, 48))
    assert report.as_published
    assert "published" in face.notes["backend"]
    assert {t.fap_id for t in face.tables} == {3, 19, 23, 48}
    jaw = next(m for m in face_motions(face, [(3, 1)]) if m.value > 0)
    teeth = jaw.offsets[face.scene.with_role(Role.LOWER_TEETH)[0].name]
    assert np.allclose(teeth, teeth[0], atol=1e-5 * face.fapu.es0), "published: teeth only translate"
    _, repaired = clone_with_report(source, *wide, faps=(3, 19, 23, 48))
    assert repaired.measures["fp_error_after"] < 0.1 * report.measures["fp_error_after"]


def test_report_is_json_and_progress_is_told(source: AnimatableFace, wide: tuple[FaceScene, FeaturePoints]) -> None:
    import json

    told: list[tuple[str, float]] = []
    _, report = clone_with_report(source, *wide, faps=(3,), progress=lambda stage, share: told.append((stage, share)))
    data = json.loads(report.to_json())
    assert data["backend"] == "fit"
    assert set(data["timings"]) >= {"source", "target", "correspondence", "motion", "tables"}
    assert {stage for stage, _ in told} >= {"correspondence", "motion"}
    assert all(0.0 <= share <= 1.0 for _, share in told)


def test_same_input_same_output(source: AnimatableFace, wide: tuple[FaceScene, FeaturePoints]) -> None:
    first, second = (clone_with_report(source, *wide, faps=FEW)[0] for _ in range(2))
    for a, b in zip(first.tables, second.tables, strict=True):
        for m, n in zip(a.meshes, b.meshes, strict=True):
            assert m.displacements.tobytes() == n.displacements.tobytes()
    assert first.scene.frame.identity == Frame().identity


def test_a_source_without_tables_is_refused() -> None:
    head = read_scene(sample("faces/tri_head.obj"))
    with pytest.raises(CloningError, match="no Facial Animation Tables"):
        clone(head, head)
