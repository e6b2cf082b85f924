"""Expression analogy in pictures: against rendered truth, onto itself, in other light, and how long it takes.

    python -m benchmarks.analogy [--parts truth,self,speed,large] [--out DIR]

Pictures are rendered: the shipped source and clones of it on the other shipped heads. The truth of a target's
expression is the picture of its own clone in that expression, in its own light. Light is turned by turning what the
shading takes for normals. Errors are of the luminance, within the pixels that the mask lets change. PSNR and SSIM are
those of 8-bit luminances, SSIM with its usual Gaussian window. Times are wall seconds of this process.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from scipy import ndimage

from cloning import clone
from cloning.image import METHODS, Analogy, AnalogyResult, Method, Picture, Places
from cloning.image.color import UInt8, to_yuv
from cloning.image.mask import face_mask
from fat.evaluate import Player
from fat.face import AnimatableFace
from fba.arrays import Floats
from fba.high_level import BLEND_MAX
from formats import read_face, read_scene
from formats.landmarks import read_landmarks
from samples import sample
from studio.render import Figure, make_renderer
from studio.render.protocol import depth_range, project
from studio.sheet import Sheet

SIZE = (311, 419)
"""The size of the paper's pictures."""
TARGETS = ("tri_head", "quad_head")
POSES = {"neutral": 0, "joy": 1, "sadness": 2, "anger": 3, "fear": 4, "disgust": 5, "surprise": 6}
SHOWN = ("joy", "anger", "disgust", "surprise")
LIGHTS = {"same light": (0.0, 0.0), "light from the other side": (70.0, 0.0), "light from below": (0.0, -60.0)}
"""How far the target's light is turned: degrees around the head, degrees up."""
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
    light: tuple[float, float] = (0.0, 0.0)

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


@dataclass(frozen=True)
class Errors:
    """Errors of a picture's luminance within some pixels.

    Attributes
    ----------
    mean : mean absolute error, levels.
    psnr : dB.
    ssim : mean structural similarity.
    """

    mean: float
    psnr: float
    ssim: float

    def __str__(self) -> str:
        return f"mean {self.mean:5.2f}  PSNR {self.psnr:5.2f} dB  SSIM {self.ssim:.4f}"


def errors(found: UInt8, truth: UInt8, where: Floats) -> Errors:
    """Compare two pictures where a mask is not zero."""
    a, b = to_yuv(found)[0], to_yuv(truth)[0]
    at = where > 0
    square = float(((a - b)[at] ** 2).mean())
    psnr = 10.0 * np.log10(255.0**2 / square) if square > 0 else np.inf
    return Errors(float(np.abs(a - b)[at].mean()), float(psnr), float(structural_similarity(a, b)[at].mean()))


def structural_similarity(a: Floats, b: Floats) -> Floats:
    """The SSIM map of two luminances (Wang et al. 2004): Gaussian window of 1.5 pixels, K1 = 0.01, K2 = 0.03."""

    def smooth(plane: Floats) -> Floats:
        return np.asarray(ndimage.gaussian_filter(plane, 1.5, truncate=3.5))

    ma, mb = smooth(a), smooth(b)
    va, vb, cov = smooth(a * a) - ma * ma, smooth(b * b) - mb * mb, smooth(a * b) - ma * mb
    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    return (2 * ma * mb + c1) * (2 * cov + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2))


def face_region(points: Places, result: AnalogyResult, shape: tuple[int, ...]) -> Floats:
    """The mask of the target's face with its expression."""
    moved = {n: p for n, p in result.points.items() if ":" not in n} or dict(points)
    return face_mask(moved, (slice(0, shape[0]), slice(0, shape[1])))


def run(source: Picture, expression: Picture, target: Picture, method: Method, teeth: bool = True) -> AnalogyResult:
    """One expression from start to end."""
    return Analogy(source, target, [expression.points], method, teeth).apply(expression)


def truth(out: Path | None) -> None:
    """Figures 12 and 14: clones whose own expression is known, in three lights."""
    own = studio("source")
    poses = [p for p in POSES if p != "neutral"]
    pictures = {pose: own.shoot(pose) for pose in POSES}
    for name in TARGETS:
        for light, turn in LIGHTS.items():
            lit = replace(studio(name), light=turn)
            neutral = lit.shoot("neutral")
            rows: dict[str, list[Errors]] = {"target left as it is": [], "vtc": [], "eri": []}
            sheet = Sheet(f"{name}, {light}: source, VTC, ERI, truth")
            for pose in poses:
                goal = lit.shoot(pose)
                made = {m: run(pictures["neutral"], pictures[pose], neutral, m) for m in METHODS}
                where = face_region(neutral.points, made["vtc"], goal.rgb.shape)
                rows["target left as it is"].append(errors(neutral.rgb, goal.rgb, where))
                for m in METHODS:
                    rows[m].append(errors(made[m].rgb, goal.rgb, where))
                if pose in SHOWN:
                    sheet.add_row(pose, [pictures[pose].rgb, made["vtc"].rgb, made["eri"].rgb, goal.rgb])
            print(f"{name}, {light}; mean over {len(poses)} expressions")
            for label, found in rows.items():
                print(f"  {label:22} {_mean(found)}", flush=True)
            if out is not None:
                sheet.save(out / f"analogy_truth_{name}_{light.replace(' ', '_')}.png")


def itself(out: Path | None) -> None:
    """Figure 15: the source's expression on the source's own neutral face gives back its expression."""
    own = studio("source")
    neutral = own.shoot("neutral")
    sheet = Sheet("Onto itself: truth, VTC and its error, ERI and its error (x 8)")
    for pose in [p for p in POSES if p != "neutral"]:
        goal = own.shoot(pose)
        pictures = [goal.rgb]
        for m in METHODS:
            made = run(neutral, goal, neutral, m)
            found = errors(made.rgb, goal.rgb, face_region(neutral.points, made, goal.rgb.shape))
            print(f"  {pose:10} {m}  {found}", flush=True)
            off = np.abs(to_yuv(made.rgb)[0] - to_yuv(goal.rgb)[0])
            error = np.repeat(np.clip(255.0 - 8.0 * off, 0, 255).astype(np.uint8)[..., None], 3, axis=2)
            pictures += [made.rgb, error]
        if pose in SHOWN:
            sheet.add_row(pose, pictures)
    if out is not None:
        sheet.save(out / "analogy_itself.png")


def speed(out: Path | None) -> None:
    """311 x 419: set-up, and each further expression."""
    del out
    own, other = studio("source"), replace(studio("tri_head"), light=LIGHTS["light from the other side"])
    pictures = {pose: own.shoot(pose) for pose in POSES}
    neutral = other.shoot("neutral")
    expressions = [p for k, p in pictures.items() if k != "neutral"]
    for m in METHODS:
        start, cpu = time.perf_counter(), time.process_time()
        made = Analogy(pictures["neutral"], neutral, [p.points for p in expressions], m)
        made.apply(expressions[0])
        first, first_cpu = time.perf_counter() - start, time.process_time() - cpu
        laps = []
        for _ in range(3):
            for expression in expressions:
                start, cpu = time.perf_counter(), time.process_time()
                made.apply(expression)
                laps.append((time.perf_counter() - start, time.process_time() - cpu))
        wall, busy = np.median(laps, axis=0)
        print(
            f"  {m}: {SIZE[0]} x {SIZE[1]}, {made.unknowns} pixels in the mask; set-up with the first expression "
            f"{first:.2f} s ({first_cpu:.2f} cpu), each further one {wall:.3f} s ({busy:.3f} cpu)"
        )


def large(out: Path | None) -> None:
    """A 1080p pair: the face fills the height of the picture."""
    del out
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


def _mean(found: Sequence[Errors]) -> Errors:
    return Errors(*(float(np.mean([getattr(e, k) for e in found])) for k in ("mean", "psnr", "ssim")))


PARTS = {"large": large, "truth": truth, "self": itself, "speed": speed}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--parts", default=",".join(PARTS))
    parser.add_argument("--out", type=Path, help="folder for the pictures")
    options = parser.parse_args()
    if options.out is not None:
        options.out.mkdir(parents=True, exist_ok=True)
    for name in options.parts.split(","):
        print(name)
        PARTS[name](options.out)


if __name__ == "__main__":
    main()
