"""How long every format takes to read and write: ``python -m benchmarks.format_speed [--json]``.

A grid of 100,000 vertices with uv goes through every mesh format; the shipped source with all its tables through
every format that carries tables. Seconds are of the processor. PyVRML97, where it is installed, reads the same VRML
file in the same run. --json prints the numbers as one line of JSON.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from fba import FaceScene, PolyMesh, Shape
from formats import formats, read, read_face, write

Rows = dict[str, dict[str, float]]
"""Extension -> seconds to write and to read, and MB; "PyVRML97": seconds to parse."""

ALIASES = (".vrml", ".wrz", ".x3dz", ".xmt", ".xmt.gz", ".usd")
"""Other names of what is measured already."""


def grid(side: int) -> FaceScene:
    """A square of quads with irregular heights, so that numbers have all their digits."""
    x, y = np.meshgrid(np.linspace(0, 1, side), np.linspace(0, 1, side))
    heights = np.random.default_rng(0).normal(size=x.size)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    quads = np.stack([corner, corner + 1, corner + side + 1, corner + side], axis=1).ravel()
    vertices = np.stack([x.ravel(), y.ravel(), heights], axis=1)
    mesh = PolyMesh(vertices, quads, np.arange(0, quads.size + 1, 4), vertices[:, :2], quads)
    return FaceScene((Shape("grid", mesh),))


def best(work: Callable[[], object], rounds: int) -> float:
    """Shortest of several runs, in seconds of the processor."""
    times = []
    for _ in range(rounds):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    found = measured(options.rounds)
    if options.json:
        print(json.dumps(found))
        return
    for title, rows in found.items():
        print(f"\n{title}\n{'':<12}{'write':>11}{'read':>11}{'size':>12}")
        for name, row in rows.items():
            writing = f"{row['write']:>9.2f} s" if "write" in row else " " * 11
            size = f"{row['MB']:>9.1f} MB" if "MB" in row else ""
            print(f"{name:<12}{writing}{row['read']:>9.2f} s{size}")


def measured(rounds: int) -> dict[str, Rows]:
    """Both tables, by what is written."""
    source = read_face("default")
    tables = f"shipped source, {source.scene.vertex_count:,} vertices, {len(source.tables)} tables"
    return {"grid, 100,489 vertices": table(grid(317), False, rounds), tables: table(source, True, rounds)}


def table(face: Any, only_tables: bool, rounds: int) -> Rows:
    """Every format that holds a face of this kind, there and back."""
    rows: Rows = {}
    with tempfile.TemporaryDirectory() as name:
        for entry in formats():
            if not (entry.reads and entry.writes) or (only_tables and not entry.carries_tables):
                continue
            for extension in (e for e in entry.extensions if e not in ALIASES):
                path = Path(name) / extension[1:] / f"face{extension}"
                path.parent.mkdir()
                writing = best(lambda p=path: write(face, p), rounds)  # type: ignore[misc]
                reading = best(lambda p=path: read(p), rounds)  # type: ignore[misc]
                size = sum(file.stat().st_size for file in path.parent.iterdir()) / 1e6
                rows[extension] = {"write": writing, "read": reading, "MB": size}
                if extension == ".wrl" and not only_tables:
                    rows.update(by_pyvrml(path))
    return rows


def by_pyvrml(path: Path) -> Rows:
    """The same file parsed by PyVRML97, where it is installed."""
    try:
        from vrml.vrml97.parser import buildParser
    except ImportError:
        return {}
    text = path.read_text()
    return {"PyVRML97": {"read": best(lambda: buildParser().parse(text), 1)}}


if __name__ == "__main__":
    main()
