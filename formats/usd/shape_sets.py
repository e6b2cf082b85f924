"""Free expressions as blend shapes, and the blend shapes of any file as free expressions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdSkel

from fba.arrays import Floats
from fba.errors import InputFileError, MeshError
from fba.scene import FaceScene
from fba.shapes import ShapeSet
from formats.matrices import into_shape
from formats.usd.names import Namer, name_of
from formats.usd.properties import get, ints, put, put_string, rows, to_single
from formats.usd.reader import own_root, read_stage
from formats.usd.stages import open_stage, placed, quiet, reading, save_layer
from formats.usd.writer import finish, start


def write_shapes(scene: FaceScene, shapes: ShapeSet, path: Path) -> None:
    """Write a scene with free expressions as blend shapes; see `formats.usd.write_shape_set`."""
    if len(shapes.neutral) != scene.vertex_count:
        raise MeshError(f"shapes over {len(shapes.neutral)} vertices do not fit a scene of {scene.vertex_count}")
    places = scene.file_order()
    packed = placed(scene, path)
    with quiet():
        draft = start(packed.scene, "SkelRoot")
        put(draft.root, "shapeNames", Sdf.ValueTypeNames.StringArray, list(shapes.names))
        # An animation knows shapes by their tokens, so one expression has the same token on every mesh.
        namer = Namer()
        tokens = [namer.name(name) for name in shapes.names]
        targets = []
        for shape in scene.shapes:
            own = draft.targets(shape.name)
            turn = into_shape(scene, shape.name).T
            for name, token, deltas in zip(shapes.names, tokens, shapes.deltas, strict=True):
                inside: Floats = scene.frame.from_file(deltas[places[shape.name]]) @ turn
                index = np.flatnonzero(np.any(to_single(inside) != 0.0, axis=1)).astype(np.int32)
                if index.size:
                    offsets = inside[index]
                    put_string(own.add(token, index, offsets, own.turned(index, offsets)).GetPrim(), "name", name)
            targets.append(own)
        finish(draft, targets)
    save_layer(draft.layer, path, packed.images)


def read_shapes(path: Path) -> ShapeSet | None:
    """Read blend shapes as free expressions; see `formats.usd.read_shape_set`."""
    with reading(path):
        stage, packed = open_stage(path)
        scene, axes, prims = read_stage(stage, path, packed)
        root = own_root(stage)
        listed = (get(root, "shapeNames") if root else None) or ()
        found: dict[str, dict[str, Floats]] = {str(name): {} for name in listed}
        for shape in scene.shapes:
            linear = scene.world_matrix(shape.name)[:3, :3]
            for name, blend in _targets(prims[shape.name]):
                local = axes.frame.from_file(_full(blend, shape.mesh.vertex_count))
                found.setdefault(name, {})[shape.name] = local @ linear.T
        if not found:
            return None
        still = {shape.name: np.zeros((shape.mesh.vertex_count, 3)) for shape in scene.shapes}
        deltas = [scene.frame.to_file(scene.gather({**still, **moved})) for moved in found.values()]
        return ShapeSet(tuple(found), scene.frame.to_file(scene.world_neutral()), np.stack(deltas))


def _targets(mesh: Usd.Prim) -> list[tuple[str, UsdSkel.BlendShape]]:
    """Name and prim of each blend shape that a mesh is bound to."""
    binding = UsdSkel.BindingAPI(mesh)
    tokens = binding.GetBlendShapesAttr().Get() or ()
    paths = binding.GetBlendShapeTargetsRel().GetForwardedTargets()
    if len(tokens) != len(paths):
        raise InputFileError(f"{mesh.GetPath()} names {len(tokens)} blend shapes, but has {len(paths)} targets")
    out = []
    for token, path in zip(tokens, paths, strict=True):
        blend = UsdSkel.BlendShape(mesh.GetStage().GetPrimAtPath(path))
        if not blend:
            raise InputFileError(f"{mesh.GetPath()}: the blend shape '{token}' leads to {path}, which is not one")
        out.append((name_of(blend.GetPrim()) if get(blend.GetPrim(), "name") is not None else str(token), blend))
    return out


def _full(blend: UsdSkel.BlendShape, count: int) -> Floats:
    """Offsets (n, 3) of all points of the mesh at weight 1."""
    offsets = rows(blend.GetOffsetsAttr().Get(), 3).astype(np.float64)
    index = ints(blend.GetPointIndicesAttr().Get() or [])
    if not index.size and len(offsets) == count:
        return offsets
    if index.size != len(offsets) or (index.size and (int(index.min()) < 0 or int(index.max()) >= count)):
        raise InputFileError(f"{blend.GetPath()} has offsets or point indices that do not fit its mesh")
    full = np.zeros((count, 3))
    np.add.at(full, index, offsets)
    return full
