"""A picture of a face with its feature points, coloured by how sure they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from fba.arrays import Floats
from fba.feature_points import FeaturePoint, FeaturePoints
from fba.scene import FaceScene
from studio.render import Figure, Renderer, make_renderer
from studio.render.camera import Camera
from studio.render.figure import Style
from studio.render.protocol import depth_range, project
from studio.sheet import Sheet, UInt8

# (name, degrees to the subject's left)
VIEWS = (("front", 0.0), ("half left", 40.0), ("left", 88.0))
SIZE = (520, 624)
DOT = 3
GIVEN = (40, 90, 220)
"""Colour of points that a person gave; detected ones run from red (0) over yellow to green (1)."""


def landmark_sheet(
    scene: FaceScene, points: FeaturePoints, title: str = "", renderer: Renderer | None = None
) -> Image.Image:
    """Draw a face from three sides with all its points that face the viewer, their numbers beside them.

    Parameters
    ----------
    scene, points : in inside axes (see `fba.orientation.orient`).
    """
    figure = Figure(scene, points, Style(features=False))
    renderer = renderer or make_renderer()
    places = points.positions(scene)
    normals = _normals(scene, points)
    pictures = []
    middle = _camera(places) or figure.camera
    for _, yaw in VIEWS:
        camera = middle.turned(yaw)
        picture = figure.draw(size=SIZE, camera=camera, renderer=renderer)
        shown = [key for key in points if key not in normals or (camera.rotation() @ normals[key])[2] > 0.1]
        pictures.append(marked(picture, points, places, shown, camera, figure))
    sheet = Sheet(title)
    sheet.add_row("", pictures, [name for name, _ in VIEWS])
    return sheet.image()


def point_color(point: FeaturePoint) -> tuple[int, int, int]:
    """The colour of a point's confidence; blue for one that a person gave.

    >>> point_color(FeaturePoint("skin", (0,), (1.0,), source="detected", confidence=1.0))
    (0, 200, 40)
    """
    if point.source in ("given", "clicked"):
        return GIVEN
    share = 2.0 * point.confidence
    return (round(220 * min(1.0, 2.0 - share)), round(200 * min(1.0, share)), 40)


def marked(
    picture: UInt8,
    points: FeaturePoints,
    places: Mapping[str, Floats],
    shown: Sequence[str],
    camera: Camera,
    figure: Figure,
    dot: int = DOT,
    numbers: bool = True,
) -> UInt8:
    """The picture (of a figure by a camera) with a dot for each point shown, its number beside it."""
    image = Image.fromarray(picture)
    draw = ImageDraw.Draw(image)
    font = ImageFont.load_default(9)
    if shown:
        height, width = picture.shape[:2]
        matrix = camera.clip_matrix(width, height, *depth_range(figure.drawables(), camera))
        flat, _ = project(np.array([places[key] for key in shown]), matrix)
        for key, (x, y, _) in zip(shown, flat, strict=True):
            u, v = (x + 1.0) * width / 2.0, (1.0 - y) * height / 2.0
            draw.ellipse((u - dot, v - dot, u + dot, v + dot), fill=point_color(points[key]))
            if numbers:
                draw.text((u + dot + 1, v - 5), key, (20, 20, 20), font)
    return np.asarray(image)


def _camera(places: dict[str, Floats]) -> Camera | None:
    """Aim at the points themselves: the rest of the file may be a whole body."""
    known = [places[key] for key in ("3.7", "3.12", "2.1") if key in places]
    if len(known) < 3:
        return None
    eyes, chin = 0.5 * (known[0] + known[1]), known[2]
    unit = float(eyes[1] - chin[1])
    target = (float(eyes[0]), float(eyes[1] - 0.2 * unit), float(eyes[2] - 0.7 * unit))
    return Camera(target, 1.3 * unit, 1.1 * unit)


def _normals(scene: FaceScene, points: FeaturePoints) -> dict[str, Floats]:
    """The direction of the surface at each point that lies on one."""
    found = {}
    shapes = {p.shape for p in points.values() if p.shape is not None}
    normals = {name: scene.shape(name).mesh.vertex_normals(scene.world_vertices(name)) for name in sorted(shapes)}
    for key, point in points.items():
        if point.shape is not None:
            found[key] = np.asarray(point.weights) @ normals[point.shape][list(point.vertices)]
    return found
