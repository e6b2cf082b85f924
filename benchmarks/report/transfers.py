"""One backend at one size, in one process: ``python -m benchmarks.report.transfers SIZE BACKEND``."""

from __future__ import annotations

import json
import sys

import numpy as np

from benchmarks.report.heads import sized, skin_motions, source
from benchmarks.report.processes import peak_memory, seconds
from cloning.backends import Anchored, SkinTransfer, find_backend
from cloning.prepare import prepare


def main() -> None:
    print(json.dumps(transfer(*sys.argv[1:3])))


def transfer(size: str, backend: str) -> dict[str, float]:
    """Seconds to find the correspondence, and to carry 88 motions over it; peak memory of all of it in MB."""
    face, mine = source()
    head = sized(size)
    yours = prepare(head.scene, head.points, "target")
    motions = skin_motions(face, mine)
    built: list[SkinTransfer] = []
    correspondence = seconds(lambda: built.append(find_backend(backend).build(mine, yours, False)))

    def carry() -> None:
        way = built[0]
        if isinstance(way, Anchored):
            way = way.anchored(np.linalg.norm(motions, axis=2).max(axis=1))
        way.apply(motions)

    first = seconds(carry)
    peak = peak_memory()
    return {
        "vertices": float(head.scene.vertex_count),
        "correspondence": correspondence,
        "motions": min(first, seconds(carry, 2)),
        "memory": peak,
    }


if __name__ == "__main__":
    main()
