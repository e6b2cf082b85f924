"""Where a picture is taken from: a long lens in front of the face, deterministic framing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fba.arrays import Floats
from fba.feature_points import FeaturePoints
from fba.scene import FaceScene, Role

EYE_LINE_ABOVE = 1.2
CHIN_BELOW = 0.35
HALF_WIDTH = 0.95
"""The frame of a face in distances from eye line to chin: above the eyes, below the chin, to each side. The eye
line of a human head lies half-way between crown and chin."""


@dataclass(frozen=True)
class Camera:
    """A camera that looks at a point of the face.

    Attributes
    ----------
    target : the point in the middle of the picture, world coordinates.
    half_height, half_width : how much around the target must be seen, in mesh units.
    yaw : degrees by which the camera walks round to the subject's left.
    pitch : degrees by which the camera rises.
    distance : to the target, in half heights; None takes an orthographic picture.
    """

    target: tuple[float, float, float]
    half_height: float
    half_width: float
    yaw: float = 0.0
    pitch: float = 0.0
    distance: float | None = 9.0

    def turned(self, yaw: float, pitch: float = 0.0) -> Camera:
        """The same camera from another side."""
        return replace(self, yaw=yaw, pitch=pitch)

    def rotation(self) -> Floats:
        """(3, 3) from world directions to view directions: +X right, +Y up, +Z towards the camera."""
        yaw, pitch = np.radians(self.yaw), np.radians(self.pitch)
        cy, sy, cp, sp = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
        turn = np.array([[cy, 0.0, -sy], [0.0, 1.0, 0.0], [sy, 0.0, cy]])
        rise = np.array([[1.0, 0.0, 0.0], [0.0, cp, -sp], [0.0, sp, cp]])
        return np.asarray(rise @ turn)

    def clip_matrix(self, width: int, height: int, near: float, far: float) -> Floats:
        """4x4 matrix from world to clip coordinates (OpenGL's: -w <= x, y, z <= w, depth growing away).

        Parameters
        ----------
        width, height : of the picture, pixels; the frame is fitted inside.
        near, far : view depths (+Z towards the camera, 0 at the target) of the nearest and farthest thing.
        """
        scale = min(height / (2.0 * self.half_height), width / (2.0 * self.half_width))
        lens = np.zeros((4, 4))
        lens[0, 0], lens[1, 1], lens[3, 3] = 2.0 * scale / width, 2.0 * scale / height, 1.0
        if self.distance is not None:
            reach = self.distance * self.half_height
            near = min(near, 0.9 * reach)
            lens[3, 2] = -1.0 / reach
        w_near, w_far = 1.0 + lens[3, 2] * near, 1.0 + lens[3, 2] * far
        lens[2, 2] = -(w_near + w_far) / max(near - far, 1e-12 * self.half_height)
        lens[2, 3] = w_far - lens[2, 2] * far
        view = np.eye(4)
        view[:3, :3] = self.rotation()
        view[:3, 3] = -view[:3, :3] @ np.asarray(self.target)
        return lens @ view


def frame_face(scene: FaceScene, points: FeaturePoints | None = None) -> Camera:
    """Aim at the face: from the crown to below the chin, seen from the front.

    Uses the feature points of eyes and chin; without them the eyeballs; without these the bounds of the skin.
    """
    places = {} if points is None else points.positions(scene)
    skin = _bounds(scene)
    face = _from_points(places) or _from_eyes(scene)
    if face is None:
        middle, half = skin.mean(axis=0), np.ptp(skin, axis=0) / 2.0
        return Camera(_triple(middle), max(1.08 * half[1], 1e-9), max(1.08 * half[0], 1e-9))
    eyes, chin_y = face
    unit = float(eyes[1] - chin_y)
    top = min(eyes[1] + EYE_LINE_ABOVE * unit, skin[1, 1] + 0.12 * unit)
    bottom = max(chin_y - CHIN_BELOW * unit, skin[0, 1] - 0.12 * unit)
    wide = max(abs(skin[0, 0] - eyes[0]), abs(skin[1, 0] - eyes[0])) + 0.1 * unit
    depth = max(skin[1, 2] - 0.9 * unit, skin[0, 2])
    target = (float(eyes[0]), float(top + bottom) / 2.0, float(depth))
    return Camera(target, float(top - bottom) / 2.0, min(float(wide), HALF_WIDTH * unit))


def _from_points(places: Mapping[str, Floats]) -> tuple[Floats, float] | None:
    for left, right in (("3.5", "3.6"), ("3.7", "3.12"), ("3.11", "3.8"), ("3.1", "3.2")):
        if left in places and right in places:
            eyes = (places[left] + places[right]) / 2.0
            for chin in ("2.1", "2.10"):
                if chin in places and places[chin][1] < eyes[1]:
                    return eyes, float(places[chin][1])
    return None


def _from_eyes(scene: FaceScene) -> tuple[Floats, float] | None:
    centers = []
    for role in (Role.EYE_LEFT, Role.EYE_RIGHT):
        corners = [scene.world_vertices(s.name) for s in scene.with_role(role) if s.mesh.vertex_count]
        if not corners:
            return None
        joined = np.concatenate(corners)
        centers.append((joined.min(axis=0) + joined.max(axis=0)) / 2.0)
    separation = float(np.linalg.norm(centers[0] - centers[1]))
    eyes = (centers[0] + centers[1]) / 2.0
    return (eyes, float(eyes[1] - EYES_TO_CHIN * separation)) if separation > 0 else None


EYES_TO_CHIN = 1.8
"""Eye line to chin in eye separations on the shared human heads (1.7 to 1.9)."""


def _bounds(scene: FaceScene) -> Floats:
    shapes = scene.with_role(Role.SKIN) or scene.shapes
    used = [scene.world_vertices(s.name)[s.mesh.used_vertices] for s in shapes]
    used = [u for u in used if len(u)]
    if not used:
        return np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])
    joined = np.concatenate(used)
    return np.stack([joined.min(axis=0), joined.max(axis=0)])


def _triple(values: Floats) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    return x, y, z
