"""Pictures of faces, with or without a graphics library."""

from __future__ import annotations

from studio.render.camera import Camera, frame_face
from studio.render.choice import make_renderer
from studio.render.drawable import Drawable, Iris
from studio.render.figure import Figure, Style, face_camera, render_pose
from studio.render.protocol import Renderer, RendererError

__all__ = [
    "Camera",
    "Drawable",
    "Figure",
    "Iris",
    "Renderer",
    "RendererError",
    "Style",
    "face_camera",
    "frame_face",
    "make_renderer",
    "render_pose",
]
