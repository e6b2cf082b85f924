"""A node that goes with the lower teeth, for what other programs hang on a jaw.

The tables move the lower teeth as a mesh, not by a node. This node draws nothing; it has the rigid motion that is
nearest to theirs (least squares over the vertices: W. Kabsch, 1976).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fba.arrays import Floats
from fba.scene import FaceScene, Role, Shape
from formats.gltf.buffers import Json
from formats.names import unique_names
from formats.node_motion import quaternion_of
from formats.targets import Target


def lower_teeth(scene: FaceScene) -> Shape | None:
    """The shape that the jaw's node goes with; None where there is none with three vertices."""
    found = [shape for shape in scene.with_role(Role.LOWER_TEETH) if shape.mesh.vertex_count >= 3]
    return found[0] if found else None


def add_jaw(nodes: list[Json], of: dict[str, int], teeth: Shape) -> str:
    """Add the node beside the lower teeth's, in their middle; return its name."""
    name = unique_names([*of, "jaw"])[-1]
    of[name] = len(nodes)
    above = next(entry for entry in nodes if of[teeth.name] in entry.get("children", ()))
    above["children"].append(len(nodes))
    nodes.append({"name": name, "translation": teeth.mesh.vertices.mean(axis=0).tolist()})
    return name


def jaw_motion(teeth: Shape, targets: Sequence[Target], weights: Floats) -> tuple[Floats, Floats]:
    """Translations (f, 3) and rotations (f, 4) of the jaw's node where the targets have weights (f, t)."""
    rest = teeth.mesh.vertices
    offsets = np.zeros((len(targets), *rest.shape))
    for row, target in zip(offsets, targets, strict=True):
        row[target.index] = target.offsets
    moved = rest + np.tensordot(weights, offsets, axes=1)
    centers = moved.mean(axis=1)
    spread = np.einsum("fni,nj->fij", moved - centers[:, None], rest - rest.mean(axis=0))
    left, _, right = np.linalg.svd(spread)
    left[:, :, 2] *= np.linalg.det(left @ right)[:, None]
    return centers, np.stack([quaternion_of(turn) for turn in left @ right])
