"""``fba author`` through the command line: what it writes, prints and refuses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from authoring.jaw import open_jaw
from cloning.prepare import prepare
from fba.shapes import ShapeSet
from formats import read_face, read_scene
from formats.landmarks import landmarks_beside, read_landmarks
from formats.shapes import read_shapes, write_shapes
from formats.usd import write_shape_set
from samples import sample
from studio.cli.app import app
from studio.cli.outcome import Outcome

HEAD = sample("faces/tri_head.obj")


def fba(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture(scope="module")
def shapes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of OBJ with a jaw that opens, once as a unit and once as a shape of a name of its own."""
    scene = read_scene(HEAD)
    beside = landmarks_beside(HEAD)
    assert beside is not None
    face = prepare(scene, read_landmarks(beside, scene), "source")
    opened = open_jaw(face, [800])[800]
    rest = {s.name: np.zeros((s.mesh.vertex_count, 3)) for s in face.scene.shapes}
    delta = face.scene.frame.to_file(face.scene.gather({**rest, **opened}))
    neutral = face.scene.frame.to_file(face.scene.world_neutral())
    made = ShapeSet(("jawOpen", "wide open", "odd one"), neutral, np.stack([delta, delta, 0.1 * delta]))
    folder = tmp_path_factory.mktemp("author") / "shapes"
    write_shapes(made, scene, folder)
    return folder


def test_a_source_from_a_folder_of_shapes(shapes: Path, tmp_path: Path) -> None:
    out, report, sheet = tmp_path / "new.wrl", tmp_path / "new.json", tmp_path / "new.png"
    result = fba("author", HEAD, "--shapes", shapes, "-o", out, "--no-construct", "--report", report, "--sheet", sheet)
    assert result.exit_code == 0, result.output
    assert "'odd one'" in result.stdout
    assert "made of units: open_jaw" in result.stdout
    assert "open_jaw practical" in result.stdout
    face = read_face(out)
    assert face.notes["open_jaw"] == "practical"
    assert face.tables.get(3) is not None
    told = json.loads(report.read_text())
    jaw = next(e for e in told["entries"] if e["name"] == "open_jaw")
    assert {s["how"] for s in jaw["steps"]} == {"units"}
    assert jaw["error"] < 1.0
    assert told["unknown"] == ["odd one", "wide open"]
    assert sheet.read_bytes().startswith(b"\x89PNG")


def test_a_map_names_shapes_and_their_values(shapes: Path, tmp_path: Path) -> None:
    names = tmp_path / "names.toml"
    names.write_text('[shapes."wide open"]\nfap = "open_jaw"\nvalue = 800\n[shapes."odd one"]\nignore = true\n')
    out, report = tmp_path / "new.usdc", tmp_path / "new.json"
    result = fba(
        "author", HEAD, "--shapes", shapes, "-o", out, "--no-construct", "--map", names, "--report", report,
        "--open-jaw", "strict",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    told = json.loads(report.read_text())
    jaw = next(e for e in told["entries"] if e["name"] == "open_jaw")
    assert [(s["value"], s["how"]) for s in jaw["steps"]] == [(800, "given")]
    assert jaw["steps"][0]["parts"]["wide open"] == pytest.approx(1.0, abs=1e-3)
    assert told["open_jaw"] == "strict"
    assert told["ignored"]["odd one"] == "the map says so"


def test_shapes_may_be_usd_and_lie_in_the_neutral_file(shapes: Path, tmp_path: Path) -> None:
    scene = read_scene(HEAD)
    stage = tmp_path / "head.usda"
    found = read_shapes(shapes, scene)
    write_shape_set(scene, found, stage)
    back = read_shapes(stage, read_scene(stage))
    assert back.names == found.names
    assert np.abs(back.deltas - found.deltas).max() < 1e-5 * np.abs(found.neutral).max()
    result = fba("author", stage, "-o", tmp_path / "new.wrl", "--landmarks", landmarks_beside(HEAD), "--no-construct")
    assert result.exit_code == 0, result.output
    assert "made of units: open_jaw" in result.stdout


def test_what_cannot_work_is_refused(shapes: Path, tmp_path: Path) -> None:
    out = tmp_path / "new.wrl"
    assert fba("author", HEAD, "-o", out).exit_code == Outcome.USAGE
    assert fba("author", HEAD, "--shapes", shapes, "-o", tmp_path / "new.obj").exit_code == Outcome.USAGE
    assert fba("author", HEAD, "--shapes", shapes, "-o", out, "--report", out).exit_code == Outcome.USAGE
    names = tmp_path / "names.toml"
    names.write_text("[shapes.jawOpen]\nfap = 99\n")
    result = fba("author", HEAD, "--shapes", shapes, "-o", out, "--map", names)
    assert result.exit_code == Outcome.BAD_INPUT
    assert "names.toml, line 1, shape 'jawOpen'" in result.stderr
    bare = tmp_path / "bare.obj"
    bare.write_bytes(HEAD.read_bytes())
    result = fba("author", bare, "--shapes", shapes, "-o", out)
    assert result.exit_code == Outcome.BAD_INPUT
    assert "--landmarks POINTS.json" in result.stderr
    np.savez(tmp_path / "few.npz", names=np.array(["jawOpen"]), deltas=np.zeros((1, 7, 3)))
    result = fba("author", HEAD, "--shapes", tmp_path / "few.npz", "-o", out)
    assert result.exit_code == Outcome.BAD_INPUT
    assert "has 7 vertices" in result.stderr
    assert not out.exists()
