"""Xiang, Chen and Yang (2008), automatic facial expression transferring: figures 4 to 7 and table 1."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from time import process_time

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from benchmarks.landmarks import Known, errors, faces
from benchmarks.papers.cast import Cast
from benchmarks.papers.pictures import save
from cloning import clone
from cloning.detect import detect_points
from cloning.detect.xiang import LANDMARKS
from cloning.mapping import map_skin
from fat.evaluate import Player
from fat.face import AnimatableFace
from fba.feature_points import FeaturePoint, FeaturePoints
from fba.high_level import BLEND_MAX, EXPRESSIONS
from fba.orientation import orient
from fba.scene import FaceScene
from studio.chessboard import chessboard
from studio.inputs import scene_of
from studio.landmark_sheet import marked
from studio.render import Figure, make_renderer
from studio.render.figure import Style
from studio.sheet import INK, PAPER, PosePick, Sheet, UInt8

KNOWN = ("tri_head", "quad_head", "closed_head", "phenotype_a", "phenotype_b", "generic_neutral_mesh")
"""Faces whose landmarks are known."""
DRAWN = ("tri_head", "quad_head", "closed_head")
PLACES = {
    ("2.1",): "chin",
    ("2.4", "2.5"): "lips",
    ("2.10",): "chin",
    ("3.7", "3.8", "3.11", "3.12"): "corners of the eyes",
    ("4.1", "4.2", "4.5", "4.6"): "brows",
    ("5.3", "5.4"): "cheeks",
    ("8.1", "8.2"): "lips",
    ("9.1", "9.2", "9.3", "9.15"): "nose",
}
"""Where the landmarks lie, as they follow each other."""
BAR = 0.08
"""The paper's "most below 8 %" of an eye width."""
CELL = 150
PANEL = (360, 432)
ONCE, AGAIN = (150, 165, 205), (55, 125, 70)


@dataclass(frozen=True)
class Found:
    """The landmarks of one face: as they are detected, and how far off, in eye widths."""

    known: Known
    points: FeaturePoints
    once: Mapping[str, float]
    again: Mapping[str, float]


def reproduce(cast: Cast, images: Path, tell: Callable[[str], None]) -> dict[str, str]:
    """Draw the figures into a folder; the tables, by the name of their place in the page."""
    tell("figures 4 and 5")
    found = [_detect(cast, known) for known in faces(cast.folder, KNOWN) if known.truth is not None]
    save(landmarks(cast, found), images / "xiang_4_landmarks.png")
    save(bars(found), images / "xiang_5_errors.png")
    tables = {"xiang-5": errors_table(found)}
    tell("figure 6")
    save(correspondence(cast), images / "xiang_6_chessboard.png")
    tell("figure 7 and table 1")
    sheet, tables["xiang-1"] = expressions(cast)
    save(sheet, images / "xiang_7_expressions.png")
    return tables


def _detect(cast: Cast, known: Known) -> Found:
    assert known.truth is not None
    ways = [detect_points(known.scene, cast.source, None, detector=way).points for way in ("xiang-once", "xiang")]
    once, again = (errors(known.scene, points, known.truth, ()) for points in ways)
    points = FeaturePoints({key: ways[1][key] for key in LANDMARKS if key in ways[1]})
    return Found(known, points, *({key: off[key] for key in LANDMARKS if key in off} for off in (once, again)))


def landmarks(cast: Cast, found: list[Found]) -> Image.Image:
    """The source with its landmarks, and faces with detected (green) and true (red) ones."""
    face = cast.grid_face
    pictures, names = [_dots(face.scene, face.feature_points, {})], [cast.source_name]
    for one in found:
        if one.known.name in DRAWN and one.known.truth is not None:
            upright, true, _ = orient(one.known.scene, one.known.truth)
            pictures.append(_dots(upright, true, one.points))
            names.append(one.known.name)
    sheet = Sheet()
    sheet.add_row("", pictures, names)
    return sheet.image()


def _dots(scene: FaceScene, true: FeaturePoints, detected: Mapping[str, FeaturePoint]) -> UInt8:
    """An upright face with its true landmarks in red, detected ones in green above them."""
    figure = Figure(scene, true, Style(features=False))
    picture = figure.draw(size=PANEL, renderer=make_renderer("software"))
    for confidence, points in ((0.0, true), (1.0, detected)):
        shown = [key for key in LANDMARKS if key in points]
        colored = {key: replace(points[key], source="detected", confidence=confidence) for key in shown}
        placed = FeaturePoints(colored)
        picture = marked(picture, placed, placed.positions(scene), shown, figure.camera, figure, numbers=False)
    return picture


def bars(found: list[Found]) -> Image.Image:
    """Mean error of each landmark over the faces, detected once and again after the source was deformed."""
    width, height, left, low = 900, 360, 60, 300
    image = Image.new("RGB", (width, height), PAPER)
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(12)
    means = {key: [np.mean([way[key] for way in ways if key in way]) for ways in _ways(found)] for key in LANDMARKS}
    top = max(0.2, max(max(pair) for pair in means.values()))
    scale = (low - 30) / top
    for level in np.arange(0.0, top + 1e-9, 0.04):
        y = low - level * scale
        draw.line((left, y, width - 20, y), fill=(170, 60, 50) if abs(level - BAR) < 1e-9 else (225, 225, 228))
        draw.text((left - 8, y), f"{100 * level:.0f} %", INK, font, anchor="rm")
    step = (width - 20 - left) / len(LANDMARKS)
    for k, key in enumerate(LANDMARKS):
        for j, (value, color) in enumerate(zip(means[key], (ONCE, AGAIN), strict=True)):
            x = left + (k + 0.15 + 0.35 * j) * step
            draw.rectangle((x, low - value * scale, x + 0.33 * step, low), fill=color)
        draw.text((left + (k + 0.5) * step, low + 6), key, INK, font, anchor="ma")
    for places, text in PLACES.items():
        middle = left + step * (float(np.mean([LANDMARKS.index(key) for key in places])) + 0.5)
        draw.text((middle, low + 24), text, INK, font, anchor="ma")
    draw.text((left, 16), f"error / eye width, mean of {len(found)} faces:", INK, font, anchor="lm")
    for x, text, color in ((300, "detected once", ONCE), (420, "deformed, detected again", AGAIN)):
        draw.rectangle((x, 10, x + 12, 22), fill=color)
        draw.text((x + 18, 16), text, INK, font, anchor="lm")
    return image


def _ways(found: list[Found]) -> tuple[list[Mapping[str, float]], list[Mapping[str, float]]]:
    return [one.once for one in found], [one.again for one in found]


def errors_table(found: list[Found]) -> str:
    """One line for each face."""
    lines = ["| face | once | nearer than 8 % | deformed, again | nearer than 8 % |", "|---|---|---|---|---|"]
    for one in found:
        cells = []
        for off in (one.once, one.again):
            values = np.array(list(off.values()))
            cells += [f"{values.mean():.3f} / {values.max():.2f}", f"{int((values < BAR).sum())} of {len(values)}"]
        lines.append(f"| {one.known.name} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def correspondence(cast: Cast) -> Image.Image:
    """A chessboard on the source, carried to a target; both at rest and in an expression."""
    source = cast.grid_face
    model = cast.grid[1]
    target = clone(source, model.neutral, model.points, backend="dt", faps=(2,))
    smile = [Player(face).pose(expression=(1, BLEND_MAX, 0, 0)).world_shapes() for face in (source, target)]
    return chessboard(*map_skin(source, target, backend="dt"), PANEL, [("joy", smile[0], smile[1])])


def expressions(cast: Cast) -> tuple[Image.Image, str]:
    """Six expressions on the source and on the other faces by deformation transfer; sizes and times."""
    source = cast.grid_face
    picks = [PosePick(e.name, expression=(e.id, BLEND_MAX, 0, 0)) for e in EXPRESSIONS]
    lines = ["| model | vertices | triangles | whole clone, s |", "|---|---|---|---|"]
    sheet = Sheet()
    for model in cast.grid:
        start = process_time()
        itself = model.path == "default"
        face = source if itself else clone(source, model.neutral, model.points, backend="dt")
        seconds = "-" if itself else f"{process_time() - start:.1f}"
        meshes = [shape.mesh for shape in scene_of(model.neutral).shapes]
        sizes = sum(m.vertex_count for m in meshes), sum(len(m.triangles) for m in meshes)
        lines.append(f"| {model.name} | {sizes[0]:,} | {sizes[1]:,} | {seconds} |")
        sheet.add_row(model.name, *_row(face, picks, model is cast.grid[-1]))
    return sheet.image(), "\n".join(lines) + "\n"


def _row(face: AnimatableFace, picks: list[PosePick], last: bool) -> tuple[list[UInt8], list[str]]:
    figure, player, renderer = Figure.of_face(face), Player(face), make_renderer("software")
    worlds = [player.pose(p.faps, p.viseme, p.expression).world_shapes() for p in picks]
    pictures = [figure.draw(world, (CELL, round(1.2 * CELL)), renderer=renderer) for world in worlds]
    return pictures, [p.caption for p in picks] if last else []
