"""What a clone leaves out by default, beside an exact one: ``python -m benchmarks.report.compact``.

Sizes and seconds of written files on the shipped head of 20,000 vertices; measures of `fba check` on a coarse one.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

from benchmarks.report.faithful import told_by_check
from benchmarks.report.heads import source
from benchmarks.report.processes import seconds
from cloning import clone
from formats import read_scene, write
from samples import sample

WRITTEN = (".wrl", ".wrl.gz", ".bt", ".glb", ".usda", ".usdc")
LARGE, COARSE = "quad_head", "tri_head"
CHECKED = {"fp-error": "feature points, relative", "flips": "flips, %"}


def main() -> None:
    print(json.dumps({name: measured(exact) for name, exact in (("exact", True), ("default", False))}))


def measured(exact: bool) -> dict[str, float]:
    """Seconds and MB of every format, and measures of a clone."""
    found: dict[str, float] = {}
    face = clone(source()[0], read_scene(sample(f"faces/{LARGE}.obj")), exact=exact)
    with tempfile.TemporaryDirectory() as name:
        for extension in WRITTEN:
            path = Path(name) / f"face{extension}"
            found[f"write {extension}"] = seconds(lambda p=path: write(face, p))  # type: ignore[misc]
            found[f"MB {extension}"] = path.stat().st_size / 1e6
    rows = told_by_check(clone(source()[0], read_scene(sample(f"faces/{COARSE}.obj")), exact=exact))
    return {**found, **{CHECKED[row["code"]]: row["value"] for row in rows if row["code"] in CHECKED}}


if __name__ == "__main__":
    main()
