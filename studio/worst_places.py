"""Pictures of the worst places: each measure that is not good in close-up, beside the source in the same motion."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from PIL import Image, ImageDraw

from cloning.lining import coming_through
from fat.face import AnimatableFace
from fat.fap_quality import APART
from fat.quality import turned_over
from fba.arrays import Floats, Ints
from fba.faps import EXPRESSION_FAP, fap
from fba.scene import Role
from studio.checked_skin import CheckedSkin, check_skin
from studio.eye_depths import EyeDepths
from studio.posing import Poses
from studio.render import Figure, Renderer, make_renderer
from studio.render.camera import Camera
from studio.render.drawable import Drawable
from studio.sheet import Sheet, UInt8
from studio.verdicts import Verdict

CELL = (300, 260)
OPENED = 0.3
"""Radius of the hole in what hides a place, in half heights of the close-up: a little more than the ring's."""
HALF = 0.35
"""Half the height of a close-up, in eye separations: a mouth, or an eye with its brow."""
RING = 26
"""Radius of the ring around the place, in pixels."""
INK = (214, 40, 40)
TURN, MOST_TURNED = 35.0, 50.0
"""Degrees by which the camera walks round for each eye separation that a place lies aside, and at most."""
MEANS = {"fp-error": "fp-error-worst", "flips": "flips-worst"}
"""Means over all motions are shown in the worst one, which another measure knows."""
Motion = tuple[int, int, int]
"""FAP, select, value."""
MOUTH = "2.2"
"""Where visemes and expressions are looked at when no place is known."""


def worst_places(
    face: AnimatableFace,
    verdicts: Iterable[Verdict],
    source: AnimatableFace | None = None,
    renderer: Renderer | None = None,
) -> Image.Image:
    """Draw every measure that fails or is only fair, the failed ones first; all good measures give a bare title.

    Each row is a measure: the face in the worst motion, a ring around the worst place, and the source likewise.
    """
    bad = sorted((v for v in verdicts if v.word in ("FAIL", "fair")), key=lambda v: v.word != "FAIL")
    sheet = Sheet("The worst place of each measure" if bad else "No measure fails")
    renderer = renderer or make_renderer()
    views = [_View(one, renderer) for one in (face, source) if one is not None]
    skin = check_skin(face) if bad else None
    given = {v.code: v for v in verdicts}
    for verdict in bad:
        shown = given.get(MEANS.get(verdict.code, ""), verdict)
        spot = views[0].spot(shown, skin)
        pictures, captions = [], []
        for name, view in zip(("face", "source"), views, strict=False):
            pictures.append(view.draw(shown.place.motion, spot))
            value = verdict.value if name == "face" else verdict.source
            number = "" if value is None else f": {value:.3g}"
            inside = ", cut open" if spot is not None and spot.inside else ""
            mean = f"; mean{number}" if shown is not verdict else f"{inside}{number}"
            seen = shown.where.partition(", ")[0]  # The ring shows where in the face.
            captions.append(f"{name}, {seen or 'neutral'}{mean}")
        sheet.add_row(f"{verdict.word}  {verdict.measure.title}", pictures, captions)
    return sheet.image()


@dataclass(frozen=True, eq=False)
class Spot:
    """A place on any face: a feature point, the way from it in eye separations (3,), and whether skin hides it."""

    point: str
    beside: Floats
    inside: bool = False


class _View:
    def __init__(self, face: AnimatableFace, renderer: Renderer) -> None:
        self.face, self.renderer = face, renderer
        self.poses = Poses(face)
        self.figure = Figure.of_face(face)
        self.points = face.feature_points.positions(face.scene)

    def draw(self, motion: Motion | None, spot: Spot | None) -> UInt8:
        """The motion, seen from before the worst place; the whole face where the place is not known."""
        world = self.poses.rest if motion is None else self.poses.world(motion)
        place = None if spot is None else self.place(spot, world)
        camera = self.figure.camera
        if place is not None:
            half = HALF * self.face.fapu.es0
            aside = float(place[0]) / self.face.fapu.es0
            x, y, z = place.tolist()
            camera = Camera((x, y, z), half, half, yaw=float(np.clip(TURN * aside, -MOST_TURNED, MOST_TURNED)))
        drawn = self.figure.drawables(world)
        if place is not None and spot is not None and spot.inside:
            skins = [world[s.name] for s in self.face.scene.with_role(Role.SKIN)]
            radius = OPENED * camera.half_height
            drawn = [
                opened(d, camera, radius) if any(np.array_equal(d.vertices, skin) for skin in skins) else d
                for d in drawn
            ]
        image = Image.fromarray(self.renderer.render(drawn, camera, *CELL))
        if place is not None:
            x, y = CELL[0] // 2, CELL[1] // 2
            ImageDraw.Draw(image).ellipse((x - RING, y - RING, x + RING, y + RING), outline=INK, width=2)
        return np.asarray(image)

    def place(self, spot: Spot, world: Mapping[str, Floats]) -> Floats | None:
        """Where a spot is in a motion, (3,)."""
        if spot.point not in self.points:
            return None
        moved = self.face.feature_points.positions(self.face.scene, world)
        place: Floats = moved[spot.point] + self.face.fapu.es0 * spot.beside
        return place

    def spot(self, verdict: Verdict, skin: CheckedSkin | None) -> Spot | None:
        """The worst place of a measure as a feature point and a way from it, so that another face has it too."""
        point, motion = verdict.place.point, verdict.place.motion
        if point is None and motion is not None and skin is not None:
            offsets = skin.offsets(self.face, self.poses.pose(motion))
            vertex = verdict.place.vertex
            vertex = self._first(verdict.code, skin, motion, offsets) if vertex is None else vertex
            if vertex is not None:
                at = skin.surface.vertices[vertex]
                near = {k: at - p for k, p in skin.surface.positions.items()}
                point = min(near, key=lambda k: (float(np.linalg.norm(near[k])), k))
                own = offsets[vertex]
                moved = self.face.feature_points.positions(self.face.scene, self.poses.world(motion))
                went = (moved[point] - self.points[point]) / self.face.fapu.es0
                return Spot(point, near[point] + own - went, not skin.seen[vertex])
        if point is None and motion is not None:
            point = fap(motion[0]).feature_points[0] if motion[0] > EXPRESSION_FAP else MOUTH
        return None if point is None else Spot(point, np.zeros(3))

    def _first(self, code: str, skin: CheckedSkin, motion: Motion, offsets: Floats) -> int | None:
        """A vertex where a motion breaks the rule of a measure that counts, one that is seen if any; None: nowhere."""
        surface = skin.surface
        found: Ints = np.zeros(0, dtype=np.int32)
        if code == "fold" or code.startswith("flips"):
            found = surface.triangles[turned_over(surface.vertices, surface.triangles, offsets)[1], 0]
        elif code == "seams":
            gap = np.linalg.norm(offsets[surface.links[:, 0]] - offsets[surface.links[:, 1]], axis=1)
            found = surface.links[gap > APART, 0]
        elif code == "in-eyes" and skin.eyeballs:
            depths = EyeDepths(skin, self.poses)
            found = depths.vertices[depths.sunk(motion)]
        elif code == "lining":
            found = coming_through(surface, skin.seen, skin.labels, skin.lining, offsets)
        seen = found[skin.seen[found]]
        return int((seen if len(seen) else found)[0]) if len(found) else None


def opened(drawable: Drawable, camera: Camera, radius: float) -> Drawable:
    """Without the triangles that hide the camera's target: those before it, and no farther aside than the radius."""
    middles = drawable.vertices[drawable.triangles].mean(axis=1) - np.asarray(camera.target)
    view = middles @ camera.rotation().T
    hides = (np.hypot(view[:, 0], view[:, 1]) < radius) & (view[:, 2] > 0.0)
    color = drawable.color
    if len(color) == len(drawable.triangles) != len(drawable.vertices) and color.ndim == 2:
        color = color[~hides]
    decal = None if drawable.decal is None else replace(drawable.decal, uv=drawable.decal.uv[~hides])
    return replace(drawable, triangles=drawable.triangles[~hides], color=color, decal=decal)


__all__ = ["opened", "worst_places"]
