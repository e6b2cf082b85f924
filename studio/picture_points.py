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

MARGIN = 0.3
"""What a picture of points shows around them, in heights of the face."""

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
    skip = set(NOT_FACE) - {"3.5", "3.6"}
    places = {
        key: np.array([p[0], -p[1]]) for key, p in face.feature_points.positions(face.scene).items() if key not in skip
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
    """The faces of pictures side by side, all of this height, with their points and numbers."""
    font = ImageFont.load_default(size=11)
    drawn = []
    for rgb, places in zip(pixels, points, strict=True):
        corner, rgb = _around(rgb, places)
        zoom = height / rgb.shape[0]
        image = Image.fromarray(rgb).resize((max(round(rgb.shape[1] * zoom), 1), height), Image.Resampling.LANCZOS)
        pen = ImageDraw.Draw(image)
        for name, place in places.items():
            x, y = (np.array(place) - corner + 0.5) * zoom - 0.5
            pen.ellipse((x - 2, y - 2, x + 2, y + 2), fill=DOT)
            pen.text((x + 3, y - 6), name, fill=LABEL, font=font)
        drawn.append(np.asarray(image))
    return np.concatenate(drawn, axis=1)


def _around(rgb: UInt8, places: Places) -> tuple[Floats, UInt8]:
    """The part of a picture around its points, and its upper left pixel (x, y)."""
    at = np.array(list(places.values()))
    margin = MARGIN * float(np.ptp(at[:, 1]))
    left, top = np.maximum(at.min(axis=0) - margin, 0).astype(int)
    right, bottom = np.ceil(at.max(axis=0) + margin).astype(int) + 1
    return np.array([left, top], np.float64), rgb[top:bottom, left:right]
