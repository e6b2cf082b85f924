"""The backend `fit`: an elastic template and FAPU-scaled displacements."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cloning import clone_shapes
from cloning.backends import find_backend
from cloning.mapping import map_skin
from cloning.prepare import PreparedFace, prepare
from cloning.source import source_motions
from cloning.transfer import build_face_transfer
from cloning.visibility import visible
from fat import AnimatableFace
from fba import FaceScene, FeaturePoints
from formats import read_scene
from formats.landmarks import read_landmarks
from samples import sample
from samples.build.makehuman import open_makehuman
from samples.build.phenotypes import decimated, known, phenotype_a, phenotype_mean

UNITS = ("jawOpen", "mouthSmileLeft", "eyeBlinkLeft", "browInnerUp", "mouthFunnel", "mouthUpperUpLeft")


def test_a_clone_onto_the_same_face_moves_as_the_source(source: AnimatableFace, mine: PreparedFace) -> None:
    skin = find_backend("fit").build(mine, mine, False)
    assert skin.measures["fitted_share"] > 0.5
    assert skin.measures["fit_residual_es"] < 1e-6
    whole = build_face_transfer(mine, mine, skin, False)
    motions = [m.offsets for m in source_motions(source, frozenset((3, 4, 12, 31)))]
    for wanted, found in zip(motions, whole.apply(motions), strict=True):
        size = np.linalg.norm(mine.skin.join(wanted), axis=1)
        away = np.linalg.norm(mine.skin.join(found) - mine.skin.join(wanted), axis=1)
        assert away.max() < 1e-6 * size.max()
    assert whole.tally.measures()["fp_error_before"] < 1e-6


def test_published_mode_takes_the_paper_s_schedule() -> None:
    path = sample("faces/tri_head.obj")
    scene = read_scene(path)
    head = prepare(scene, read_landmarks(path.with_name("tri_head.fps.json"), scene), "source")
    made = find_backend("fit").build(head, head, True)
    assert made.parameters["schedule"] == "published"
    assert made.parameters["steps"] == 10


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
    source, yours = known(phenotype_mean(data), UNITS), decimated(phenotype_a(data), names=UNITS)
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
    assert np.mean(errors) < 0.15
    assert report.measures["fp_error_before"] < 0.10
    assert report.measures["fp_error_after"] < 0.01
