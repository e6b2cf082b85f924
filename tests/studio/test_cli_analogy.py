"""``fba analogy``: pictures and points from files."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from photo_faces import SIZE, picture, pixels, points, wrinkle
from PIL import Image
from typer.testing import CliRunner, Result

from formats.picture_points import read_picture_points, write_picture_points
from studio.cli.app import app
from studio.cli.doctor import detector_check
from studio.cli.outcome import Outcome
from studio.picture_points import template_points

SMILE = {"8.3": (0.1, -0.1), "8.4": (-0.1, -0.1)}


def fba(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three pictures and one file of their points."""
    faces = {"s": picture(pixels()), "e": picture(wrinkle(pixels()), SMILE), "t": picture(pixels(0.9, seed=5))}
    for name, face in faces.items():
        Image.fromarray(face.rgb).save(tmp_path / f"{name}.png")
    sizes = {f"{name}.png": SIZE for name in faces}
    write_picture_points(tmp_path / "points.json", {f"{n}.png": dict(f.points) for n, f in faces.items()}, sizes)
    return tmp_path


def words(folder: Path, *more: object) -> list[object]:
    return [*(folder / f"{name}.png" for name in "set"), *more]


def pixels_of(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path))


def test_a_picture_is_written_and_its_background_is_that_of_the_target(folder: Path) -> None:
    out = folder / "out.png"
    result = fba("analogy", *words(folder, "-o", out, "--landmarks", folder / "points.json", "--json"))
    assert result.exit_code == Outcome.OK, result.output
    (row,) = json.loads(result.stdout)["pictures"]
    target, made = pixels_of(folder / "t.png"), pixels_of(out)
    differs = (made != target).any(axis=2)
    assert 100 < differs.sum() <= row["changed_pixels"]
    assert not differs[:15].any()
    assert made.shape == target.shape
    other = folder / "eri.png"
    assert (
        fba("analogy", *words(folder, "-o", other, "--landmarks", folder / "points.json", "--method", "eri")).exit_code
        == 0
    )
    assert (pixels_of(other) != made).any()


def test_a_folder_of_expressions_becomes_a_folder_of_pictures(folder: Path) -> None:
    poses = folder / "poses"
    poses.mkdir()
    for name, moves in (("a", None), ("b", SMILE)):
        Image.fromarray(picture(wrinkle(pixels())).rgb).save(poses / f"{name}.png")
        write_picture_points(poses / f"{name}.points.json", {f"{name}.png": points(moves)}, {f"{name}.png": SIZE})
    out = folder / "made"
    result = fba("analogy", folder / "s.png", poses, folder / "t.png", "-o", out, "--landmarks", folder / "points.json")
    assert result.exit_code == Outcome.OK, result.output
    assert sorted(p.name for p in out.iterdir()) == ["a.png", "b.png"]
    assert fba("analogy", folder / "s.png", poses, folder / "t.png", "-o", folder / "x.png").exit_code == Outcome.USAGE


def test_a_template_lies_on_the_points_already_known(folder: Path) -> None:
    known = {name: points()[name] for name in ("3.7", "3.12", "8.1")}
    laid = template_points(SIZE, known)
    assert {name: laid[name] for name in known} == known
    assert laid["2.1"][1] > laid["8.2"][1] > laid["9.3"][1] > laid["3.5"][1]
    assert laid["3.5"][0] > laid["3.6"][0]
    guess = template_points((200, 300), {})
    assert all(0 <= x < 200 and 0 <= y < 300 for x, y in guess.values())
    write = folder / "template.json"
    result = fba("analogy", *words(folder, "--template", write))
    assert result.exit_code == Outcome.OK, result.output
    assert pixels_of(write.with_suffix(".png")).shape[0] == 700
    found = read_picture_points(write, {"s.png": SIZE, "t.png": SIZE})
    assert {"2.1", "3.7", "8.4", "11.1"} <= set(found["s.png"])
    assert fba("analogy", *words(folder, "-o", folder / "out.png", "--landmarks", write)).exit_code == Outcome.OK


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"points": {"8.3": [1, 2, 3]}}, "two numbers"),
        ({"points": {"8.3": [1, float("nan")]}}, "two numbers"),
        ({"points": {"8.3": [500, 2]}}, "outside its picture"),
        ({"points": {"8.3": [50, 60]}}, "are missing"),
        ({"size": [7, 7], "points": {}}, "another copy|this copy"),
        ([], "must be an object"),
    ],
)
def test_wrong_points_are_named(folder: Path, change: object, said: str) -> None:
    document = json.loads((folder / "points.json").read_text())
    document["pictures"]["t.png"] = change
    (folder / "points.json").write_text(json.dumps(document))
    result = fba("analogy", *words(folder, "-o", folder / "out.png", "--landmarks", folder / "points.json"))
    assert result.exit_code == Outcome.BAD_INPUT
    assert any(part in result.stderr for part in said.split("|"))
    assert not (folder / "out.png").exists()


def test_wrong_calls_are_refused(folder: Path) -> None:
    listed = ("--landmarks", folder / "points.json")
    assert fba("analogy", *words(folder)).exit_code == Outcome.USAGE
    assert fba("analogy", *words(folder, "-o", folder / "out.jpg", *listed)).exit_code == Outcome.USAGE
    assert fba("analogy", *words(folder, "-o", folder / "t.png", *listed)).exit_code == Outcome.USAGE
    bare = fba("analogy", *words(folder, "-o", folder / "out.png"))
    assert bare.exit_code == Outcome.BAD_INPUT
    assert "--template" in bare.stderr
    (folder / "t.png").write_bytes(b"no picture")
    broken = fba("analogy", *words(folder, "-o", folder / "out.png", *listed))
    assert broken.exit_code == Outcome.BAD_INPUT
    assert "no picture that can be read" in broken.stderr


def test_a_detector_that_is_not_there_says_what_to_install(folder: Path) -> None:
    for python in (str(folder / "nothing"), sys.executable):
        result = fba("analogy", *words(folder, "-o", folder / "out.png", "--detector", python))
        assert result.exit_code == Outcome.BAD_INPUT
        assert "mediapipe==0.10.21" in result.stderr


def test_a_detector_answers_with_places_of_the_face_mesh(folder: Path) -> None:
    """Any program that prints a face mesh will do."""
    script = folder / "detector"
    mesh = [[3.0 + 0.2 * i, 4.0 + 0.25 * i] for i in range(468)]
    script.write_text(f"#!{sys.executable}\nimport json, sys\nprint(json.dumps([{mesh}] * (len(sys.argv) - 2)))\n")
    script.chmod(0o755)
    write = folder / "found.json"
    result = fba("analogy", *words(folder, "--template", write, "--detector", script))
    assert result.exit_code == Outcome.OK, result.output
    found = read_picture_points(write, {"s.png": SIZE})["s.png"]
    assert found["8.3"] == pytest.approx((3.0 + 0.2 * 291, 4.0 + 0.25 * 291), abs=0.01)
    script.write_text(f"#!{sys.executable}\nimport json, sys\nprint(json.dumps([[]] * (len(sys.argv) - 2)))\n")
    assert "finds no face" in fba("analogy", *words(folder, "--template", write, "--detector", script)).stderr


def test_pictures_that_do_not_go_together_are_found(folder: Path) -> None:
    listed = ("--landmarks", folder / "points.json", "--json")
    (alike,) = json.loads(fba("analogy", *words(folder, "-o", folder / "out.png", *listed)).stdout)["pictures"]
    assert alike["findings"] == []
    Image.fromarray(picture(wrinkle(pixels(1.5)), SMILE).rgb).save(folder / "e.png")
    document = json.loads((folder / "points.json").read_text())
    document["pictures"]["e.png"]["points"]["3.7"][0] -= 12.0
    (folder / "points.json").write_text(json.dumps(document))
    (row,) = json.loads(fba("analogy", *words(folder, "-o", folder / "out.png", *listed)).stdout)["pictures"]
    turned, relit = row["findings"]
    assert "turned" in turned
    assert "light" in relit
    said = fba("analogy", *words(folder, "-o", folder / "out.png", *listed[:2])).stdout
    assert said.count("warning:") == 2


def test_the_paper_knows_no_guard_against_texture(folder: Path) -> None:
    listed = ("--landmarks", folder / "points.json")
    for name, more in (("guarded", ()), ("published", ("--as-published",))):
        result = fba("analogy", *words(folder, "-o", folder / f"{name}.png", *listed, *more))
        assert result.exit_code == Outcome.OK, result.output
    assert (pixels_of(folder / "guarded.png") != pixels_of(folder / "published.png")).any()


@pytest.mark.parametrize("detector", ["", "nowhere", "there"])
def test_the_doctor_knows_the_detector(folder: Path, monkeypatch: pytest.MonkeyPatch, detector: str) -> None:
    (folder / "there").write_text("#!/bin/sh\necho 0.10.21\n")
    (folder / "there").chmod(0o755)
    monkeypatch.setenv("FBA_DETECTOR", str(folder / detector) if detector else "")
    found = detector_check()
    assert found.ok == (detector == "there")
    assert ("0.10.21" if found.ok else "pip install mediapipe==0.10.21") in found.detail
    assert not found.needed
