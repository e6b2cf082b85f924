"""Make the papers' figures and tables again.

    python -m benchmarks.papers [--only fmc,vtc,xiang] [--faces FOLDER] [--write]

Pictures go to docs/images/papers, tables into docs/papers.md (--write) or to the terminal. Faces of the folder
(ICT-FaceKit, SOMA, MakeHuman) play along where it is there; none of the papers' own models are public.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

from benchmarks.fidelity import DOCS
from benchmarks.kits import SHARED
from benchmarks.papers import fmc, vtc, xiang
from benchmarks.papers.cast import Cast
from samples.build.arkit_docs import put_tables

PAPERS: Mapping[str, Callable[[Cast, Path, Callable[[str], None]], dict[str, str]]] = {
    "fmc": fmc.reproduce,
    "vtc": vtc.reproduce,
    "xiang": xiang.reproduce,
}


def main() -> None:
    """Read the arguments, reproduce, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default=",".join(PAPERS), help="papers, by commas")
    parser.add_argument("--faces", type=Path, default=SHARED)
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    cast = Cast(options.faces)
    with tempfile.TemporaryDirectory() as scratch:
        images = DOCS / "images" / "papers" if options.write else Path(scratch)
        images.mkdir(parents=True, exist_ok=True)
        for name in options.only.split(","):
            tables = PAPERS[name](cast, images, lambda what, paper=name: print(f"{paper}: {what}", flush=True))  # type: ignore[misc]
            for place, table in tables.items():
                print(f"\n{place}\n{table}")
            if options.write:
                put_tables(DOCS / "papers.md", tables)


if __name__ == "__main__":
    main()
