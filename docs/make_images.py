"""Draw the pictures of the documentation: ``python docs/make_images.py [hero|faps]...``, everything by default."""

from __future__ import annotations

import sys
from pathlib import Path

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


def main(*wanted: str) -> None:
    """Draw these pictures; all without names."""
    FOLDER.mkdir(exist_ok=True)
    pictures = {"hero": hero, "faps": faps}
    for name in wanted or pictures:
        pictures[name]()


if __name__ == "__main__":
    main(*sys.argv[1:])
