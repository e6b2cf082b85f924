# ruff: noqa: E402 - the number of threads is set before numpy is imported
"""How fast a face plays: frames per second with every FAP, a viseme and an expression active, on one core.

Run ``python benchmarks/playback.py``. The face is synthetic: a sphere whose low-level FAPs move local bumps, whose jaw
moves a third, and whose visemes and expressions move about half of the vertices. Each FAP's feature point lies in the
middle of its bump, so that all combination rules are at work, in every frame. With ``--dense`` every table moves every
vertex, which no real face does. Values jump from frame to frame, which is the hardest; speech, whose lids blink and
whose lips go from viseme to viseme, uses few tables at a time. Everything is played twice, in 8-byte and in 4-byte
numbers. The plain loop adds the tables one after the other with numpy, frame by frame. Seconds are the processor's.
"""

from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"

import argparse
import resource
import time

import numpy as np

from fat import AnimatableFace, FaceMotion
from fat.build import build_tables
from fat.evaluate import Player
from fat.intervals import interval_weights
from fat.rig import rig_head
from fba import (
    EXPRESSIONS,
    VISEMES,
    FaceScene,
    FapStream,
    Fapu,
    FeaturePoint,
    FeaturePoints,
    PolyMesh,
    Shape,
    fap,
    faps,
)

FAPU = Fapu(irisd0=0.1, es0=0.6, ens0=0.45, mns0=0.18, mw0=0.5)
LOW_LEVEL = range(3, 69)
HEAD = (48, 49, 50)


def sphere(count: int) -> PolyMesh:
    """About `count` vertices in rings of quads, one grid without poles."""
    columns = round(np.sqrt(2 * count))
    rows = count // columns
    theta, phi = np.meshgrid(
        np.linspace(0.05, np.pi - 0.05, rows), np.arange(columns) * 2 * np.pi / columns, indexing="ij"
    )
    vertices = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], axis=-1).reshape(
        -1, 3
    )
    ids = np.arange(rows * columns).reshape(rows, columns)
    right = np.roll(ids, -1, axis=1)
    return PolyMesh.from_faces(vertices, np.stack([ids[:-1], ids[1:], right[1:], right[:-1]], axis=-1).reshape(-1, 4))


def bump(vertices: np.ndarray, center: np.ndarray, radius: float, direction: np.ndarray) -> np.ndarray:
    """Offsets that fall to zero at `radius` (chord length on the unit sphere)."""
    share = np.clip(1.0 - (np.linalg.norm(vertices - center, axis=1) / radius) ** 2, 0.0, None)
    return 0.1 * share[:, None] ** 2 * direction


def synthetic_face(count: int, dense: bool, seed: int = 0) -> AnimatableFace:
    """A face with a table for every FAP, viseme and expression."""
    rng = np.random.default_rng(seed)
    mesh = sphere(count)
    motions = []
    points: dict[str, FeaturePoint] = {}

    def add(number: int, select: int, value: int, center: np.ndarray, radius: float) -> None:
        place = center / np.linalg.norm(center)
        offsets = bump(mesh.vertices, place, 9.0 if dense else radius, rng.normal(size=3))
        motions.append(FaceMotion(f"{number}.{select}", number, select, value, {"skin": offsets}))
        if number in LOW_LEVEL:
            nearest = int(np.argmin(np.linalg.norm(mesh.vertices - place, axis=1)))
            points[fap(number).feature_points[0]] = FeaturePoint("skin", (nearest,), (1.0,))

    mouth = np.array([0.0, -0.4, 1.0])
    for number in LOW_LEVEL:
        if number not in HEAD:
            center = rng.normal(size=3) * 0.4 + [0.0, 0.0, 1.0]
            for value in (600, -600) if fap(number).bidirectional else (600,):
                add(
                    number, 1, value, mouth if number in (3, 14, 15) else center, 1.1 if number in (3, 14, 15) else 0.45
                )
    for viseme in VISEMES:
        add(1, viseme.id, 63, mouth, 1.3)
    for expression in EXPRESSIONS:
        add(2, expression.id, 63, np.array([0.0, 0.0, 1.0]), 1.5)
    scene, transforms = rig_head(FaceScene((Shape("skin", mesh),)), np.array([0.0, -1.2, -0.3]))
    return AnimatableFace(scene, FeaturePoints(points), build_tables(scene, FAPU, motions, transforms), FAPU)


def full_stream(frames: int, head: bool, seed: int = 1) -> FapStream:
    """Every FAP with a value in every frame, two visemes and two expressions."""
    rng = np.random.default_rng(seed)
    values = {
        f.id: rng.integers(1, 600, frames) * rng.choice([-1, 1] if f.bidirectional else [1], frames) for f in faps()[2:]
    }
    values |= {k: rng.integers(1000, 30000, frames) if head else np.zeros(frames) for k in HEAD}
    first, second = rng.integers(1, 15, (2, frames))
    visemes = np.stack([first, second, rng.integers(1, 63, frames), 0 * first], axis=1)
    one, two = rng.integers(1, 7, (2, frames))
    levels = rng.integers(1, 64, (2, frames))
    expressions = np.stack([one, levels[0], two, levels[1], 0 * one, 0 * one], axis=1)
    return FapStream.build(25, frames, values, visemes, expressions)


def speech_stream(frames: int) -> FapStream:
    """Visemes that blend into each other, jaw, lids and brows; all else at rest."""
    step, phase = np.divmod(np.arange(frames), 5)
    rest = np.zeros(frames, dtype=int)
    values = {3: 200 + 20 * phase, 31: 5 * phase, 32: 5 * phase}
    values |= {lid: np.where(step % 20 == 0, 200 * phase, 0) for lid in (19, 20)}
    visemes = np.stack([1 + step % 14, 1 + (step + 1) % 14, 63 - 12 * phase, rest], axis=1)
    return FapStream.build(25, frames, values, visemes)


def plain_frame(face: AnimatableFace, stream: FapStream, frame: int) -> np.ndarray:
    """One frame, one table after the other (mesh displacements only)."""
    moved = face.scene.shapes[0].mesh.vertices.copy()
    select1, select2, blend, _ = stream.visemes[frame].tolist()
    one, level1, two, level2, _, _ = stream.expressions[frame].tolist()
    for table in face.tables:
        value = int(stream.values[frame, table.fap_id - 1])
        if table.fap_id == 1:
            value = blend * (select1 == table.high_level_select) + (63 - blend) * (select2 == table.high_level_select)
        if table.fap_id == 2:
            value = level1 * (one == table.high_level_select) + level2 * (two == table.high_level_select)
        for mesh in table.meshes if value else ():
            weights = interval_weights(mesh.interval_borders, value) * face.fapu.unit(fap(table.fap_id).unit)
            moved[mesh.coord_index] += np.einsum("kjc,j->kc", mesh.displacements, weights)
    return moved


def measure(player: Player, stream: FapStream, runs: int, single: bool = False) -> float:
    """Best frames per second of several runs."""
    best = 0.0
    for _ in range(runs):
        start = time.process_time()
        for _batch in player.world_frames(stream, single=True) if single else player.world_frames(stream):
            pass
        best = max(best, len(stream) / (time.process_time() - start))
    return best


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vertices", type=int, default=20_000)
    parser.add_argument("--frames", type=int, default=1024)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--dense", action="store_true", help="every table moves every vertex")
    options = parser.parse_args()
    face = synthetic_face(options.vertices, options.dense)
    count = face.scene.vertex_count
    parts = [m.coord_index.size / count for t in face.tables for m in t.meshes]
    print(f"{count:,} vertices, {len(face.tables)} tables, each moves {100 * np.mean(parts):.0f} % of them (mean)")
    still, turning = full_stream(options.frames, head=False), full_stream(options.frames, head=True)
    start = time.process_time()
    player = Player(face)
    next(player.world_frames(still))
    print(f"set-up with the first batch: {time.process_time() - start:.2f} s")
    summed = Player(face, rules=())
    speeds = {}
    for what, used, stream in (
        ("all FAPs, viseme, expression, head turning", player, turning),
        ("the same with the head at rest", player, still),
        ("the same by the plain sum, without combination rules", summed, still),
        ("speech", player, speech_stream(options.frames)),
    ):
        double, single = (measure(used, stream, options.runs, kind) for kind in (False, True))
        speeds[what] = double
        print(f"{what}: {double:,.0f} frames/s, {single:,.0f} in 4-byte numbers")
    print(f"peak memory of the process: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
    beside_plain(face, summed, speeds["the same by the plain sum, without combination rules"])


def beside_plain(face: AnimatableFace, summed: Player, speed: float) -> None:
    """Print what a plain loop does, and how far both are apart."""
    stream = full_stream(20, head=False)
    plain_frame(face, stream, 0)
    start = time.process_time()
    frames = np.stack([plain_frame(face, stream, k) for k in range(len(stream))])
    plain = len(stream) / (time.process_time() - start)
    print(f"plain numpy loop over the tables, head at rest: {plain:,.0f} frames/s; player / loop = {speed / plain:.0f}")
    (double,), (single,) = summed.world_frames(stream), summed.world_frames(stream, single=True)
    apart = [np.abs(found - frames).max() for found in (double, single)]
    print(f"largest difference between them: {apart[0]:.1e}, in 4-byte numbers {apart[1]:.1e} (radius 1)")


if __name__ == "__main__":
    main()
