"""``fba export --profile``: shapes of ARKit, Oculus and VRM on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from faces import small_face
from pxr import Usd, UsdGeom, UsdSkel
from typer.testing import CliRunner, Result

from authoring.open_jaw import strict
from fat.profiles import ARKIT, VRM, profile_shapes
from formats import read_face, read_scene, write
from formats.shapes import read_shapes
from formats.usd import read_shape_set
from formats.usd.validate import validate_stage
from samples import default_source, sample
from studio.cli.app import app
from studio.cli.outcome import Outcome


def fba(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def test_an_npz_holds_the_shapes(tmp_path: Path) -> None:
    out = tmp_path / "arkit.npz"
    result = fba("export", "default", "-o", out, "--profile", "arkit")
    assert result.exit_code == Outcome.OK, result.output
    assert "shapes of the profile 'arkit'" in result.stdout
    face = read_face("default")
    made, _ = profile_shapes(face, "arkit", strict(face))
    found = read_shapes(out, read_scene(default_source()))
    assert found.names == made.names
    assert set(found.names) <= set(ARKIT)
    assert np.array_equal(found.deltas, made.deltas)
    again = tmp_path / "again.npz"
    fba("export", "default", "-o", again, "--profile", "arkit")
    assert again.read_bytes() == out.read_bytes()


def test_a_folder_of_obj_holds_the_shapes(tmp_path: Path) -> None:
    out = tmp_path / "vrm"
    assert fba("export", "default", "-o", out, "--profile", "vrm").exit_code == Outcome.OK
    assert {file.stem for file in out.glob("*.obj")} == set(VRM)
    found = read_shapes(out, read_scene(default_source()))
    made, _ = profile_shapes(read_face("default"), "vrm")
    blink = made.deltas[made.names.index("blink")]
    assert np.allclose(found.deltas[found.names.index("blink")], blink, rtol=0, atol=1e-5)


@pytest.mark.parametrize("extension", ["usda", "usdc"])
def test_usd_plays_the_shapes(tmp_path: Path, extension: str) -> None:
    """OpenUSD's own skinning moves the points as the shapes say."""
    out = tmp_path / f"oculus.{extension}"
    assert fba("export", "default", "-o", out, "--profile", "oculus").exit_code == Outcome.OK
    assert [f for f in validate_stage(out) if f.severity == "error"] == []
    made, _ = profile_shapes(read_face("default"), "oculus")
    found = read_shape_set(out)
    assert found is not None
    assert found.names == made.names
    assert np.allclose(found.deltas, made.deltas, rtol=0, atol=1e-6)
    stage = Usd.Stage.Open(str(out))
    skin = next(p for p in stage.Traverse() if p.IsA(UsdGeom.Mesh) and p.GetName() == "skin")
    binding = UsdSkel.BindingAPI(skin)
    query = UsdSkel.BlendShapeQuery(binding)
    weights = [float(token == "viseme_aa") for token in binding.GetBlendShapesAttr().Get()]
    points = UsdGeom.Mesh(skin).GetPointsAttr().Get()
    before = np.array(points)
    assert query.ComputeDeformedPoints(
        *query.ComputeSubShapeWeights(weights),
        query.ComputeBlendShapePointIndices(),
        query.ComputeSubShapePointOffsets(),
        points,
    )
    face = read_face("default")
    order = face.scene.file_order()["skin"]
    assert np.allclose(np.array(points) - before, made.deltas[made.names.index("viseme_aa")][order], rtol=0, atol=1e-5)


def test_gltf_holds_the_shapes(tmp_path: Path) -> None:
    out = tmp_path / "arkit.glb"
    assert fba("export", "default", "-o", out, "--profile", "arkit").exit_code == Outcome.OK
    face = read_face("default")
    made, _ = profile_shapes(face, "arkit", strict(face))
    found = read_shapes(out, read_scene(default_source()))
    assert found.names == made.names
    assert np.allclose(found.deltas, made.deltas, rtol=0, atol=1e-6)


def test_a_stream_becomes_the_animation_of_a_gltf(tmp_path: Path) -> None:
    write(small_face(), tmp_path / "face.wrl")
    result = fba("export", tmp_path / "face.wrl", "-o", tmp_path / "face.gltf", "--stream", "demo")
    assert result.exit_code == Outcome.OK, result.output
    assert "8 tables for 26 vertices, 150 frames at 25/s" in result.stdout
    document = json.loads((tmp_path / "face.gltf").read_text("utf-8"))
    (animation,) = document["animations"]
    assert {c["target"]["path"] for c in animation["channels"]} == {
        "weights",
        "rotation",
        "translation",
    }  # translation: the jaw
    times = document["accessors"][animation["samplers"][0]["input"]]
    assert (times["count"], times["max"]) == (150, [pytest.approx(149 / 25)])
    result = fba("export", tmp_path / "face.wrl", "-o", tmp_path / "face.ply", "--stream", "demo")
    assert result.exit_code == Outcome.BAD_INPUT
    assert "without animation" in result.stderr


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (
            ("default", "-o", "o.npz", "--profile", "talking"),
            Outcome.USAGE,
            "known: native, portable, arkit, oculus, vrm",
        ),
        (("default", "-o", "o.glb", "--profile", "arkit", "--stream", "demo"), Outcome.USAGE, "stay still"),
        (("default", "-o", "o.wrl", "--profile", "arkit"), Outcome.USAGE, "folder of OBJ"),
        (("default", "-o", "none/o.npz", "--profile", "arkit"), Outcome.BAD_INPUT, "there is no folder"),
    ],
)
def test_wrong_use_says_what_to_do(
    words: tuple[str, ...], code: Outcome, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = fba("export", *words)
    assert result.exit_code == code
    assert said in result.stderr
    assert not list(tmp_path.iterdir())


def test_a_plain_mesh_has_no_shapes(tmp_path: Path) -> None:
    result = fba("export", sample("faces/quad_head.obj"), "-o", tmp_path / "o.npz", "--profile", "arkit")
    assert result.exit_code == Outcome.BAD_INPUT
    assert "fba clone" in result.stderr
