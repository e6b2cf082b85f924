"""What the pieces beside skin, eyes, teeth and tongue are: lashes, brows, hair, glasses; and how they move.

Told by what the file calls them, else by where they lie about the feature points.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from cloning.bind import nearest_on
from cloning.pieces import Pieces, find_pieces
from cloning.surface import Surface
from fba.arrays import Bools, Floats
from fba.findings import Finding
from fba.scene import FaceScene, Role


class Kind(StrEnum):
    """What a piece is; the words are those of the report."""

    SKIN = "skin"
    EYE_LEFT = "left eye"
    EYE_RIGHT = "right eye"
    UPPER_TEETH = "upper teeth"
    LOWER_TEETH = "lower teeth"
    UPPER_GUMS = "upper gums"
    LOWER_GUMS = "lower gums"
    TONGUE = "tongue"
    LASHES = "lashes"
    EYE_TRIM = "tear lines"
    BROWS = "brows"
    BEARD = "beard"
    HAIR = "hair"
    GLASSES = "glasses"
    CLOTHES = "clothes"
    OTHER = "other pieces"


NAMES: tuple[tuple[Kind, str], ...] = (
    (Kind.GLASSES, r"glasses|spectacle|goggle|eye ?wear|monocle"),
    (Kind.LASHES, r"lash|\bcilia"),
    (Kind.BROWS, r"brow"),
    (Kind.BEARD, r"beard|mou?stache|stubble|whisker|goatee"),
    (Kind.HAIR, r"(?<!c)hair(?!line)|\bwig\b|braid|pony ?tail|\bbangs\b"),
    (Kind.EYE_TRIM, r"lacrimal|caruncle|\btear|occlusion|eye ?blend|wet ?line|meniscus"),
    (Kind.CLOTHES, r"cloth|outfit|shirt|collar|\bhat\b|helmet|scarf|jacket|footwear|shoe|trouser|skirt|dress"),
)
"""Words by which files call them, the surer ones first."""

MOTION: Mapping[Kind, str] = {
    Kind.SKIN: "is cloned",
    Kind.EYE_LEFT: "turns about its centre",
    Kind.EYE_RIGHT: "turns about its centre",
    Kind.UPPER_TEETH: "rest with the head",
    Kind.UPPER_GUMS: "rest with the head",
    Kind.LOWER_TEETH: "follow the jaw",
    Kind.LOWER_GUMS: "follow the jaw",
    Kind.TONGUE: "bends like the source's",
    Kind.LASHES: "ride on the lids",
    Kind.EYE_TRIM: "ride on the lids",
    Kind.BROWS: "ride on the skin",
    Kind.BEARD: "rides on the skin",
    Kind.HAIR: "rests with the head",
    Kind.GLASSES: "rest with the head",
    Kind.CLOTHES: "rest with the head",
    Kind.OTHER: "ride on the skin where they touch it, else rest with the head",
}

RESTING = (Kind.HAIR, Kind.GLASSES, Kind.CLOTHES)
"""They may touch moving skin, but do not bend with it: hair hangs before cheeks, glasses stand on nose and ears."""

LYING = (Kind.BROWS, Kind.BEARD)
"""They lie on the skin all over; lashes are rooted in it with one edge."""

ON_SKIN = 0.08
"""Brows lie at most this far from the skin, in eye separations; lashes are rooted at most so far from it."""

EYE = 0.45
"""Lashes and tear lines reach at most this far from the pupil, in eye separations: an eye is 0.45 wide."""

GUMS = r"\bgums?\b|gingiva"


@dataclass(frozen=True)
class Part:
    """The pieces of one kind in one shape."""

    shape: str
    kind: Kind
    pieces: int
    vertices: int

    def to_dict(self) -> dict[str, object]:
        """For the report."""
        return {
            "shape": self.shape,
            "part": self.kind.value,
            "pieces": self.pieces,
            "vertices": self.vertices,
            "motion": MOTION[self.kind],
        }


@dataclass(frozen=True, eq=False)
class Parts:
    """All parts of a face.

    Attributes
    ----------
    rows : in scene order.
    resting : shape name -> (n,) which vertices rest although they may touch the skin; shapes of role "other".
    lying : likewise which lie flat on the skin.
    """

    rows: tuple[Part, ...]
    resting: Mapping[str, Bools]
    lying: Mapping[str, Bools]

    def finding(self, where: str) -> Finding:
        """One line about all of them."""
        return Finding("info", "parts", f"parts: {in_words(self.rows)}", where)


NO_PARTS = Parts((), {}, {})


def tell_parts(scene: FaceScene, skin: Surface, es0: float) -> Parts:
    """Name every piece of a scene whose shapes have their roles.

    Parameters
    ----------
    skin : in eye separations, with its feature points.
    es0 : an eye separation in mesh units.
    """
    pieces = find_pieces(scene)
    rows: list[Part] = []
    resting: dict[str, Bools] = {}
    lying: dict[str, Bools] = {}
    for shape in scene.shapes:
        of_vertex, used = pieces.of_vertex[shape.name], shape.mesh.used_vertices
        if not used.any():
            continue
        numbers, count = np.unique(of_vertex[used], return_counts=True)
        kinds = [_kind(shape.role, int(k), pieces, skin, es0) for k in numbers]
        for kind in dict.fromkeys(kinds):
            size = [int(n) for n, k in zip(count, kinds, strict=True) if k is kind]
            rows.append(Part(shape.name, kind, len(size), sum(size)))
        if shape.role is Role.OTHER:
            for found, wanted in ((resting, RESTING), (lying, LYING)):
                some = [int(k) for k, kind in zip(numbers, kinds, strict=True) if kind in wanted]
                found[shape.name] = np.isin(of_vertex, some)
    return Parts(tuple(rows), resting, lying)


def named(name: str) -> Kind | None:
    """The kind that a piece's words say, or None.

    >>> named("wolf3 d glasses"), named("helper l eyelashes 1"), named("face")
    (<Kind.GLASSES: 'glasses'>, <Kind.LASHES: 'lashes'>, None)
    """
    return next((kind for kind, pattern in NAMES if re.search(pattern, name)), None)


def in_words(rows: Sequence[Part]) -> str:
    """What a face has, in one line.

    >>> in_words([Part("a", Kind.SKIN, 1, 9), Part("b", Kind.EYE_LEFT, 2, 9), Part("c", Kind.HAIR, 3, 9)])
    'skin; the left eye turns about its centre; hair (3 pieces) rests with the head'
    """
    kinds = {kind: sum(row.pieces for row in rows if row.kind is kind) for kind in Kind}
    said = ["skin" if kinds[Kind.SKIN] < 2 else f"skin ({kinds[Kind.SKIN]} pieces)"]
    if kinds[Kind.EYE_LEFT] and kinds[Kind.EYE_RIGHT]:
        said.append("2 eyeballs turn about their centres")
    else:
        said += [f"the {k} {MOTION[k]}" for k in (Kind.EYE_LEFT, Kind.EYE_RIGHT) if kinds[k]]
    for kind in list(Kind)[3:]:
        count = kinds[kind]
        if count:
            many = f" ({count} pieces)" if count > 1 and kind is not Kind.OTHER else ""
            number = f"{count} " if kind is Kind.OTHER else ""
            said.append(f"{number}{kind}{many} {MOTION[kind]}")
    return "; ".join(said)


def _kind(role: Role, number: int, pieces: Pieces, skin: Surface, es0: float) -> Kind:
    name = pieces.names[number]
    if role in (Role.UPPER_TEETH, Role.LOWER_TEETH):
        gums = re.search(GUMS, name) and not re.search("teeth|tooth", name)
        jaw = "upper" if role is Role.UPPER_TEETH else "lower"
        return Kind(f"{jaw} {'gums' if gums else 'teeth'}")
    if role is not Role.OTHER:
        return Kind(role.value if role not in (Role.EYE_LEFT, Role.EYE_RIGHT) else f"{role.value[4:]} eye")
    return named(name) or _by_place(pieces.vertices[number] / es0, skin)


def _by_place(vertices: Floats, skin: Surface) -> Kind:
    """The kind of a piece without a telling name, (n, 3) in eye separations."""
    at = skin.positions
    left, right = at["3.5"], at["3.6"]
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    eyes = 0.5 * (left + right)
    if _spans_eyes(vertices, left, right):
        return Kind.GLASSES
    if high[1] > eyes[1] + 1.0 and float((high - low).max()) > 0.8:
        return Kind.HAIR
    near_eye = [float(np.linalg.norm(vertices - pupil, axis=1).max()) < EYE for pupil in (left, right)]
    flat = bool(low[1] > eyes[1] + 0.1 and high[1] < eyes[1] + 0.9 and high[0] - low[0] > 0.15)
    if not any(near_eye) and not flat:
        return Kind.OTHER
    _, _, away = nearest_on(vertices, skin.vertices, skin.triangles)
    if any(near_eye) and away.min() < ON_SKIN:
        return Kind.LASHES
    return Kind.BROWS if flat and away.max() < ON_SKIN else Kind.OTHER


def _spans_eyes(vertices: Floats, left: Floats, right: Floats) -> bool:
    """A frame: from beyond one pupil to beyond the other, before both, about as high as the eyes."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    eye = 0.5 * (left + right)
    wide = bool(low[0] < right[0] and high[0] > left[0])
    level = bool(low[1] < eye[1] and high[1] > eye[1] - 0.3 and high[1] < eye[1] + 0.8 and low[1] > eye[1] - 1.2)
    before = vertices[vertices[:, 2] > min(left[2], right[2])]
    both = bool(len(before) and before[:, 0].min() < right[0] and before[:, 0].max() > left[0])
    return wide and level and both
