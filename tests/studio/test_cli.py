"""The command line: what it does, what it prints, how it ends."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import resource
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from fat import AnimatableFace, FaceDefTables
from fat.open_jaw import open_jaw_mode
from fba import FapStream
from formats import read, read_face, read_scene, write
from formats.fap import write_fap
from formats.shapes import read_shapes
from formats.usd import read_shape_set
from samples import sample
from studio.cli.app import app
from studio.cli.arguments import parse_faps
from studio.cli.console import print_json
from studio.cli.outcome import Outcome

VERBS = (
    "demo",
    "inspect",
    "landmarks",
    "clone",
    "author",
    "export",
    "convert",
    "play",
    "check",
    "analogy",
    "doctor",
)


def fba(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def refused(result: Result, *said: str) -> None:
    """The command ended with exit code 3 and one message that says all of this."""
    assert result.exit_code == Outcome.BAD_INPUT, result.output
    assert result.exception is None or isinstance(result.exception, SystemExit)
    lines = [line for line in result.stderr.splitlines() if line.strip()]
    assert len(lines) == 1, result.stderr
    assert lines[0].startswith("fba: error: ")
    for words in said:
        assert words in lines[0]


@pytest.fixture(scope="session")
def cloned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The shipped triangle head made animatable through the command line."""
    path = tmp_path_factory.mktemp("cli") / "tri.wrl"
    result = fba("clone", sample("faces/tri_head.obj"), "-o", path, "--report", path.with_suffix(".json"))
    assert result.exit_code == 0, result.output
    return path


def test_help_of_every_verb() -> None:
    assert fba("--help").exit_code == 0
    for verb in VERBS:
        result = fba(verb, "--help")
        assert result.exit_code == 0
        assert verb in result.stdout


def test_version_is_that_of_the_package() -> None:
    assert re.fullmatch(r"fba-toolkit \d+\.\d+\.\d+\n", fba("--version").stdout)


def test_unknown_words_are_a_usage_error() -> None:
    assert fba("fly").exit_code == Outcome.USAGE
    assert fba("clone").exit_code == Outcome.USAGE
    assert fba("clone", "a.obj", "-o", "b.wrl", "--faps", "3,99").exit_code == Outcome.USAGE
    assert fba("clone", "a.obj", "-o", "b.wrl", "--backend", "magic").exit_code == Outcome.USAGE


def test_fap_lists() -> None:
    assert parse_faps("3,12-14,open_jaw,19") == (3, 12, 13, 14, 19)
    for wrong in ("0", "69", "jaw_open", "5-", "3;4", "", ",", "20-3"):
        with pytest.raises(ValueError, match=r"FAP"):
            parse_faps(wrong)


def test_clone_keeps_the_mesh_and_reports(cloned: Path) -> None:
    face = read_face(cloned)
    head = read_scene(sample("faces/tri_head.obj"))
    np.testing.assert_array_equal(face.scene.world_neutral(), head.world_neutral())
    assert sum(s.mesh.face_count for s in face.scene.shapes) == sum(s.mesh.face_count for s in head.shapes)
    report = json.loads(cloned.with_suffix(".json").read_text())
    assert report["backend"] == "fit"
    assert report["timings"]


def test_clone_only_some_faps(tmp_path: Path) -> None:
    out = tmp_path / "some.usda"
    assert fba("clone", sample("faces/tri_head.obj"), "-o", out, "--faps", "3,19-20").exit_code == 0
    assert [t.fap_id for t in read_face(out).tables] == [3, 19, 20]


def test_check_passes_on_a_clone_and_prints_json(cloned: Path) -> None:
    result = fba("check", cloned, "--source", "default", "--json")
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    assert document["passed"] is True
    assert document["faps"]


def test_inspect_says_what_a_face_can_play(cloned: Path) -> None:
    result = fba("inspect", cloned, "--json")
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    assert 3 in document["tables"]["faps"]
    assert document["fapu"]["ES0"] > 0
    assert "plays:" in fba("inspect", cloned).stdout


def test_inspect_a_plain_mesh_and_a_stream() -> None:
    document = json.loads(fba("inspect", sample("faces/tri_head.obj"), "--json").stdout)
    assert document["kind"].startswith("plain mesh")
    assert json.loads(fba("inspect", sample("streams/demo.fap"), "--json").stdout)["frames"] > 50


def test_inspect_names_the_morph_targets_of_a_gltf(shared: Path) -> None:
    path = shared / "faces" / "rpm-brunette" / "brunette-t.glb"
    assert len(json.loads(fba("inspect", path, "--json").stdout)["morph_targets"]) == 67
    assert "67 morph targets: " in fba("inspect", path).stdout


def test_play_writes_vertices_in_the_files_own_order(cloned: Path, tmp_path: Path) -> None:
    out = tmp_path / "played.npz"
    assert fba("play", cloned, "demo", "-o", out).exit_code == 0
    with np.load(out) as played:
        neutral, vertices, rate = played["neutral"], played["vertices"], float(played["fps"])
    head = read_scene(sample("faces/tri_head.obj"))
    np.testing.assert_array_equal(neutral, head.world_neutral())
    assert vertices.shape[1:] == neutral.shape
    assert rate == 25
    assert np.abs(vertices - neutral).max() > 0


def test_play_holds_values_on_request(cloned: Path, tmp_path: Path) -> None:
    stream = FapStream.build(25.0, 2, {3: [500, 0]})
    mask = stream.mask.copy()
    mask[1] = False
    write_fap(replace(stream, mask=mask), tmp_path / "gap.fap")
    moved = []
    for words in ((), ("--hold",)):
        assert fba("play", cloned, tmp_path / "gap.fap", "-o", tmp_path / "o.npz", *words).exit_code == 0
        with np.load(tmp_path / "o.npz") as played:
            moved.append(np.abs(played["vertices"] - played["neutral"]).max(axis=(1, 2)))
    assert moved[0][0] > 0
    assert moved[0][1] == 0
    assert moved[1][1] == moved[1][0]


def test_play_combines_faps_by_rules_that_can_be_switched_off(tmp_path: Path) -> None:
    write_fap(FapStream.build(25.0, 2, {12: [300, 300], 59: [0, 300]}), tmp_path / "corner.fap")
    moved = {}
    for rules in ("all", "none", "lids", "corners,lips"):
        words = ("play", "default", tmp_path / "corner.fap", "-o", tmp_path / "o.npz", "--rules", rules)
        assert fba(*words).exit_code == 0
        with np.load(tmp_path / "o.npz") as played:
            moved[rules] = np.abs(played["vertices"] - played["neutral"]).max(axis=(1, 2))
    for rules, doubled in (("all", False), ("none", True), ("lids", True), ("corners,lips", False)):
        once, both = moved[rules]
        assert once == moved["none"][0]
        assert (both > 1.5 * once) is np.bool_(doubled)
    for wrong in ("corner", "", "none,lids"):
        result = fba("play", "default", "demo", "-o", tmp_path / "p.npz", "--rules", wrong)
        assert result.exit_code == Outcome.USAGE
        assert "--rules" in result.stderr
    assert not (tmp_path / "p.npz").exists()


def test_play_draws(cloned: Path, tmp_path: Path) -> None:
    from PIL import Image

    short = tmp_path / "short.fap"
    jaw = [100, 300, 500]
    write_fap(FapStream.build(25.0, 3, {3: jaw}), short)
    out = tmp_path / "short.gif"
    result = fba("play", cloned, short, "-o", out, "--size", "64")
    assert result.exit_code == 0, result.output
    with Image.open(out) as picture:
        assert picture.n_frames == 3
    folder = tmp_path / "frames"
    assert fba("play", cloned, short, "-o", folder, "--size", "64").exit_code == 0
    assert len(list(folder.glob("*.png"))) == 3


def test_open_jaw_strict_on_request(cloned: Path, tmp_path: Path) -> None:
    out = tmp_path / "strict.usda"
    assert fba("export", cloned, "-o", out, "--open-jaw", "strict").exit_code == 0
    about = json.loads(fba("inspect", out, "--json").stdout)
    assert (about["open_jaw"], about["notes"]["open_jaw"]) == ("strict", "strict")
    assert json.loads(fba("inspect", cloned, "--json").stdout)["open_jaw"] == "practical"
    assert "open_jaw: strict: the lips stay" in fba("inspect", out).stdout
    back = fba("export", out, "-o", tmp_path / "back.wrl", "--open-jaw", "practical")
    assert back.exit_code == Outcome.BAD_INPUT
    assert "start from a practical source" in back.stderr
    plain = fba("export", sample("faces/tri_head.obj"), "-o", tmp_path / "plain.wrl", "--open-jaw", "strict")
    assert plain.exit_code == Outcome.USAGE
    shapes = fba("export", cloned, "-o", tmp_path / "s.npz", "--profile", "arkit", "--open-jaw", "strict")
    assert shapes.exit_code == Outcome.USAGE


def test_clone_with_a_strict_jaw(tmp_path: Path) -> None:
    out = tmp_path / "strict.wrl"
    words = ("clone", sample("faces/tri_head.obj"), "-o", out, "--faps", "3", "--open-jaw", "strict")
    result = fba(*words)
    assert result.exit_code == 0
    assert "the FAPs that open them are missing: 5 raise_b_midlip" in result.stdout
    assert open_jaw_mode(read_face(out)) == "strict"
    no_jaw = fba("clone", sample("faces/tri_head.obj"), "-o", out, "--faps", "5", "--open-jaw", "strict")
    assert no_jaw.exit_code == Outcome.BAD_INPUT
    assert "no table for FAP 3" in no_jaw.stderr


def test_inspect_says_when_a_file_is_wrong_about_its_jaw(cloned: Path, tmp_path: Path) -> None:
    face = read_face(cloned)
    write(replace(face, notes={**face.notes, "open_jaw": "strict"}), tmp_path / "wrong.wrl")
    found = json.loads(fba("inspect", tmp_path / "wrong.wrl", "--json").stdout)["findings"]
    (finding,) = [f for f in found if f["code"] == "open-jaw"]
    assert "by its tables it is practical" in finding["message"]


def test_export_to_every_format_and_back(cloned: Path, tmp_path: Path) -> None:
    before = read_face(cloned)
    for name in ("a.usda", "a.usdc", "a.bt", "a.wrl.gz"):
        out = tmp_path / name
        assert fba("export", cloned, "-o", out).exit_code == 0
        after = read_face(out)
        assert [t.key for t in after.tables] == [t.key for t in before.tables]
    out = tmp_path / "a.obj"
    result = fba("export", cloned, "-o", out)
    assert result.exit_code == 0
    assert "neutral mesh only" in result.stdout
    np.testing.assert_array_equal(
        read_scene(out).world_neutral(), read_scene(sample("faces/tri_head.obj")).world_neutral()
    )


def test_doctor_finds_the_shipped_face() -> None:
    document = json.loads(fba("doctor", "--json").stdout)
    found = {c["name"]: c["ok"] for c in document["checks"]}
    assert found["shipped source face"]
    assert found["compiled loops"] == (importlib.util.find_spec("numba") is not None)


@pytest.mark.parametrize("name", ["out.npz", "out", "out.usda"])
def test_free_shapes(tmp_path: Path, name: str) -> None:
    head = read_scene(sample("faces/tri_head.obj"))
    neutral = head.world_neutral()
    up = np.zeros((1, *neutral.shape))
    nose = neutral[neutral[:, 2].argmax()]
    up[0, :, 1] = np.exp(-(((neutral - nose) / 2.0) ** 2).sum(axis=1))
    up[np.abs(up) < 1e-3] = 0.0
    np.savez(tmp_path / "in.npz", names=np.array(["nose lift"]), deltas=up, neutral=neutral)
    out = tmp_path / name
    result = fba(
        *("clone", sample("faces/closed_head.obj"), "-o", out),
        *("--source", sample("faces/tri_head.obj"), "--shapes", tmp_path / "in.npz"),
    )
    assert result.exit_code == 0, result.output
    target = read_scene(sample("faces/closed_head.obj"))
    made = read_shape_set(out) if name.endswith(".usda") else read_shapes(out, target)
    assert made is not None
    assert list(made.names) == ["nose lift"]
    np.testing.assert_array_equal(made.neutral, target.world_neutral())
    lifted = np.linalg.norm(made.deltas[0], axis=1)
    nose = target.world_neutral()[:, 2].argmax()
    assert lifted[nose] > 0.8 * lifted.max()
    assert (lifted == 0).mean() > 0.5


# Bad input: one clear message, exit code 3, and nothing lost.


def test_missing_and_empty_files(tmp_path: Path) -> None:
    refused(fba("inspect", tmp_path / "none.obj"), "none.obj", "does not exist")
    empty = tmp_path / "empty.obj"
    empty.write_bytes(b"")
    refused(fba("clone", empty, "-o", tmp_path / "out.wrl"), "empty.obj", "empty")


@pytest.mark.parametrize("name", ["text.obj", "text.ply", "text.stl", "text.off", "text.glb", "text.wrl", "text.usda"])
def test_not_a_mesh(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_text("Dear diary, today I met a face.\nIt did not move.\n")
    refused(fba("inspect", path), name)


def test_unknown_kind_of_file(tmp_path: Path) -> None:
    path = tmp_path / "face.xyz"
    path.write_text("0 0 0")
    refused(fba("inspect", path), "face.xyz", "known extensions")


def test_a_mesh_without_a_face(tmp_path: Path) -> None:
    lonely = tmp_path / "lonely.obj"
    lonely.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    refused(fba("clone", lonely, "-o", tmp_path / "out.wrl"), "no face was found", "Give the feature points")
    assert not (tmp_path / "out.wrl").exists()


def _points() -> dict[str, dict[str, object]]:
    return json.loads(sample("faces/tri_head.fps.json").read_text())["points"]


def _with_points(tmp_path: Path, points: dict[str, dict[str, object]]) -> Result:
    path = tmp_path / "points.json"
    path.write_text(json.dumps({"format": "fba-landmarks/1", "points": points}))
    return fba("clone", sample("faces/tri_head.obj"), "-o", tmp_path / "out.wrl", "--landmarks", path)


def test_feature_points_off_the_surface(tmp_path: Path) -> None:
    points = _points()
    points["9.3"] = {"position": [0.0, 0.0, 1000.0]}
    refused(_with_points(tmp_path, points), "9.3", "surface")


def test_feature_points_swapped_left_and_right(tmp_path: Path) -> None:
    from fba import feature_point_definitions

    points = _points()
    mirror = {i: d.counterpart for i, d in feature_point_definitions().items() if d.counterpart}
    refused(_with_points(tmp_path, {mirror.get(i, i): p for i, p in points.items()}), "left", "right")


def test_feature_points_that_are_not_there(tmp_path: Path) -> None:
    refused(_with_points(tmp_path, {**_points(), "9.3": {"vertex": 10**9}}), "9.3")
    refused(_with_points(tmp_path, {**_points(), "99.1": {"vertex": 1}}), "99.1")
    broken = tmp_path / "broken.json"
    broken.write_text('{"format": "fba-landmarks/1", "points": {')
    refused(fba("clone", sample("faces/tri_head.obj"), "-o", tmp_path / "o.wrl", "--landmarks", broken), "broken.json")


def test_vertices_that_are_not_numbers(tmp_path: Path) -> None:
    path = tmp_path / "nan.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n")
    refused(fba("inspect", path), "nan.obj")


def test_tables_whose_indices_exceed_the_mesh(cloned: Path, tmp_path: Path) -> None:
    text = cloned.read_text()
    place = re.search(r"FaceDefMesh\s*\{[^}]*?coordIndex\s*\[\s*(\d+)", text)
    assert place is not None
    path = tmp_path / "beyond.wrl"
    path.write_text(text[: place.start(1)] + "99999999" + text[place.end(1) :])
    for words in (("check", path), ("play", path, "demo", "-o", tmp_path / "o.npz")):
        result = fba(*words)
        assert result.exit_code in (Outcome.FINDINGS, Outcome.BAD_INPUT)
        assert "99999999" in result.output
    assert not (tmp_path / "o.npz").exists()


def test_a_stream_cut_in_the_middle(cloned: Path, tmp_path: Path) -> None:
    data = sample("streams/demo.fap").read_bytes()
    path = tmp_path / "cut.fap"
    path.write_bytes(data[: len(data) // 2].rstrip(b"0123456789 \n") + b" 1 2")
    refused(fba("play", cloned, path, "-o", tmp_path / "o.npz"), "cut.fap", "line")


def test_output_that_cannot_be_written(cloned: Path, tmp_path: Path) -> None:
    for name in ("o.wrl", "o.usda", "o.obj", "o.bt"):
        refused(fba("export", cloned, "-o", tmp_path / "no_such_folder" / name), "cannot write")
    refused(fba("play", cloned, "demo", "-o", tmp_path / "no_such_folder" / "o.npz"), "cannot write")
    taken = tmp_path / "taken.wrl"
    taken.mkdir()
    refused(fba("export", cloned, "-o", taken), "taken.wrl")
    refused(fba("export", cloned, "-o", tmp_path / "o.xyz"), "o.xyz")


@pytest.mark.parametrize("name", ["o.wrl", "o.usda", "o.usdc", "o.bt", "o.obj", "o.npz", "o.gif"])
def test_a_full_disk_leaves_the_old_file(cloned: Path, tmp_path: Path, name: str) -> None:
    """A limit on the size of files stands in for the full disk."""
    out = tmp_path / name
    out.write_text("precious")

    def small_files() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))

    verb = ["play", str(cloned), "demo"] if name.endswith((".npz", ".gif")) else ["export", str(cloned)]
    done = subprocess.run(
        [sys.executable, "-m", "studio.cli", *verb, "-o", str(out)],
        capture_output=True,
        text=True,
        preexec_fn=small_files,
        check=False,
    )
    assert done.returncode == Outcome.BAD_INPUT, done.stderr
    assert "Traceback" not in done.stderr
    assert name in done.stderr
    assert out.read_text() == "precious"
    assert [p.name for p in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("verb", [("inspect", "default"), ("inspect", "default", "--json"), ("doctor", "--json")])
def test_a_reader_that_goes_away_ends_the_command_quietly(verb: tuple[str, ...]) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [sys.executable, "-m", "studio.cli", *verb], stdout=writing, stderr=subprocess.PIPE, check=False
    )
    os.close(writing)
    assert done.returncode == Outcome.READER_GONE
    assert done.stderr == b""


def test_output_that_standard_output_cannot_take() -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "studio.cli", "inspect", "default"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert done.returncode == Outcome.BAD_INPUT
    assert done.stderr.startswith("fba: error: standard output: ")
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("delay", [0.05, 0.9])
def test_an_interrupt_ends_quietly_and_leaves_nothing(tmp_path: Path, delay: float) -> None:
    # The interpreter's own start-up is over when this line appears; the packages are still to be loaded.
    # A shell starts what runs in the background with interrupts ignored; this program is to have them.
    code = (
        "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
        "from studio.cli import main; print('here', flush=True); main()"
    )
    words = ["clone", str(sample("faces/quad_head.obj")), "-o", str(tmp_path / "o.wrl")]
    with subprocess.Popen(
        [sys.executable, "-c", code, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.readline()
        time.sleep(delay)
        process.send_signal(signal.SIGINT)
        said = process.stderr.read()
    assert process.returncode == Outcome.INTERRUPTED
    assert said == "fba: interrupted\n"
    assert list(tmp_path.iterdir()) == []


def test_brackets_in_names_are_printed_as_they_are(cloned: Path, tmp_path: Path) -> None:
    folder = tmp_path / "a["
    folder.mkdir()
    out = folder / "b]c [i] [" / "red].obj"
    out.parent.mkdir()
    result = fba("export", cloned, "-o", out)
    assert result.exit_code == 0, result.output
    assert str(out) in result.stdout
    assert str(out) in fba("inspect", out).stdout


def test_json_has_no_numbers_that_json_does_not_know(capsys: pytest.CaptureFixture[str]) -> None:
    print_json({"a": [float("nan"), (float("inf"), 1.5)]})
    assert json.loads(capsys.readouterr().out) == {"a": [None, [None, 1.5]]}


def test_faps_that_the_source_cannot_give(tmp_path: Path) -> None:
    face = read_face("default")
    few = FaceDefTables(tuple(t for t in face.tables if t.fap_id in (3, 19)))
    source = tmp_path / "few.wrl"
    write(replace(face, tables=few), source)
    result = fba("clone", sample("faces/tri_head.obj"), "-o", tmp_path / "o.wrl", "--source", source, "--faps", "62-68")
    refused(result, "no motion of these FAPs")
    assert list(tmp_path.iterdir()) == [source]


def test_outputs_that_would_harm_each_other_are_refused_first(tmp_path: Path) -> None:
    head = sample("faces/tri_head.obj")
    before = head.read_bytes()
    for words in (("--report", head), ("--sheet", tmp_path / "s.jpg"), ("--report", tmp_path / "o.wrl")):
        assert fba("clone", head, "-o", tmp_path / "o.wrl", *words).exit_code == Outcome.USAGE
    assert head.read_bytes() == before
    refused(fba("clone", head, "-o", tmp_path / "none" / "o.wrl"), "cannot write", "folder")
    assert fba("clone", head, "-o", tmp_path / "o.wrl", "--shapes", tmp_path).exit_code == Outcome.USAGE
    assert list(tmp_path.iterdir()) == []


def test_a_damaged_face_is_not_exported(cloned: Path, tmp_path: Path) -> None:
    good = tmp_path / "good.usda"
    assert fba("export", cloned, "-o", good).exit_code == 0
    text = good.read_text()
    place = re.search(r"int\[\] pointIndices = \[(\d+)", text)
    assert place is not None
    bad = tmp_path / "bad.usda"
    bad.write_text(text[: place.start(1)] + "9999999" + text[place.end(1) :])
    refused(fba("export", bad, "-o", tmp_path / "o.wrl"), "bad.usda", "coordIndex")
    assert fba("check", bad).exit_code == Outcome.FINDINGS
    assert not (tmp_path / "o.wrl").exists()


def test_textures_come_along_or_are_named(tmp_path: Path) -> None:
    head = tmp_path / "head.wrl"
    head.write_text(
        '#VRML V2.0 utf8\nShape { appearance Appearance { texture ImageTexture { url "skin.png" } } geometry '
        "IndexedFaceSet { coord Coordinate { point [ 0 0 0, 1 0 0, 0 1 0 ] } coordIndex [ 0 1 2 ] } }\n"
    )
    assert "skin.png is not there" in fba("inspect", head).stdout
    (tmp_path / "new").mkdir()
    assert "skin.png: head.wrl names this texture" in fba("export", head, "-o", tmp_path / "new" / "head.usda").stdout
    (tmp_path / "skin.png").write_bytes(b"no image")
    assert "is not there" not in fba("inspect", head).stdout
    assert "PNG or JPEG" in fba("export", head, "-o", tmp_path / "new" / "head.glb").stdout
    (tmp_path / "skin.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    for name in ("new/head.usda", "new/head.glb", "head.usda"):
        assert "warning" not in fba("export", head, "-o", tmp_path / name).stdout
    assert (tmp_path / "new" / "skin.png").read_bytes() == (tmp_path / "skin.png").read_bytes()
    (tmp_path / "new" / "skin.png").unlink()
    assert "skin.png is not there" not in fba("inspect", tmp_path / "new" / "head.glb").stdout


def test_the_word_default_names_the_shipped_source() -> None:
    assert isinstance(read("default"), AnimatableFace)
