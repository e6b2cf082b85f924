"""How long every format takes to read and write: ``python -m benchmarks.format_speed``.

A grid of 100,000 vertices with uv goes through every mesh format; the shipped source with all its tables through
every format that carries tables. Seconds are of the processor. PyVRML97, where it is installed, reads the same VRML
file in the same run.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fba import FaceScene, PolyMesh, Shape
from formats import formats, read, read_face, write


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


def row(name: str, write_it: Callable[[], object], read_it: Callable[[], object], path: Path, rounds: int) -> float:
    """Measure and print one line; return the reading time."""
    writing = best(write_it, rounds)
    reading = best(read_it, rounds)
    print(f"{name:<12}{writing:>9.2f} s{reading:>9.2f} s{path.stat().st_size / 1e6:>9.1f} MB")
    return reading


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    rounds = parser.parse_args().rounds
    source = read_face("default")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for title, face, only_tables in (
            ("plain mesh, 100,489 vertices", grid(317), False),
            (f"shipped source, {source.scene.vertex_count} vertices, {len(source.tables)} tables", source, True),
        ):
            print(f"\n{title}\n{'':<12}{'write':>11}{'read':>11}{'size':>12}")
            for entry in formats():
                if not (entry.reads and entry.writes) or (only_tables and not entry.carries_tables):
                    continue
                for extension in entry.extensions:
                    path = folder / f"face{extension}"
                    seconds = row(extension, lambda p=path, f=face: write(f, p), lambda p=path: read(p), path, rounds)
                    if extension == ".wrl" and not only_tables:
                        compare_with_pyvrml(path, seconds)


def compare_with_pyvrml(path: Path, seconds: float) -> None:
    """Read the same file with PyVRML97."""
    try:
        from vrml.vrml97.parser import buildParser
    except ImportError:
        print("  (PyVRML97 is not installed)")
        return
    text = path.read_text()
    other = best(lambda: buildParser().parse(text), 1)
    print(f"  PyVRML97 parses the same file in {other:.2f} s: {other / seconds:.0f} times as long")


if __name__ == "__main__":
    main()
