"""Contact sheets: pictures in rows and columns with captions, and a source face above its clone pose by pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from fat.evaluate import Player
from fat.face import AnimatableFace
from fba.faps import EXPRESSION_FAP, VISEME_FAP
from fba.high_level import BLEND_MAX, EXPRESSIONS, VISEMES
from formats.files import atomic_output
from studio.render import Figure, Renderer, make_renderer

UInt8 = NDArray[np.uint8]

PAPER = (255, 255, 255)
INK = (32, 33, 36)
GREY = (110, 113, 120)
MARGIN = 14
GAP = 6
TALL = 1.2
"""Height of a face's picture in widths."""
TITLE_SIZE, LABEL_SIZE, CAPTION_SIZE = 22, 15, 13


@dataclass(frozen=True, eq=False)
class Row:
    """Pictures side by side: label on the left, a caption below each picture (empty: no line for it)."""

    label: str
    pictures: Sequence[UInt8]
    captions: Sequence[str] = ()
    space_before: int = GAP


@dataclass
class Sheet:
    """Builds one picture out of many.

    Attributes
    ----------
    title : on top; may be empty.
    rows : from top to bottom; all pictures have one size, rows may differ in length.
    """

    title: str = ""
    rows: list[Row] = field(default_factory=list)

    def add_row(
        self, label: str, pictures: Sequence[UInt8], captions: Sequence[str] = (), space_before: int = GAP
    ) -> None:
        """Append a row."""
        self.rows.append(Row(label, pictures, captions, space_before))

    def image(self) -> Image.Image:
        """Lay everything out and draw it."""
        fonts = {size: ImageFont.load_default(size) for size in (TITLE_SIZE, LABEL_SIZE, CAPTION_SIZE)}
        cell_h, cell_w = max(((p.shape[0], p.shape[1]) for r in self.rows for p in r.pictures), default=(0, 0))
        labels = [fonts[LABEL_SIZE].getlength(r.label) for r in self.rows]
        left = MARGIN + (int(max(labels, default=0)) + 2 * GAP if any(labels) else 0)
        columns = max((len(r.pictures) for r in self.rows), default=0)
        width = left + columns * (cell_w + GAP) - GAP + MARGIN
        width = max(width, int(fonts[TITLE_SIZE].getlength(self.title)) + 2 * MARGIN)
        top = MARGIN + (TITLE_SIZE + 2 * GAP if self.title else 0)
        tops: list[int] = []
        for row in self.rows:
            top += row.space_before if tops else 0
            tops.append(top)
            top += cell_h + (CAPTION_SIZE + GAP if any(row.captions) else 0)
        image = Image.new("RGB", (width, top + MARGIN), PAPER)
        draw = ImageDraw.Draw(image)
        draw.text((MARGIN, MARGIN - 4), self.title, INK, fonts[TITLE_SIZE])
        for row, y in zip(self.rows, tops, strict=True):
            draw.text((MARGIN, y + cell_h // 2), row.label, INK, fonts[LABEL_SIZE], anchor="lm")
            for k, picture in enumerate(row.pictures):
                image.paste(Image.fromarray(picture), (left + k * (cell_w + GAP), y))
            for k, caption in enumerate(row.captions):
                place = (left + k * (cell_w + GAP) + cell_w // 2, y + cell_h + 2)
                draw.text(place, _fitted(caption, cell_w, fonts[CAPTION_SIZE]), GREY, fonts[CAPTION_SIZE], anchor="ma")
        return image

    def save(self, path: Path) -> None:
        """Write a PNG; same sheet, same bytes."""
        save_png(self.image(), path)


def save_png(image: Image.Image, path: Path) -> None:
    """Write a PNG atomically.

    Raises
    ------
    OutputFileError
        If it cannot be written.
    """
    with atomic_output(path) as temporary:
        image.save(temporary, format="PNG", compress_level=6)


def _fitted(text: str, width: int, font: ImageFont.FreeTypeFont | ImageFont.ImageFont) -> str:
    if font.getlength(text) <= width:
        return text
    while text and font.getlength(text + "...") > width:
        text = text[:-1]
    return text + "..."


@dataclass(frozen=True)
class PosePick:
    """A pose to show: caption, and what `Player.pose` takes."""

    caption: str
    faps: Mapping[int, float] = field(default_factory=dict)
    viseme: tuple[int, int, int] | None = None
    expression: tuple[int, int, int, int] | None = None

    def tables(self) -> set[tuple[int, int]]:
        """(fap_id, select) of every table that this pose needs."""
        keys = {(number, 1) for number in self.faps}
        if self.viseme is not None:
            keys.add((VISEME_FAP, self.viseme[0]))
        if self.expression is not None:
            keys.add((EXPRESSION_FAP, self.expression[0]))
        return keys


SHOWN_VISEMES = (1, 2, 6, 10, 11, 14)
FAP_POSES: tuple[PosePick, ...] = (
    PosePick("open_jaw", {3: 900}),
    PosePick("blink", {19: 1024, 20: 1024}),
    PosePick("wink left", {19: 1024}),
    PosePick("eyes to the left", {23: 40000, 24: 40000}),
    PosePick("eyes up", {25: -25000, 26: -25000}),
    PosePick("brows raised", {31: 120, 32: 120, 33: 140, 34: 140, 35: 100, 36: 100}),
    PosePick("brows squeezed", {31: -100, 32: -100, 33: -60, 34: -60, 37: 120, 38: 120}),
    PosePick("smile", {6: 180, 7: 180, 12: 400, 13: 400}),
    PosePick("lips pushed", {16: 300, 17: 300, 53: -120, 54: -120}),
    PosePick("cheeks puffed", {39: 200, 40: 200}),
    PosePick("jaw to the left", {15: 150}),
    PosePick("nose wrinkled", {61: 120, 62: 120, 63: 100}),
    PosePick("tongue out", {3: 700, 46: 500}),
    PosePick("head turned", {48: 12000, 49: 30000}),
)
"""FAP combinations that show each part of the face once, at amounts of everyday motion (FAP units)."""
DEFAULT_COUNT = 24


def default_poses(*faces: AnimatableFace, count: int = DEFAULT_COUNT) -> list[PosePick]:
    """Choose poses that all these faces have tables for: neutral, expressions, visemes, FAPs.

    Parameters
    ----------
    count : at most so many; the last ones are left out.
    """
    picks = [PosePick("neutral")]
    picks += [PosePick(e.name, expression=(e.id, BLEND_MAX, 0, 0)) for e in EXPRESSIONS]
    named = {v.id: v.name for v in VISEMES}
    picks += [PosePick(f"viseme {named[i]}", viseme=(i, 0, BLEND_MAX)) for i in SHOWN_VISEMES]
    picks += FAP_POSES
    held = [{table.key for table in face.tables} for face in faces]
    return [p for p in picks if all(p.tables() <= keys for keys in held)][:count]


def contact_sheet(
    source: AnimatableFace | Player,
    target: AnimatableFace | Player,
    poses: Sequence[PosePick] | None = None,
    *,
    title: str = "",
    labels: tuple[str, str] = ("source", "clone"),
    cell: int = 180,
    columns: int = 8,
    yaw: float = 0.0,
    renderer: Renderer | None = None,
) -> Image.Image:
    """Draw a source face above its clone, pose by pose, in bands.

    Parameters
    ----------
    poses : None takes `default_poses` of both.
    cell : width of one picture, pixels; its height is 1.2 times as much.
    columns : poses in one band.
    yaw : degrees by which the camera walks to the subject's left.

    Returns
    -------
    A Pillow image; with the defaults about 1,580 pixels wide.
    """
    players = [p if isinstance(p, Player) else Player(p) for p in (source, target)]
    picks = list(poses) if poses is not None else default_poses(*(p.face for p in players))
    renderer = renderer or make_renderer()
    drawn = [_draw_poses(player, picks, cell, yaw, renderer) for player in players]
    sheet = Sheet(title)
    for start in range(0, len(picks), columns):
        band = slice(start, start + columns)
        sheet.add_row(labels[0], drawn[0][band], space_before=2 * GAP)
        sheet.add_row(labels[1], drawn[1][band], [p.caption for p in picks[band]], space_before=0)
    return sheet.image()


def face_sheet(
    face: AnimatableFace | Player,
    poses: Sequence[PosePick] | None = None,
    *,
    title: str = "",
    cell: int = 180,
    columns: int = 8,
    yaw: float = 0.0,
    renderer: Renderer | None = None,
) -> Image.Image:
    """Draw one face in many poses; the parameters are those of `contact_sheet`."""
    player = face if isinstance(face, Player) else Player(face)
    picks = list(poses) if poses is not None else default_poses(player.face)
    drawn = _draw_poses(player, picks, cell, yaw, renderer or make_renderer())
    sheet = Sheet(title)
    for start in range(0, len(picks), columns):
        band = slice(start, start + columns)
        sheet.add_row("", drawn[band], [p.caption for p in picks[band]], space_before=2 * GAP)
    return sheet.image()


def _draw_poses(player: Player, picks: Sequence[PosePick], cell: int, yaw: float, renderer: Renderer) -> list[UInt8]:
    figure = Figure.of_face(player.face)
    camera = figure.camera.turned(yaw)
    out = []
    for pick in picks:
        pose = player.pose(pick.faps, pick.viseme, pick.expression)
        out.append(figure.draw(pose.world_shapes(), (cell, round(TALL * cell)), camera, renderer))
    return out
