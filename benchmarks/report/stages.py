"""Each stage of a clone at one size, in one process: ``python -m benchmarks.report.stages SIZE``."""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.clone_speed import Stages
from benchmarks.playback import full_stream
from benchmarks.report.heads import sized, skin_motions, source
from benchmarks.report.player import played
from benchmarks.report.processes import seconds
from cloning import clone_with_report
from cloning.correct import correction
from cloning.detect import detect_points
from cloning.prepare import prepare
from cloning.template.fitting import fit_template
from fat.evaluate import Player
from formats import read_scene, write

TABLE_FORMATS = (".wrl", ".wrl.gz", ".x3d", ".bt", ".xmta", ".glb", ".usda", ".usdc", ".usdz")
FRAMES = 128


def main() -> None:
    print(json.dumps(stages(sys.argv[1])))


def stages(size: str) -> dict[str, float]:
    """Seconds of every stage, frames per second, and MB of written files."""
    head = sized(size)
    face, mine = source()
    found: dict[str, float] = {"vertices": float(head.scene.vertex_count)}
    with tempfile.TemporaryDirectory() as name:
        for extension in (".obj", ".wrl"):
            path = Path(name) / f"head{extension}"
            write(head.scene, path)
            found[f"read {extension}"] = seconds(lambda p=path: read_scene(p), 2)  # type: ignore[misc]
    found["feature points, detected"] = seconds(lambda: detect_points(head.scene, mine))
    told = Stages()
    cloned, _ = clone_with_report(face, head.scene, head.points, progress=told)
    told("tables", 1.0)
    found["make ready"] = told.seconds["target"]
    yours = prepare(head.scene, head.points, "target")
    labels = (mine.labels.values, yours.labels.values)
    found["template fit, the source's skin"] = seconds(lambda: fit_template(mine.skin, yours.skin, labels=labels), 2)
    found["88 motions corrected"] = _corrected(yours, skin_motions(face, mine).shape[1])
    found["all motions, corrected, with lids and parts"] = told.seconds["motion"]
    found["tables"] = told.seconds["tables"]
    with tempfile.TemporaryDirectory() as name:
        for extension in TABLE_FORMATS:
            path = Path(name) / f"face{extension}"
            found[f"write {extension}"] = seconds(lambda p=path: write(cloned, p))  # type: ignore[misc]
            found[f"MB {extension}"] = path.stat().st_size / 1e6
    for what, turning in (("head at rest", False), ("head turning", True)):
        stream = full_stream(FRAMES, turning)
        for numbers, single in (("", False), (", 4-byte numbers", True)):
            found[f"frames/s, {what}{numbers}"] = played(Player(cloned), stream, single)
    return found


def _corrected(face: object, count: int) -> float:
    """Set-up of the bumps, and as many random smooth motions made exact at the feature points."""
    skin = face.skin  # type: ignore[attr-defined]
    ids = list(skin.points)
    wave = np.sin(3.0 * skin.vertices[:, None] + np.arange(count)[:, None])
    goals = np.random.default_rng(0).normal(size=(len(ids), count, 3))

    def work() -> None:
        bumps = correction(skin, ids)
        for start in range(0, count, 22):
            bumps.apply(wave[:, start : start + 22].copy(), goals[:, start : start + 22])

    return seconds(work)


if __name__ == "__main__":
    main()
