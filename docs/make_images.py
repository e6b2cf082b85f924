"""Draw the pictures of the documentation: ``python docs/make_images.py [NAME]...``, everything by default."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path

from benchmarks.analogy import SHOWN, itself_sheet, onto_clone, onto_itself, truth_sheet
from cloning import clone
from fat.evaluate import Player
from fba.high_level import BLEND_MAX
from formats import read_face, read_scene
from formats.landmarks import read_landmarks
from samples import sample
from studio.fap_sheet import fap_sheets
from studio.render import Figure, make_renderer
from studio.sheet import PosePick, Sheet, save_png

FOLDER = Path(__file__).resolve().parent / "images"
HEADS = (("tri_head", "triangles"), ("quad_head", "quads"), ("closed_head", "one closed skin"))
POSES = (
    PosePick("neutral"),
    PosePick("joy", expression=(1, BLEND_MAX, 0, 0)),
    PosePick("anger", expression=(3, BLEND_MAX, 0, 0)),
    PosePick("surprise", expression=(6, BLEND_MAX, 0, 0)),
    PosePick("viseme aa", viseme=(10, 0, BLEND_MAX)),
    PosePick("viseme ou", viseme=(14, 0, BLEND_MAX)),
    PosePick("eyes and head", faps={23: 30000, 24: 30000, 49: 25000, 50: -8000}),
    PosePick("wink", faps={19: 620, 21: 400, 12: 300, 59: 300}),
)


@dataclass(frozen=True)
class Combination:
    """FAPs that fight, and the feature points in the middle of their picture."""

    name: str
    faps: dict[int, float]
    around: tuple[str, ...]
    zoom: float = 0.3


LIPS = (4, 5, 8, 9, 10, 11, 51, 52, 55, 56, 57, 58)
CORNERS = (6, 7, 53, 54)
MOUTH = ("8.1", "8.2")
COMBINATIONS = (
    Combination("smile, both corner pairs", dict.fromkeys(CORNERS, 200) | dict.fromkeys((12, 13, 59, 60), 300), MOUTH),
    Combination("lips pressed, 300 each", dict.fromkeys(LIPS, 300), MOUTH),
    Combination("both lids closed", {19: 1024, 20: 1024, 21: 500, 22: 500}, ("3.5", "3.6")),
    Combination("brows raised and squeezed", dict.fromkeys(range(31, 39), 300), ("4.1", "4.2")),
    Combination(
        "open_jaw 800, corners 150, lips -400",
        {3: 800} | dict.fromkeys(CORNERS, 150) | dict.fromkeys(LIPS, -400) | dict.fromkeys(range(31, 37), 300),
        MOUTH,
    ),
)


def hero() -> None:
    """Source above three clones."""
    source = read_face("default")
    faces = [("source", source)]
    for name, label in HEADS:
        path = sample(f"faces/{name}.obj")
        scene = read_scene(path)
        faces.append((label, clone(source, scene, read_landmarks(path.with_suffix(".fps.json"), scene))))
    renderer = make_renderer("software")
    sheet = Sheet()
    for index, (label, face) in enumerate(faces):
        player, figure = Player(face), Figure.of_face(face)
        pictures = [
            figure.draw(player.pose(p.faps, p.viseme, p.expression).world_shapes(), (170, 200), renderer=renderer)
            for p in POSES
        ]
        captions = [p.caption for p in POSES] if index == len(faces) - 1 else ()
        sheet.add_row(label, pictures, captions)
    sheet.save(FOLDER / "hero.png")


def faps() -> None:
    """The reference sheet of the shipped source, one picture for each region: docs/faps.md."""
    for sheet in fap_sheets(read_face("default"), make_renderer("software")):
        save_png(sheet.image, FOLDER / f"faps_{sheet.name}.png")


def combining() -> None:
    """FAPs that fight, by the plain sum and by the rules: docs/combining.md."""
    face = read_face("default")
    figure, renderer = Figure.of_face(face), make_renderer("software")
    places = face.feature_points.positions(face.scene)
    sheet = Sheet()
    for index, combination in enumerate(COMBINATIONS):
        middle = sum(places[key] for key in combination.around) / len(combination.around)
        near = replace(
            figure.camera,
            target=tuple(float(c) for c in middle),
            half_height=combination.zoom * figure.camera.half_height,
            half_width=combination.zoom * figure.camera.half_width,
        )
        pictures = []
        for rules in ((), None):
            world = Player(face, rules=rules).pose(combination.faps).world_shapes()
            pictures += [figure.draw(world, (260, 220), near.turned(yaw), renderer) for yaw in (0.0, 40.0)]
        captions = ("plain sum", "", "by the rules", "") if index == len(COMBINATIONS) - 1 else ()
        sheet.add_row(combination.name, pictures, captions)
    sheet.save(FOLDER / "combining.png")


def analogy() -> None:
    """Expressions on pictures of other heads and on the source itself: docs/analogy.md."""
    name, light = "quad_head", "light from the other side"
    title = f"{name}, {light}: source, VTC, ERI, truth"
    truth_sheet(onto_clone(name, light, SHOWN), title, shrink=2).save(FOLDER / "analogy_truth.png")
    itself_sheet(onto_itself(), shrink=2).save(FOLDER / "analogy_itself.png")


def main(*wanted: str) -> None:
    """Draw these pictures; all without names."""
    FOLDER.mkdir(exist_ok=True)
    pictures = {"hero": hero, "faps": faps, "combining": combining, "analogy": analogy}
    for name in wanted or pictures:
        pictures[name]()


if __name__ == "__main__":
    main(*sys.argv[1:])
