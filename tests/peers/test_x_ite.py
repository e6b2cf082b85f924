"""An independent VRML97 browser (X_ITE in headless Chromium) opens what the toolkit writes."""

from __future__ import annotations

import base64
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import open_page
from faces import small_face
from PIL import Image

from fat import AnimatableFace
from formats import write

pytestmark = pytest.mark.peer

PAGE = """<!DOCTYPE html><html><head><meta charset="utf-8"><script src="/node_modules/x_ite/dist/x_ite.min.js"></script>
<style>x3d-canvas { width: 400px; height: 400px; }</style></head><body>
<x3d-canvas splashScreen="false" notifications="false" contextMenu="false"></x3d-canvas>
<script>
const said = [];
for (const kind of ["warn", "error"]) {
  const before = console[kind];
  console[kind] = (...words) => { said.push(kind + ": " + words.join(" ")); before(...words); };
}
window.addEventListener("error", (event) => said.push("error: " + event.message));
const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const number = (values) => Array.from(values, (v) => Array.from(v));
async function main() {
  const browser = X3D.getBrowser();
  await browser.loadURL(new X3D.MFString("/face.wrl"));
  const scene = browser.currentScene;
  await wait(1500);
  const names = JSON.parse(new URLSearchParams(location.search).get("names"));
  const points = {};
  for (const name of names) points[name] = number(scene.getNamedNode(name).geometry.coord.point);
  const face = scene.rootNodes.find((n) => n.getNodeTypeName() === "Face");
  const tables = Array.from(face.fdp.faceDefTables, (t) => ({
    fapID: t.fapID,
    meshes: Array.from(t.faceDefMesh, (m) => ({
      shape: m.faceSceneGraphNode.getNodeName(), borders: Array.from(m.intervalBorders),
      index: Array.from(m.coordIndex), displacements: number(m.displacements) })) }));
  const canvas = document.querySelector("x3d-canvas").shadowRoot.querySelector("canvas");
  // Asked for after the browser's own request, so that it runs after the drawing of the same frame.
  const picture = await new Promise((resolve) => requestAnimationFrame(() => resolve(canvas.toDataURL("image/png"))));
  return { points, tables, picture };
}
main().catch((e) => ({ failed: String(e) })).then((result) =>
  fetch("/result", { method: "POST", body: JSON.stringify({ ...result, said }) }));
</script></body></html>
"""


def open_in_browser(face: AnimatableFace, folder: Path) -> dict[str, Any]:
    """Load a face in X_ITE and return what the page found."""
    write(face, folder / "face.wrl")
    (folder / "index.html").write_text(PAGE)
    return open_page("x_ite", folder, f"?names={json.dumps([s.name for s in face.scene.shapes])}")


def test_browser_shows_the_face_and_holds_its_tables(tmp_path: Path) -> None:
    face = small_face()
    found = open_in_browser(face, tmp_path)
    assert "failed" not in found, found
    assert not [line for line in found["said"] if "face.png" not in line]
    for shape in face.scene.shapes:
        expected = shape.mesh.vertices.astype(np.float32)
        assert np.array_equal(np.array(found["points"][shape.name], np.float32), expected)
    assert [t["fapID"] for t in found["tables"]] == [t.fap_id for t in face.tables]
    for seen, table in zip(found["tables"], face.tables, strict=True):
        for m, mesh in zip(seen["meshes"], table.meshes, strict=True):
            assert (m["shape"], m["borders"]) == (mesh.shape, mesh.interval_borders.tolist())
            assert m["index"] == mesh.coord_index.tolist()
            assert np.array_equal(np.array(m["displacements"], np.float32), mesh.displacements.reshape(-1, 3))
    picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(found["picture"].split(",")[1]))).convert("RGB"))
    (tmp_path / "picture.png").write_bytes(base64.b64decode(found["picture"].split(",")[1]))
    middle = picture[picture.shape[0] // 3 : -picture.shape[0] // 3, picture.shape[1] // 3 : -picture.shape[1] // 3]
    assert (middle.max(axis=2) > 60).mean() > 0.5, "the face should fill the middle of the picture"
