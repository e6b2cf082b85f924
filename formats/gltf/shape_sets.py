"""Free expressions as morph targets, and the morph targets of our own files as free expressions."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fat.face import AnimatableFace
from fba.arrays import Floats
from fba.errors import MeshError
from fba.scene import FaceScene
from fba.shapes import ShapeSet
from formats.gltf.data import GltfData, Json
from formats.gltf.own_reader import own_json, read_unchanged
from formats.gltf.primitives import split
from formats.gltf.writer import Draft
from formats.matrices import into_shape
from formats.targets import Target


def write_shapes(scene: FaceScene, shapes: ShapeSet, path: Path) -> None:
    """Write a scene with free expressions; see `formats.gltf.write_shape_set`."""
    if len(shapes.neutral) != scene.vertex_count:
        raise MeshError(f"shapes over {len(shapes.neutral)} vertices do not fit a scene of {scene.vertex_count}")
    places = scene.file_order()
    targets: dict[str, list[Target]] = {}
    for shape in scene.shapes:
        turn = into_shape(scene, shape.name).T
        targets[shape.name] = []
        for name, deltas in zip(shapes.names, shapes.deltas, strict=True):
            inside: Floats = scene.frame.from_file(deltas[places[shape.name]]) @ turn
            index = np.flatnonzero(inside.astype(np.float32).any(axis=1)).astype(np.int32)
            if index.size:
                targets[shape.name].append(Target(name, index, inside[index]))
    draft = Draft(scene, targets)
    draft.own["shapeNames"] = list(shapes.names)
    draft.save(path)


def read_shapes(path: Path) -> ShapeSet | None:
    """Read the morph targets of an own file; see `formats.gltf.read_shape_set`."""
    data = GltfData(Path(path))
    own = own_json(data)
    found = None if own is None else read_unchanged(data, own)
    if own is None or found is None:
        return None
    scene = found.scene if isinstance(found, AnimatableFace) else found
    deltas: dict[str, dict[str, Floats]] = {str(name): {} for name in data.list(own, "shapeNames")}
    drawn = [shape for shape in scene.shapes if shape.mesh.face_count]
    for number, shape in enumerate(drawn):
        mesh = data.item("meshes", number)
        linear = scene.world_matrix(shape.name)[:3, :3]
        for place, name in enumerate(data.list(data.dict(mesh, "extras"), "targetNames")):
            local = np.zeros((shape.mesh.vertex_count, 3))
            primitives = split(shape, np.zeros_like(local))
            for primitive, entry in zip(primitives, data.list(mesh, "primitives"), strict=True):
                local[primitive.vertices] = _target(data, entry, place, len(primitive.vertices))
            deltas.setdefault(str(name), {})[shape.name] = local @ linear.T
    if not deltas:
        return None
    still = {shape.name: np.zeros((shape.mesh.vertex_count, 3)) for shape in scene.shapes}
    rows = [scene.frame.to_file(scene.gather(still | parts)) for parts in deltas.values()]
    return ShapeSet(tuple(deltas), scene.frame.to_file(scene.world_neutral()), np.stack(rows))


def _target(data: GltfData, entry: object, place: int, count: int) -> Floats:
    """(count, 3) offsets of a morph target of a primitive."""
    targets = data.list(entry, "targets") if isinstance(entry, dict) else []
    target: Json = targets[place] if place < len(targets) and isinstance(targets[place], dict) else {}  # type: ignore[assignment]
    offsets = data.accessor(target.get("POSITION"), "VEC3")
    if len(offsets) != count:
        raise data.fail(f"a morph target has {len(offsets)} offsets for {count} vertices")
    return offsets
