"""The backend `dt`: elastic template and deformation transfer on whole faces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from remade import bare
from scipy.sparse import diags_array
from scipy.spatial import cKDTree

from cloning import clone_with_report
from cloning.backends import Anchored, find_backend
from cloning.deformation import deformation_transfer
from cloning.dt import LANDMARKS
from cloning.local_transfer import BareTransfer, GoalTransfer
from cloning.normalize import ratios
from cloning.prepare import PreparedFace, prepare
from cloning.refine import refine
from cloning.source import source_motions
from cloning.transfer import FaceTransfer, build_face_transfer
from fat import AnimatableFace
from fat.build import face_motions
from fba import FaceScene, FeaturePoints, PolyMesh, Role
from fba.arrays import Floats

FEW = (3, 5, 8, 12, 19, 31, 37, 61)


@pytest.fixture(scope="module")
def mine(source: AnimatableFace) -> PreparedFace:
    return prepare(source.scene, source.feature_points, "source")


@pytest.fixture(scope="module")
def motions(source: AnimatableFace, mine: PreparedFace) -> Floats:
    """(n, K, 3) a few motions of the source's skin."""
    return np.stack([mine.skin.join(m.offsets) for m in source_motions(source, frozenset(FEW))], axis=1)


@pytest.fixture(scope="module")
def yours(wide: tuple[FaceScene, FeaturePoints]) -> PreparedFace:
    return prepare(*wide, "target")


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


def test_a_dense_target_gets_a_smoothly_refined_source(source: AnimatableFace) -> None:
    scene, points = bare(source)
    skin = scene.with_role(Role.SKIN)[0]
    step = refine(skin.mesh.indices, skin.mesh.offsets, skin.mesh.vertex_count)
    fine = replace(skin, mesh=PolyMesh(step.matrix @ skin.mesh.vertices, *step.polygons))
    face, report = clone_with_report(source, scene.map_shapes({skin.name: fine}), points, backend="dt", faps=(31,))
    assert report.parameters["refinements"] == 1
    assert report.measures["fp_error_before"] < 0.05
    assert report.measures["fp_error_after"] < 0.002
    wanted = step.apply(face_motions(source, [(31, 1)])[-1].offsets[skin.name])
    found = face_motions(face, [(31, 1)])[-1].offsets[skin.name]
    assert np.linalg.norm(found - wanted) < 0.05 * np.linalg.norm(wanted)


def test_published_mode_is_the_papers(
    mine: PreparedFace, yours: PreparedFace, motions: Floats, corrected: FaceTransfer
) -> None:
    assert len(LANDMARKS) == len(set(LANDMARKS)) == 20
    made = find_backend("dt").build(mine, yours, True)
    assert isinstance(made, BareTransfer)
    assert made.parameters["landmarks"] == 20
    ready = made.anchored(np.linalg.norm(motions, axis=2).max(axis=1))
    assert ready.solver is not None
    assert ready.solver.pulling.shape[1] == 0, "no feature point has a goal"
    assert np.count_nonzero(ready.solver.holding.diagonal()) == mine.skin.components().max() + 1
    whole = build_face_transfer(mine, yours, made, True)
    whole.apply([mine.skin.split(motions[:, k]) for k in range(motions.shape[1])])
    assert whole.tally.after == whole.tally.before, "nothing is corrected"
    assert whole.tally.measures()["fp_error_before"] > 2.0 * corrected.tally.measures()["fp_error_before"]
