"""``fba compare``: grids of clones, their measures, and the names of motions."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest
import typer
from PIL import Image
from typer.testing import CliRunner, Result

from fat.evaluate import Player
from fba.amplitudes import amplitudes
from fba.errors import FapStreamError, LandmarkError
from fba.faps import faps
from formats import read_face
from samples import sample
from studio.cli.app import app
from studio.cli.outcome import Outcome
from studio.cli.spread import Spread
from studio.compared_faces import read_model, read_models
from studio.comparison import Way
from studio.motions import COMBINATIONS, parse_motions
from studio.render import Figure, make_renderer

HEAD = sample("faces/tri_head.obj")


def fba(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def test_motions_have_names() -> None:
    joy, ih, also_ih, faps_ = parse_motions("joy, viseme_ih,viseme_12,open_jaw=800+37+32=-5.5")
    assert (joy.caption, joy.expression) == ("joy", (1, 63, 0, 0))
    assert ih.viseme == also_ih.viseme == (12, 0, 63)
    assert faps_.faps == {3: 800.0, 37: amplitudes()[37].positive, 32: -5.5}


@pytest.mark.parametrize("text", ["", " , ", "smirk", "viseme_42", "open_jaw=wide", "69", "joy=5", "open_jaw+"])
def test_what_is_no_motion_is_named(text: str) -> None:
    with pytest.raises(FapStreamError, match=r"no motion"):
        parse_motions(text)


def test_the_combination_is_the_papers() -> None:
    """Every FAP of the lips but the corners' raises at -400, jaw 800, corners stretched 150, left brow 300."""
    pose = COMBINATIONS["combination"].faps
    by_name = {f.name: pose.get(f.id) for f in faps()}
    lips = [n for n in by_name if n.startswith(("raise_", "lower_")) and "lip" in n and "corner" not in n]
    assert len(lips) == 12
    assert {by_name[n] for n in lips} == {-400.0}
    assert by_name["open_jaw"] == 800.0
    assert (by_name["stretch_l_cornerlip"], by_name["stretch_r_cornerlip"]) == (150.0, 150.0)
    assert [n for n, v in by_name.items() if v == 300.0] == [f"raise_l_{k}_eyebrow" for k in "imo"]
    assert len(pose) == 18


@pytest.fixture(scope="module")
def grid(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    out = tmp_path_factory.mktemp("grid") / "grid.png"
    result = fba(
        *("compare", "default", "--targets", HEAD, "default", "-o", out, "--motion", "open_jaw=500,31=100"),
        *("--backends", "fmc", "--generations", 2, "--cell", 60, "--json"),
    )
    assert result.exit_code == Outcome.OK, result.output
    return json.loads(result.stdout), out


def test_every_pair_and_motion_is_measured(grid: tuple[dict[str, Any], Path]) -> None:
    cells = grid[0]["cells"]
    named = {(c["source"], c["target"], c["backend"], c["generation"], c["motion"]) for c in cells}
    assert named == {("default", "tri_head", "fmc", g, m) for g in (1, 2) for m in ("open_jaw=500", "31=100")}
    assert all(c["fp_error"] < 0.01 and c["flips"] < 1.0 for c in cells)
    means = {m["generation"]: m for m in grid[0]["means"]}
    assert means[1]["fp_error"] == pytest.approx(np.mean([c["fp_error"] for c in cells if c["generation"] == 1]))


def test_a_clone_of_a_clones_clone_stays_near_the_first(grid: tuple[dict[str, Any], Path]) -> None:
    drifts = {c["generation"]: c["drift"] for c in grid[0]["cells"]}
    assert drifts[1] is None
    assert 0.0 < drifts[2] < 0.15


def test_the_picture_holds_a_grid_for_each_motion(grid: tuple[dict[str, Any], Path]) -> None:
    """The source's own column is the source itself, bit by bit, in every generation."""
    image = np.asarray(Image.open(grid[1]))
    face = read_face("default")
    figure = Figure.of_face(face)
    for value in ({3: 500.0}, {31: 100.0}):
        pose = Player(face).pose(value)
        own = figure.draw(pose.world_shapes(), (60, 72), figure.camera, make_renderer())
        windows = np.lib.stride_tricks.sliding_window_view(image[:, -74:-14], own.shape, axis=(0, 1, 2))[:, 0, 0]  # type: ignore[call-overload]
        assert (windows == own).all(axis=(1, 2, 3)).sum() == 2


@pytest.mark.parametrize(
    ("words", "targets"),
    [
        (("a", "--targets", "b", "c", "-o", "x"), ["b", "c"]),
        (("a", "--targets=b", "c", "-o", "x"), ["b", "c"]),
        (("--targets", "b", "-o", "x", "a"), ["b"]),
        (("a", "-o", "x", "--targets"), None),
        (("a", "--targets", "-o", "x"), None),
    ],
)
def test_as_many_targets_as_follow(words: tuple[str, ...], targets: list[str] | None) -> None:
    app = typer.Typer()

    @app.command(cls=Spread)
    def show(
        sources: list[str],
        targets: Annotated[list[str] | None, typer.Option()] = None,
        output: Annotated[str, typer.Option("-o")] = "",
    ) -> None:
        typer.echo(json.dumps([sources, targets, output]))

    result = CliRunner().invoke(app, words)
    if targets is None:
        assert result.exit_code == Outcome.USAGE
        assert "--targets" in result.output
    else:
        assert json.loads(result.output) == [["a"], targets, "x"]


def test_a_pair_that_cannot_be_cloned_is_a_finding(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise LandmarkError("no face was found in it")

    monkeypatch.setattr("studio.comparing.clone", refuse)
    words = (
        "--targets",
        HEAD,
        "default",
        "-o",
        tmp_path / "g.png",
        "--motion",
        "open_jaw",
        "--generations",
        2,
        "--json",
    )
    result = fba("compare", "default", *words)
    assert result.exit_code == Outcome.FINDINGS, result.output
    found = json.loads(result.stdout)
    assert found["cells"] == found["means"] == []
    assert [(f["where"], f["message"]) for f in found["findings"]] == [
        ("default onto tri_head, fit", "no face was found in it")
    ]
    assert (tmp_path / "g.png").exists()


def test_a_published_backend_finds_points_in_its_own_way() -> None:
    given = read_model(str(HEAD))
    found = replace(given, found=True)
    assert given.points is not None
    assert given.points_for(Way("dt", as_published=True)) is given.points
    assert found.points_for(Way("dt", as_published=True)) is None
    assert found.points_for(Way("dt")) is found.points_for(Way("vtc", as_published=True)) is given.points


def test_files_of_one_name_are_told_apart(tmp_path: Path) -> None:
    paths = [tmp_path / folder / "head.obj" for folder in "ab"]
    for path in paths:
        path.parent.mkdir()
        path.write_bytes(HEAD.read_bytes())
        path.with_suffix(".fps.json").write_bytes(HEAD.with_suffix(".fps.json").read_bytes())
    models, findings = read_models(["default", *map(str, paths)])
    assert [model.name for model in models.values()] == ["default", "a/head", "b/head"]
    assert findings == []


def test_a_face_that_cannot_be_used_does_not_lose_the_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file without a mesh, and one without a face; each is told once. The source stands in a column of its own."""
    (tmp_path / "empty.obj").write_text("no mesh")
    (tmp_path / "box.obj").write_text(
        "\n".join([f"v {x} {y} {z}" for x in (0, 1) for y in (0, 1) for z in (0, 1)] + ["f 1 2 4 3", "f 5 6 8 7"])
    )

    def nothing(*_: object) -> None:
        raise LandmarkError("no face was found in it")

    monkeypatch.setattr("studio.compared_faces.detect_points", nothing)
    bad = [tmp_path / "empty.obj", tmp_path / "box.obj"]
    words = ("--targets", *bad, HEAD, "-o", tmp_path / "g.png", "--motion", "open_jaw", "--backends", "fmc")
    result = fba("compare", "default", *words, "--cell", 60, "--json")
    assert result.exit_code == Outcome.FINDINGS, result.output
    found = json.loads(result.stdout)
    assert [c["target"] for c in found["cells"]] == ["tri_head"]
    assert [(f["code"], f["where"]) for f in found["findings"]] == [("left-out", str(path)) for path in bad]
    image = np.asarray(Image.open(tmp_path / "g.png"))
    face = read_face("default")
    figure = Figure.of_face(face)
    for value in ({}, {3: amplitudes()[3].positive}):
        own = figure.draw(Player(face).pose(value).world_shapes(), (60, 72), figure.camera, make_renderer())
        windows = np.lib.stride_tricks.sliding_window_view(image[:, -140:-80], own.shape, axis=(0, 1, 2))[:, 0, 0]  # type: ignore[call-overload]
        assert (windows == own).all(axis=(1, 2, 3)).sum() == 1


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("default", "-o", "g.png"), Outcome.USAGE, "--targets"),
        (("default", "--targets", HEAD, "-o", "g.jpg"), Outcome.USAGE, "a .png"),
        (("default", "--targets", HEAD, "-o", "g.png", "--backends", "fit,magic"), Outcome.USAGE, "backend 'magic'"),
        (("default", "--targets", HEAD, "-o", "g.png", "--motion", "smirk"), Outcome.BAD_INPUT, "'smirk' is no motion"),
        (("default", "--targets", "no.obj", "-o", "g.png"), Outcome.BAD_INPUT, "no.obj"),
    ],
)
def test_wrong_use_says_what_to_do(tmp_path: Path, words: tuple[object, ...], code: int, said: str) -> None:
    result = fba("compare", *(tmp_path / w if str(w).startswith("g.") else w for w in words))
    assert result.exit_code == code, result.output
    assert said in result.stderr
    assert list(tmp_path.iterdir()) == []
