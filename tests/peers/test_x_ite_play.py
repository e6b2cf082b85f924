"""An independent VRML97 and X3D browser (X_ITE in headless Chromium) plays faces as our own evaluation does."""

from __future__ import annotations

import base64
import io
import json
import re
import subprocess
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import open_page, program
from PIL import Image

from fat import AnimatableFace, FaceDefTables, Player
from fat.intervals import interval_weights
from fba.faps import Unit, fap
from fba.scene import FaceScene, Node, Shape
from fba.stream import FapStream
from formats import read_face, write
from formats.vrml97.portable_script import SCRIPT

pytestmark = pytest.mark.peer

PLAY = """<!DOCTYPE html><html><head><meta charset="utf-8"><script>
// Pictures of frames in which nothing changes stay readable.
const getContext = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, options) {
  return getContext.call(this, kind, { ...options, preserveDrawingBuffer: true });
};
</script><script src="/node_modules/x_ite/dist/x_ite.min.js"></script>
<style>x3d-canvas { width: 240px; height: 240px; }</style></head><body>
<x3d-canvas antialiased="false" splashScreen="false" notifications="false" contextMenu="false"></x3d-canvas>
<script>
const said = [];
for (const kind of ["warn", "error"]) {
  const before = console[kind];
  console[kind] = (...words) => { said.push(kind + ": " + words.join(" ")); before(...words); };
}
window.addEventListener("error", (event) => said.push("error: " + event.message));
const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const browser = X3D.getBrowser();
function floats(vectors) {
  const out = new Float64Array(3 * vectors.length);
  for (let i = 0; i < vectors.length; i++) { const v = vectors[i]; out.set([v.x, v.y, v.z], 3 * i); }
  return out;
}
function base64(values) {
  const bytes = new Uint8Array(values.buffer);
  let text = "";
  for (let i = 0; i < bytes.length; i += 8192) text += String.fromCharCode(...bytes.subarray(i, i + 8192));
  return btoa(text);
}
async function picture() {
  for (let i = 0; i < 2; i++) await browser.nextFrame();
  return document.querySelector("x3d-canvas").shadowRoot.querySelector("canvas").toDataURL("image/png");
}
// Points of a shape: those of its Coordinate and, where a segment has displacers, what these add at their weights.
function points(scene, name, displacers) {
  const out = floats(scene.getNamedNode(name).geometry.coord.point);
  for (const one of displacers) {
    const weight = one.node.weight;
    one.index.forEach((vertex, i) => {
      for (let k = 0; k < 3; k++) out[3 * vertex + k] += weight * one.moves[3 * i + k];
    });
  }
  return base64(out);
}
function segment(scene, job, name) {
  if (!job.displacers) return [];
  return Array.from(scene.getNamedNode(name + "_segment").displacers, (node) => ({
    node, index: Array.from(node.coordIndex), moves: floats(node.displacements) }));
}
// Attributes that X_ITE's nodes have no field for, and whether all ROUTEs were made.
async function check(scene, file) {
  const root = new DOMParser().parseFromString(await (await fetch("/" + file)).text(), "application/xml");
  const unknown = [], named = root.querySelectorAll("[DEF]");
  for (const element of named) {
    const node = scene.getNamedNode(element.getAttribute("DEF"));
    const known = new Set(Array.from(node.getFieldDefinitions(), (d) => d.name));
    for (const { name } of element.attributes)
      if (!known.has(name) && !["DEF", "containerField"].includes(name)) unknown.push(element.tagName + "." + name);
  }
  const routesInFile = root.querySelectorAll("ROUTE").length;
  return { unknown, elements: named.length, routes: scene.routes.length, routesInFile };
}
function state(scene, job, of) {
  const found = { points: {}, fields: {} };
  for (const name of job.shapes) found.points[name] = points(scene, name, of[name]);
  for (const name of job.transforms) {
    const node = scene.getNamedNode(name);
    found.fields[name] = { rotation: Array.from(node.rotation), translation: Array.from(node.translation) };
  }
  return found;
}
async function play(job) {
  await browser.loadURL(new X3D.MFString("/" + job.file));
  const scene = browser.currentScene, live = [], frames = [];
  const clock = scene.getNamedNode("fba_clock");
  const of = Object.fromEntries(job.shapes.map((name) => [name, segment(scene, job, name)]));
  while (live.length < 2) {
    await wait(100);
    await browser.nextFrame();
    const fraction = clock.fraction_changed;
    if (fraction > 0.2 && !live.some((shot) => Math.abs(shot.fraction - fraction) < 0.1))
      live.push({ fraction, points: points(scene, job.skin, of[job.skin]) });
  }
  clock.enabled = false;
  await wait(100);
  for (const fraction of job.fractions) {
    for (const name of job.driven) scene.getNamedNode(name).set_fraction = fraction;
    frames.push({ picture: await picture(), ...state(scene, job, of) });
  }
  for (const name of job.driven) scene.getNamedNode(name).set_fraction = 0;
  await picture();
  for (const [name, value] of Object.entries(job.byHand)) scene.getNamedNode(name)[job.handle] = value;
  frames.push({ picture: await picture(), ...state(scene, job, of) });
  return { live, frames, checked: job.displacers ? await check(scene, job.file) : null };
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

FILES = {"vrml97": "face.wrl", "x3d": "face.x3d"}
FRAMES = (0, 12, 25)
"""At rest, half way, at the end."""


BY_HAND = {3: 300.0, 6: -120.0, 12: -150.5, 13: 90.0, 19: -250.0, 20: 1500.0, 23: 25000.0, 49: -30000.0}
"""FAP values sent straight to the tables: below zero, and beyond the borders."""


@dataclass(frozen=True)
class Played:
    """The shipped face with the tables that a stream uses, and what X_ITE showed of it in both formats."""

    face: AnimatableFace
    stream: FapStream
    results: dict[str, dict[str, Any]]


def moving() -> FapStream:
    """Jaw, smile, lids, eyes and head, a viseme that gives way to another and an expression: always on the move."""
    t = np.linspace(0.0, 1.0, FRAMES[-1] + 1)
    faps = {3: 500 * t, 6: 200 * t, 7: 200 * t, 12: 150 * t, 13: 150 * t, 19: 900 * t**2, 20: 900 * t**2}
    turns = {23: -30000 * t, 24: -30000 * t, 25: 9000 * t, 26: 9000 * t, 48: 12000 * t, 49: -20000 * t, 50: 9000 * t}
    visemes = np.stack([0 * t + 1, 0 * t + 10, 63 * t, 0 * t], axis=1) * (t > 0)[:, None]
    expressions = np.stack([0 * t + 1, 40 * t, 0 * t, 0 * t, 0 * t, 0 * t], axis=1)
    return FapStream.build(10.0, len(t), {**faps, **turns}, visemes, expressions)


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> Played:
    folder = tmp_path_factory.mktemp("x_ite")
    face = read_face("default")
    stream = moving()
    used = Player(face).table_values(stream).any(axis=0)
    face = replace(face, tables=FaceDefTables(tuple(t for t, kept in zip(face.tables, used, strict=True) if kept)))
    jobs = []
    for kind, file in FILES.items():
        write(face, folder / file, stream, portable=kind == "vrml97")
        routes = r'ROUTE (?:fba_clock\.fraction_changed TO |fromNode="fba_clock" .*toNode=")(\w+)'
        jobs.append(
            {
                "file": file,
                "driven": re.findall(routes, (folder / file).read_text()),
                "fractions": [k / (len(stream) - 1) for k in FRAMES],
                "shapes": [s.name for s in face.scene.shapes],
                "transforms": [t.name for t in face.scene.transforms],
                "displacers": kind == "x3d",
                "handle": "value" if kind == "vrml97" else "set_fraction",
                "byHand": {f"fap_{number:02d}_{fap(number).name}": value for number, value in BY_HAND.items()},
                "skin": "skin",
            }
        )
    (folder / "jobs.json").write_text(json.dumps(jobs))
    (folder / "index.html").write_text(PLAY)
    found = open_page("x_ite", folder)
    assert "failed" not in found, found["failed"]
    assert not found["said"]
    return Played(face, stream, dict(zip(FILES, found["results"], strict=True)))


def shown(scene: FaceScene, frame: dict[str, Any]) -> np.ndarray:
    """World vertices from the points and the fields of transforms that the browser has."""

    def visit(part: Node) -> Node:
        if isinstance(part, Shape):
            points = np.frombuffer(base64.b64decode(frame["points"][part.name])).reshape(-1, 3)
            return replace(part, mesh=replace(part.mesh, vertices=scene.frame.from_file(points)))
        fields = {name: tuple(values) for name, values in frame["fields"][part.name].items()}
        return replace(part, children=tuple(visit(child) for child in part.children), **fields)

    return replace(scene, roots=tuple(visit(root) for root in scene.roots)).world_neutral()


def image(text: str) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(text.split(",")[1]))).convert("RGB")).astype(int)


def changed(a: np.ndarray, b: np.ndarray) -> float:
    """Part of a picture that looks otherwise in another one."""
    return float((np.abs(a - b).max(axis=2) > 48).mean())


@pytest.mark.parametrize("kind", FILES)
def test_browser_moves_the_vertices_as_we_do(played: Played, kind: str) -> None:
    face = played.face
    unit = min(face.fapu.unit(u) for u in (Unit.MNS, Unit.MW, Unit.IRISD, Unit.ES, Unit.ENS))
    expected = np.concatenate(list(Player(face).world_frames(played.stream)))
    away, moved = [], []
    for number, frame in zip(FRAMES, played.results[kind]["frames"][:-1], strict=True):
        away.append(float(np.linalg.norm(shown(face.scene, frame) - expected[number], axis=1).max()) / unit)
        moved.append(float(np.linalg.norm(expected[number] - face.scene.world_neutral(), axis=1).max()) / unit)
    assert min(moved[1:]) > 100
    assert max(away) < 0.05, away


@pytest.mark.parametrize("kind", FILES)
def test_a_face_is_moved_by_hand(played: Played, kind: str) -> None:
    """Values that are sent to the tables are summed as the standard says, without rules for FAPs that fight."""
    scene = played.face.scene
    expected = Player(played.face, rules=()).pose(BY_HAND).world()
    away = np.abs(shown(scene, played.results[kind]["frames"][-1]) - expected).max()
    assert np.abs(expected - scene.world_neutral()).max() > 100 * played.face.fapu.unit(Unit.MNS)
    assert away < 0.05 * played.face.fapu.unit(Unit.MNS)


def test_the_script_knows_every_kind_of_interval() -> None:
    """Its rule against our own, for borders and values that one face does not have."""
    borders = [[0, 512], [-300, 0], [-300, 0, 600], [-1860, -400, 0, 600], [0, 400, 1080], [-9, -3, -1, 0]]
    values = [-5000.0, -1860.0, -350.5, -3.0, -0.25, 0.0, 0.5, 1.0, 399.0, 600.0, 4000.0]
    code = SCRIPT.removeprefix("javascript:")
    code += (
        f"console.log(JSON.stringify({json.dumps(borders)}.map((b) => {json.dumps(values)}.map((v) => uses(b, v)))))"
    )
    done = subprocess.run(
        [program("x_ite", "node"), "-e", code], capture_output=True, text=True, check=True, timeout=60
    )
    for edges, found in zip(borders, json.loads(done.stdout), strict=True):
        assert np.array_equal(np.array(found), interval_weights(np.array(edges), values)), edges


@pytest.mark.parametrize("kind", FILES)
def test_browser_plays_by_itself(played: Played, kind: str) -> None:
    """At the times that the clock happens to have, between the frames of the stream."""
    face = played.face
    values = Player(face).table_values(played.stream)
    rest = face.scene.shape("skin").mesh.vertices
    assert len(played.results[kind]["live"]) == 2
    for shot in played.results[kind]["live"]:
        expected = rest.copy()
        for table, column in zip(face.tables, values.T, strict=True):
            value = np.interp(shot["fraction"] * FRAMES[-1], np.arange(len(column)), column)
            for mesh in (m for m in table.meshes if m.shape == "skin"):
                weights = interval_weights(mesh.interval_borders, value) * face.fapu.unit(fap(table.fap_id).unit)
                expected[mesh.coord_index] += np.einsum("i,kic->kc", weights, mesh.displacements)
        found = np.frombuffer(base64.b64decode(shot["points"])).reshape(-1, 3)
        assert np.abs(expected - rest).max() > 100 * face.fapu.unit(Unit.MNS)
        assert np.abs(found - expected).max() < 0.1 * face.fapu.unit(Unit.MNS)


def test_displaced_shapes_are_drawn_where_the_coordinates_would_be(played: Played, tmp_path: Path) -> None:
    """The graphics card moves the vertices of displacers, so pictures tell: VRML97 draws the vertices checked above."""
    pictures = {kind: [image(f["picture"]) for f in played.results[kind]["frames"]] for kind in FILES}
    for number, frame in enumerate(FRAMES):
        for kind in FILES:
            Image.fromarray(pictures[kind][number].astype(np.uint8)).save(tmp_path / f"{kind} {frame}.png")
    neutral = pictures["vrml97"][0]
    assert (neutral[90:150, 100:140].max(axis=2) > 60).mean() > 0.9, "the face should fill the middle"
    assert changed(neutral, pictures["x3d"][0]) < 0.002
    for number in range(1, len(FRAMES)):
        same = changed(pictures["vrml97"][number], pictures["x3d"][number])
        rest = changed(neutral, pictures["x3d"][number])
        assert rest > 0.003
        assert same < 0.35 * rest, (FRAMES[number], same, rest)


def test_every_field_and_route_of_x3d_is_known(played: Played) -> None:
    found = played.results["x3d"]["checked"]
    assert found["elements"] > 90
    assert found["unknown"] == []
    assert found["routes"] == found["routesInFile"] > 60
