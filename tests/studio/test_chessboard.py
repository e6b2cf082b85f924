"""The picture of the correspondence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from cloning.mapping import SkinPlaces
from fba.scene import Role
from formats import read_face
from samples import sample
from studio.chessboard import DARK, SQUARE, chessboard
from studio.cli.app import app


@pytest.fixture(scope="module")
def placed() -> SkinPlaces:
    """The shipped source with its own places."""
    face = read_face("default")
    es0, tip = face.fapu.es0, face.feature_points.positions(face.scene)["9.3"]
    skins = [s.name for s in face.scene.with_role(Role.SKIN)]
    places = {name: (face.scene.world_vertices(name) - tip) / es0 for name in skins}
    return SkinPlaces(face.scene, face.feature_points, places)


def test_a_face_of_equal_places_looks_the_same_on_both_sides(placed: SkinPlaces) -> None:
    image = np.asarray(chessboard(placed, placed, (160, 200))).astype(int)
    middle = image.shape[1] // 2
    left, right = image[60:240, 14:174], image[60:240, -174:-14]
    assert middle > 160
    assert np.abs(left - right).max() == 0


def test_squares_are_where_the_places_say(placed: SkinPlaces) -> None:
    still = SkinPlaces(placed.scene, placed.points, {k: 0.0 * v + 0.5 * SQUARE for k, v in placed.places.items()})
    other = SkinPlaces(
        placed.scene,
        placed.points,
        {k: 0.0 * v + 0.5 * SQUARE * np.array([3.0, 1.0, 0.0]) for k, v in placed.places.items()},
    )
    light, dark = sorted(np.asarray(chessboard(p, p, (160, 200))).mean() for p in (still, other))[::-1]
    assert light > dark + 20, "one square over: the whole face has the other colour"
    assert min(DARK) < 255


def test_the_command_draws_the_map(tmp_path: Path) -> None:
    picture, out, head = tmp_path / "map.png", str(tmp_path / "o.wrl"), str(sample("faces/tri_head.obj"))
    done = CliRunner().invoke(app, ["clone", head, "-o", out, "--backend", "fit", "--faps", "3", "--map", str(picture)])
    assert done.exit_code == 0, done.output
    assert Image.open(picture).size[0] > 900
    refused = CliRunner().invoke(app, ["clone", head, "-o", out, "--map", str(tmp_path / "map.jpg")])
    assert refused.exit_code == 2
