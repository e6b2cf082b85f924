"""ICT-FaceKit's faces: its generic one, and another identity, each moving by the kit's own shapes.

The kit has linear modes of identity on the same vertices, and one set of expression shapes for all identities. So the
shapes are the truth on every one of its faces, as MakeHuman's units are on every phenotype.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.kits import arkit_shapes
from cloning.prepare import prepare
from fba.arrays import Floats
from fba.feature_points import FeaturePoints
from fba.scene import FaceScene, Role
from formats import read_scene
from formats.landmarks import read_landmarks
from formats.shapes import read_shapes
from samples.build.phenotypes import BENCHMARK_UNITS, KnownHead, in_other_topology

SEED = 1
"""Of the weights of the identity's modes."""
DECIMATED = 8000
"""Vertices of the identity in another topology; the kit's own face has 26,719, of which 14,062 are skin."""


def kit_folder(faces: Path) -> Path:
    """Where the kit lies."""
    return faces / "faces" / "ict-facekit"


def generic(faces: Path) -> KnownHead:
    """The kit's generic face, and its shapes under ARKit's names."""
    kit = kit_folder(faces)
    scene = read_scene(kit / "generic_neutral_mesh.obj")
    points = read_landmarks(faces / "landmarks" / "ict.json", scene)
    shapes = read_shapes(kit / "expressions.npz", scene)
    every = arkit_shapes(shapes.names, shapes.deltas)
    return KnownHead(scene, points, {name: scene.scatter(every[name]) for name in BENCHMARK_UNITS})


def identity(faces: Path, seed: int = SEED) -> KnownHead:
    """Another of the kit's faces: its ten first modes with weights of a normal distribution, as the kit asks for."""
    face = generic(faces)
    scene = read_scene(kit_folder(faces) / "generic_neutral_mesh.obj")
    modes = np.load(kit_folder(faces) / "identities_0_9.npz")["deltas"].astype(np.float64)
    weights = np.random.default_rng(seed).normal(size=len(modes))
    moved = scene.scatter(np.einsum("k,knc->nc", weights, modes))
    change = {s.name: replace(s, mesh=s.mesh.with_vertices(s.mesh.vertices + moved[s.name])) for s in scene.shapes}
    return KnownHead(replace(scene.map_shapes(change), name="ict_b"), face.points, face.units)


def decimated(head: KnownHead) -> KnownHead:
    """The same in another topology, without what is neither skin, eye, tooth nor tongue."""
    parts = prepare(head.scene, head.points, "target")
    names = {s.name: "skin" if s.role is Role.SKIN else s.name for s in parts.scene.shapes if s.role is not Role.OTHER}
    shapes = tuple(replace(s, name=names[s.name]) for s in parts.scene.shapes if s.name in names)
    points = {key: replace(p, shape=names.get(p.shape or "")) for key, p in parts.points.items()}

    def offsets(unit: str) -> dict[str, Floats]:
        found = parts.scene.scatter(head.scene.gather(dict(head.units[unit])))
        return {names[shape]: values for shape, values in found.items() if shape in names}

    units = {unit: offsets(unit) for unit in head.units}
    return in_other_topology(
        KnownHead(FaceScene(shapes, name=head.scene.name), FeaturePoints(points), units), DECIMATED
    )
