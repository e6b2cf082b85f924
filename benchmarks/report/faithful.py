"""Fidelity values that are measured on shipped faces: ``python -m benchmarks.report.faithful [FACES]``.

FACES is a folder as in `benchmarks.landmarks`; without it the shipped heads alone are looked at.
"""

from __future__ import annotations

import contextlib
import io
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.deformation import errors
from benchmarks.landmarks import belongs, faces, measure
from benchmarks.report.heads import source
from benchmarks.vtc import by_solvers, skin_motions
from cloning import clone
from fat.evaluate import Player
from fat.face import AnimatableFace
from formats import read_scene, write
from samples import sample
from studio.cli.app import app

HEADS = ("tri_head", "quad_head", "closed_head")
CHECKED = {
    "own-fp": "own feature point, %",
    "cross-talk": "cross-talk, %",
    "fp-error": "feature points",
    "lip-gap": "lip gap, MNS",
    "lid-gap": "lid gap, IRISD",
    "flips": "flips, %",
    "still": "still skin, eye separations",
}
"""Measures of `fba check`."""


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path("nowhere")
    print(json.dumps({**checked(), **self_mapped(), **detected(folder)}))


def checked() -> dict[str, float]:
    """The worst over clones of the shipped source, on each shipped head, and the source's own value."""
    found: dict[str, float] = {"neutral": 0.0}
    for head in HEADS:
        scene = read_scene(sample(f"faces/{head}.obj"))
        face = clone(source()[0], scene)
        rest, shapes = face.scene, Player(face).pose({}).world_shapes()
        off = max(float(np.abs(shapes[s.name] - rest.world_vertices(s.name)).max()) for s in rest.shapes)
        found["neutral"] = max(found["neutral"], off)
        for row in told_by_check(face):
            if row["code"] in CHECKED:
                key, own = CHECKED[row["code"]], row["source"] or 0.0
                found[key] = max(found.get(key, 0.0), row["value"])
                found[f"{key}, source"] = max(found.get(f"{key}, source", 0.0), own)
    return found


def told_by_check(face: AnimatableFace) -> list[dict[str, Any]]:
    """The measures of `fba check` on a written clone of the shipped source."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "face.wrl"
        write(face, path)
        text = io.StringIO()
        with contextlib.redirect_stdout(text), contextlib.suppress(SystemExit):
            app(["check", str(path), "--source", "default", "--json"])
    rows: list[dict[str, Any]] = json.loads(text.getvalue())["measures"]
    return rows


def self_mapped() -> dict[str, float]:
    """Largest error of the source's motions given back to itself, against the largest motion."""
    face, mine = source()
    motions = skin_motions(face, mine)
    rows = {mapped.name: errors(mapped.found, motions)["largest"] for mapped in by_solvers(mine, motions)}
    tents = max(value for name, value in rows.items() if name.startswith("tents"))
    return {"self mapping, DT": rows["deformation transfer"], "self mapping, VTC": tents}


def detected(folder: Path) -> dict[str, float]:
    """Mean and largest error of detected points, in eye widths: the worst mean, and the worst point, of all faces."""
    mine = source()[1]
    means, worst = [], []
    for known in faces(folder, []):
        if known.truth is None:
            continue
        row = measure(known, mine, "auto", None)
        off = row.get("errors") if row else None
        values = [v for key, v in off.items() if belongs(key, "all")] if isinstance(off, dict) else [np.inf]
        means.append(float(np.mean(values)))
        worst.append(float(max(values)))
    return {"faces with known points": len(means), "points, mean": max(means), "points, largest": max(worst)}


if __name__ == "__main__":
    main()
