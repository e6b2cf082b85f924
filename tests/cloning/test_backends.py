"""What every backend must keep: one contract, whatever finds the correspondence and carries the motion."""

from __future__ import annotations

import numpy as np
import pytest

from cloning import CloneReport, backends, clone_with_report, find_backend
from fat import AnimatableFace, conformance
from fat.build import face_motions
from fba import FaceScene, FeaturePoints, Role

FAPS = (3, 12, 19, 31)
Cloned = tuple[AnimatableFace, CloneReport]


@pytest.fixture(scope="module", params=[b.name for b in backends()])
def both(
    request: pytest.FixtureRequest, source: AnimatableFace, wide: tuple[FaceScene, FeaturePoints]
) -> tuple[str, Cloned, Cloned]:
    """A backend's name, its default clone and the published one, of some FAPs."""
    name: str = request.param
    default, published = (
        clone_with_report(source, *wide, backend=name, as_published=literal, faps=FAPS) for literal in (False, True)
    )
    return name, default, published


def test_both_modes_move_the_face_and_say_what_they_are(both: tuple[str, Cloned, Cloned]) -> None:
    name, *modes = both
    for (face, report), literal in zip(modes, (False, True), strict=True):
        assert report.backend == name
        assert report.as_published is literal
        assert face.notes["backend"] == name + (" as published" if literal else "")
        assert {t.fap_id for t in face.tables} == set(FAPS)


def test_the_neutral_mesh_is_the_targets_own_but_for_results_in_the_source_s_topology(
    both: tuple[str, Cloned, Cloned], wide: tuple[FaceScene, FeaturePoints]
) -> None:
    name, *modes = both
    for (face, _), literal in zip(modes, (False, True), strict=True):
        recast = literal and bool(find_backend(name).recast)
        assert {s.name for s in face.scene.shapes} == {s.name for s in wide[0].shapes}
        for shape in wide[0].shapes:
            same = face.scene.shape(shape.name).mesh is shape.mesh
            assert same != (recast and shape.role is Role.SKIN), shape.name


def test_feature_points_move_as_their_faps_say(both: tuple[str, Cloned, Cloned]) -> None:
    face, report = both[1]
    assert report.measures["fp_error_before"] < 0.1
    assert report.measures["fp_error_after"] < 0.01
    assert all(row.passed for row in conformance(face))


def test_the_back_of_the_head_rests(both: tuple[str, Cloned, Cloned]) -> None:
    face, _ = both[1]
    skin = face.scene.with_role(Role.SKIN)[0]
    back = skin.mesh.vertices[:, 2] < face.feature_points.positions(face.scene)["7.1"][2] - 0.6 * face.fapu.es0
    assert back.sum() > 50
    for motion in face_motions(face):
        if skin.name in motion.offsets:
            assert not np.any(motion.offsets[skin.name][back]), motion.name
