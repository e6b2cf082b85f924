"""Contact sheets: layout, and which poses they show."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fat import AnimatableFace, FaceDefTables
from fba.errors import OutputFileError
from formats import read_face
from studio.render import make_renderer
from studio.sheet import GAP, MARGIN, PosePick, Sheet, contact_sheet, default_poses


@pytest.fixture(scope="module")
def face() -> AnimatableFace:
    return read_face("default")


def flat(color: tuple[int, int, int], height: int = 30, width: int = 50) -> np.ndarray:
    return np.broadcast_to(np.array(color, dtype=np.uint8), (height, width, 3)).copy()


def test_pictures_lie_in_rows_and_columns() -> None:
    sheet = Sheet()
    sheet.add_row("", [flat((255, 0, 0)), flat((0, 255, 0))])
    sheet.add_row("", [flat((0, 0, 255))])
    image = np.asarray(sheet.image())
    assert image.shape == (2 * MARGIN + 2 * 30 + GAP, 2 * MARGIN + 2 * 50 + GAP, 3)
    assert np.array_equal(image[MARGIN : MARGIN + 30, MARGIN : MARGIN + 50], flat((255, 0, 0)))
    assert np.array_equal(image[MARGIN : MARGIN + 30, MARGIN + 50 + GAP : -MARGIN], flat((0, 255, 0)))
    assert np.array_equal(image[-MARGIN - 30 : -MARGIN, MARGIN : MARGIN + 50], flat((0, 0, 255)))
    assert (image[-MARGIN - 30 : -MARGIN, MARGIN + 50 :] == 255).all()


def test_text_makes_room_for_itself_and_stays_out_of_the_pictures() -> None:
    plain, told = Sheet(), Sheet("A title that is wider than the one picture of this sheet")
    plain.add_row("", [flat((9, 9, 9))])
    told.add_row("label", [flat((9, 9, 9))], ["a caption much too long for so small a picture"])
    a, b = plain.image(), told.image()
    assert b.width > a.width
    assert b.height > a.height
    found = np.argwhere((np.asarray(b) == 9).all(axis=2))
    assert len(found) == 30 * 50
    assert np.ptp(found, axis=0).tolist() == [29, 49]
    assert (np.asarray(b) < 128).all(axis=2).sum() > 30 * 50 + 50  # there is ink


def test_empty_sheet_is_paper() -> None:
    assert np.asarray(Sheet().image()).min() == 255


def test_default_poses_need_tables_of_every_face(face: AnimatableFace) -> None:
    poses = default_poses(face)
    captions = [p.caption for p in poses]
    assert captions[:2] == ["neutral", "joy"]
    assert len(poses) == 24
    assert len(set(captions)) == 24
    jaw = replace(face, tables=FaceDefTables(tuple(t for t in face.tables if t.fap_id in (3, 19, 20))))
    assert [p.caption for p in default_poses(face, jaw)] == ["neutral", "open_jaw", "blink", "wink left"]
    assert [p.caption for p in default_poses(replace(face, tables=FaceDefTables()))] == ["neutral"]
    assert len(default_poses(face, count=5)) == 5


def test_contact_sheet_shows_source_above_clone(face: AnimatableFace, tmp_path: Path) -> None:
    poses = [PosePick("neutral"), PosePick("jaw", {3: 800}), PosePick("joy", expression=(1, 63, 0, 0))]
    still = replace(face, tables=FaceDefTables())
    renderer = make_renderer("software")
    image = contact_sheet(face, still, poses, cell=60, columns=2, renderer=renderer)
    again = contact_sheet(face, still, poses, cell=60, columns=2, renderer=renderer)
    assert image.tobytes() == again.tobytes()
    pixels = np.asarray(image)
    band = 2 * 72 + 13 + GAP + 2 * GAP
    left = image.width - MARGIN - 2 * 60 - GAP
    cells = {
        (row, column): pixels[y : y + 72, left + column * (60 + GAP) :][:, :60]
        for row, y in enumerate((MARGIN, MARGIN + 72, MARGIN + band, MARGIN + band + 72))
        for column in range(2)
    }
    neutral, jaw, joy = cells[0, 0], cells[0, 1], cells[2, 0]
    assert np.array_equal(neutral, cells[1, 0])
    assert np.array_equal(neutral, cells[1, 1])  # a face without tables stays still
    assert np.array_equal(neutral, cells[3, 0])
    assert (np.abs(jaw.astype(int) - neutral) > 30).any()
    assert (np.abs(joy.astype(int) - jaw) > 30).any()
    assert (cells[3, 1] == 255).all()


def test_wide_sheets_are_about_1600_pixels(face: AnimatableFace) -> None:
    poses = [PosePick(str(k)) for k in range(8)]
    image = contact_sheet(face, face, poses, renderer=make_renderer("software"))
    assert 1400 < image.width <= 1600


def test_sheet_is_saved_whole_and_the_same_each_time(tmp_path: Path) -> None:
    sheet = Sheet("title")
    sheet.add_row("row", [flat((1, 2, 3))], ["caption"])
    for name in ("a.png", "b.png"):
        sheet.save(tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert np.array_equal(np.asarray(Image.open(tmp_path / "a.png")), np.asarray(sheet.image()))
    with pytest.raises(OutputFileError):
        sheet.save(tmp_path / "missing" / "a.png")
