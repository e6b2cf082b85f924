"""Blender takes what the toolkit writes, and moves it as the toolkit does.

Slow, and Blender is no dependency: the tests run where FBA_BLENDER names a Python that has Blender's module
(``pip install bpy`` in an environment of its own), and are skipped elsewhere.
"""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pytest
from faces import small_face
from usd_played import smallest_unit

from fat import AnimatableFace, Player
from fba.scene import Transform
from fba.stream import FapStream
from formats import read_face, write
from formats.fap import read_fap
from formats.targets import table_borders
from formats.usd.blend_shapes import full_value
from samples import sample

pytestmark = pytest.mark.peer

SCRIPT = """
import json, sys
import bpy
import numpy as np

job = json.load(open(sys.argv[1]))
found = {}
for name, frames in job["files"].items():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    path = job["folder"] + "/" + name
    if name.endswith(".glb"):
        bpy.ops.import_scene.gltf(filepath=path)
    else:
        bpy.ops.wm.usd_import(filepath=path)
    scene = bpy.context.scene
    for frame in frames:
        # Blender keeps its own 24 frames a second: it takes USD's time codes for frames, and glTF's times for seconds.
        at = frame * scene.render.fps / job["rate"] if name.endswith(".glb") else frame
        scene.frame_set(int(at), subframe=at - int(at))
        graph = bpy.context.evaluated_depsgraph_get()
        for thing in scene.objects:
            if thing.type != "MESH":
                continue
            mesh = thing.evaluated_get(graph)
            points = np.zeros(3 * len(mesh.data.vertices), np.float32)
            mesh.data.vertices.foreach_get("co", points)
            matrix = np.array(mesh.matrix_world)
            world = points.reshape(-1, 3).astype(float) @ matrix[:3, :3].T + matrix[:3, 3]
            found[f"{name}|{frame}|{thing.name}"] = world
            if "_VERTEX" in mesh.data.attributes:
                number = np.zeros(len(mesh.data.vertices), np.float32)
                mesh.data.attributes["_VERTEX"].data.foreach_get("value", number)
                found[f"{name}|{frame}|{thing.name}|vertices"] = number.astype(int)
            if mesh.data.shape_keys or thing.data.shape_keys:
                keys = thing.data.shape_keys.key_blocks
                found[f"{name}|{thing.name}|keys"] = np.array([key.name for key in keys])
np.savez(job["out"], **found)
"""


NAMES = (
    *(f"{profile}.{kind}" for profile in ("portable", "native") for kind in ("usda", "usdc", "usdz")),
    *("turned_native.usdc", "turned_portable.usdc", "face.glb"),
)


@dataclass(frozen=True, eq=False)
class Job:
    """What is written, and how far Blender may be away in units of the face's smallest FAPU."""

    face: AnimatableFace
    stream: FapStream
    portable: bool
    frames: tuple[int, ...]


def _at_borders() -> FapStream:
    """Values at which native blend shapes have the weight 0 or 1: all that Blender makes of them."""
    face = read_face("default")
    rows: dict[int, np.ndarray] = {}
    for frame, numbers in enumerate(((), (3, 35), (31, 32, 39, 64), (14, 53, 44))):
        for number in numbers:
            table = face.tables.get(number)
            assert table is not None
            rows.setdefault(number, np.zeros(5))[frame] = full_value(table_borders(table))
    rows |= {48: np.array([0, 9000, 0, -20000, 0]), 49: np.array([0, 0, 30000, 9000, 0])}
    rows |= {23: np.array([0, 9000, 0, -20000, 0]), 26: np.array([0, -9000, 8000, 0, 0])}
    expressions = np.zeros((5, 6), np.int32)
    expressions[4, :2] = (1, 63)
    return FapStream.build(25, 5, rows, expressions=expressions)


def _turned() -> AnimatableFace:
    """The small face with a turned head below a transform that nothing drives."""
    face = small_face()
    head = face.scene.roots[0]
    assert isinstance(head, Transform)
    body = Transform("body", (replace(head, rotation=(0.6, 0.0, 0.8, 0.3)),), (0.5, 0.0, -0.5), (0.0, 0.0, 1.0, 0.4))
    return replace(face, scene=replace(face.scene, roots=(body,)))


def _jobs() -> dict[str, Job]:
    shipped, (demo, _) = read_face("default"), read_fap(sample("streams/demo.fap"))
    some = (0, 30, 48, 60, 72, 84, 149)
    small = FapStream.build(
        25, 3, {3: [0, 1080, 0], 5: [0, 0, 600], 14: [0, 500, 0], 23: [0, 9000, -20000], 25: [0, 3000, -9000]}
    )
    both = replace(small, values=np.where(np.arange(68) == 4, -small.values, small.values))
    jobs = {f"portable.{kind}": Job(shipped, demo, True, some) for kind in ("usda", "usdc", "usdz")}
    jobs |= {f"native.{kind}": Job(shipped, _at_borders(), False, (0, 1, 2, 3, 4)) for kind in ("usda", "usdc", "usdz")}
    jobs["turned_native.usdc"] = Job(_turned(), small, False, (0, 1, 2))
    jobs["turned_portable.usdc"] = Job(_turned(), both, True, (0, 1, 2))
    jobs["face.glb"] = Job(shipped, demo, False, some)
    return jobs


@dataclass(frozen=True, eq=False)
class Result:
    """The jobs, and what Blender made of them."""

    jobs: dict[str, Job]
    arrays: dict[str, np.ndarray]


@pytest.fixture(scope="module")
def blender(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Result]:
    python = os.environ.get("FBA_BLENDER")
    if not python:
        pytest.skip("needs Blender: FBA_BLENDER must name a Python with the module bpy (see docs/formats/usd.md)")
    folder = tmp_path_factory.mktemp("blender")
    jobs = _jobs()
    for name, job in jobs.items():
        write(job.face, folder / name, job.stream, portable=job.portable)
    (folder / "script.py").write_text(SCRIPT, "utf-8")
    files = {name: job.frames for name, job in jobs.items()}
    order = {"folder": str(folder), "files": files, "rate": 25, "out": str(folder / "found.npz")}
    (folder / "job.json").write_text(json.dumps(order), "utf-8")
    done = subprocess.run(
        [python, str(folder / "script.py"), str(folder / "job.json")],
        capture_output=True, text=True, timeout=600,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    with np.load(folder / "found.npz") as found:
        yield Result(jobs, dict(found))


def test_every_file_is_looked_at(blender: Result) -> None:
    assert set(blender.jobs) == set(NAMES)


def difference(name: str, result: Result) -> float:
    """Largest distance between Blender's vertices and ours over all frames, in the smallest FAPU."""
    job = result.jobs[name]
    meters = job.face.scene.meters_per_unit or 1.0
    poses = list(Player(job.face).frames(job.stream))
    largest = 0.0
    for frame in job.frames:
        for shape, vertices in poses[frame].world_shapes().items():
            x, y, z = result.arrays[f"{name}|{frame}|{shape}"].T / meters
            number = result.arrays.get(f"{name}|{frame}|{shape}|vertices")
            wanted = vertices if number is None else vertices[number]
            # Blender's Z is up, its Y leads away from the viewer.
            away = np.linalg.norm(np.stack([x, z, -y], axis=1) - wanted, axis=1)
            largest = max(largest, float(away.max()))
    assert max(np.abs(p.world() - job.face.scene.world_neutral()).max() for p in poses) > 0.02 * job.face.fapu.es0
    return largest / smallest_unit(job.face)


@pytest.mark.parametrize("name", NAMES)
def test_blender_moves_the_vertices_as_we_do(name: str, blender: Result) -> None:
    assert difference(name, blender) < 0.1


def test_blender_has_the_names_of_the_shapes(blender: Result) -> None:
    portable = set(blender.arrays["portable.usdc|skin|keys"].tolist())
    assert {"open_jaw_pos", "raise_l_i_eyebrow_neg", "viseme_PP", "expression_joy"} <= portable
    assert {"open_jaw", "viseme_PP"} <= set(blender.arrays["native.usdc|skin|keys"].tolist())
