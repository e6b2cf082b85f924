"""``fba landmarks``, and ``fba clone`` without any landmarks."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from PIL import Image
from typer.testing import CliRunner, Result

from formats import read_face, read_scene
from formats.landmarks import read_landmarks
from samples import sample
from studio.cli.app import app
from studio.cli.outcome import Outcome
from studio.landmark_sheet import point_color


def fba(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture(scope="module")
def head(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A head with no landmark file beside it."""
    return Path(shutil.copy(sample("faces/tri_head.obj"), tmp_path_factory.mktemp("head") / "head.obj"))


def test_landmarks_are_written_with_confidence_and_drawn(head: Path) -> None:
    out, picture = head.with_name("points.json"), head.with_name("points.png")
    result = fba("landmarks", head, "-o", out, "--sheet", picture, "--json")
    assert result.exit_code == Outcome.OK, result.output
    points = read_landmarks(out, read_scene(head))
    assert {"2.1", "2.2", "3.5", "3.7", "8.4", "9.3", "9.11", "6.1"} <= set(points)
    document = json.loads(result.stdout)
    assert {key: entry["confidence"] for key, entry in document["points"].items()} == {
        key: p.confidence for key, p in points.items()
    }
    assert {"detected-points"} <= {f["code"] for f in document["findings"]}
    image = Image.open(picture).convert("RGB")
    seen = {color for _, color in image.getcolors(1 << 24)}
    assert point_color(points["9.3"]) in seen


def test_clone_needs_no_landmarks(head: Path) -> None:
    out, report = head.with_suffix(".wrl"), head.with_name("report.json")
    result = fba("clone", head, "-o", out, "--faps", "3,19", "--report", report)
    assert result.exit_code == Outcome.OK, result.output
    assert {t.fap_id for t in read_face(out).tables} == {3, 19}
    document = json.loads(report.read_text())
    said = {f["code"]: f["message"] for f in document["findings"]}
    assert "mean confidence" in said["detected-points"]
    assert document["timings"]["landmarks"] > 0.0


def test_a_file_without_a_face_is_refused_once(tmp_path: Path) -> None:
    cube = tmp_path / "cube.obj"
    corners = [f"v {x} {y} {z}" for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    faces = ("1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4")
    cube.write_text("\n".join([*corners, *(f"f {f}" for f in faces)]) + "\n")
    out = tmp_path / "points.json"
    result = fba("landmarks", cube, "-o", out)
    assert result.exit_code == Outcome.BAD_INPUT
    assert result.output.count("no face was found") == 1
    assert not out.exists()
    assert fba("landmarks", cube, "-o", tmp_path / "p.json", "--detector", "magic").exit_code == Outcome.USAGE
