"""How long a whole clone takes, stage by stage, and how much memory: shipped heads, from file to file.

    python -m benchmarks.clone_speed [--runs N] [--backends NAMES] [--heads NAMES] [--json FILE]

Each run is a process of its own that does what `fba clone HEAD.obj -o HEAD.wrl` does, feature points detected, all
68 FAPs, 14 visemes and 6 expressions. Seconds are of the processor, which other programs disturb less than the clock's;
the median of the runs is printed, and the largest memory. Afterwards 88 motions are carried over the map that is
there, without correction and parts.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.report.processes import peak_memory

if TYPE_CHECKING:
    from fat.face import AnimatableFace

MOTIONS = 88
HEADS = ("closed_head", "quad_head")
"""Shipped heads of about 5,000 and 20,000 vertices."""
ONCE = "--once"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--backends", default="fit,dt,fmc", help="names, by commas")
    parser.add_argument("--heads", default=",".join(HEADS), help="names, by commas")
    parser.add_argument("--json", type=Path)
    parser.add_argument(ONCE, nargs=2, metavar=("HEAD", "BACKEND"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.once:
        print(json.dumps(once(*options.once)))
        return
    rows = []
    for head in options.heads.split(","):
        for backend in options.backends.split(","):
            rows.append({"head": head, "backend": backend, **median(head, backend, options.runs)})
            print(
                "  ".join(f"{k} {v:.2f}" if isinstance(v, float) else str(v) for k, v in rows[-1].items()), flush=True
            )
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=2))


def median(head: str, backend: str, runs: int) -> dict[str, float]:
    """The median of each number over some processes, one after the other, each with one thread."""
    command = [sys.executable, "-m", "benchmarks.clone_speed", ONCE, head, backend]
    one_thread = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    found = []
    for _ in range(runs):
        done = subprocess.run(command, check=True, stdout=subprocess.PIPE, env=one_thread)
        found.append(json.loads(done.stdout))
    return {key: statistics.median(row[key] for row in found) for key in found[0]}


def once(head: str, backend: str) -> dict[str, float]:
    """Clone onto a shipped head, from file to file.

    Returns
    -------
    Processor seconds of the whole process and of each stage, its peak memory and the size of the file in MB, the
    number of vertices, and seconds for 88 motions over the finished map.
    """
    from cloning import clone_with_report
    from formats import read_face, read_scene, write
    from samples import sample

    stages = Stages()
    stages("import", 1.0)
    source = read_face("default")
    scene = read_scene(sample(f"faces/{head}.obj"))
    stages("read", 1.0)
    face, _ = clone_with_report(source, scene, backend=backend, progress=stages)
    stages("tables", 1.0)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{head}.wrl"
        write(face, path)
        size = path.stat().st_size / 1e6
    stages("write", 1.0)
    whole, peak = time.process_time(), peak_memory()
    known = known_map(source, face, backend)
    vertices = float(scene.vertex_count)
    return {"whole": whole, **stages.seconds, "memory": peak, "size": size, "vertices": vertices, "known map": known}


class Stages:
    """Takes what a clone says about its progress, and the time since the stage before."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = 0.0

    def __call__(self, stage: str, share: float) -> None:
        now = time.process_time()
        if share > 0.0:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + now - self._last
            self._last = now


def known_map(source: AnimatableFace, face: AnimatableFace, backend: str) -> float:
    """Processor seconds for 88 motions over a map that is there; the best of three."""
    import numpy as np

    from cloning.backends import Anchored, find_backend
    from cloning.prepare import prepare
    from cloning.source import source_motions

    mine = prepare(source.scene, source.feature_points, "source")
    yours = prepare(face.scene, face.feature_points, "target")
    transfer = find_backend(backend).build(mine, yours, False)
    skins = [mine.skin.join(m.offsets) for m in source_motions(source)]
    step = len(skins) / MOTIONS
    motions = np.stack([skins[int(k * step)] for k in range(MOTIONS)], axis=1)
    if isinstance(transfer, Anchored):
        transfer = transfer.anchored(np.linalg.norm(motions, axis=2).max(axis=1))
    return min(seconds(lambda: transfer.apply(motions)) for _ in range(3))


def seconds(work: Callable[[], object]) -> float:
    """Processor seconds of a call."""
    start = time.process_time()
    work()
    return time.process_time() - start


if __name__ == "__main__":
    main()
