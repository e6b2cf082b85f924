"""How fast Facial Motion Cloning is, stage by stage, on targets of about 5,000 and 20,000 vertices.

    python -m benchmarks.clone_speed [--json FILE]

The targets are the shipped source's head with other proportions, once as it is and once with its skin subdivided.
"""

from __future__ import annotations

import argparse
import json
import resource
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np

from cloning import clone_with_report
from cloning.fmc import build_transfer
from cloning.prepare import prepare
from cloning.refine import refine
from cloning.source import source_motions
from fat.face import AnimatableFace
from fba.arrays import Floats
from fba.feature_points import FeaturePoints
from fba.mesh import PolyMesh
from fba.scene import FaceScene, Role, Shape
from formats import read_face

MOTIONS = 88


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    start = perf_counter()
    source = read_face("default")
    rows = [{"what": "read the source", "seconds": perf_counter() - start}]
    for name, scene in (("5k", reshaped(source, 0)), ("20k", reshaped(source, 1))):
        for as_published in (False, True):
            rows.append(whole(name, source, scene, as_published))
        rows.append(known_map(name, source, scene))
    for row in rows:
        print(
            "  ".join(f"{key} {value:.3f}" if isinstance(value, float) else f"{value:24}" for key, value in row.items())
        )
    print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=2))


def reshaped(source: AnimatableFace, steps: int) -> tuple[FaceScene, FeaturePoints]:
    """The source's shapes without transforms, stretched, and their skin subdivided."""
    shapes = []
    for shape in source.scene.shapes:
        mesh = shape.mesh.with_vertices(stretched(source.scene.world_vertices(shape.name)))
        for _ in range(steps if shape.role is Role.SKIN else 0):
            step = refine(mesh.indices, mesh.offsets, mesh.vertex_count)
            mesh = PolyMesh(step.matrix @ mesh.vertices, *step.polygons)
        shapes.append(Shape(shape.name, mesh, shape.role))
    points = {
        key: p if p.point is None else replace(p, point=tuple(stretched(np.array([p.point]))[0].tolist()))
        for key, p in source.feature_points.items()
    }
    return FaceScene(tuple(shapes), name="target"), FeaturePoints(points)


def stretched(vertices: Floats) -> Floats:
    return vertices * np.array([1.08, 1.0, 0.94]) + 0.02 * np.sin(3.0 * vertices)


def whole(
    name: str, source: AnimatableFace, target: tuple[FaceScene, FeaturePoints], as_published: bool
) -> dict[str, object]:
    """A whole clone, tables included."""
    start = perf_counter()
    _, report = clone_with_report(source, *target, as_published=as_published)
    seconds = perf_counter() - start
    mode = "published" if as_published else "default"
    return {"what": f"clone {name} {mode}", "seconds": seconds, **dict(report.timings)}


def known_map(name: str, source: AnimatableFace, target: tuple[FaceScene, FeaturePoints]) -> dict[str, object]:
    """88 motions over a map that is already there."""
    mine, yours = prepare(source.scene, source.feature_points, "source"), prepare(*target, "target")
    transfer = build_transfer(mine, yours, False)
    motions = [mine.skin.join(m.offsets) for m in source_motions(source)]
    stacked = np.stack([motions[k % len(motions)] for k in range(MOTIONS)], axis=1)
    best = min(timed(lambda: transfer.apply(stacked)) for _ in range(3))
    return {"what": f"{MOTIONS} motions {name}", "seconds": best, "vertices": float(yours.skin.vertex_count)}


def timed(work: object) -> float:
    start = perf_counter()
    work()  # type: ignore[operator]
    return perf_counter() - start


if __name__ == "__main__":
    main()
