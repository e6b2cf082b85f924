"""The backend `dt`: elastic template and deformation transfer on whole faces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from remade import warped
from scipy.sparse import diags_array
from scipy.spatial import cKDTree

from cloning import clone_shapes
from cloning.backends import Anchored, find_backend
from cloning.deformation import deformation_transfer
from cloning.detect import Detection
from cloning.dt import LANDMARKS
from cloning.local_transfer import BareTransfer, GoalTransfer
from cloning.normalize import ratios
from cloning.prepare import PreparedFace, prepare
from cloning.refine import refine
from cloning.source import source_motions
from cloning.transfer import FaceTransfer, build_face_transfer
from fat import AnimatableFace
from fba import FaceScene, FeaturePoint, FeaturePoints, PolyMesh, Role, Shape
from fba.arrays import Floats
from fba.shapes import ShapeSet
from formats import read_scene
from formats.landmarks import read_landmarks
from samples import sample

FEW = (3, 5, 8, 12, 19, 31, 37, 61)


@pytest.fixture(scope="module")
def motions(source: AnimatableFace, mine: PreparedFace) -> Floats:
    """(n, K, 3) a few motions of the source's skin."""
    return np.stack([mine.skin.join(m.offsets) for m in source_motions(source, frozenset(FEW))], axis=1)


@pytest.fixture(scope="module")
def transfer(mine: PreparedFace, yours: PreparedFace) -> GoalTransfer:
    made = find_backend("dt").build(mine, yours, False)
    assert isinstance(made, GoalTransfer)
    return made


@pytest.fixture(scope="module")
def corrected(mine: PreparedFace, yours: PreparedFace, transfer: GoalTransfer, motions: Floats) -> FaceTransfer:
    """The whole face's transfer, after it has carried the motions."""
    whole = build_face_transfer(mine, yours, transfer, False)
    whole.apply([mine.skin.split(motions[:, k]) for k in range(motions.shape[1])])
    return whole


@pytest.fixture(scope="module")
def coarse() -> PreparedFace:
    """The coarse shipped head."""
    path = sample("faces/tri_head.obj")
    scene = read_scene(path)
    return prepare(scene, read_landmarks(path.with_name("tri_head.fps.json"), scene), "source")


@pytest.fixture(scope="module")
def bumps(coarse: PreparedFace) -> Floats:
    """(n, 3, 3) smooth motions of a coarse head: the chin goes down, a brow up, a lip corner out; the rest is still."""
    ways = {"2.1": (0.0, -0.2, -0.05), "4.3": (0.0, 0.1, 0.0), "2.4": (0.1, 0.05, 0.02)}
    found = np.zeros((coarse.skin.vertex_count, len(ways), 3))
    for k, (key, way) in enumerate(ways.items()):
        away = np.linalg.norm(coarse.skin.vertices - coarse.skin.positions[key], axis=1)
        found[:, k] = np.clip(1.0 - (away / 0.5) ** 2, 0.0, None)[:, None] ** 2 * np.array(way)
    return found * coarse.fapu.es0


@pytest.mark.parametrize("as_published", [False, True])
def test_a_face_onto_itself_gives_its_own_motion(mine: PreparedFace, motions: Floats, as_published: bool) -> None:
    found = find_backend("dt").build(mine, mine, as_published).apply(motions)
    largest = np.linalg.norm(motions, axis=2).max(axis=0)
    error = np.linalg.norm(found - motions, axis=2).max(axis=0)
    assert largest.min() > 0.0
    assert (error / largest).max() < 1e-6


def test_feature_points_are_near_before_the_correction_and_exact_after_it(corrected: FaceTransfer) -> None:
    measures = corrected.tally.measures()
    assert measures["fp_error_before"] < 0.03
    assert measures["fp_error_after"] < 0.004
    assert corrected.skin.measures["unmatched_share"] < 0.02


def relative(found: Floats, truth: Floats) -> Floats:
    """(K,) relative errors of motions."""
    error: Floats = np.linalg.norm(found - truth, axis=(0, 2)) / np.linalg.norm(truth, axis=(0, 2))
    return error


def test_fitted_map_does_nearly_as_well_as_the_true_one(
    mine: PreparedFace, yours: PreparedFace, transfer: GoalTransfer, motions: Floats
) -> None:
    skin = mine.skin
    still = (~motions.any(axis=(1, 2))).astype(float)
    rows = skin.point_matrix(transfer.ids)
    scale = ratios(mine.fapu, yours.fapu, transfer.ids)
    goals = (rows @ motions.reshape(len(motions), -1)).reshape(len(transfer.ids), -1, 3) * scale[:, None]
    known = deformation_transfer(skin.vertices, yours.skin.vertices, skin.triangles, still, rows, links=skin.links)
    truth = known.apply(motions / mine.fapu.es0, goals=goals / yours.fapu.es0) * yours.fapu.es0
    errors = relative(transfer.apply(motions), truth)
    assert errors.mean() < 0.10
    assert errors.max() < 0.25


def test_skin_that_rests_in_the_source_rests_in_the_target(
    mine: PreparedFace, transfer: GoalTransfer, motions: Floats
) -> None:
    found = transfer.apply(motions)
    matched = ~transfer.skin_map.unmatched
    for k in range(motions.shape[1]):
        moving = motions[:, k].any(axis=1)
        away = cKDTree(mine.skin.vertices[moving]).query(mine.skin.vertices)[0]
        far = matched & (away > 0.6)
        assert far.any()
        assert not found[far, k].any()


def test_feature_points_without_a_partner_have_their_goal_at_the_source_s_own_place(
    mine: PreparedFace, yours: PreparedFace, transfer: GoalTransfer
) -> None:
    lost = transfer.ids.index("9.3")
    away = np.ones(yours.skin.vertex_count)
    away[yours.skin.points["9.3"][0]] = 0.0
    holed = replace(transfer.skin_map, matrix=(diags_array(away) @ transfer.skin_map.matrix).tocsr())
    rows = replace(transfer, skin_map=holed).goal_rows()
    assert np.allclose(rows.sum(axis=1), 1.0)
    own = mine.skin.point_matrix(["9.3"]).toarray()[0]
    assert np.array_equal(rows.toarray()[lost], own)


def test_each_motion_comes_out_the_same_in_any_company(transfer: GoalTransfer, motions: Floats) -> None:
    assert isinstance(transfer, Anchored)
    reach = np.linalg.norm(motions, axis=2).max(axis=1)
    ready = transfer.anchored(reach)
    alone = np.concatenate([ready.apply(motions[:, [k]]) for k in (0, 3)], axis=1)
    assert np.allclose(alone, ready.apply(motions)[:, [0, 3]], atol=1e-9 * reach.max())
    assert np.allclose(transfer.apply(motions), ready.apply(motions), atol=1e-9 * reach.max())


def nearest_vertices(face: PreparedFace, skin: Shape) -> FeaturePoints:
    """The face's feature points, those of the skin at the vertices of another mesh."""
    tree = cKDTree(skin.mesh.vertices)
    place = face.points.positions(face.scene)
    return face.points.with_points(
        {k: FeaturePoint(skin.name, (int(tree.query(place[k])[1]),), (1.0,)) for k in face.skin.points}
    )


def test_a_dense_target_gets_a_smoothly_refined_source(coarse: PreparedFace, bumps: Floats) -> None:
    skin = coarse.scene.with_role(Role.SKIN)[0]
    step = refine(skin.mesh.indices, skin.mesh.offsets, skin.mesh.vertex_count)
    fine = Shape(skin.name, PolyMesh(step.matrix @ skin.mesh.vertices, *step.polygons), Role.SKIN)
    dense = prepare(coarse.scene.map_shapes({skin.name: fine}), nearest_vertices(coarse, fine), "target")
    made = find_backend("dt").build(coarse, dense, False)
    assert made.parameters["refinements"] == 1
    found, wanted = made.apply(bumps), step.matrix @ bumps.reshape(len(bumps), -1)
    assert relative(found, wanted.reshape(found.shape)).max() < 0.1


def test_published_mode_is_the_papers(coarse: PreparedFace, bumps: Floats) -> None:
    assert len(LANDMARKS) == len(set(LANDMARKS)) == 20
    wider = prepare(*warped(coarse.scene, coarse.points, lambda v: v * [1.2, 1.0, 0.9]), "target")
    made = find_backend("dt").build(coarse, wider, True)
    assert isinstance(made, BareTransfer)
    assert made.parameters["landmarks"] == 20
    ready = made.anchored(np.linalg.norm(bumps, axis=2).max(axis=1))
    assert ready.solver is not None
    assert ready.solver.pulling.shape[1] == 0, "no feature point has a goal"
    assert np.count_nonzero(ready.solver.holding.diagonal()) == coarse.skin.components().max() + 1
    whole, fapu = (
        build_face_transfer(coarse, wider, find_backend("dt").build(coarse, wider, mode), mode)
        for mode in (True, False)
    )
    for transfer in (whole, fapu):
        transfer.apply([coarse.skin.split(bumps[:, k]) for k in range(bumps.shape[1])])
    assert whole.tally.after == whole.tally.before, "nothing is corrected"
    assert whole.tally.measures()["fp_error_before"] > 2.0 * fapu.tally.measures()["fp_error_before"]


def test_published_mode_finds_its_own_landmarks_where_none_are_given(
    coarse: PreparedFace, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []

    def detect(scene: FaceScene, source: PreparedFace, given: FeaturePoints | None, *, detector: str) -> Detection:
        asked.append(detector)
        return Detection(coarse.points, 1.0, ())

    monkeypatch.setattr("cloning.target.detect_points", detect)
    still = ShapeSet(("still",), coarse.scene.world_neutral(), np.zeros((1, coarse.scene.vertex_count, 3)))
    for backend, as_published in (("dt", True), ("fmc", False)):
        clone_shapes(coarse.scene, coarse.points, still, coarse.scene, None, backend=backend, as_published=as_published)
    assert asked == ["xiang", "auto"]
