"""What a face has besides its skin: told by name and by place, and moved as it should be."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cloning import CloneReport, clone_with_report
from cloning.bind import nearest_on
from cloning.kinds import Kind, named
from cloning.pieces import count_pieces, find_pieces, words
from fat import AnimatableFace
from fat.build import face_motions
from fba import FaceScene, FeaturePoint, FeaturePoints, PolyMesh, Role, Shape
from fba.arrays import Floats
from formats import read_scene
from formats.landmarks import read_landmarks
from samples import sample

BLINK, JAW, BROW = 19, 3, 31
FAPS = (JAW, BLINK, BROW)


@pytest.fixture(scope="module")
def head() -> tuple[FaceScene, FeaturePoints]:
    """The coarse shipped head."""
    path = sample("faces/tri_head.obj")
    scene = read_scene(path)
    return scene, read_landmarks(path.with_name("tri_head.fps.json"), scene)


class Place:
    """Positions in eye separations from the middle between the pupils."""

    def __init__(self, scene: FaceScene, points: FeaturePoints) -> None:
        self.at = points.positions(scene)
        self.middle = 0.5 * (self.at["3.5"] + self.at["3.6"])
        self.es = float(np.linalg.norm(self.at["3.5"] - self.at["3.6"]))

    def __call__(self, *xyz: float) -> Floats:
        there: Floats = self.middle + self.es * np.array(xyz)
        return there


def tube(line: Floats, radius: float) -> PolyMesh:
    """A square tube along a polyline (k, 3)."""
    ring = radius * np.array([[1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0], [1.0, -1.0, 0.0]])
    vertices = (line[:, None] + ring).reshape(-1, 3)
    faces = [
        [4 * k + j, 4 * k + (j + 1) % 4, 4 * k + 4 + (j + 1) % 4, 4 * k + 4 + j]
        for k in range(len(line) - 1)
        for j in range(4)
    ]
    return PolyMesh.from_faces(vertices, faces)


def glasses(place: Place) -> PolyMesh:
    """A frame from temple to temple before the eyes, touching the bridge of the nose."""
    angle = np.linspace(0.0, 2.0 * np.pi, 24)
    rims = [
        np.stack([side + 0.32 * np.cos(angle), 0.28 * np.sin(angle) - 0.05, 0.25 + 0.0 * angle], axis=1)
        for side in (0.5, -0.5)
    ]
    temples = [np.array([[side * 0.82, 0.0, 0.25], [side * 1.2, 0.0, -1.4]]) for side in (1.0, -1.0)]
    line = np.concatenate([temples[0][::-1], rims[0], rims[1][::-1], temples[1]])
    return tube(place.middle + place.es * line, 0.02 * place.es)


def sheet(columns: Floats) -> PolyMesh:
    """A grid of quads over (a, b, 3) places."""
    a, b = columns.shape[:2]
    number = np.arange(a * b).reshape(a, b)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1)
    return PolyMesh.from_faces(columns.reshape(-1, 3), quads.reshape(-1, 4).tolist())


def hair(scene: FaceScene, place: Place) -> PolyMesh:
    """A cap a little above the scalp, hanging down beside the cheeks."""
    turn, rise = np.meshgrid(np.linspace(0.35 * np.pi, 1.65 * np.pi, 15), np.linspace(-0.5, 1.2, 10), indexing="ij")
    skin = scene.shape("skin").mesh.vertices
    top = float(skin[:, 1].max() - place.middle[1]) / place.es
    side = float(np.ptp(skin[skin[:, 1] > place.middle[1]][:, 0])) / place.es / 2.0 + 0.05
    x, z = np.sin(turn) * np.cos(rise.clip(0.0)) * side, np.cos(turn) * np.cos(rise.clip(0.0)) * side - 0.9
    y = np.where(rise > 0.0, np.sin(rise) * (top + 0.1), 3.0 * rise)
    return sheet(place.middle + place.es * np.stack([x, y, z], axis=-1))


def brow(place: Place, side: str) -> PolyMesh:
    """A strip over the three points of a brow, just above the skin."""
    line = np.array([place.at[key] for key in (("4.1", "4.3", "4.5") if side == "left" else ("4.2", "4.4", "4.6"))])
    share = np.linspace(0.0, 2.0, 9)
    middle = np.stack([np.interp(share, range(3), line[:, k]) for k in range(3)], axis=1)
    middle[:, 2] += 0.03 * place.es
    up = np.array([0.0, 0.03 * place.es, 0.0])
    return sheet(np.stack([middle - up, middle + up], axis=1))


def merged(meshes: list[PolyMesh]) -> PolyMesh:
    """One mesh without groups."""
    starts = np.cumsum([0, *(m.vertex_count for m in meshes)])
    faces = [m.face(f) + starts[k] for k, m in enumerate(meshes) for f in range(m.face_count)]
    return PolyMesh.from_faces(np.concatenate([m.vertices for m in meshes]), faces)


Dressed = tuple[AnimatableFace, CloneReport, dict[str, slice]]


@pytest.fixture(scope="module")
def dressed(source: AnimatableFace, head: tuple[FaceScene, FeaturePoints]) -> Dressed:
    """The head with glasses, hair and brows, everything in one mesh; and where each part's vertices are."""
    scene, points = head
    place = Place(scene, points)
    more = {
        "glasses": glasses(place),
        "hair": hair(scene, place),
        "left brow": brow(place, "left"),
        "right brow": brow(place, "right"),
    }
    parts = {s.name: s.mesh for s in scene.shapes} | more
    starts = np.cumsum([0, *(m.vertex_count for m in parts.values())]).tolist()
    rows = {name: slice(starts[k], starts[k + 1]) for k, name in enumerate(parts)}
    moved = {
        key: p
        if p.shape is None
        else replace(p, shape="all", vertices=tuple(v + rows[p.shape].start for v in p.vertices))
        for key, p in points.items()
    }
    whole = FaceScene((Shape("all", merged(list(parts.values()))),), name="dressed")
    face, report = clone_with_report(source, whole, FeaturePoints(moved), faps=FAPS)
    return face, report, rows


def motion(face: AnimatableFace, fap: int) -> Floats:
    """(N, 3) offsets at a FAP's largest value, the file's vertex order."""
    found = face_motions(face, [(fap, 1)])[-1]
    rest = {s.name: np.zeros((s.mesh.vertex_count, 3)) for s in face.scene.shapes}
    return face.scene.gather({**rest, **found.offsets})


def test_unnamed_pieces_are_told_by_their_place(dressed: Dressed) -> None:
    _, report, rows = dressed
    found = {part.kind: part.vertices for part in report.parts}
    for kind, names in (
        (Kind.GLASSES, ("glasses",)),
        (Kind.HAIR, ("hair",)),
        (Kind.BROWS, ("left brow", "right brow")),
        (Kind.LOWER_TEETH, ("lower_teeth",)),
        (Kind.TONGUE, ("tongue",)),
        (Kind.EYE_LEFT, ("eye_left",)),
    ):
        assert found[kind] == sum(rows[n].stop - rows[n].start for n in names), kind
    assert Kind.OTHER not in found


def test_hair_and_glasses_keep_their_shape_in_every_motion(dressed: Dressed) -> None:
    face, _, rows = dressed
    for fap in FAPS:
        moved = motion(face, fap)
        assert moved[rows["skin"]].any()
        assert not moved[rows["glasses"]].any()
        assert not moved[rows["hair"]].any()


def test_brows_go_with_the_skin_below_them(dressed: Dressed) -> None:
    face, _, rows = dressed
    moved, rest = motion(face, BROW), face.scene.world_neutral()
    skin = face.scene.with_role(Role.SKIN)[0].mesh.triangles
    triangles, weights, _ = nearest_on(rest[rows["left brow"]], rest[rows["skin"]], skin)
    below = np.einsum("nc,ncd->nd", weights, moved[rows["skin"]][skin[triangles]])
    strip = moved[rows["left brow"]]
    assert np.abs(below).max() > 0.02 * face.fapu.es0
    assert np.linalg.norm(strip - below) < 0.2 * np.linalg.norm(below)
    assert not motion(face, JAW)[rows["left brow"]].any()


def test_the_report_says_every_part_and_its_motion(dressed: Dressed) -> None:
    _, report, _ = dressed
    said = json.loads(report.to_json())["parts"]
    assert sum(row["vertices"] for row in said) == sum(s.mesh.vertex_count for s in dressed[0].scene.shapes)
    assert {row["part"]: row["motion"] for row in said}["hair"] == "rests with the head"
    line = next(f.message for f in report.findings if f.code == "parts")
    assert "2 eyeballs turn" in line
    assert "glasses rest with the head" in line


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("Wolf3D_Glasses", Kind.GLASSES),
        ("helper-l-eyelashes-1", Kind.LASHES),
        ("M_EyeOcclusion", Kind.EYE_TRIM),
        ("EyebrowLeft", Kind.BROWS),
        ("Hair_Long", Kind.HAIR),
        ("Wolf3D_Outfit_Top", Kind.CLOTHES),
        ("EyeLeft", None),
        ("Chair", None),
    ],
)
def test_names(name: str, kind: Kind | None) -> None:
    assert named(words(name)) is kind


def test_a_piece_has_the_name_that_most_of_its_polygons_have() -> None:
    mesh = PolyMesh.from_faces(
        np.random.default_rng(0).normal(size=(9, 3)), [[0, 1, 2], [2, 3, 4], [5, 6, 7], [6, 7, 8]]
    )
    mesh = replace(mesh, face_groups=np.array([0, 0, 1, 0], np.int32), group_names=("M_Teeth", "gums"))
    pieces = find_pieces(FaceScene((Shape("face", mesh),)))
    assert [name.removeprefix("face").strip() for name in pieces.names] == ["m teeth", ""]
    assert count_pieces(FaceScene((Shape("face", mesh),))) == 2


def test_teeth_and_tongue_are_found_by_their_names_alone(
    source: AnimatableFace, head: tuple[FaceScene, FeaturePoints]
) -> None:
    scene, points = head
    bare = FeaturePoints({k: p for k, p in points.items() if not k.startswith("6.") and k not in TEETH})
    face, report = clone_with_report(source, scene, bare, faps=(JAW,))
    roles = {s.name: s.role for s in face.scene.shapes}
    assert roles["upper_teeth"] is Role.UPPER_TEETH
    assert roles["lower_teeth"] is Role.LOWER_TEETH
    assert roles["tongue"] is Role.TONGUE
    full, _ = clone_with_report(source, scene, points, faps=(JAW,))
    for name, most in (("lower_teeth", 0.1), ("tongue", 0.3)):
        a, b = (face_motions(f, [(JAW, 1)])[-1].offsets[name] for f in (face, full))
        assert np.linalg.norm(a - b) < most * np.linalg.norm(b), name
    assert not [f for f in report.findings if f.code.startswith("no-")]


TEETH = ("9.8", "9.9", "9.10", "9.11")


def test_one_eye_is_enough(source: AnimatableFace, head: tuple[FaceScene, FeaturePoints]) -> None:
    scene, points = head
    place = points.positions(scene)
    shapes = tuple(replace(s, vertex_ids=None) for s in scene.shapes if s.name != "eye_right")
    kept = FeaturePoints({**points, "3.6": FeaturePoint.free(place["3.6"])})
    face, report = clone_with_report(source, replace(scene, roots=shapes), kept, faps=(BLINK, 23, 24))
    assert "no-eye-right" in {f.code for f in report.warnings()}
    assert face.tables.get(23) is not None
    assert face.tables.get(24) is None


def test_real_kits_have_all_their_parts(shared: Path, source: AnimatableFace) -> None:
    """ICT-FaceKit: gums and tongue are one piece that its name tells from the teeth."""
    scene = read_scene(shared / "faces" / "ict-facekit" / "generic_neutral_mesh.obj")
    points = read_landmarks(shared / "landmarks" / "ict.json", scene)
    face, report = clone_with_report(source, scene, points, faps=(JAW,), backend="fmc")
    pieces = {part.kind: part.pieces for part in report.parts}
    assert pieces[Kind.UPPER_TEETH] == 16
    assert pieces[Kind.LOWER_TEETH] == 16
    assert pieces[Kind.TONGUE] == 1
    jaw = face_motions(face, [(JAW, 1)])[-1].offsets
    tongue, teeth = (next(s.name for s in face.scene.with_role(r)) for r in (Role.TONGUE, Role.LOWER_TEETH))
    still = ~jaw[tongue].any(axis=1)
    assert 0.2 < still.mean() < 0.8, "the upper gums rest, the lower ones go with the teeth"
    assert jaw[teeth][:, 1].max() < 0.0
