"""Cloning against known motion, and on faces that are hard."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from remade import bare

from cloning import clone_shapes, clone_with_report
from cloning.contours import CONTOURS, contour_places
from cloning.labels import label
from cloning.prepare import prepare
from cloning.visibility import visible
from fat import AnimatableFace
from fat.build import face_motions
from fba import FaceScene, FeaturePoints, PolyMesh, Role
from fba.arrays import Floats
from samples.build.makehuman import open_makehuman
from samples.build.phenotypes import KnownHead, known, phenotype_a, phenotype_b, phenotype_mean

UNITS = ("jawOpen", "mouthSmileLeft", "eyeBlinkLeft", "browInnerUp", "mouthFunnel", "mouthUpperUpLeft")


@pytest.fixture(scope="module")
def heads(shared: Path) -> dict[str, KnownHead]:
    data = open_makehuman(shared / "faces" / "makehuman")
    made = {"source": phenotype_mean(data), "a": phenotype_a(data), "b": phenotype_b(data)}
    return {name: known(head, UNITS) for name, head in made.items()}


@pytest.mark.parametrize("target", ["a", "b"])
def test_other_phenotypes_move_nearly_as_their_own_units_say(heads: dict[str, KnownHead], target: str) -> None:
    source, yours = heads["source"], heads[target]
    truth = yours.shapes(UNITS)
    found, report = clone_shapes(source.scene, source.points, source.shapes(UNITS), yours.scene, yours.points)
    face = prepare(yours.scene, yours.points, "target")
    seen = visible(face.skin)
    errors = []
    for k in range(len(UNITS)):
        mine, real = (face.skin.join(face.scene.scatter(s.deltas[k]))[seen] for s in (found, truth))
        errors.append(np.linalg.norm(mine - real) / np.linalg.norm(real))
    assert np.mean(errors) < 0.19
    assert report.measures["fp_error_after"] < 0.01


@pytest.mark.parametrize("target", ["a", "b"])
def test_lids_close_as_on_the_source_and_lips_do_not_pull_each_other(heads: dict[str, KnownHead], target: str) -> None:
    source, yours = heads["source"], heads[target]
    shapes = source.shapes(UNITS)
    found, _ = clone_shapes(source.scene, source.points, shapes, yours.scene, yours.points)
    gaps = []
    for head, motion in ((source, shapes), (yours, found)):
        face = prepare(head.scene, head.points, "target")
        blink = motion.deltas[UNITS.index("eyeBlinkLeft")]
        offsets = face.skin.join(face.scene.scatter(blink)) / face.fapu.es0
        lid = face.skin.point_matrix(["3.1", "3.3"]) @ (face.skin.vertices + offsets)
        lips = []
        for name in UNITS:
            moved = face.skin.join(face.scene.scatter(motion.deltas[UNITS.index(name)]))
            at = face.skin.point_matrix(["2.2", "2.6", "2.7", "2.3", "2.8", "2.9"]) @ moved
            lips.append((at[:3, 1] - at[3:, 1]) / face.fapu.mns0)
        gaps.append(((lid[0, 1] - lid[1, 1]) * face.fapu.es0 / face.fapu.irisd0, np.array(lips)))
    assert abs(gaps[0][0] - gaps[1][0]) < 0.05
    assert np.abs(gaps[0][1] - gaps[1][1]).max() < 0.01


def sealed(scene: FaceScene, points: FeaturePoints) -> FaceScene:
    """The same head with a strip of triangles between its lips."""
    face = prepare(scene, points, "target")
    skin = face.scene.with_role(Role.SKIN)[0]
    lines = []
    for contour in CONTOURS[:2]:
        way = contour_places(face.skin, contour).tocsr()
        between = [int(way.indices[s:e][np.argmax(way.data[s:e])]) for s, e in pairwise(way.indptr)]
        ends = [int(face.skin.points[i][0][np.argmax(face.skin.points[i][1])]) for i in ("2.4", "2.5")]
        lines.append([ends[0], *between, ends[1]])
    faces = [skin.mesh.face(f) for f in range(skin.mesh.face_count)]
    for (a, b), (c, d) in zip(pairwise(lines[0]), pairwise(lines[1]), strict=True):
        faces += [t for t in ([a, c, b], [b, c, d]) if len(set(t)) == 3]
    mesh = PolyMesh.from_faces(skin.mesh.vertices, faces)
    return face.scene.map_shapes({skin.name: replace(skin, mesh=mesh)})


def jaw_of(face: AnimatableFace) -> Floats:
    skin = face.scene.with_role(Role.SKIN)[0].name
    return face_motions(face, [(3, 1)])[-1].offsets[skin]


def test_a_sealed_mouth_is_said_and_stretches_without_tearing(source: AnimatableFace) -> None:
    scene, points = bare(source)
    closed = sealed(scene, points)
    assert not label(prepare(scene, points, "target").skin).sealed
    face, report = clone_with_report(source, closed, points, faps=(3,))
    assert "sealed-mouth" in {f.code for f in report.warnings()}
    offsets = jaw_of(face)
    skin = prepare(closed, points, "target").skin
    jump = np.linalg.norm(offsets[skin.edges[:, 0]] - offsets[skin.edges[:, 1]], axis=1)
    lips = skin.positions["2.2"]
    near = np.linalg.norm(skin.vertices[skin.edges[:, 0]] - lips, axis=1) < 0.4
    opening = np.linalg.norm(offsets, axis=1).max()
    assert jump[near].max() < 0.75 * opening, "the strip does not take the whole opening"
    open_mouth = jaw_of(clone_with_report(source, scene, points, faps=(3,))[0])
    far = np.linalg.norm(skin.vertices - lips, axis=1) > 0.8
    assert np.allclose(offsets[far], open_mouth[far], atol=0.01 * opening), "away from the lips nothing changes"


def test_ict_facekit(shared: Path, source: AnimatableFace) -> None:
    import json

    from fba import FeaturePoint
    from formats import read_scene

    scene = read_scene(shared / "faces" / "ict-facekit" / "generic_neutral_mesh.obj")
    name = scene.shapes[0].name
    assert len(scene.shapes) == 1
    points = {}
    for key, row in json.loads((shared / "landmarks" / "ict.json").read_text()).items():
        points[key] = (
            FeaturePoint(name, tuple(row["face"]), tuple(row["bary"]))
            if "face" in row
            else FeaturePoint.free(np.array(row["point"]))
        )
    face, report = clone_with_report(source, scene, FeaturePoints(points))
    counts = {role: sum(s.mesh.vertex_count for s in face.scene.with_role(role)) for role in Role}
    assert counts[Role.EYE_LEFT] == counts[Role.EYE_RIGHT] >= 770
    assert 2000 < counts[Role.UPPER_TEETH] < 2400
    assert 2000 < counts[Role.LOWER_TEETH] < 2400
    assert counts[Role.SKIN] == 14062
    assert np.array_equal(face.scene.world_neutral(), scene.world_neutral())
    assert report.measures["fp_error_after"] < 0.01
    assert report.measures["fp_error_before"] < 0.10
    assert not report.warnings()


def test_points_at_one_place_are_said_and_break_nothing(source: AnimatableFace) -> None:
    scene, points = bare(source)
    joined = points.with_points({"8.1": points["2.2"], "4.3": points["4.1"]})
    face, report = clone_with_report(source, scene, joined, faps=(4, 31, 35, 51))
    for fap in (4, 31, 35, 51):
        moved, own = (
            np.linalg.norm(face_motions(f, [(fap, 1)])[-1].offsets["skin"], axis=1).max() for f in (face, source)
        )
        assert moved < 2.0 * own, fap
    doubled = next(f for f in report.warnings() if f.code == "doubled-points")
    assert "8.1" in doubled.message
    assert "4.3" in doubled.message
