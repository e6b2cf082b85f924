"""The reference sheet of a face: every FAP in both directions, every viseme and expression, each in close-up."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from PIL import Image

from fat.evaluate import Player
from fat.face import AnimatableFace
from fba.amplitudes import amplitudes
from fba.arrays import Floats
from fba.faps import fap
from fba.high_level import BLEND_MAX, EXPRESSIONS, VISEMES
from fba.scene import FaceScene, Node, Role, Transform
from studio.render import Figure, Renderer, make_renderer
from studio.render.camera import Camera
from studio.sheet import MARGIN, PAPER, PosePick, Sheet, UInt8

CELL = (208, 172)
COLUMNS = 6
SIDE = 50.0
"""Degrees by which the camera walks round for motions that a front view hides."""

OPEN_MOUTH = 700
"""FAP 3 at which the tongue is shown."""

LOWER_LIP = (5, 10, 11, 52, 57, 58)
"""The FAPs that open the lips where open_jaw alone leaves them closed."""

MOUTH = ("8.1", "8.2", "8.3", "8.4")
JAW = ("9.15", "2.1", "8.3", "8.4")
LEFT_EYE, RIGHT_EYE = ("3.7", "3.11", "3.1", "3.3"), ("3.8", "3.12", "3.2", "3.4")
LEFT_BROW, RIGHT_BROW = ("4.5", "4.2", "3.3"), ("4.6", "4.1", "3.4")
LEFT_CHEEK, RIGHT_CHEEK = ("5.1", "3.3", "8.3", "9.3"), ("5.2", "3.4", "8.4", "9.3")
TONGUE = ("6.1", "6.2", "6.3", "6.4")
NOSE = ("9.1", "9.2", "9.3", "9.15")
LEFT_EAR, RIGHT_EAR = ("10.1", "10.5", "10.3", "10.7"), ("10.2", "10.6", "10.4", "10.8")
FACE = ("4.5", "4.6", "2.1")
WHOLE: tuple[str, ...] = ()


@dataclass(frozen=True)
class View:
    """A camera.

    Attributes
    ----------
    points : feature points that must be in the picture; empty for the whole head.
    margin : around them, in eye separations.
    yaw, pitch : degrees; see `Camera`.
    words : what a caption says about it.
    roles : draw the shapes of these roles alone; empty for all.
    """

    points: tuple[str, ...] = WHOLE
    margin: float = 0.0
    yaw: float = 0.0
    pitch: float = 0.0
    words: str = ""
    roles: tuple[Role, ...] = ()

    def camera(self, places: Mapping[str, Floats], whole: Camera, es0: float) -> Camera:
        """The camera for a face; the whole head where it lacks one of the points."""
        if not self.points or any(i not in places for i in self.points):
            return whole.turned(self.yaw, self.pitch)
        known = np.array([places[i] for i in self.points])
        low, high = known.min(axis=0) - self.margin * es0, known.max(axis=0) + self.margin * es0
        x, y, z = (0.5 * (low + high)).tolist()
        half = 0.5 * (high - low)
        turn = np.radians(self.yaw)
        width = float(np.hypot(half[0] * np.cos(turn), half[2] * np.sin(turn)))
        return Camera((x, y, z), float(half[1]), width, self.yaw, self.pitch)


@dataclass(frozen=True)
class Section:
    """One part of the sheet: a name for files, a title, what it shows, and the views of FAPs that need their own."""

    name: str
    title: str
    view: View
    faps: tuple[int, ...] = ()
    views: Mapping[int, View] = field(default_factory=dict)
    opened: bool = False


def _each(faps: tuple[int, ...], view: View) -> dict[int, View]:
    return dict.fromkeys(faps, view)


SECTIONS: tuple[Section, ...] = (
    Section(
        "jaw",
        "Jaw, chin, and lips in depth",
        View(JAW, 0.32),
        (3, 15, 18, 14, 16, 17),
        _each((14, 16, 17), View(JAW, 0.32, SIDE, words="side")),
    ),
    Section("inner_lips", "Inner lips", View(MOUTH, 0.2), (4, 5, *range(6, 14))),
    Section("outer_lips", "Outer lips", View(MOUTH, 0.2), tuple(range(51, 61))),
    Section(
        "eyes",
        "Eyelids, eyeballs, pupils",
        View(LEFT_EYE, 0.16),
        (*range(19, 27, 2), 29, 27, *range(20, 27, 2), 30, 28),
        _each((20, 22, 24, 26, 30), View(RIGHT_EYE, 0.16))
        | {27: View(LEFT_EYE, 0.16, SIDE, words="side"), 28: View(RIGHT_EYE, 0.16, -SIDE, words="side")},
    ),
    Section(
        "brows_cheeks",
        "Eyebrows and cheeks",
        View(LEFT_BROW, 0.25),
        (*range(31, 39, 2), *range(32, 39, 2), 39, 41, 40, 42),
        _each((32, 34, 36, 38), View(RIGHT_BROW, 0.25))
        | _each((39, 41), View(LEFT_CHEEK, 0.3))
        | _each((40, 42), View(RIGHT_CHEEK, 0.3)),
    ),
    Section(
        "tongue",
        f"Tongue, the mouth opened by open_jaw {OPEN_MOUTH}",
        View(MOUTH, 0.24),
        (43, 44, 47, 45, 46),
        {
            45: View(MOUTH, 0.24, SIDE, words="side"),
            46: View(TONGUE, 0.28, SIDE, 15.0, "inside", (Role.TONGUE, Role.LOWER_TEETH)),
        },
        opened=True,
    ),
    Section(
        "head_nose_ears",
        "Head, nose and ears",
        View(),
        (48, 49, 50, *range(61, 69)),
        _each((61, 62, 63, 64), View(NOSE, 0.3))
        | _each((65,), View(LEFT_EAR, 0.3, 75.0, words="side"))
        | _each((66,), View(RIGHT_EAR, 0.3, -75.0, words="side"))
        | _each((67,), View(LEFT_EAR, 0.35))
        | _each((68,), View(RIGHT_EAR, 0.35)),
    ),
)

FIGURE_13: Mapping[int, float] = {
    3: 800,
    **dict.fromkeys((6, 7, 53, 54), 150),
    **dict.fromkeys((4, 5, 8, 9, 10, 11, 51, 52, 55, 56, 57, 58), -400),
    **dict.fromkeys(range(31, 37), 300),
}
"""The combination that Pandzic's Facial Motion Cloning shows in its figure 13."""


@dataclass(frozen=True, eq=False)
class FapSheet:
    """One part of the reference sheet as a picture."""

    name: str
    image: Image.Image


def fap_sheets(
    face: AnimatableFace,
    renderer: Renderer | None = None,
    progress: Callable[[str, float], None] = lambda _stage, _fraction: None,
) -> list[FapSheet]:
    """Draw the reference sheet of a face, one picture for each region; what has no table is left out.

    Low-level FAPs are shown at their normal amplitudes (`fba.amplitudes`), visemes and expressions at 63.
    """
    artist = _Artist(face, renderer or make_renderer())
    parts: list[tuple[str, Callable[[], Sheet]]] = [
        (s.name, lambda s=s: artist.section(s))  # type: ignore[misc]
        for s in SECTIONS
    ]
    parts += [("visemes", artist.visemes), ("expressions", artist.expressions)]
    sheets = []
    for k, (name, draw) in enumerate(parts):
        progress(f"drawing {name}", k / len(parts))
        sheet = draw()
        if sheet.rows:
            sheets.append(FapSheet(name, sheet.image()))
    return sheets


def tall_sheet(sheets: list[FapSheet]) -> Image.Image:
    """All parts below one another."""
    width = max((s.image.width for s in sheets), default=2 * MARGIN)
    image = Image.new("RGB", (width, sum(s.image.height for s in sheets) or 2 * MARGIN), PAPER)
    top = 0
    for sheet in sheets:
        image.paste(sheet.image, (0, top))
        top += sheet.image.height
    return image


class _Artist:
    def __init__(self, face: AnimatableFace, renderer: Renderer) -> None:
        self.face = face
        self.player = Player(face)
        self.figure = Figure.of_face(face)
        self.figures: dict[tuple[Role, ...], Figure] = {(): self.figure}
        self.renderer = renderer
        self.places = face.feature_points.positions(face.scene)
        self.keys = {t.key for t in face.tables}

    def section(self, section: Section) -> Sheet:
        """FAPs in both directions; a neutral picture before the first one of each view."""
        base = self._open_mouth() if section.opened else {}
        pictures: list[UInt8] = []
        captions: list[str] = []
        seen: set[View] = set()
        for number in section.faps:
            if (number, 1) not in self.keys:
                continue
            view = section.views.get(number, section.view)
            if view not in seen:
                seen.add(view)
                pictures.append(self._draw(PosePick("", base), view))
                captions.append("mouth open" if section.opened else "neutral")
            for value in amplitudes()[number].values:
                pictures.append(self._draw(PosePick("", {**base, number: value}), view))
                words = f", {view.words}" if view.words else ""
                captions.append(f"{number} {fap(number).name} {value:+d}{words}")
        return _sheet(section.title, pictures, captions)

    def visemes(self) -> Sheet:
        """The visemes."""
        picks = [PosePick(f"{v.id} {v.name}: {v.phonemes}", viseme=(v.id, 0, BLEND_MAX)) for v in VISEMES]
        return self._poses("Visemes at 63", picks, View(JAW, 0.32))

    def expressions(self) -> Sheet:
        """The expressions, and a published combination of FAPs."""
        picks = [PosePick(f"{e.id} {e.name}", expression=(e.id, BLEND_MAX, 0, 0)) for e in EXPRESSIONS]
        picks.append(PosePick("combination, FMC fig. 13", FIGURE_13))
        return self._poses("Expressions at 63, and a combination of FAPs", picks, View(FACE, 0.4))

    def _poses(self, title: str, picks: list[PosePick], view: View) -> Sheet:
        shown = [p for p in picks if p.tables() <= self.keys]
        if not shown:
            return Sheet(title)
        shown.insert(0, PosePick("neutral"))
        return _sheet(title, [self._draw(p, view) for p in shown], [p.caption for p in shown])

    def _draw(self, pick: PosePick, view: View) -> UInt8:
        pose = self.player.pose(pick.faps, pick.viseme, pick.expression)
        camera = view.camera(self.places, self.figure.camera, self.face.fapu.es0)
        return self._figure(view.roles).draw(pose.world_shapes(), CELL, camera, self.renderer)

    def _figure(self, roles: tuple[Role, ...]) -> Figure:
        if roles not in self.figures:
            self.figures[roles] = Figure(_only(self.face.scene, roles))
        return self.figures[roles]

    def _open_mouth(self) -> dict[int, float]:
        strict = self.face.notes.get("open_jaw") == "strict"
        return {3: OPEN_MOUTH, **(dict.fromkeys(LOWER_LIP, -OPEN_MOUTH) if strict else {})}


def _only(scene: FaceScene, roles: tuple[Role, ...]) -> FaceScene:
    """The scene with the shapes of these roles alone."""

    def kept(nodes: tuple[Node, ...]) -> tuple[Node, ...]:
        found: list[Node] = []
        for node in nodes:
            if isinstance(node, Transform):
                found.append(replace(node, children=kept(node.children)))
            elif node.role in roles:
                found.append(node)
        return tuple(found)

    return replace(scene, roots=kept(scene.roots))


def _sheet(title: str, pictures: list[UInt8], captions: list[str]) -> Sheet:
    sheet = Sheet(title)
    for start in range(0, len(pictures), COLUMNS):
        band = slice(start, start + COLUMNS)
        sheet.add_row("", pictures[band], captions[band])
    return sheet
