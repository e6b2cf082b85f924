"""The backend `fit`: an elastic template and FAPU-scaled displacements."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from remade import bare

from cloning import CloneReport, clone_shapes, clone_with_report
from cloning.mapping import map_skin
from cloning.prepare import prepare
from cloning.visibility import visible
from fat import AnimatableFace
from fat.build import face_motions
from fba import FaceScene, FeaturePoints
from samples.build.makehuman import open_makehuman
from samples.build.phenotypes import decimated, known, phenotype_a
from samples.build.source import source_head

UNITS = ("jawOpen", "mouthSmileLeft", "eyeBlinkLeft", "browInnerUp", "mouthFunnel", "mouthUpperUpLeft")


@pytest.fixture(scope="module")
def itself(source: AnimatableFace) -> tuple[AnimatableFace, CloneReport]:
    """The source cloned onto its own bare head."""
    return clone_with_report(source, *bare(source), backend="fit", faps=(3, 4, 12, 19, 31))


def test_a_clone_onto_the_same_face_moves_as_the_source(
    source: AnimatableFace, itself: tuple[AnimatableFace, CloneReport]
) -> None:
    face, report = itself
    for key in ((3, 1), (4, 1), (12, 1), (19, 1), (31, 1)):
        mine, yours = (face_motions(f, [key])[-1].offsets["skin"] for f in (source, face))
        assert np.linalg.norm(yours - mine) < 0.03 * np.linalg.norm(mine), f"{key}: only the filter changes it"
    assert report.backend == "fit"
    assert report.measures["fp_error_before"] < 0.01
    assert report.measures["fitted_share"] > 0.5
    assert report.measures["fit_residual_es"] < 1e-3


def test_the_report_names_the_schedule(source: AnimatableFace) -> None:
    report = clone_with_report(source, *bare(source), backend="fit", as_published=True, faps=(3,))[1]
    assert report.parameters["schedule"] == "published"
    assert report.parameters["steps"] == 10
    assert report.as_published


def test_every_vertex_knows_its_place_on_the_source(
    source: AnimatableFace, wide: tuple[FaceScene, FeaturePoints]
) -> None:
    target = AnimatableFace(wide[0], wide[1], source.tables, source.fapu)
    mine, yours = map_skin(source, target, backend="fit")
    away = np.linalg.norm(yours.places["skin"] - mine.places["skin"], axis=1)
    seen = visible(prepare(*wide, "target").skin)
    assert np.median(away[seen]) < 0.02, "the same mesh, warped: each vertex finds itself"
    assert np.percentile(away[seen], 95) < 0.08
    tip = prepare(source.scene, source.feature_points, "source").skin.point_matrix(["9.3"])
    assert np.allclose(tip @ yours.places["skin"], 0.0, atol=0.01)


def test_another_topology_moves_nearly_as_its_own_units_say(shared: Path) -> None:
    data = open_makehuman(shared / "faces" / "makehuman")
    source, yours = known(source_head(data), UNITS), decimated(phenotype_a(data), names=UNITS)
    truth = yours.shapes(UNITS)
    found, report = clone_shapes(
        source.scene, source.points, source.shapes(UNITS), yours.scene, yours.points, backend="fit"
    )
    face = prepare(yours.scene, yours.points, "target")
    seen = visible(face.skin)
    errors = []
    for k in range(len(UNITS)):
        mine, real = (face.skin.join(face.scene.scatter(s.deltas[k]))[seen] for s in (found, truth))
        errors.append(np.linalg.norm(mine - real) / np.linalg.norm(real))
    assert np.mean(errors) < 0.22
    assert report.measures["fp_error_before"] < 0.10
    assert report.measures["fp_error_after"] < 0.01
