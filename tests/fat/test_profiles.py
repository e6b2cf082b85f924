"""Profiles: the published tables, and the shapes that a face's tables make of them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from faces import small_face

from authoring.open_jaw import strict
from fat import AnimatableFace, FaceDefTables, Player, conformance, face_motions
from fat.profiles import (
    ARKIT,
    OCULUS,
    PROFILES,
    VRM,
    Profile,
    faps_as_arkit,
    profile_shapes,
    profile_table,
)
from fat.quality import LIP_PAIRS, TIED, asymmetry, fap_values, feature_point_motion, mirror_map
from fba import Frame, ShapeSet
from fba.arrays import Floats, Ints
from fba.errors import FaceDefTablesError
from fba.faps import LOW_LEVEL_FAPS, Unit, fap
from fba.fapu import ANGLE_UNIT
from fba.scene import Role
from fba.sphere import fit_sphere
from formats import read_face

Z_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
SIDEWAYS = (15, 43, 64)
"""Middle FAPs whose positive direction is the subject's right."""

CROSS_TALK = 0.05
"""What a FAP may move other FAPs' points by, as a share of its own motion."""


@pytest.fixture(scope="module")
def source() -> AnimatableFace:
    return read_face("default")


@pytest.fixture(scope="module")
def arkit(source: AnimatableFace) -> ShapeSet:
    return profile_shapes(source, "arkit")[0]


def _mirrored(faps: dict[int, float]) -> dict[int, float]:
    """The same face in the mirror, by the standard's definitions of the FAPs."""
    turned = (*SIDEWAYS, 23, 24, 49, 50)
    return {fap(k).mirror or k: -v if k in turned else v for k, v in faps.items()}


def _values(face: AnimatableFace, delta: Floats) -> dict[int, float]:
    inside = face.scene.scatter(face.scene.frame.from_file(delta))
    return fap_values(feature_point_motion(face.feature_points, inside), face.fapu)


def _worst_asymmetry(face: AnimatableFace, mirror: Ints) -> float:
    """Largest difference between a FAP's motion and that of its mirror FAP on the skin."""
    motions = {(m.fap_id or 0, m.value): m.offsets["skin"] for m in face_motions(face) if "skin" in m.offsets}
    worst = 0.0
    for (number, value), offsets in motions.items():
        entry = fap(number)
        if entry.direction is not None and number not in SIDEWAYS:
            worst = max(worst, asymmetry(offsets, motions[entry.mirror or number, value], mirror))
    return worst


def test_every_shape_has_a_row() -> None:
    assert tuple(s.name for s in profile_table("arkit")) == ARKIT
    assert tuple(s.name for s in profile_table("vrm")) == VRM
    assert len(profile_table("oculus")) == len(OCULUS)
    assert [s.viseme for s in profile_table("oculus")] == list(range(15))


@pytest.mark.parametrize("profile", PROFILES)
def test_rows_are_possible_faces(profile: Profile) -> None:
    for shape in profile_table(profile):
        assert 0 <= shape.viseme <= 14
        assert 0 <= shape.expression <= 6
        for number, value in shape.faps.items():
            low, high = fap(number).i_range
            assert number in LOW_LEVEL_FAPS
            assert value == round(value) != 0
            assert (low if fap(number).bidirectional else 0) <= value <= high
            if fap(number).unit is Unit.IRISD:
                assert value <= 1024, "lids meet at 1024"


def test_left_and_right_are_mirror_images() -> None:
    table = {s.name: dict(s.faps) for s in (*profile_table("arkit"), *profile_table("vrm"))}
    for name, faps in table.items():
        other = name.replace("Left", "Rite").replace("Right", "Left").replace("Rite", "Right")
        assert table[other] == _mirrored(faps), name


def test_the_way_back_has_both_directions_of_every_fap() -> None:
    found = {(row.fap_id, row.value > 0) for row in faps_as_arkit()}
    assert found == {(f, up) for f in LOW_LEVEL_FAPS for up in (True, False) if up or fap(f).bidirectional}
    for row in faps_as_arkit():
        assert set(row.weights) <= set(ARKIT)
        assert all(weight > 0.0 for weight in row.weights.values())
        assert row.weights or row.note, "an empty row says why"


def test_there_and_back_points_the_same_way() -> None:
    """A shape that stands for a FAP moves that FAP's point that way itself."""
    table = {s.name: s.faps for s in profile_table("arkit")}
    for row in faps_as_arkit():
        for name in row.weights:
            assert table[name].get(row.fap_id, 0.0) * row.value > 0.0


def test_shapes_show_the_table(source: AnimatableFace, arkit: ShapeSet) -> None:
    """What the exported shapes do to the feature points is what the table says, wherever FAPs are independent."""
    player, rest = Player(source), source.scene.world_neutral()
    exact = {c.fap_id for c in conformance(source) if c.kind == "translation"}

    @cache
    def alone(number: int, value: int) -> dict[int, float]:
        return _values(source, source.scene.frame.to_file(player.pose({number: value}).world() - rest))

    deltas = dict(zip(arkit.names, arkit.deltas, strict=True))
    compared = 0
    for row in (row for row in profile_table("arkit") if row.name in deltas):
        found = _values(source, deltas[row.name])
        for number in row.faps.keys() & exact:
            value = row.faps[number]
            tied = {number, *(k for pair in TIED if number in pair for k in pair)}
            others = {k: v for k, v in row.faps.items() if k in exact and k not in tied}
            carried = sum(abs(alone(k, v)[number]) for k, v in others.items())
            if carried <= CROSS_TALK * abs(value):
                compared += 1
                assert found[number] == pytest.approx(value, abs=1.0 + CROSS_TALK * abs(value)), (row.name, number)
    assert compared > 150


def test_the_jaw_opens_by_its_own_value(source: AnimatableFace, arkit: ShapeSet) -> None:
    rows = {s.name: s for s in profile_table("arkit")}
    found = _values(source, arkit.deltas[arkit.names.index("jawOpen")])
    assert found[3] == pytest.approx(rows["jawOpen"].faps[3], rel=0.01)
    found = _values(source, arkit.deltas[arkit.names.index("jawLeft")])
    assert found[15] == pytest.approx(rows["jawLeft"].faps[15], rel=0.01)
    assert found[15] < 0, "left is the subject's left"


def test_mouth_close_shuts_the_open_jaw(source: AnimatableFace, arkit: ShapeSet) -> None:
    shut, _ = profile_shapes(source, "arkit", strict(source))
    opened, closed = (shut.deltas[shut.names.index(name)] for name in ("jawOpen", "mouthClose"))
    both = feature_point_motion(source.feature_points, source.scene.scatter(opened + closed))
    alone = feature_point_motion(source.feature_points, source.scene.scatter(opened))
    for upper, lower in LIP_PAIRS:
        assert alone[upper][1] - alone[lower][1] > 0.5 * source.fapu.mns0
        assert abs(both[upper][1] - both[lower][1]) < 0.02 * source.fapu.mns0
    assert both["2.1"][1] == pytest.approx(alone["2.1"][1], rel=1e-6), "the chin stays down"
    others = [k for k, name in enumerate(shut.names) if name != "mouthClose"]
    assert np.array_equal(shut.deltas[others], arkit.deltas[others])


def test_a_strict_jaw_opens_the_mouth_by_the_lips(source: AnimatableFace) -> None:
    face = strict(source)
    shapes, _ = profile_shapes(face, "arkit")
    row = next(s for s in profile_table("arkit") if s.name == "jawOpen")
    assert row.strict_faps.keys() > row.faps.keys()
    motion = feature_point_motion(face.feature_points, face.scene.scatter(shapes.deltas[shapes.names.index("jawOpen")]))
    assert motion["2.2"][1] - motion["2.3"][1] > 0.5 * face.fapu.mns0


def test_shapes_of_the_two_sides_mirror(source: AnimatableFace, arkit: ShapeSet) -> None:
    skin = source.scene.shape("skin")
    mirror = mirror_map(skin.mesh.vertices, 1e-3 * source.fapu.es0)
    place = source.scene.file_order()["skin"]
    deltas = {n: source.scene.frame.from_file(d)[place] for n, d in zip(arkit.names, arkit.deltas, strict=True)}
    own = _worst_asymmetry(source, mirror)
    compared = 0
    for name, delta in deltas.items():
        other = name.replace("Left", "Rite").replace("Right", "Left").replace("Rite", "Right")
        if np.abs(delta).max() > 1e-3 * source.fapu.es0:
            compared += 1
            assert asymmetry(delta, deltas[other], mirror) <= own + 1e-3, name
    assert compared > 40


def test_gaze_turns_the_eyeball_and_nothing_else(source: AnimatableFace, arkit: ShapeSet) -> None:
    angle = {s.name: s for s in profile_table("arkit")}["eyeLookOutLeft"].faps[23] * ANGLE_UNIT
    delta = source.scene.frame.from_file(arkit.deltas[arkit.names.index("eyeLookOutLeft")])
    moved = source.scene.scatter(delta)
    (eye,) = source.scene.with_role(Role.EYE_LEFT)
    rest = source.scene.world_vertices(eye.name)
    centre = fit_sphere(rest)[0]
    front = int(np.argmax(rest[:, 2]))
    before, after = rest[front] - centre, rest[front] + moved[eye.name][front] - centre
    turned = np.arctan2(after[0], after[2]) - np.arctan2(before[0], before[2])
    assert turned == pytest.approx(angle, abs=0.005)
    assert all(np.abs(values).max() < 1e-9 for name, values in moved.items() if name != eye.name)


def test_visemes_and_expressions_are_the_faces_own(source: AnimatableFace) -> None:
    shapes, findings = profile_shapes(source, "oculus")
    assert findings == []
    assert not shapes.deltas[0].any(), "silence is the neutral face"
    world = Player(source).pose(viseme=(10, 0, 63)).world() - source.scene.world_neutral()
    assert np.array_equal(shapes.deltas[10], source.scene.frame.to_file(world))
    shapes, _ = profile_shapes(source, "vrm")
    world = Player(source).pose(expression=(1, 63, 0, 0)).world() - source.scene.world_neutral()
    assert np.array_equal(shapes.deltas[0], source.scene.frame.to_file(world))
    assert not shapes.deltas[shapes.names.index("neutral")].any()


def test_shapes_are_in_the_files_own_axes(source: AnimatableFace, arkit: ShapeSet) -> None:
    turned = replace(source, scene=replace(source.scene, frame=Frame(Z_UP)))
    shapes, _ = profile_shapes(turned, "arkit")
    before = source.scene.frame.from_file(arkit.deltas)
    assert np.array_equal(shapes.deltas, before @ Z_UP)
    assert np.array_equal(shapes.neutral, source.scene.world_neutral() @ Z_UP)


def test_what_a_face_cannot_show_is_reported(source: AnimatableFace) -> None:
    kept = FaceDefTables(tuple(t for t in source.tables if t.fap_id not in (1, 12, 19)))
    shapes, findings = profile_shapes(replace(source, tables=kept), "arkit")
    said = {f.code: f.message for f in findings}
    assert "eyeBlinkLeft" not in shapes.names
    assert "eyeBlinkLeft (FAP 19)" in said["profile-shapes-missing"]
    assert "mouthSmileLeft" in shapes.names
    assert "mouthSmileLeft (FAP 12" in said["profile-shapes-partial"]
    assert "eyeBlinkRight" in shapes.names
    assert "eyeBlinkRight" not in said["profile-shapes-missing"]
    with pytest.raises(FaceDefTablesError, match="oculus"):
        profile_shapes(replace(source, tables=kept), "oculus")


def test_a_small_face_keeps_its_vertex_order() -> None:
    face = small_face(Frame(Z_UP))
    shapes, findings = profile_shapes(face, "arkit")
    assert shapes.neutral.shape == (face.scene.vertex_count, 3)
    assert np.array_equal(shapes.neutral, face.scene.frame.to_file(face.scene.world_neutral()))
    assert any("mouthSmileLeft" in f.message for f in findings)
