"""Scenes and animatable faces to USD stages."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pxr import Gf, Kind, Sdf, Tf, Usd, UsdSkel, Vt

from fat.build import check_indices
from fat.face import AnimatableFace
from fat.tables import FaceDefTransform
from fba.errors import FaceDefTablesError
from fba.scene import FaceScene, Shape
from formats.normals import SmoothNormals
from formats.usd.axes import StageAxes, axes_for, write_axes
from formats.usd.blend_shapes import MeshTargets, write_face_def_mesh
from formats.usd.facts import write_facts
from formats.usd.materials import MaterialLibrary
from formats.usd.meshes import write_mesh
from formats.usd.names import Namer, node_paths, put_name
from formats.usd.properties import put, put_string, put_targets
from formats.usd.stages import quiet, save_layer
from formats.usd.xforms import write_transform

FORMAT = "fba-usd/1"
JOINT = "root"


@dataclass(frozen=True, eq=False)
class Draft:
    """A stage under construction, in memory.

    Attributes
    ----------
    paths : name of a scene node -> its prim.
    namers : name of a shape -> what hands out the names of prims below it.
    normals : name of a shape -> the normals that it was given; None where it has its own.
    """

    layer: Sdf.Layer
    stage: Usd.Stage
    root: Usd.Prim
    axes: StageAxes
    paths: dict[str, Sdf.Path]
    namers: dict[str, Namer]
    normals: dict[str, SmoothNormals | None]

    def targets(self, shape: str) -> MeshTargets:
        """Where the blend shapes of a shape go."""
        prim = self.stage.GetPrimAtPath(self.paths[shape])
        return MeshTargets(prim, self.namers[shape], self.axes, self.normals[shape])


def write_usd(face: FaceScene | AnimatableFace, path: Path) -> None:
    """Write a scene, or a face with its tables as blend shapes; see `formats.usd.write`."""
    with quiet():
        if isinstance(face, AnimatableFace):
            draft = start(face.scene, "SkelRoot")
            write_facts(draft.root, face, draft.paths, draft.axes)
            _write_tables(draft, face)
        else:
            draft = start(face, "Xform")
    save_layer(draft.layer, path)


def start(scene: FaceScene, root_type: str) -> Draft:
    """Build the stage of a scene: transforms, meshes, materials, axes and units."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    stage = Usd.Stage.Open(layer)
    root = stage.DefinePrim(Sdf.Path.absoluteRootPath.AppendChild(Tf.MakeValidIdentifier(scene.name)), root_type)
    stage.SetDefaultPrim(root)
    Usd.ModelAPI(root).SetKind(Kind.Tokens.component)
    axes = axes_for(scene)
    put_string(root, "format", FORMAT)
    write_axes(stage, root, scene, axes)
    paths = node_paths(scene, root.GetPath())
    library = MaterialLibrary(stage, root.GetPath().AppendChild("Materials"))
    namers: dict[str, Namer] = {}
    normals: dict[str, SmoothNormals | None] = {}
    for node, _ in scene.walk():
        if isinstance(node, Shape):
            smooth = SmoothNormals(node.mesh) if node.mesh.normal_indices is None else None
            namers[node.name] = write_mesh(stage, paths[node.name], node, axes, library, smooth)
            normals[node.name] = smooth
        else:
            write_transform(stage.DefinePrim(paths[node.name], "Xform"), node, axes)
        put_name(stage.GetPrimAtPath(paths[node.name]), node.name)
    return Draft(layer, stage, root, axes, paths, namers, normals)


def bind_targets(draft: Draft, targets: list[MeshTargets]) -> None:
    """Give the meshes with blend shapes their skeletons, and all skeletons one animation with zero weights.

    A skeleton stands beside the meshes that it is bound to: readers differ in whether a mesh without joints
    follows its own transforms or its skeleton's, and so both are the same.
    """
    tokens = list(dict.fromkeys(token for target in targets for token in target.tokens))
    if not tokens:
        return
    animation = UsdSkel.Animation.Define(draft.stage, draft.root.GetPath().AppendChild("Animation"))
    animation.CreateBlendShapesAttr(tokens)
    animation.CreateBlendShapeWeightsAttr(Vt.FloatArray.FromNumpy(np.zeros(len(tokens), np.float32)))
    skeletons: set[Sdf.Path] = set()
    for target in targets:
        if not target.tokens:
            continue
        path = target.mesh.GetPath().GetParentPath().AppendChild("Skeleton")
        if path not in skeletons:
            _write_skeleton(draft.stage, path, animation.GetPath())
            skeletons.add(path)
        target.bind(path)


def _write_skeleton(stage: Usd.Stage, path: Sdf.Path, animation: Sdf.Path) -> None:
    skeleton = UsdSkel.Skeleton.Define(stage, path)
    skeleton.CreateJointsAttr([JOINT])
    skeleton.CreateBindTransformsAttr([Gf.Matrix4d(1.0)])
    skeleton.CreateRestTransformsAttr([Gf.Matrix4d(1.0)])
    binding = UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    binding.CreateAnimationSourceRel().SetTargets([animation])


def _write_tables(draft: Draft, face: AnimatableFace) -> None:
    counts = {shape.name: shape.mesh.vertex_count for shape in face.scene.shapes}
    transforms = {transform.name for transform in face.scene.transforms}
    targets = {name: draft.targets(name) for name in counts}
    scope = draft.stage.DefinePrim(draft.root.GetPath().AppendChild("Tables"), "Scope")
    put_targets(draft.root, "tables", [scope.GetPath()])
    for table in face.tables:
        prim = draft.stage.DefinePrim(scope.GetPath().AppendChild(table.name), "Scope")
        put(prim, "fapID", Sdf.ValueTypeNames.Int, table.fap_id)
        put(prim, "highLevelSelect", Sdf.ValueTypeNames.Int, table.high_level_select)
        blends = []
        for mesh in table.meshes:
            check_indices(table, mesh, counts)
            blends.append(write_face_def_mesh(targets[mesh.shape], table, mesh, face.fapu, draft.axes))
        put_targets(prim, "meshes", blends)
        for number, turn in enumerate(table.transforms):
            if turn.transform not in transforms:
                raise FaceDefTablesError(f"{table.name}: there is no transform '{turn.transform}' in the scene")
            _write_face_def_transform(draft, prim.GetPath().AppendChild(f"transform_{number}"), turn)
    bind_targets(draft, list(targets.values()))


def _write_face_def_transform(draft: Draft, path: Sdf.Path, turn: FaceDefTransform) -> None:
    prim = draft.stage.DefinePrim(path, "Scope")
    x, y, z = draft.axes.vector(turn.rotation_def[:3])
    put_targets(prim, "transform", [draft.paths[turn.transform]])
    put(prim, "fieldId", Sdf.ValueTypeNames.Int, int(turn.field))
    put(prim, "rotationDef", Sdf.ValueTypeNames.Double4, Gf.Vec4d(x, y, z, turn.rotation_def[3]))
    put(prim, "scaleDef", Sdf.ValueTypeNames.Double3, Gf.Vec3d(*draft.axes.scale(turn.scale_def)))
    put(prim, "translationDef", Sdf.ValueTypeNames.Double3, Gf.Vec3d(*draft.axes.vector(turn.translation_def)))
