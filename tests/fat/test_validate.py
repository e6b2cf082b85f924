from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from literal_player import strip

from fat import AnimatableFace, FaceDefMesh, FaceDefTable, FaceDefTables, FaceDefTransform, TransformField
from fat.evaluate import Player
from fat.validate import validate
from fba import FaceScene, Fapu, FeaturePoint, FeaturePoints, Transform
from fba.errors import FaceDefTablesError
from fba.faps import LOW_LEVEL_FAPS, fap
from fba.feature_points import standard_feature_points

FAPU = Fapu(irisd0=0.1, es0=0.6, ens0=0.4, mns0=0.2, mw0=0.5)
PLACES = {
    "3.1": (0.3, 0.45, 0), "3.2": (-0.3, 0.45, 0), "3.3": (0.3, 0.35, 0), "3.4": (-0.3, 0.35, 0),
    "3.5": (0.3, 0.4, 0), "3.6": (-0.3, 0.4, 0), "9.15": (0, 0, 0), "2.2": (0, -0.2, 0),
    "8.3": (0.25, -0.2, 0), "8.4": (-0.25, -0.2, 0),
}  # fmt: skip
EVERY = {i: FeaturePoint.free(np.array(PLACES.get(i, (0, 0, 0)))) for i in standard_feature_points()}


def mesh(**change: object) -> FaceDefMesh:
    fields = {
        "shape": "skin",
        "interval_borders": [-100, 0, 100],
        "coord_index": [0, 1],
        "displacements": 0.1,
        **change,
    }
    borders, index = np.array(fields["interval_borders"]), np.array(fields["coord_index"])
    slopes = np.broadcast_to(fields["displacements"], (index.size, borders.size - 1, 3))
    return FaceDefMesh(str(fields["shape"]), borders, index, slopes)


def complete() -> AnimatableFace:
    """A face about which nothing is to be said."""
    scene = FaceScene((Transform("yaw", (Transform("pitch", (strip("eye", 5, 1),)),)), strip("skin", 20, 0)))
    tables = [FaceDefTable(n, 1, (mesh(interval_borders=[0, 100]),)) for n in LOW_LEVEL_FAPS if n not in (23, 25)]
    tables += [FaceDefTable(1, n, (mesh(interval_borders=[0, 63], displacements=1e-4),)) for n in range(1, 15)]
    tables += [FaceDefTable(2, n, (mesh(interval_borders=[0, 63], displacements=1e-4),)) for n in range(1, 7)]
    tables.append(FaceDefTable(23, 1, (), (FaceDefTransform("yaw", rotation_def=(0, 1, 0, 1)),)))
    tables.append(FaceDefTable(25, 1, (), (FaceDefTransform("pitch", rotation_def=(1, 0, 0, 1)),)))
    return AnimatableFace(scene, FeaturePoints(EVERY), FaceDefTables(tuple(tables)), FAPU)


def with_table(table: FaceDefTable) -> AnimatableFace:
    face = complete()
    return replace(face, tables=FaceDefTables((*(t for t in face.tables if t.key != table.key), table)))


def turn(name: str = "yaw", **more: object) -> FaceDefTransform:
    return FaceDefTransform(name, **more)


def test_a_sound_face_has_no_findings() -> None:
    assert validate(complete()) == []
    Player(complete())


@pytest.mark.parametrize(
    ("table", "severity", "code", "words"),
    [
        (FaceDefTable(3, 1, (mesh(shape="nose"),)), "error", "unknown-shape", "no shape 'nose'"),
        (FaceDefTable(3, 1, (mesh(coord_index=[3, 20, -1]),)), "error", "vertex-index", "2 of 3 entries"),
        (FaceDefTable(4, 1, (mesh(displacements=np.nan),)), "error", "not-finite", "of 2 vertices"),
        (FaceDefTable(0, 1, (mesh(),)), "error", "fap-id", "fapID 0"),
        (FaceDefTable(69, 1, (mesh(),)), "error", "fap-id", "fapID 69"),
        (FaceDefTable(48, 1, (), (turn("neck"),)), "error", "unknown-transform", "no Transform 'neck'"),
        (FaceDefTable(4, 1, (mesh(coord_index=[3, 3, 4]),)), "warning", "duplicate-index", "1 vertices"),
        (FaceDefTable(4, 1, (mesh(interval_borders=[-2000, 0, 100]),)), "warning", "border-range", "-2000 lie outside"),
        (FaceDefTable(3, 1, (mesh(),)), "warning", "border-range", "-100 lie outside 0..4320"),
        (FaceDefTable(1, 10, (mesh(interval_borders=[0, 64]),)), "warning", "border-range", "64 lie outside 0..63"),
        (FaceDefTable(4, 1, (mesh(interval_borders=[-90, 0]),)), "warning", "negative-interval", "[-90, 0]"),
        (FaceDefTable(4, 1, (mesh(displacements=100.0),)), "warning", "huge", "eye separations"),
        (FaceDefTable(4, 1, (mesh(displacements=0.0),)), "info", "no-motion", "all displacements are zero"),
        (FaceDefTable(4, 1), "warning", "empty-table", "moves nothing"),
        (FaceDefTable(4, 7, (mesh(),)), "warning", "high-level-select", "low-level FAP"),
        (FaceDefTable(1, 15, (mesh(interval_borders=[0, 63]),)), "warning", "high-level-select", "only 14 visemes"),
        (FaceDefTable(2, 70, (mesh(interval_borders=[0, 63]),)), "error", "high-level-select", "1..64"),
        (FaceDefTable(29, 1, (), (turn("yaw", field=TransformField.SCALE),)), "warning", "scale-field", "vanishes"),
        (FaceDefTable(24, 1, (), (turn("yaw"),)), "warning", "shared-field", "yaw_l_eyeball, yaw_r_eyeball all set"),
        (FaceDefTable(3, 1, (), (turn("yaw"),)), "warning", "rotation-unit", "no angle (MNS)"),
        (FaceDefTable(24, 1, (), (turn(rotation_def=(0, 0, 0, 1)),)), "error", "null-axis", "0 0 0"),
        (FaceDefTable(24, 1, (), (turn(rotation_def=(0, 1, 0, np.inf)),)), "error", "not-finite", "not finite"),
    ],
)
def test_each_mistake_is_told(table: FaceDefTable, severity: str, code: str, words: str) -> None:
    face = with_table(table)
    found = {f.code: f for f in validate(face)}
    assert code in found, found
    assert found[code].severity == severity
    assert words in found[code].message
    if code in ("unknown-shape", "vertex-index", "not-finite", "fap-id", "unknown-transform"):
        with pytest.raises(FaceDefTablesError):
            Player(face)


def test_rest_poses_that_a_fap_overwrites_are_told() -> None:
    face = complete()
    roots = (replace(face.scene.roots[0], rotation=(0.0, 1.0, 0.0, 0.2)), face.scene.roots[1])
    (finding,) = validate(replace(face, scene=FaceScene(roots)))
    assert (finding.code, finding.where) == ("rest-field", "yaw_l_eyeball on 'yaw'")


def test_absent_tables_are_facts_unless_nothing_moves() -> None:
    face = complete()
    few = FaceDefTables(tuple(t for t in face.tables if t.fap_id in (1, 3)))
    found = {f.code: f for f in validate(replace(face, tables=few))}
    assert {c: f.severity for c, f in found.items()} == {"absent-faps": "info", "absent-expressions": "info"}
    assert "65 FAPs" in found["absent-faps"].message
    assert fap(68).name in found["absent-faps"].message
    (nothing,) = validate(replace(face, tables=FaceDefTables()))
    assert (nothing.severity, nothing.code) == ("error", "no-tables")


def test_fapus_and_feature_points() -> None:
    face = complete()
    points = dict(EVERY)
    cases = (
        (replace(face, fapu=replace(FAPU, mns0=0.0)), "fapu", "MNS0 must be positive"),
        (replace(face, fapu=replace(FAPU, mw0=float("nan"))), "fapu", "MW0 must be positive"),
        (replace(face, fapu=replace(FAPU, mns0=0.1)), "fapu-differs", "MNS0 = 0.1, the feature points give 0.2"),
        (replace(face, feature_points=FeaturePoints({})), "fapu-points", "9.15"),
        (replace(face, feature_points=FeaturePoints({**points, "8.3": points["8.4"]})), "fapu", "MW0"),
        (
            replace(face, feature_points=FeaturePoints({**points, "9.3": FeaturePoint("skin", (20,), (1.0,))})),
            "feature-point",
            "9.3 names vertices of 'skin'",
        ),
        (
            replace(face, feature_points=FeaturePoints({**points, "3.5": FeaturePoint("gone", (0,), (1.0,))})),
            "feature-point",
            "3.5 names vertices of 'gone'",
        ),
    )
    for changed, code, words in cases:
        found = {f.code: f.message for f in validate(changed)}
        assert words in found[code]
    few = FeaturePoints({k: v for k, v in points.items() if k in PLACES})
    assert [(f.severity, f.code) for f in validate(replace(face, feature_points=few))] == [("info", "feature-points")]


def test_names_used_twice_are_an_error() -> None:
    scene = FaceScene((*complete().scene.roots, Transform("yaw")))
    (finding,) = validate(replace(complete(), scene=scene))
    assert (finding.severity, finding.code, finding.where) == ("error", "duplicate-name", "yaw")
