"""Independent glTF programs take what the toolkit writes: the Khronos validator, and three.js in headless Chromium."""

from __future__ import annotations

import base64
import io
import json
import subprocess
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import MODULES, open_page, program
from dressed import FULL, IMAGES, SKIN, dressed
from faces import small_face
from PIL import Image

from fat import AnimatableFace, Player
from fat.profiles import profile_shapes
from fba.faps import Unit
from fba.stream import FapStream
from formats import gltf, read_face, write
from formats.fap import read_fap
from samples import sample

pytestmark = pytest.mark.peer

VALIDATE = """
const fs = require("fs"), path = require("path"), validator = require("gltf-validator");
(async () => {
  const found = {};
  for (const file of process.argv.slice(1)) {
    const beside = (uri) => Promise.resolve(new Uint8Array(fs.readFileSync(
      path.join(path.dirname(file), decodeURIComponent(uri)))));
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)),
      { uri: path.basename(file), externalResourceFunction: beside });
    found[path.basename(file)] = { errors: report.issues.numErrors, warnings: report.issues.numWarnings,
      messages: report.issues.messages.filter((m) => m.severity < 2), info: report.info };
  }
  console.log(JSON.stringify(found));
})();
"""

PAGE = """<!DOCTYPE html><html><head><meta charset="utf-8"><script type="importmap">{"imports": {
"three": "/node_modules/three/build/three.module.js", "three/addons/": "/node_modules/three/examples/jsm/"}}</script>
</head><body><script type="module">
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
const said = [];
for (const kind of ["warn", "error"]) {
  const before = console[kind];
  console[kind] = (...words) => { said.push(kind + ": " + words.join(" ")); before(...words); };
}
const renderer = new THREE.WebGLRenderer({ preserveDrawingBuffer: true });
renderer.setSize(300, 300);
document.body.append(renderer.domElement);
function base64(floats) {
  const bytes = new Uint8Array(floats.buffer);
  let text = "";
  for (let i = 0; i < bytes.length; i += 8192) text += String.fromCharCode(...bytes.subarray(i, i + 8192));
  return btoa(text);
}
function points(gltf) {
  gltf.scene.updateMatrixWorld(true);
  const found = [];
  gltf.scene.traverse((mesh) => {
    if (!mesh.isMesh) return;
    const place = gltf.parser.associations.get(mesh), count = mesh.geometry.attributes.position.count;
    const out = new Float32Array(3 * count), point = new THREE.Vector3();
    for (let i = 0; i < count; i++) mesh.getVertexPosition(i, point).applyMatrix4(mesh.matrixWorld).toArray(out, 3 * i);
    found.push({ shape: gltf.parser.json.meshes[place.meshes].name, points: base64(out),
      vertices: base64(new Float32Array(mesh.geometry.attributes._vertex.array)) });
  });
  return found;
}
function picture(gltf) {
  const scene = new THREE.Scene(), box = new THREE.Box3().setFromObject(gltf.scene, true);
  const middle = box.getCenter(new THREE.Vector3()), size = box.getSize(new THREE.Vector3());
  const half = 0.5 * Math.max(size.x, size.y);
  const camera = new THREE.OrthographicCamera(-half, half, half, -half, 0.01 * size.z, 10 * size.z);
  camera.position.set(middle.x, middle.y, box.max.z + size.z);
  scene.background = new THREE.Color(0x000000);
  scene.add(gltf.scene, new THREE.AmbientLight(0xffffff, 1.5), camera);
  camera.add(new THREE.DirectionalLight(0xffffff, 2));
  renderer.render(scene, camera);
  return renderer.domElement.toDataURL("image/png");
}
async function play(job) {
  const gltf = await new GLTFLoader().loadAsync("/" + job.file);
  const names = {};
  gltf.scene.traverse((mesh) => Object.assign(names, mesh.morphTargetDictionary ?? {}));
  const result = { frames: [], poses: [], names: Object.keys(names), pictures: [] };
  if (job.pictures) result.pictures.push(picture(gltf));
  for (const pose of job.poses) {
    gltf.scene.traverse((mesh) => {
      for (const [name, k] of Object.entries(mesh.morphTargetDictionary ?? {}))
        mesh.morphTargetInfluences[k] = pose[name] ?? 0;
    });
    result.poses.push(points(gltf));
  }
  const mixer = new THREE.AnimationMixer(gltf.scene);
  if (job.times.length) mixer.clipAction(gltf.animations[0]).setLoop(THREE.LoopOnce).play().clampWhenFinished = true;
  for (const time of job.times) {
    mixer.setTime(time);
    result.frames.push(points(gltf));
    if (job.pictures) result.pictures.push(picture(gltf));
  }
  return result;
}
async function main() {
  const results = [];
  for (const job of await (await fetch("/jobs.json")).json()) results.push(await play(job));
  return { results };
}
main().catch((e) => ({ failed: String(e.stack ?? e) })).then((result) =>
  fetch("/result", { method: "POST", body: JSON.stringify({ ...result, said }) }));
</script></body></html>
"""


def validate(*files: Path) -> dict[str, Any]:
    """What the Khronos validator says of files, by their names."""
    node = program("gltf-validator", "node")
    words = [node, "-e", VALIDATE, *map(str, files)]
    done = subprocess.run(words, cwd=MODULES.parent, capture_output=True, text=True, check=True, timeout=120)
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def three(jobs: list[dict[str, Any]], folder: Path) -> dict[str, Any]:
    """Play files of a folder in three.js and return what the page found."""
    (folder / "index.html").write_text(PAGE)
    (folder / "jobs.json").write_text(json.dumps(jobs))
    return open_page("three", folder)


def png() -> bytes:
    """A picture, half red and half green."""
    pixels = np.zeros((8, 8, 3), np.uint8)
    pixels[:, :4, 0] = pixels[:, 4:, 1] = 255
    data = io.BytesIO()
    Image.fromarray(pixels).save(data, "png")
    return data.getvalue()


@pytest.fixture(scope="module")
def default() -> AnimatableFace:
    return read_face("default")


def test_the_khronos_validator_finds_nothing_to_complain_about(default: AnimatableFace, tmp_path: Path) -> None:
    small = small_face()
    textured = replace(small, scene=replace(small.scene, images={"face.png": png()}))
    stream, _ = read_fap(sample("streams/demo.fap"))
    write(small, tmp_path / "plain.gltf")
    write(textured, tmp_path / "textured.glb", stream)
    write(small.scene, tmp_path / "scene.glb")
    write(default, tmp_path / "all motions.gltf", stream)
    gltf.write_shape_set(small.scene, profile_shapes(small, "vrm")[0], tmp_path / "vrm.glb")
    full = {name: png() for name in IMAGES}
    write(replace(small, scene=replace(dressed(), images=full)), tmp_path / "surfaces.glb", stream)
    flat = replace(SKIN, shading=replace(FULL, unlit=True))
    write(replace(dressed(flat), images=full), tmp_path / "unlit.glb")
    webp = io.BytesIO()
    Image.new("RGB", (8, 8), (200, 150, 120)).save(webp, "webp")
    write(replace(small.scene, images={"face.png": webp.getvalue()}), tmp_path / "webp.glb")
    write(gltf.read_foreign(tmp_path / "surfaces.glb"), tmp_path / "again.glb")
    found = validate(*sorted(tmp_path.glob("*.gl*")))
    assert len(found) == 9
    for name, report in found.items():
        assert (report["errors"], report["warnings"]) == (0, 0), (name, report["messages"])
    assert found["textured.glb"]["info"]["hasTextures"]
    assert found["all motions.gltf"]["info"]["hasMorphTargets"]
    assert found["all motions.gltf"]["info"]["animationCount"] == 1


@dataclass(frozen=True)
class Played:
    """A face, what was asked of three.js, and what it found."""

    face: AnimatableFace
    stream: FapStream
    frames: list[int]
    result: dict[str, Any]


POSES: dict[str, dict[int, float]] = {
    "fap_03_open_jaw_512": {3: 512},
    "fap_05_raise_b_midlip_neg_300": {5: -300},
    "fap_19_close_t_l_eyelid_1024": {19: 1024},
}


@pytest.fixture(scope="module")
def played(default: AnimatableFace, tmp_path_factory: pytest.TempPathFactory) -> list[Played]:
    """The shipped face with its stream, and a small face whose nodes have centres and turned scales."""
    folder = tmp_path_factory.mktemp("three")
    demo, _ = read_fap(sample("streams/demo.fap"))
    frames = 6
    ramp = np.linspace(-700, 700, frames)
    small = FapStream.build(10.0, frames, {3: ramp * 2, 5: ramp * 3, 14: ramp, 23: 60 * ramp, 25: 80 * ramp})
    pairs = [(default, demo, [0, 20, 55, 100, 140]), (_turned(small_face()), small, list(range(frames)))]
    jobs = []
    for number, (face, stream, chosen) in enumerate(pairs):
        write(face, folder / f"{number}.glb", stream)
        times = [float(np.float32(stream.frame_numbers[k] / stream.frame_rate)) for k in chosen]
        poses = [] if number else [{name: 1.0} for name in POSES]
        jobs.append({"file": f"{number}.glb", "times": times, "poses": poses, "pictures": number == 0})
    found = three(jobs, folder)
    assert "failed" not in found, found["failed"]
    assert not [line for line in found["said"] if "GPU stall" not in line]
    return [Played(*pair, result) for pair, result in zip(pairs, found["results"], strict=True)]


def _turned(face: AnimatableFace) -> AnimatableFace:
    """The face below a head with a turned scale, a centre and a texture."""
    head = replace(
        face.scene.roots[0],
        rotation=(0.6, 0.0, 0.8, 0.3), scale=(1.0, 1.2, 0.9), scale_orientation=(0.0, 1.0, 0.0, 0.5),
    )  # fmt: skip
    return replace(face, scene=replace(face.scene, roots=(head,), images={"face.png": png()}))


def difference(face: AnimatableFace, expected: dict[str, np.ndarray], found: list[dict[str, Any]]) -> float:
    """Largest distance between three.js and our own evaluation, in the smallest FAPU that displacements have."""
    unit = min(face.fapu.unit(u) for u in (Unit.MNS, Unit.MW, Unit.IRISD, Unit.ES, Unit.ENS))
    meters = face.scene.meters_per_unit or 1.0
    largest = 0.0
    assert {part["shape"] for part in found} == set(expected)
    for part in found:
        points = np.frombuffer(base64.b64decode(part["points"]), np.float32).reshape(-1, 3)
        vertices = np.frombuffer(base64.b64decode(part["vertices"]), np.float32).astype(int)
        away = np.linalg.norm(points / meters - expected[part["shape"]][vertices], axis=1)
        largest = max(largest, float(away.max()) / unit)
    return largest


@pytest.mark.parametrize("number", [0, 1], ids=["shipped face", "nodes with centres"])
def test_three_plays_a_stream_as_we_do(played: list[Played], number: int) -> None:
    job = played[number]
    poses = list(Player(job.face).frames(job.stream))
    away = [
        difference(job.face, poses[frame].world_shapes(), found)
        for frame, found in zip(job.frames, job.result["frames"], strict=True)
    ]
    moved = [np.abs(poses[frame].world() - job.face.scene.world_neutral()).max() for frame in job.frames]
    assert max(moved) > 0.02 * job.face.fapu.es0
    assert max(away) < 0.05, away


def test_a_target_at_weight_one_is_the_fap_at_that_border(played: list[Played]) -> None:
    job = played[0]
    player = Player(job.face)
    assert set(POSES) <= set(job.result["names"])
    assert {"viseme_PP", "expression_joy"} <= set(job.result["names"])
    for faps, found in zip(POSES.values(), job.result["poses"], strict=True):
        assert difference(job.face, player.pose(faps).world_shapes(), found) < 0.05


def test_three_draws_the_face_and_its_motion(played: list[Played], tmp_path: Path) -> None:
    pictures = []
    for number, text in enumerate(played[0].result["pictures"]):
        data = base64.b64decode(text.split(",")[1])
        (tmp_path / f"{number}.png").write_bytes(data)
        pictures.append(np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int))
    neutral = pictures[0]
    assert (neutral[100:200, 100:200].max(axis=2) > 60).mean() > 0.95, "the face should fill the middle"
    changed = [(np.abs(p - neutral).max(axis=2) > 24).mean() for p in pictures[1:]]
    assert max(changed) > 0.01, changed
