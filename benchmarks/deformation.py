"""How exact and how fast deformation transfer is, beside the full system with fourth vertices.

    python -m benchmarks.deformation [--json FILE]

Self mapping: the shipped source's skin is given its own motions, and a sheet of 20,022 vertices 88 smooth motions that
move nearly all of it. Speed: the same, from two meshes to finished offsets; the full system (vertices and fourth
vertices, one factor for x, y and z) is solved in the same run with the same solver. Seconds are those of the processor.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from cloning.deformation import deformation_transfer
from cloning.prepare import prepare
from cloning.shape_solver import COLUMNS
from cloning.source import source_motions
from fba.arrays import Floats, Ints
from formats import read_face

MOTIONS = 88
BANDS = (0.001, 0.005, 0.02)
STILL = 0.001
"""Vertices that move less than this share of a motion's largest offset are not counted in the bands."""


@dataclass(frozen=True)
class Case:
    """A mesh and its motions, (n, K, 3)."""

    name: str
    vertices: Floats
    triangles: Ints
    links: Ints | None
    motions: Floats

    @property
    def held(self) -> Floats:
        return (~self.motions.any(axis=(1, 2))).astype(float)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    headings = ("seconds", *(f"< {band:.1%}" for band in BANDS), "largest")
    print(f"{'mesh':10}{'system':10}" + "".join(f"{heading:>12}" for heading in headings))
    rows: list[dict[str, Any]] = []
    for case in (shipped(), sheet()):
        for name, transfer in (("reduced", reduced), ("full", full)):
            seconds, found = timed(transfer, case)
            rows.append({"mesh": case.name, "system": name, "seconds": seconds, **errors(found, case.motions)})
            print(line(rows[-1]))
        print(f"{case.name}: full / reduced = {rows[-1]['seconds'] / rows[-2]['seconds']:.1f}")
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=2))


def shipped() -> Case:
    """The shipped source's skin with its own tables, repeated to 88 motions."""
    source = read_face("default")
    face = prepare(source.scene, source.feature_points, "source")
    every = [face.skin.join(m.offsets) / face.fapu.es0 for m in source_motions(source)]
    moving = [m for m in every if m.any()]
    motions = np.stack([moving[k % len(moving)] for k in range(MOTIONS)], axis=1)
    return Case("source", face.skin.vertices, face.skin.triangles, face.skin.links, motions)


def sheet(rows: int = 142, columns: int = 141) -> Case:
    """A domed, wavy sheet; its motions are smooth bumps that rest at its border only."""
    random = np.random.default_rng(0)
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-1.0, 1.0, columns), np.linspace(-1.2, 1.2, rows)))
    z = np.sqrt(2.5 - x**2 - 0.6 * y**2) + 0.05 * np.sin(7.0 * x) * np.cos(5.0 * y)
    vertices = np.stack([x, y, z], axis=1)
    corner = np.arange(rows * columns).reshape(rows, columns)
    quads = np.stack([corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]], axis=-1).reshape(-1, 4)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32)
    centers = random.uniform(-0.7, 0.7, (MOTIONS, 2))
    height = np.exp(-np.sum((vertices[:, None, :2] - centers) ** 2, axis=2) / 0.18)
    height[(np.abs(x) > 0.999) | (np.abs(y) > 1.199)] = 0.0
    return Case("sheet", vertices, triangles, None, height[:, :, None] * random.normal(size=(MOTIONS, 3)) * 0.1)


def reduced(case: Case) -> Floats:
    """The product's own way."""
    transfer = deformation_transfer(case.vertices, case.vertices, case.triangles, case.held, links=case.links)
    return transfer.apply(case.motions)


def full(case: Case) -> Floats:
    """Vertices and fourth vertices as unknowns, uniform weights, as the papers write it; without seams."""
    from scipy.sparse import csr_array, diags_array
    from scipy.sparse.linalg import splu

    n, t = len(case.vertices), len(case.triangles)
    rest = np.linalg.inv(frames(case.vertices, case.triangles))
    corners = np.concatenate([case.triangles, n + np.arange(t)[:, None]], axis=1)
    entries = np.concatenate([-rest.sum(axis=1, keepdims=True), rest], axis=1)
    rows = np.arange(3 * t).reshape(t, 1, 3)
    system = csr_array(
        (entries.ravel(), (np.broadcast_to(rows, entries.shape).ravel(), np.repeat(corners, 3))), shape=(3 * t, n + t)
    )
    held = np.concatenate([case.held, np.zeros(t)])
    factor = splu(
        (system.T @ system + diags_array(held)).tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    out = np.empty(case.motions.shape)
    pinned = held[:n, None] * case.vertices
    for start in range(0, MOTIONS, COLUMNS):
        some = range(start, min(start + COLUMNS, MOTIONS))
        maps = [frames(case.vertices + case.motions[:, k], case.triangles) @ rest for k in some]
        for axis in range(3):
            wanted = np.stack([m[:, axis].ravel() for m in maps], axis=1)
            right = system.T @ wanted
            right[:n] += pinned[:, [axis]]
            solved = factor.solve(np.asfortranarray(right))[:n]
            out[:, start : start + len(some), axis] = solved - case.vertices[:, [axis]]
    return out


def frames(vertices: Floats, triangles: Ints) -> Floats:
    """(t, 3, 3) columns v2 - v1, v3 - v1, v4 - v1."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    fourth = cross / np.sqrt(np.linalg.norm(cross, axis=1, keepdims=True))
    return np.stack([b - a, c - a, fourth], axis=2)


def errors(found: Floats, truth: Floats) -> dict[str, float]:
    """Shares of moving vertices by |length / true length - 1|; the largest error against the largest motion."""
    size, length = np.linalg.norm(truth, axis=2), np.linalg.norm(found, axis=2)
    largest = size.max(axis=0)
    moving = size > STILL * largest
    ratio = np.abs(length[moving] / size[moving] - 1.0)
    shares = {f"below {band:.1%}": float((ratio < band).mean()) for band in BANDS}
    return {**shares, "largest": float((np.linalg.norm(found - truth, axis=2).max(axis=0) / largest).max())}


def line(row: dict[str, Any]) -> str:
    """One printed row."""
    numbers = [f"{v:.2e}" if k == "largest" else f"{v:.3f}" for k, v in row.items() if isinstance(v, float)]
    return f"{row['mesh']:10}{row['system']:10}" + "".join(f"{n:>12}" for n in numbers)


def timed(work: Callable[[Case], Floats], case: Case) -> tuple[float, Floats]:
    """The better of two runs, seconds of the processor, and the result."""
    best = np.inf
    for _ in range(2):
        start = process_time()
        done = work(case)
        best = min(best, process_time() - start)
    return best, done


if __name__ == "__main__":
    main()
