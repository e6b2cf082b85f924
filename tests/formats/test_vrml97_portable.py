"""The portable form of VRML97: the same face, with PROTOs and interpolators that play it in browsers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faces import assert_same_face, small_face, small_scene

from fat import AnimatableFace, FaceDefTable, FaceDefTables, FaceDefTransform, Player
from fba import Frame
from fba.errors import UnsupportedFeatureError
from fba.faps import Unit
from fba.fapu import ANGLE_UNIT
from fba.scene import rotation_matrix
from fba.stream import FapStream
from formats import read, vrml97, write
from formats.vrml97.tree import Numbers, Proto, Route, Strings, VrmlNode, definitions, walk

FRAMES = 7


def stream() -> FapStream:
    """A ramp of every kind of FAP, with a stretch that stands still and a gap."""
    ramp = np.linspace(-500, 500, FRAMES)
    ramp[3:5] = ramp[3]
    visemes = np.array([[1, 0, 9 * k, 0] for k in range(FRAMES)])
    made = FapStream.build(10.0, FRAMES, {3: 2 * ramp, 5: 3 * ramp, 14: ramp, 23: 60 * ramp, 25: 80 * ramp}, visemes)
    return replace(made, frame_numbers=np.array([2, 3, 4, 5, 6, 7, 9]))


def written(face: AnimatableFace, folder: Path, played: FapStream | None) -> tuple[VrmlNode, ...]:
    """The nodes and other statements of the portable file."""
    write(face, folder / "face.wrl", played, portable=True)
    return vrml97.parse((folder / "face.wrl").read_text())  # type: ignore[return-value]


def numbers(item: VrmlNode, name: str) -> np.ndarray:
    value = item.get(name)
    assert isinstance(value, Numbers)
    return value.values


FRAME = Frame(np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]))


@pytest.mark.parametrize("frame", [Frame(), FRAME], ids=["Y up", "Z up"])
@pytest.mark.parametrize("played", [None, stream()], ids=["still", "with a stream"])
def test_it_reads_back_as_the_same_face(frame: Frame, played: FapStream | None, tmp_path: Path) -> None:
    face = small_face(frame)
    write(face, tmp_path / "face.wrz", played, portable=True)
    found = read(tmp_path / "face.wrz")
    assert isinstance(found, AnimatableFace)
    assert_same_face(found, face)
    write(found, tmp_path / "native.wrl")
    text = (tmp_path / "native.wrl").read_text()
    assert "fba_player" not in text
    assert "Interpolator" not in text
    assert "ROUTE" not in text
    write(found, tmp_path / "again.wrz", played, portable=True)
    assert (tmp_path / "again.wrz").read_bytes() == (tmp_path / "face.wrz").read_bytes()


def test_every_table_is_a_proto_with_a_value_that_reaches_the_script(tmp_path: Path) -> None:
    face = small_face()
    statements = written(face, tmp_path, None)
    protos = {p.name: p for p in statements if isinstance(p, Proto)}
    assert {"value", "unit"} <= {i.name for i in protos["FaceDefTables"].interface}
    (script,) = (n for n in walk(protos["Face"].body) if isinstance(n, VrmlNode) and n.type == "Script")
    url = script.get("url")
    assert isinstance(url, Strings)
    assert url.values[0].startswith("javascript:")
    known = definitions(statements)
    (player,) = (n for n in statements if isinstance(n, VrmlNode) and n.def_name == "fba_player")
    routes = {(r.source, r.target) for r in player.body if isinstance(r, Route)}
    units = {"fap_03_open_jaw": face.fapu.unit(Unit.MNS), "viseme_PP": 1.0, "fap_23_yaw_l_eyeball": ANGLE_UNIT}
    for label, unit in units.items():
        assert numbers(known[label], "unit")[0] == unit
        assert ((label, "fba_face") in routes) == bool(known[label].nodes("faceDefMesh"))
    assert sum(target == "fba_face" for _, target in routes) == sum(bool(t.meshes) for t in face.tables)


def test_interpolators_give_the_values_of_our_own_player(tmp_path: Path) -> None:
    face, played = small_face(), stream()
    known = definitions(written(face, tmp_path, played))
    times = (played.frame_numbers - 2) / 10.0
    assert numbers(known["fba_clock"], "cycleInterval")[0] == times[-1]
    expected = Player(face).table_values(played)
    seen = 0
    for column, table in enumerate(face.tables):
        name = f"fap_{table.fap_id:02d}_{table.name}_values" if table.fap_id > 2 else f"{table.name}_values"
        if name not in known:
            assert not expected[:, column].any()
            continue
        key, values = numbers(known[name], "key"), numbers(known[name], "keyValue")
        assert key[0] == 0.0
        assert key[-1] == 1.0
        assert np.all(np.diff(key) > 0)
        assert len(key) <= FRAMES
        found = np.interp(times / times[-1], key, values)
        np.testing.assert_allclose(found, expected[:, column], atol=0.0006)
        seen += 1
    assert seen >= 5


def test_eyes_turn_by_interpolators_with_fap_values_as_keys(tmp_path: Path) -> None:
    face = small_face(FRAME)
    known = definitions(written(face, tmp_path, stream()))
    turns = known["fap_23_yaw_l_eyeball_turns"]
    key, rows = numbers(turns, "key"), numbers(turns, "keyValue").reshape(-1, 4)
    assert key[0] < -3e5
    assert key[-1] > 3e5
    assert 0.0 in key
    for value, row in zip(key, rows, strict=True):
        inside = FRAME.axes @ rotation_matrix(tuple(row))[:3, :3] @ FRAME.axes.T
        expected = rotation_matrix((0.0, 1.0, 0.0, value * ANGLE_UNIT))[:3, :3]
        np.testing.assert_allclose(inside, expected, atol=1e-9)
    # The pitch has another rotation in the file than its table's neutral one: it stays while the value is 0.
    pitch = known["fap_25_pitch_l_eyeball_turns"]
    rest = numbers(pitch, "keyValue").reshape(-1, 4)[numbers(pitch, "key") == 0.0]
    inside = FRAME.axes @ rotation_matrix(tuple(rest[0]))[:3, :3] @ FRAME.axes.T
    np.testing.assert_allclose(inside, rotation_matrix((1.0, 0.0, 0.0, 0.05))[:3, :3], atol=1e-12)


@pytest.mark.parametrize("frames", [0, 1])
@pytest.mark.parametrize("extension", ["wrl", "x3d"])
def test_a_stream_of_one_frame_or_none_is_a_pose(frames: int, extension: str, tmp_path: Path) -> None:
    path = tmp_path / f"face.{extension}"
    played = FapStream.build(25.0, frames, {3: [400] * frames})
    write(small_face(), path, played, portable=extension == "wrl")
    text = path.read_text()
    assert ("fba_clock" in text) == bool(frames)
    if frames:
        wanted = {"wrl": "key [ 0 ]", "x3d": 'key="0"'}[extension]
        assert wanted in text
        assert {"wrl": "keyValue [ 400 ]", "x3d": 'keyValue="400"'}[extension] in text
    found = read(path)
    assert isinstance(found, AnimatableFace)
    assert_same_face(found, small_face())


def test_two_tables_on_one_field_are_refused(tmp_path: Path) -> None:
    face = small_face()
    again = FaceDefTable(26, 1, (), (FaceDefTransform("eye_left_yaw", rotation_def=(1.0, 0.0, 0.0, 1.0)),))
    face = replace(face, tables=FaceDefTables((*face.tables, again)))
    with pytest.raises(UnsupportedFeatureError, match=r"yaw_l_eyeball and pitch_r_eyeball both drive .*eye_left_yaw"):
        write(face, tmp_path / "face.wrl", portable=True)
    assert not list(tmp_path.iterdir())


FOREIGN = """#VRML V2.0 utf8
PointLight { location 0 0 9 }
Viewpoint { position 0 0 4 }
DEF head Transform { children [
  DEF skin Shape { geometry DEF faces IndexedFaceSet {
    coord DEF shared Coordinate { point [ 0 0 0, 1 0 0, 0 1 0, 1 1 0 ] } coordIndex [ 0 1 2 -1 ]
    normal Normal { vector [ 0 0 1 ] } normalIndex [ 0 0 0 -1 ] } }
  DEF other Shape { geometry IndexedFaceSet { coord USE shared coordIndex [ 1 3 2 -1 ] } }
] }
DEF f Face { fdp FDP { faceSceneGraph [ USE head ] faceDefTables [
  FaceDefTables { fapID 3 faceDefMesh [
    FaceDefMesh { faceSceneGraphNode USE skin intervalBorders [ 0 512 ] coordIndex [ 1 ] displacements [ 0 1 0 ] }
    FaceDefMesh { faceSceneGraphNode USE other intervalBorders [ 0 512 ] coordIndex [ 3 ] displacements [ 0 1 0 ] }
  ] } ] } }
"""


def test_what_a_file_has_of_its_own_stays(tmp_path: Path) -> None:
    """Lights, viewpoints, shared points; normals of what moves go, since browsers would not turn them."""
    (tmp_path / "foreign.wrl").write_text(FOREIGN)
    face = read(tmp_path / "foreign.wrl")
    assert isinstance(face, AnimatableFace)
    statements = written(face, tmp_path, None)
    types = [n.type for n in walk(statements) if isinstance(n, VrmlNode)]
    assert types.count("PointLight") == 1
    assert "DirectionalLight" not in types
    assert types.count("Viewpoint") == 1
    assert "Normal" not in types
    assert types.count("Coordinate") >= 1
    assert definitions(statements)["shared"].type == "Coordinate"
    again = read(tmp_path / "face.wrl")
    assert isinstance(again, AnimatableFace)
    assert [m.shape for t in again.tables for m in t.meshes] == ["skin", "other"]


def test_a_scene_without_tables_gets_lights_and_a_viewpoint(tmp_path: Path) -> None:
    write(small_scene(FRAME), tmp_path / "scene.wrl", portable=True)
    statements = vrml97.parse((tmp_path / "scene.wrl").read_text())
    found = {n.type: n for n in walk(statements) if isinstance(n, VrmlNode)}
    assert {"Viewpoint", "NavigationInfo", "DirectionalLight"} <= found.keys()
    assert "Face" not in found
    light = FRAME.axes @ numbers(found["DirectionalLight"], "direction")
    assert max(light[1:]) < 0, "lights shine from above and from the front"


def test_a_second_parser_reads_it(tmp_path: Path) -> None:
    """PyVRML97 sees the tables and the interpolators. A Script in a PROTO sends it round in circles."""
    loader = pytest.importorskip("vrml.vrml97.parser")
    write(small_face(), tmp_path / "face.wrl", stream(), portable=True)
    text = (tmp_path / "face.wrl").read_text()
    start = text.index(" Script {")
    text = text[:start] + text[text.index("\n }\n", start) + 3 :]
    ok, (_, scene, *_), used = loader.buildParser().parse(text)
    assert ok
    assert used == len(text)
    table = scene.getDEF("fap_03_open_jaw")
    assert (table.fapID, len(table.faceDefMesh), table.value) == (3, 2, 0.0)
    values = scene.getDEF("fap_03_open_jaw_values")
    assert len(values.key) == len(values.keyValue) > 2
