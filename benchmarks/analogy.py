"""Expression analogy in pictures: against rendered truth, onto itself, in other light, and how long it takes.

    python -m benchmarks.analogy [--parts truth,self,speed,large] [--sheets DIR]
    python -m benchmarks.analogy --photos FOLDER [--pair S,S_EXPR,T]... [--detector PYTHON] [--sheets DIR]

Pictures are rendered: the shipped source and clones of it on the other shipped heads. The truth of a target's
expression is the picture of its own clone in that expression, in its own light. Light is turned by turning what the
shading takes for normals. Points of photographs come from NAME.points.json beside them or from the detector. Errors are
of the luminance, within the pixels that the mask lets change. PSNR and SSIM are
those of 8-bit luminances, SSIM with its usual Gaussian window. Times are those of the processor.
"""

from __future__ import annotations

import argparse
import os
import resource
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from PIL import Image

from benchmarks.analogy_photos import photo_sheets
from benchmarks.image_errors import Errors, errors, face_region, mean_errors
from cloning import clone
from cloning.image import METHODS, Analogy, AnalogyResult, Method, Picture
from cloning.image.color import UInt8, to_yuv
from fat.evaluate import Player
from fat.face import AnimatableFace
from fba.arrays import Floats
from fba.high_level import BLEND_MAX
from formats import read_face, read_scene
from formats.landmarks import read_landmarks
from samples import sample
from studio.picture_detector import FBA_DETECTOR
from studio.render import Figure, make_renderer
from studio.render.protocol import depth_range, project
from studio.sheet import Sheet

SIZE = (311, 419)
"""The size of the paper's pictures."""
TARGETS = ("tri_head", "quad_head")
POSES = {"neutral": 0, "joy": 1, "sadness": 2, "anger": 3, "fear": 4, "disgust": 5, "surprise": 6}
EXPRESSIONS = tuple(pose for pose in POSES if pose != "neutral")
SHOWN = ("joy", "anger", "disgust", "surprise")
LEFT, WHOLE = "target left as it is", "vtc, whole picture"
Light = tuple[float, float]
"""How far a light is turned: degrees around the head, degrees up."""
LIGHTS: dict[str, tuple[Light, Light]] = {
    "same light": ((0.0, 0.0), (0.0, 0.0)),
    "light from the other side": ((70.0, 0.0), (0.0, 0.0)),
    "light from below": ((0.0, -60.0), (0.0, 0.0)),
    "expression relit": ((0.0, 0.0), (40.0, -20.0)),
}
"""The target's light, and that of the source's expression; the source's neutral picture has (0, 0)."""
ZOOM = 0.92
"""Height of the picture against that of the whole head: face and neck fill it."""


@dataclass(frozen=True, eq=False)
class Studio:
    """An animatable face in front of a camera.

    Attributes
    ----------
    light : degrees by which the light is turned, around and up.
    """

    face: AnimatableFace
    figure: Figure
    size: tuple[int, int] = SIZE
    light: Light = (0.0, 0.0)

    def shoot(self, pose: str) -> Picture:
        """Take a picture of an expression; its points are the face's own, projected."""
        number = POSES[pose]
        expression = (number, BLEND_MAX, 0, 0) if number else None
        world = Player(self.face).pose(expression=expression).world_shapes()
        camera = self.figure.camera
        camera = replace(camera, half_height=ZOOM * camera.half_height, half_width=ZOOM * camera.half_width)
        drawables = self.figure.drawables(world)
        turn = _turn(*self.light)
        lit = [d if d.normals is None else replace(d, normals=d.normals @ turn.T) for d in drawables]
        rgb = make_renderer("software").render(lit, camera, *self.size)
        positions = self.face.feature_points.positions(self.face.scene, world)
        width, height = self.size
        clip, _ = project(np.array(list(positions.values())), camera.clip_matrix(*self.size, *depth_range(lit, camera)))
        x, y = (clip[:, 0] + 1.0) * width / 2.0 - 0.5, (1.0 - clip[:, 1]) * height / 2.0 - 0.5
        return Picture(rgb, {key: (float(a), float(b)) for key, a, b in zip(positions, x, y, strict=True)})


def _turn(around: float, up: float) -> Floats:
    a, b = np.radians(around), np.radians(up)
    yaw = np.array([[np.cos(a), 0, -np.sin(a)], [0, 1, 0], [np.sin(a), 0, np.cos(a)]])
    pitch = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    return np.asarray(pitch @ yaw)


@cache
def studio(name: str) -> Studio:
    """The shipped source (``source``), or a clone of it on a shipped head."""
    face = read_face("default")
    if name != "source":
        path = sample(f"faces/{name}.obj")
        scene = read_scene(path)
        face = clone(face, scene, read_landmarks(path.with_suffix(".fps.json"), scene))
    return Studio(face, Figure.of_face(face))


def run(source: Picture, expression: Picture, target: Picture, method: Method, teeth: bool = True) -> AnalogyResult:
    """One expression from start to end."""
    return Analogy(source, target, [expression.points], method, teeth).apply(expression)


@dataclass(frozen=True, eq=False)
class Transfer:
    """One expression of the source on a target, by both methods.

    Attributes
    ----------
    expression, target, goal : what the source shows, the target at rest, and its own expression.
    made : by method.
    found : errors of luminance; keys are `LEFT`, `WHOLE` and the methods.
    """

    pose: str
    expression: UInt8
    target: UInt8
    goal: UInt8
    made: dict[Method, UInt8]
    found: dict[str, Errors]


def transferred(source: Picture, expression: Picture, target: Picture, goal: Picture, pose: str) -> Transfer:
    """Transfer one expression by both methods and compare with the truth."""
    results = {m: run(source, expression, target, m) for m in METHODS}
    where = face_region(results["vtc"])
    found = {LEFT: errors(target.rgb, goal.rgb, where)}
    found |= {m: errors(results[m].rgb, goal.rgb, where) for m in METHODS}
    found[WHOLE] = errors(results["vtc"].rgb, goal.rgb, np.ones_like(where))
    return Transfer(pose, expression.rgb, target.rgb, goal.rgb, {m: r.rgb for m, r in results.items()}, found)


def means(transfers: Sequence[Transfer]) -> dict[str, Errors]:
    """The mean of each measure over the expressions."""
    return {key: mean_errors([t.found[key] for t in transfers]) for key in transfers[0].found}


def truth(sheets: Path | None) -> None:
    """Figures 12 and 14: clones whose own expression is known, in several lights."""
    for name in TARGETS:
        for light in LIGHTS:
            transfers = onto_clone(name, light)
            print(f"{name}, {light}; mean over {len(transfers)} expressions")
            for label, found in means(transfers).items():
                print(f"  {label:22} {found}", flush=True)
            if sheets is not None:
                path = sheets / f"analogy_truth_{name}_{light.replace(' ', '_')}.png"
                truth_sheet(transfers, f"{name}, {light}: source, VTC, ERI, truth").save(path)


def onto_clone(name: str, light: str, poses: Sequence[str] = EXPRESSIONS) -> list[Transfer]:
    """Transfer expressions to one target in one light."""
    turn, relit = LIGHTS[light]
    own, lit = studio("source"), replace(studio(name), light=turn)
    neutral, target = own.shoot("neutral"), lit.shoot("neutral")
    shifted = replace(own, light=relit)
    return [transferred(neutral, shifted.shoot(pose), target, lit.shoot(pose), pose) for pose in poses]


def truth_sheet(transfers: Sequence[Transfer], title: str, shrink: int = 1) -> Sheet:
    """Some expressions: the source's, VTC, ERI, the truth."""
    sheet = Sheet(title)
    for t in transfers:
        if t.pose in SHOWN:
            pictures = (t.expression, t.made["vtc"], t.made["eri"], t.goal)
            sheet.add_row(t.pose, [reduced(rgb, shrink) for rgb in pictures])
    return sheet


def itself(sheets: Path | None) -> None:
    """Figure 15: the source's expression on the source's own neutral face gives back its expression."""
    transfers = onto_itself()
    for t in transfers:
        for m in METHODS:
            print(f"  {t.pose:10} {m}  {t.found[m]}", flush=True)
    if sheets is not None:
        itself_sheet(transfers).save(sheets / "analogy_itself.png")


def onto_itself() -> list[Transfer]:
    """Map all expressions onto the source itself."""
    own = studio("source")
    neutral = own.shoot("neutral")
    goals = {pose: own.shoot(pose) for pose in EXPRESSIONS}
    return [transferred(neutral, goal, neutral, goal, pose) for pose, goal in goals.items()]


def itself_sheet(transfers: Sequence[Transfer], shrink: int = 1) -> Sheet:
    """Some expressions mapped onto the source itself, and the errors."""
    sheet = Sheet("Onto itself: truth, VTC and its error, ERI and its error (x 8)")
    for t in transfers:
        if t.pose not in SHOWN:
            continue
        pictures = [t.goal]
        for made in t.made.values():
            off = np.abs(to_yuv(made)[0] - to_yuv(t.goal)[0])
            error = np.repeat(np.clip(255.0 - 8.0 * off, 0, 255).astype(np.uint8)[..., None], 3, axis=2)
            pictures += [made, error]
        sheet.add_row(t.pose, [reduced(rgb, shrink) for rgb in pictures])
    return sheet


@dataclass(frozen=True)
class Seconds:
    """Time of the processor: set-up with the first expression, and each further one (median)."""

    unknowns: int
    first: float
    further: float


def speed(sheets: Path | None) -> None:
    """311 x 419: set-up, and each further expression."""
    del sheets
    for m, taken in seconds().items():
        print(
            f"  {m}: {SIZE[0]} x {SIZE[1]}, {taken.unknowns} pixels in the mask; set-up and first expression "
            f"{taken.first:.2f} s cpu, each further one {taken.further:.3f} s cpu"
        )


def seconds() -> dict[Method, Seconds]:
    """How long both methods take, in turns."""
    own, other = studio("source"), replace(studio("tri_head"), light=LIGHTS["light from the other side"][0])
    pictures = {pose: own.shoot(pose) for pose in POSES}
    neutral = other.shoot("neutral")
    expressions = [p for k, p in pictures.items() if k != "neutral"]
    prepared: dict[Method, Analogy] = {}
    first: dict[Method, float] = {}
    laps: dict[Method, list[float]] = {m: [] for m in METHODS}
    for m in METHODS:
        start = time.process_time()
        prepared[m] = Analogy(pictures["neutral"], neutral, [p.points for p in expressions], m)
        prepared[m].apply(expressions[0])
        first[m] = time.process_time() - start
    for expression in 3 * expressions:
        for m in METHODS:
            start = time.process_time()
            prepared[m].apply(expression)
            laps[m].append(time.process_time() - start)
    return {m: Seconds(prepared[m].unknowns, first[m], float(np.median(laps[m]))) for m in METHODS}


def large(sheets: Path | None) -> None:
    """A 1080p pair: the face fills the height of the picture."""
    del sheets
    size = (1920, 1080)
    own, other = (replace(studio(n), size=size) for n in ("source", "tri_head"))
    source, expression, target = own.shoot("neutral"), own.shoot("disgust"), other.shoot("neutral")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    start, cpu = time.perf_counter(), time.process_time()
    made = Analogy(source, target, [expression.points])
    result = made.apply(expression)
    wall, busy = time.perf_counter() - start, time.process_time() - cpu
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(
        f"  1920 x 1080, {made.unknowns} pixels in the mask, {result.steps} steps: {wall:.1f} s ({busy:.1f} cpu), "
        f"peak {peak:.0f} MB of the process ({before:.0f} MB before)"
    )


def reduced(rgb: UInt8, shrink: int) -> UInt8:
    """A picture, smaller by a whole number."""
    return np.asarray(Image.fromarray(rgb).reduce(shrink))


PARTS = {"large": large, "truth": truth, "self": itself, "speed": speed}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--parts", default=",".join(PARTS))
    parser.add_argument("--photos", type=Path, help="folder of photographs: draw these instead")
    parser.add_argument("--pair", action="append", default=[], help="S,S_EXPR,T: file names in that folder")
    parser.add_argument("--detector", default=os.environ.get(FBA_DETECTOR), help="python with mediapipe")
    parser.add_argument("--sheets", type=Path, help="folder for the pictures")
    options = parser.parse_args()
    if options.sheets is not None:
        options.sheets.mkdir(parents=True, exist_ok=True)
    if options.photos is not None:
        pairs = [tuple(pair.split(",")) for pair in options.pair]
        if any(len(pair) != 3 for pair in pairs):
            parser.error("--pair takes three file names: S,S_EXPR,T")
        photo_sheets(options.photos, pairs, options.detector, options.sheets)
        return
    for name in options.parts.split(","):
        print(name)
        PARTS[name](options.sheets)


if __name__ == "__main__":
    main()
