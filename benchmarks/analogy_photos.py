"""Style sheets of expression analogy on photographs, as in figures 12, 14 and 15 of the paper.

Photographs of people are not part of this repository: the caller gives a folder. Without pairs named on the command
line, those of `PAIRS` are drawn as far as the folder holds them.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from benchmarks.image_errors import errors, face_region
from cloning.image import METHODS, Analogy, Picture, Places
from cloning.image.color import UInt8, luminance
from cloning.image.points import RIGID, fit_similarity_2d, to_array
from cloning.image.sampler import Sampler
from studio.photos import known_points, read_photo, with_points
from studio.sheet import Sheet

Pair = tuple[str, str, str]
"""File names: neutral source, source with an expression, neutral target."""

PAIRS: tuple[Pair, ...] = (
    *(("obama3.jpg", "obama.jpg", t) for t in ("biden.jpg", "orl_s33_1.pgm", "orl_s11_1.pgm")),
    *(("obama3.jpg", "obama2.jpg", t) for t in ("biden.jpg", "orl_s33_1.pgm", "orl_s11_1.pgm")),
    *(("orl_s33_1.pgm", "orl_s33_5.pgm", t) for t in ("orl_s11_1.pgm", "biden.jpg", "obama3.jpg")),
    *(("orl_s33_2.pgm", "orl_s33_7.pgm", t) for t in ("orl_s11_6.pgm", "biden.jpg", "obama3.jpg")),
    *(("orl_s11_1.pgm", "orl_s11_7.pgm", t) for t in ("orl_s33_1.pgm", "biden.jpg", "obama3.jpg")),
    *(("orl_s11_6.pgm", "orl_s11_8.pgm", t) for t in ("orl_s33_1.pgm", "biden.jpg", "obama3.jpg")),
)
"""Pictures of the tests of face_recognition 1.3.0 (source archive on the package index), and of subjects 11 and 33 of
the AT&T Laboratories Cambridge (ORL) database, named as in `PERSON_NUMBER.pgm`."""

CELL = (240, 290)
"""Size of a picture on the sheets, pixels."""
AROUND = 1.7
"""Height of what a picture shows, in heights of the face."""


def photo_sheets(folder: Path, pairs: Sequence[Pair], detector: str | None, sheets: Path | None) -> None:
    """Transfer each pair, tell what is found, and draw the sheets."""
    pairs = pairs or [pair for pair in PAIRS if all((folder / name).is_file() for name in pair)]
    names = sorted({name for pair in pairs for name in pair})
    paths = [folder / name for name in names]
    pixels = [read_photo(path) for path in paths]
    found = with_points(paths, pixels, known_points(paths, pixels, None, detector))
    pictures = dict(zip(names, found, strict=True))
    sheet = Sheet("Source, its expression, target, VTC, VTC as published, ERI")
    for pair in pairs:
        source, expression, target = (pictures[name] for name in pair)
        made = [
            Analogy(source, target, [expression.points], method, as_published=raw).apply(expression)
            for method, raw in (("vtc", False), ("vtc", True), ("eri", False))
        ]
        print(f"  {' -> '.join(pair)}: turned {made[0].turned:.3f}, relit {made[0].relit:.3f}", flush=True)
        shown = [(p.rgb, p.points) for p in (source, expression, target)] + [(m.rgb, target.points) for m in made]
        sheet.add_row("", [crop(rgb, points) for rgb, points in shown])
    own = Sheet("Onto itself: neutral, truth, VTC and its error, ERI and its error (x 4)")
    for one, other in dict.fromkeys((s, e) for s, e, _ in pairs):
        own.add_row("", _onto_itself(pictures[one], pictures[other], f"{one} -> {other}"))
    if sheets is not None:
        sheet.save(sheets / "analogy_photos.png")
        own.save(sheets / "analogy_photos_itself.png")


def _onto_itself(source: Picture, expression: Picture, name: str) -> list[UInt8]:
    """Figure 15: the truth is the expression's photograph, laid on the neutral one by points that hardly move."""
    truth = _laid(source, expression)
    shown = [crop(source.rgb, source.points), crop(truth, source.points)]
    for method in METHODS:
        made = Analogy(source, source, [expression.points], method).apply(expression)
        off = np.abs(luminance(made.rgb) - luminance(truth))
        print(f"  onto itself, {name}: {method}  {errors(made.rgb, truth, face_region(made))}", flush=True)
        error = np.repeat(np.clip(255.0 - 4.0 * off, 0, 255).astype(np.uint8)[..., None], 3, axis=2)
        shown += [crop(made.rgb, source.points), crop(error, source.points)]
    return shown


def _laid(source: Picture, expression: Picture) -> UInt8:
    still = [name for name in RIGID if name in source.points and name in expression.points]
    there = fit_similarity_2d(to_array(source.points, still), to_array(expression.points, still))
    rows, columns = np.indices(source.rgb.shape[:2]).reshape(2, -1)
    places = there.apply(np.stack([columns, rows], axis=1).astype(np.float64)).T
    planes = [Sampler(plane, 3, there.scale).at(places) for plane in np.moveaxis(expression.rgb, 2, 0)]
    laid: UInt8 = np.clip(np.rint(np.stack(planes, axis=1)), 0, 255).astype(np.uint8).reshape(source.rgb.shape)
    return laid


def crop(rgb: UInt8, points: Places) -> UInt8:
    """The face of a picture, in a picture of `CELL`."""
    at = np.array(list(points.values()))
    x, y = (at.min(axis=0) + at.max(axis=0)) / 2.0
    high = AROUND * float(np.ptp(at[:, 1]))
    wide = high * CELL[0] / CELL[1]
    part = (x - wide / 2.0, y - high / 2.0, x + wide / 2.0, y + high / 2.0)
    step = max(int(high / CELL[1]), 1)
    small = Image.fromarray(rgb).reduce(step)
    box = tuple(value / step for value in part)
    return np.asarray(small.transform(CELL, Image.Transform.EXTENT, box, Image.Resampling.BICUBIC))
