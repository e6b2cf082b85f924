"""A scene made ready for pictures: what stays the same from pose to pose is worked out once."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fat.face import AnimatableFace
from fba.arrays import Floats, Ints
from fba.feature_points import FeaturePoints
from fba.scene import FaceScene, Role, Shape
from studio.render.camera import Camera, frame_face
from studio.render.choice import make_renderer
from studio.render.colors import EYES, GLOSS, clear_faces, eye_iris, is_clear, opacity, shape_colors, with_skin
from studio.render.drawable import Decal, Drawable, Iris, same_place, smooth_normals
from studio.render.features import feature_decal
from studio.render.occlusion import ambient_occlusion
from studio.render.protocol import Renderer
from studio.render.shading import UInt8

SHADE_TINT = np.array([1.0, 1.30, 1.35])
"""Exponents of the open sky for red, green, blue: light in the folds of skin turns red."""
SHADE_FLOOR = {Role.UPPER_TEETH: 0.72, Role.LOWER_TEETH: 0.72, Role.TONGUE: 0.4}
"""Least light of parts that are hidden in the neutral face, but seen when the mouth opens."""


@dataclass(frozen=True)
class Style:
    """How to draw.

    Attributes
    ----------
    smooth : shade smoothly over edges; False shows every polygon flat.
    occlusion : darken folds and hollows (measured on the neutral face).
    features : paint brows and lips where the feature points are.
    natural : ignore the file's materials and take natural colours.
    """

    smooth: bool = True
    occlusion: bool = True
    features: bool = True
    natural: bool = False


@dataclass(frozen=True, eq=False)
class _Part:
    shape: Shape
    triangles: Ints
    color: Floats
    places: Ints
    opacity: float = 1.0
    iris: Iris | None = None
    decal: Decal | None = None


class Figure:
    """A face ready to be drawn in any pose.

    Parameters
    ----------
    scene : the neutral face.
    points : its feature points: they frame the face. Optional.
    style : see `Style`.

    Examples
    --------
    >>> figure = Figure(scene, points)                          # doctest: +SKIP
    >>> picture = figure.draw(player.pose({3: 500}).world_shapes(), size=(320, 320))  # doctest: +SKIP
    """

    def __init__(self, scene: FaceScene, points: FeaturePoints | None = None, style: Style | None = None) -> None:
        self.scene = scene
        self.style = style or Style()
        self.camera = frame_face(scene, points)
        self.neutral = {s.name: scene.world_vertices(s.name) for s in scene.shapes}
        self._parts = [part for s in with_skin(scene) if (part := _part(scene, s, self.style)) is not None]
        if self.style.features and points is not None:
            self._parts = self._painted(points)
        if self.style.occlusion and self._parts:
            self._parts = self._shaded()

    @classmethod
    def of_face(cls, face: AnimatableFace, style: Style | None = None) -> Figure:
        """The figure of an animatable face, framed by its feature points."""
        return cls(face.scene, face.feature_points, style)

    def drawables(self, world_shapes: Mapping[str, Floats] | None = None) -> list[Drawable]:
        """Everything to draw in one pose: shape name -> (n, 3) world vertices; absent shapes stay neutral."""
        out = []
        for part in self._parts:
            name = part.shape.name
            vertices = self.neutral[name] if world_shapes is None else world_shapes.get(name, self.neutral[name])
            normals = smooth_normals(vertices, part.triangles, part.places) if self.style.smooth else None
            gloss = GLOSS[part.shape.role]
            out.append(
                Drawable(vertices, part.triangles, part.color, normals, gloss, part.opacity, part.iris, part.decal)
            )
        return out

    def draw(
        self,
        world_shapes: Mapping[str, Floats] | None = None,
        size: tuple[int, int] = (320, 320),
        camera: Camera | None = None,
        renderer: Renderer | None = None,
    ) -> UInt8:
        """Take a picture: (height, width, 3) uint8 for ``size = (width, height)``."""
        renderer = renderer or make_renderer()
        return renderer.render(self.drawables(world_shapes), camera or self.camera, *size)

    def _painted(self, points: FeaturePoints) -> list[_Part]:
        places = points.positions(self.scene)
        brows = not any(re.search("brow", p.shape.name, re.IGNORECASE) for p in self._parts)
        out = []
        for part in self._parts:
            if part.shape.role is Role.SKIN:
                decal = feature_decal(places, self.neutral[part.shape.name], part.triangles, brows)
                part = replace(part, decal=decal)
            out.append(part)
        return out

    def _shaded(self) -> list[_Part]:
        meshes = [(self.neutral[p.shape.name], p.triangles) for p in self._parts]
        normals = [smooth_normals(v, t, p.places) for (v, t), p in zip(meshes, self._parts, strict=True)]
        radius = 1.35 * max(self.camera.half_height, self.camera.half_width)
        open_sky = ambient_occlusion(meshes, normals, np.asarray(self.camera.target), radius)
        return [_darkened(part, sky) for part, sky in zip(self._parts, open_sky, strict=True)]


def _part(scene: FaceScene, shape: Shape, style: Style) -> _Part | None:
    if is_clear(shape) or shape.mesh.face_count == 0:
        return None
    dressed = shape
    if style.natural:
        dressed = replace(shape, materials=())
    color, triangles = shape_colors(dressed), shape.mesh.triangles
    hidden = clear_faces(shape)
    if hidden is not None:
        shown = hidden[shape.mesh.triangle_faces] == 0
        triangles = triangles[shown]
        color = color[shown] if color.ndim == 2 else color
    places = same_place(scene.world_vertices(shape.name))
    return _Part(shape, triangles, color, places, opacity(shape), eye_iris(scene, dressed, color))


def _darkened(part: _Part, open_sky: Floats) -> _Part:
    role = part.shape.role
    if role in EYES:
        return part
    floor = SHADE_FLOOR.get(role, 0.08)
    light = floor + (1.0 - floor) * np.clip(open_sky, 0.0, 1.0)
    # Half the exponent: colours are stored with gamma 2.
    tint = light[:, None] ** (0.5 * SHADE_TINT)
    if part.color.ndim == 1 or len(part.color) == len(tint):
        return replace(part, color=part.color * tint)
    return replace(part, color=part.color * tint[part.triangles].mean(axis=1))


def face_camera(face: AnimatableFace) -> Camera:
    """The camera in front of an animatable face."""
    return frame_face(face.scene, face.feature_points)


def render_pose(
    scene: FaceScene,
    world_shapes: Mapping[str, Floats] | None = None,
    camera: Camera | None = None,
    size: tuple[int, int] = (320, 320),
    style: Style | None = None,
    renderer: Renderer | None = None,
) -> UInt8:
    """Take one picture of a scene; for many poses of one scene keep a `Figure`, whose preparation costs most.

    Parameters
    ----------
    world_shapes : shape name -> (n, 3) world vertices, inside axes; None for neutral.
    camera : None frames the face from the front.
    size : (width, height) in pixels.

    Returns
    -------
    (height, width, 3) uint8.
    """
    return Figure(scene, style=style).draw(world_shapes, size, camera, renderer)
