"""The reference sheet shows what a face can play, in close-up, and leaves out what it cannot."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from fat import AnimatableFace, FaceDefTables, FaceMotion
from fat.build import build_tables
from fba.faps import LOW_LEVEL_FAPS, fap
from fba.feature_points import FeaturePoints
from formats import read_face
from studio.cli.app import app
from studio.cli.outcome import Outcome
from studio.fap_sheet import CELL, JAW, MOUTH, SECTIONS, View, fap_sheets, tall_sheet
from studio.render import Figure, make_renderer
from studio.render.camera import Camera
from studio.sheet import GAP, MARGIN, TITLE_SIZE


@pytest.fixture(scope="module")
def face() -> AnimatableFace:
    return read_face("default")


def only(face: AnimatableFace, *keys: tuple[int, int]) -> AnimatableFace:
    """The face with these tables alone."""
    return replace(face, tables=FaceDefTables(tuple(t for t in face.tables if t.key in keys)))


def cells(image: Image.Image) -> list[np.ndarray]:
    """The pictures of the first row, left to right."""
    pixels = np.asarray(image).astype(int)
    top = MARGIN + TITLE_SIZE + 2 * GAP
    lefts = range(MARGIN, image.width - MARGIN - CELL[0] + 1, CELL[0] + GAP)
    return [pixels[top : top + CELL[1], left : left + CELL[0]] for left in lefts]


def test_every_low_level_fap_is_in_one_section() -> None:
    shown = [number for section in SECTIONS for number in section.faps]
    assert sorted(shown) == list(LOW_LEVEL_FAPS)
    for section in SECTIONS:
        assert set(section.views) <= set(section.faps)


def test_a_fap_is_shown_in_both_directions_beside_the_neutral_face(face: AnimatableFace) -> None:
    (sheet,) = fap_sheets(only(face, (4, 1)), make_renderer("software"))
    assert sheet.name == "inner_lips"
    neutral, down, up = cells(sheet.image)
    assert np.abs(down - neutral).max() > 30
    assert np.abs(up - neutral).max() > 30
    assert np.abs(up - down).max() > 30


def test_what_has_no_table_is_left_out(face: AnimatableFace) -> None:
    sheets = fap_sheets(only(face, (3, 1), (1, 10), (2, 6)), make_renderer("software"))
    assert [s.name for s in sheets] == ["jaw", "visemes", "expressions"]
    assert [len(cells(s.image)) for s in sheets] == [2, 2, 2]
    assert fap_sheets(only(face), make_renderer("software")) == []
    joined = tall_sheet(sheets)
    assert joined.height == sum(s.image.height for s in sheets)
    assert np.array_equal(np.asarray(joined)[: sheets[0].image.height, : sheets[0].image.width], sheets[0].image)


def test_a_view_holds_its_feature_points(face: AnimatableFace) -> None:
    places = face.feature_points.positions(face.scene)
    whole = Figure.of_face(face).camera
    for points, yaw in ((MOUTH, 0.0), (JAW, 50.0)):
        camera = View(points, 0.2, yaw).camera(places, whole, face.fapu.es0)
        matrix = camera.clip_matrix(*CELL, 10.0, -10.0)
        for key in points:
            x, y, _, w = matrix @ [*places[key], 1.0]
            assert abs(x / w) < 1.0
            assert abs(y / w) < 1.0
    assert camera.half_height < whole.half_height


def test_without_feature_points_the_whole_head_is_shown(face: AnimatableFace) -> None:
    whole = Camera((0.0, 1.0, 2.0), 3.0, 4.0)
    assert View(MOUTH, 0.2, 50.0).camera({}, whole, 1.0) == whole.turned(50.0)
    bare = replace(only(face, (19, 1)), feature_points=FeaturePoints({}))
    (sheet,) = fap_sheets(bare, make_renderer("software"))
    assert sheet.name == "eyes"


def test_some_shapes_can_be_drawn_alone(face: AnimatableFace) -> None:
    (number,) = [k for s in SECTIONS for k, view in s.views.items() if view.roles]
    offsets = np.tile([0.0, 0.1 * face.fapu.es0, 0.0], (face.scene.shape("tongue").mesh.vertex_count, 1))
    motion = FaceMotion(fap(number).name, number, 1, 400, {"tongue": offsets})
    playing = replace(face, tables=build_tables(face.scene, face.fapu, [motion]))
    (sheet,) = fap_sheets(playing, make_renderer("software"))
    neutral, raised, _ = cells(sheet.image)
    assert np.abs(raised - neutral).max() > 30
    # Without the skin most of the picture is background: the same left and right of the tongue.
    assert (np.abs(neutral - raised).max(axis=2) == 0).mean() > 0.3


def test_check_draws_the_sheet(tmp_path: Path, face: AnimatableFace) -> None:
    from formats import write

    path = tmp_path / "small.wrl"
    write(only(face, (3, 1)), path)
    done = CliRunner().invoke(app, ["check", str(path), "--sheet", str(tmp_path / "sheet.png")])
    assert done.exit_code in (Outcome.OK, Outcome.FINDINGS), done.output
    with Image.open(tmp_path / "sheet.png") as image:
        assert image.width > 2 * CELL[0]
    refused = CliRunner().invoke(app, ["check", str(path), "--sheet", str(tmp_path / "sheet.jpg")])
    assert refused.exit_code == Outcome.USAGE
