"""A face for programs that know UsdSkel, but neither inbetweens nor negative weights nor nested transforms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from pxr import Sdf

from fat.face import AnimatableFace
from fat.tables import FaceDefMesh, FaceDefTables
from fba.arrays import Floats
from fba.scene import Shape
from fba.stream import FapStream
from formats.one_sided import LEAST, one_sided, smallest_unit
from formats.usd.animation import motion_of
from formats.usd.blend_shapes import NORMAL_PLACES, rounded
from formats.usd.joints import Rig
from formats.usd.properties import put, to_single
from formats.usd.stages import placed, quiet, save_layer
from formats.usd.writer import finish, start


def write_portable_usd(face: AnimatableFace, path: Path, stream: FapStream | None) -> None:
    """Write a face as one-sided blend shapes and joints; see `formats.usd.write_portable`."""
    motion = None if stream is None else motion_of(face, stream)
    packed = placed(face.scene, path)
    flat = flat_face(replace(face, scene=packed.scene))
    with quiet():
        draft = start(flat.scene, "SkelRoot", Rig(face.scene, face.tables))
        split = one_sided(flat, draft.normals, None if motion is None else motion.values)
        # Digits behind what counts as no motion would only make the file longer.
        places = int(np.ceil(-np.log10(LEAST * smallest_unit(face.fapu))))
        targets = []
        weights: dict[str, Floats] = {}
        for shape in flat.scene.shapes:
            own = draft.targets(shape.name)
            for entry in split[shape.name]:
                normals = None if entry.normals is None else rounded(entry.normals, NORMAL_PLACES)
                blend = own.add(entry.name, entry.index, rounded(entry.offsets, places), normals)
                put(blend.GetPrim(), "valueAtWeightOne", Sdf.ValueTypeNames.Double, entry.at)
                if motion is not None:
                    weights[entry.name] = entry.weight(motion.values[:, entry.table])
            targets.append(own)
        finish(draft, targets, motion, weights)
    save_layer(draft.layer, path, packed.images)


def flat_face(face: AnimatableFace) -> AnimatableFace:
    """The same face without transforms, its shapes and tables in world coordinates.

    Shapes that tables move lose normals of their own, which blend shapes could not turn.
    """
    moved = {mesh.shape for table in face.tables for mesh in table.meshes}
    linear = {shape.name: face.scene.world_matrix(shape.name)[:3, :3] for shape in face.scene.shapes}
    tables = tuple(
        replace(table, meshes=tuple(_flat_table(mesh, linear) for mesh in table.meshes), transforms=())
        for table in face.tables
    )
    shapes = tuple(
        _flat_shape(shape, face.scene.world_matrix(shape.name), shape.name in moved) for shape in face.scene.shapes
    )
    return replace(face, scene=replace(face.scene, roots=shapes), tables=FaceDefTables(tables))


def _flat_table(mesh: FaceDefMesh, linear: Mapping[str, Floats]) -> FaceDefMesh:
    turn = linear.get(mesh.shape)
    if turn is None or np.array_equal(turn, np.eye(3)):
        return mesh
    return replace(mesh, displacements=to_single(mesh.displacements.astype(np.float64) @ turn.T))


def _flat_shape(shape: Shape, matrix: Floats, moved: bool) -> Shape:
    mesh = replace(shape.mesh, normals=None, normal_indices=None) if moved else shape.mesh
    if np.array_equal(matrix, np.eye(4)):
        return replace(shape, mesh=mesh)
    linear = matrix[:3, :3]
    normals = mesh.normals
    if normals is not None:
        turned = normals @ np.linalg.pinv(linear)
        length = np.linalg.norm(turned, axis=1, keepdims=True)
        normals = np.divide(turned, length, out=turned.copy(), where=length > 0)
    mesh = replace(mesh, vertices=mesh.vertices @ linear.T + matrix[:3, 3], normals=normals)
    return replace(shape, mesh=mesh.reversed() if np.linalg.det(linear) < 0.0 else mesh)
