"""A template of points to adjust by hand, and a picture of points to look at."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from cloning.image.align import fit_similarity_2d
from cloning.image.color import UInt8
from cloning.image.points import NOT_FACE, Places
from fba.arrays import Floats
from formats import read_face

EYE_LINE, SEPARATION = 0.42, 0.22
"""Where a template without any hint goes, in heights of the picture: the eye line of a portrait, and how far its eyes
are apart."""

DOT, LABEL = (255, 60, 40), (20, 60, 220)


def template_points(size: tuple[int, int], known: Places) -> dict[str, tuple[float, float]]:
    """The points of the shipped source's face from the front, laid on those already known, which stay as they are.

    Parameters
    ----------
    size : (width, height) of the picture.
    known : two or more points fix place, size and turn of the others; with fewer the face is taken to be in the
        middle.
    """
    face = read_face("default")
    skip = tuple(n for n in NOT_FACE if n not in ("3.5", "3.6"))
    places = {
        key: np.array([p[0], -p[1]])
        for key, p in face.feature_points.positions(face.scene).items()
        if not any(key == n or (n[-1] == "." and key.startswith(n)) for n in skip)
    }
    width, height = size
    shared = [name for name in known if name in places]
    if len(shared) >= 2:
        goals = np.array([known[name] for name in shared])
    else:
        shared = ["3.5", "3.6"]
        half = SEPARATION * height / 2.0
        goals = np.array([[width / 2.0 + half, EYE_LINE * height], [width / 2.0 - half, EYE_LINE * height]])
    laid = fit_similarity_2d(np.array([places[n] for n in shared]), goals).apply(np.array(list(places.values())))
    laid = np.clip(laid, 0.0, np.array(size) - 1.0)
    return {key: known.get(key, (float(x), float(y))) for key, (x, y) in zip(places, laid, strict=True)} | dict(known)


def points_picture(pixels: list[UInt8], points: list[Places], height: int = 700) -> UInt8:
    """Pictures side by side with their points and numbers, all of this height."""
    font = ImageFont.load_default(size=11)
    drawn = []
    for rgb, places in zip(pixels, points, strict=True):
        zoom = height / rgb.shape[0]
        image = Image.fromarray(rgb).resize((max(round(rgb.shape[1] * zoom), 1), height), Image.Resampling.LANCZOS)
        pen = ImageDraw.Draw(image)
        for name, place in places.items():
            x, y = _place(place, zoom)
            pen.ellipse((x - 2, y - 2, x + 2, y + 2), fill=DOT)
            pen.text((x + 3, y - 6), name, fill=LABEL, font=font)
        drawn.append(np.asarray(image))
    return np.concatenate(drawn, axis=1)


def _place(place: tuple[float, float], zoom: float) -> Floats:
    scaled: Floats = (np.asarray(place) + 0.5) * zoom - 0.5
    return scaled
