"""The elastic template against another program's non-rigid registration: error against truth, and time.

    python -m benchmarks.template_fit [--makehuman FOLDER] [--sizes 5k,20k]

One MakeHuman phenotype is fitted onto another whose skin has the same vertices: where each of them belongs is known.
The target is decimated to another topology first, so that no vertex can find its own copy. All get the same feature
points and the same similarity as start. The peers are those of trimesh (`nricp_sumner`, `nricp_amberg`; pip install
trimesh rtree) with their default steps. Times are processor seconds of this process; errors are in eye widths.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cloning.align import anchor_ids
from cloning.prepare import prepare
from cloning.refine import refine
from cloning.similarity import fit_similarity
from cloning.surface import Surface
from cloning.template.closest import TriangleSearch
from cloning.template.fitting import BENDING, PUBLISHED, fit_template
from cloning.visibility import visible
from fba.arrays import Bools, Floats
from fba.mesh import PolyMesh
from samples.build.makehuman import MakeHuman, open_makehuman
from samples.build.phenotypes import known, phenotype_a, phenotype_b, simplified

SHARED = Path(__file__).resolve().parents[2] / "shared"
STEPS = {"5k": 0, "20k": 1}
"""Subdivisions of both skins, which have 4,300 vertices."""
DENSITY = 0.8
"""Vertices of the decimated target, relative to the template's."""


@dataclass(frozen=True, eq=False)
class Task:
    """A template, a target of another topology, and where each of the template's vertices belongs."""

    template: Surface
    target: Surface
    truth: Floats
    ids: list[str]
    face: Bools
    eye_width: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--makehuman", type=Path, default=SHARED / "faces" / "makehuman")
    parser.add_argument("--sizes", default="5k,20k")
    options = parser.parse_args()
    makehuman = open_makehuman(options.makehuman)
    for size in options.sizes.split(","):
        task = build_task(makehuman, STEPS[size])
        print(f"{size}: template {task.template.vertex_count} vertices, target {task.target.vertex_count}")
        base = 0.0
        for name, fit in METHODS.items():
            start = time.process_time()
            found = fit(task)
            spent = time.process_time() - start
            base = base or spent
            error = np.linalg.norm(found - task.truth, axis=1)[task.face] / task.eye_width
            print(
                f"  {name:24} mean {error.mean():.4f}  95 % {np.percentile(error, 95):.4f}  "
                f"{spent:6.1f} s  {spent / base:5.1f} x",
                flush=True,
            )


def build_task(makehuman: MakeHuman, subdivisions: int) -> Task:
    """Phenotype A onto phenotype B."""
    skins = [
        prepare(h.scene, h.points, "target").skin for h in map(known, (phenotype_a(makehuman), phenotype_b(makehuman)))
    ]
    template, goal = (_subdivided(skin, subdivisions) for skin in skins)
    mesh = simplified(PolyMesh.from_faces(goal.vertices, goal.triangles), int(DENSITY * goal.vertex_count))
    target = replace(
        goal, vertices=mesh.vertices, polygons=(mesh.indices, mesh.offsets), triangles=mesh.triangles, points={}
    )
    place, v = template.positions, template.vertices
    near = np.linalg.norm(v - place["9.3"], axis=1) < 1.4
    face = near & (v[:, 2] > place["3.7"][2] - 0.4) & visible(template)
    width = float(np.linalg.norm(goal.positions["3.7"] - goal.positions["3.11"]))
    return Task(template, target, goal.vertices, anchor_ids(*skins), face, width)


def _subdivided(skin: Surface, times: int) -> Surface:
    """The skin as one mesh without seams, subdivided; feature points stay on their vertices."""
    skin = replace(skin, links=np.zeros((0, 2), np.int32))
    for _ in range(times):
        step = refine(*skin.polygons, skin.vertex_count)
        quads = step.polygons[0].reshape(-1, 4)
        triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        vertices = step.matrix @ skin.vertices
        rows = {key: np.asarray(w) @ vertices[v] for key, (v, w) in skin.points.items()}
        positions = {**skin.positions, **rows}
        skin = replace(skin, vertices=vertices, polygons=step.polygons, triangles=triangles, positions=positions)
    return skin


def fit_bending(task: Task) -> Floats:
    return fit_template(task.template, task.target, task.ids, schedule=BENDING).vertices


def fit_published(task: Task) -> Floats:
    return fit_template(task.template, task.target, task.ids, schedule=PUBLISHED).vertices


def fit_peer(name: str) -> Callable[[Task], Floats]:
    """A registration of trimesh."""

    def fit(task: Task) -> Floats:
        import trimesh
        from trimesh import registration

        template, target = task.template, task.target
        places, goals = (np.array([s.positions[i] for i in task.ids]) for s in (template, target))
        start = fit_similarity(places, goals).apply(template.vertices)
        on = TriangleSearch(template.vertices, template.triangles).closest(places)
        found = getattr(registration, name)(
            trimesh.Trimesh(start, template.triangles, process=False),
            trimesh.Trimesh(target.vertices, target.triangles, process=False),
            source_landmarks=(on.triangles, on.weights),
            target_positions=goals,
        )
        return np.asarray(found, np.float64)

    return fit


METHODS: dict[str, Callable[[Task], Floats]] = {
    "elastic, bending": fit_bending,
    "elastic, published": fit_published,
    "trimesh nricp_sumner": fit_peer("nricp_sumner"),
    "trimesh nricp_amberg": fit_peer("nricp_amberg"),
}


if __name__ == "__main__":
    main()
