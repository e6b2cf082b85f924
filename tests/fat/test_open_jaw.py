"""Which reading of open_jaw a face has, measured on its tables."""

from __future__ import annotations

import numpy as np
import pytest

from fat import AnimatableFace, FaceDefMesh, FaceDefTable, FaceDefTables
from fat.open_jaw import closed_mouth, open_jaw_mode
from fba import FaceScene, Fapu, FeaturePoint, FeaturePoints, PolyMesh, Shape

POINTS = FeaturePoints({"2.1": FeaturePoint("skin", (0,), (1.0,)), "2.3": FeaturePoint("skin", (1, 2), (0.5, 0.5))})


def face(lip: float, faps: tuple[int, ...] = (5, 10, 11), points: FeaturePoints = POINTS) -> AnimatableFace:
    """A chin that goes down by its amount, and a lower lip that goes along by a share."""
    mesh = PolyMesh.from_faces(np.array([[0, -1, 0], [-1, 0, 0], [1, 0, 0]], float), [[0, 1, 2]])
    slopes = -np.array([[[0, 1, 0]], [[0, lip, 0]], [[0, lip, 0]]])
    jaw = FaceDefTable(3, 1, (FaceDefMesh("skin", (0, 1024), (0, 1, 2), slopes),))
    lips = [FaceDefTable(k, 1, (FaceDefMesh("skin", (0, 600), (1,), [[[0, 1, 0]]]),)) for k in faps]
    return AnimatableFace(
        FaceScene((Shape("skin", mesh),)), points, FaceDefTables((jaw, *lips)), Fapu(0.1, 0.6, 0.4, 0.2, 0.5)
    )


@pytest.mark.parametrize(("lip", "mode"), [(0.0, "strict"), (0.03, "strict"), (0.5, "practical"), (1.6, "practical")])
def test_the_mode_is_measured_at_the_lower_lip(lip: float, mode: str) -> None:
    assert open_jaw_mode(face(lip)) == mode


def test_what_cannot_be_measured_has_no_mode() -> None:
    assert open_jaw_mode(face(1.0, points=FeaturePoints({"2.1": POINTS["2.1"]}))) is None
    assert open_jaw_mode(face(1.0, points=FeaturePoints({"2.3": POINTS["2.3"]}))) is None
    whole = face(1.0)
    lips_only = FaceDefTables(tuple(t for t in whole.tables if t.fap_id != 3))
    assert open_jaw_mode(AnimatableFace(whole.scene, POINTS, lips_only, whole.fapu)) is None


def test_a_strict_face_without_lip_faps_cannot_open_its_mouth() -> None:
    assert closed_mouth(face(0.0)) == []
    assert closed_mouth(face(1.0, ())) == []
    (finding,) = closed_mouth(face(0.0, (5,)))
    assert finding.severity == "warning"
    assert "10 raise_b_lip_lm, 11 raise_b_lip_rm" in finding.message
