"""Lining that comes through the skin before it, on a box of skin and on the shipped source."""

from __future__ import annotations

import numpy as np
import pytest

from cloning.lining import coming_through, lining
from cloning.prepare import prepare
from cloning.surface import Surface
from cloning.visibility import visible
from fat.evaluate import Player
from fba.arrays import Bools, Floats
from formats import read_face

APART = 0.1
COLUMNS = 21
UNLABELLED = np.zeros(2 * 7 * COLUMNS, np.int32)


def folded_sheet() -> tuple[Surface, Bools]:
    """A strip of skin that is folded back behind itself, 0.1 apart; its front half can be seen."""
    along = np.linspace(0.0, 1.0, COLUMNS)
    across = np.linspace(0.0, 0.3, 7)
    front = np.array([(x, y, 0.0) for x in along for y in across])
    back = np.array([(x, y, -APART) for x in along[::-1] for y in across])
    vertices, width = np.concatenate([front, back]), len(across)
    corner = np.array([r * width + c for r in range(2 * COLUMNS - 1) for c in range(width - 1)])
    quads = np.stack([corner, corner + width, corner + width + 1, corner + 1], axis=1).astype(np.int32)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    offsets = np.arange(0, quads.size + 1, 4, dtype=np.int32)
    none = np.zeros((0, 2), np.int32)
    starts = np.array([0, len(vertices)])
    surface = Surface(("skin",), starts, vertices, (quads.ravel(), offsets), triangles, none, {}, {})
    return surface, vertices[:, 2] == 0.0


def test_what_is_deep_behind_the_skin_is_lining() -> None:
    surface, seen = folded_sheet()
    inner = lining(surface, seen, UNLABELLED)
    assert set(inner.tolist()) == set(np.flatnonzero(~seen & (surface.vertices[:, 0] < 0.95 - 1e-9)).tolist())


@pytest.mark.parametrize(("forward", "through"), [(0.0, False), (0.09, False), (0.11, True), (0.2, True)])
def test_lining_that_comes_before_the_skin_is_found(forward: float, through: bool) -> None:
    surface, seen = folded_sheet()
    inner = lining(surface, seen, UNLABELLED)
    pushed = inner[np.abs(surface.vertices[inner, 0] - 0.4) < 0.01]
    moved = np.zeros_like(surface.vertices)
    moved[pushed] = [0.0, 0.0, forward]
    assert coming_through(surface, seen, UNLABELLED, inner, moved).tolist() == (
        sorted(pushed.tolist()) if through else []
    )


def test_lining_that_goes_along_stays_behind() -> None:
    surface, seen = folded_sheet()
    moved: Floats = np.zeros_like(surface.vertices)
    moved[:, 2] = 0.5 * np.sin(4.0 * surface.vertices[:, 0])
    assert not len(coming_through(surface, seen, UNLABELLED, lining(surface, seen, UNLABELLED), moved))


LOWER_LIP = (5, 10, 11, 52, 57, 58)
UPPER_LIP = (4, 8, 9, 51, 55, 56)
CORNERS = (6, 7, 12, 13)


@pytest.mark.parametrize(
    "faps",
    [
        dict.fromkeys(LOWER_LIP, -600),
        dict.fromkeys(UPPER_LIP, -600),
        {3: 800, **dict.fromkeys((*LOWER_LIP, *UPPER_LIP), -400), **dict.fromkeys(CORNERS, 150)},
        {39: -80, 40: -80},
    ],
)
def test_no_lining_comes_through_the_lips_of_the_source(faps: dict[int, float]) -> None:
    """Nor through the chin below them, when lips are moved together, as far as the standard goes."""
    face = read_face("default")
    prepared = prepare(face.scene, face.feature_points, "source")
    skin, labels = prepared.skin, prepared.labels.values
    seen = visible(skin)
    inner = lining(skin, seen, labels)
    assert len(inner) > 100
    player = Player(face, rules=())
    rest, moved = (player.pose(given).world_shapes() for given in ({}, faps))
    offsets = skin.join({name: moved[name] - rest[name] for name in skin.shapes}) / face.fapu.es0
    assert not len(coming_through(skin, seen, labels, inner, offsets))
