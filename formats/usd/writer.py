"""Scenes and animatable faces to USD stages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pxr import Gf, Kind, Sdf, Tf, Usd, UsdGeom

from fat.build import check_indices
from fat.face import AnimatableFace
from fat.tables import FaceDefTables, FaceDefTransform
from fba.arrays import Floats
from fba.scene import FaceScene, Shape
from fba.stream import FapStream
from formats.normals import SmoothNormals
from formats.targets import table_borders
from formats.usd.animation import Motion, motion_of, write_animation
from formats.usd.axes import StageAxes, axes_for, write_axes
from formats.usd.blend_shapes import MeshTargets, full_value, write_face_def_mesh
from formats.usd.facts import write_facts
from formats.usd.joints import Rig, gf_matrix
from formats.usd.materials import MaterialLibrary
from formats.usd.meshes import write_mesh
from formats.usd.names import CHILDREN, Namer, node_paths, put_name
from formats.usd.properties import put, put_string, put_targets
from formats.usd.stages import placed, quiet, save_layer
from formats.usd.vertex_attributes import write_vertex_attributes
from formats.usd.xforms import write_matrix, write_transform

FORMAT = "fba-usd/1"
ANIMATION = "Animation"
SKELETON = "Skeleton"


@dataclass(frozen=True, eq=False)
class Draft:
    """A stage under construction, in memory.

    Attributes
    ----------
    scene : what is being written.
    rig : the joints that its meshes hang on.
    paths : name of a scene node -> its prim.
    namers : name of a shape -> what hands out the names of prims below it.
    normals : name of a shape -> the normals that it was given; None where it has its own.
    """

    scene: FaceScene
    rig: Rig
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


def write_usd(face: FaceScene | AnimatableFace, path: Path, stream: FapStream | None) -> None:
    """Write a scene, or a face with its tables as blend shapes; see `formats.usd.write`."""
    scene = face.scene if isinstance(face, AnimatableFace) else face
    packed = placed(scene, path)
    with quiet():
        if isinstance(face, AnimatableFace):
            draft = start(packed.scene, "SkelRoot", Rig(scene, face.tables))
            write_facts(draft.root, face, draft.paths, draft.axes)
            _write_tables(draft, face, None if stream is None else motion_of(face, stream))
        else:
            draft = start(packed.scene, "Xform")
    save_layer(draft.layer, path, packed.images)


def start(scene: FaceScene, root_type: str, rig: Rig | None = None) -> Draft:
    """Build the stage of a scene: transforms, meshes, materials, axes and units.

    The meshes stand directly below the root, each with its own matrix: readers differ in whether a mesh with joints
    follows the transforms above it too. Which mesh belongs to which transform is kept beside.

    rig : made of the same shapes; None for one without joints.
    """
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
    draft = Draft(scene, rig or Rig(scene, FaceDefTables()), layer, stage, root, axes, paths, {}, {})
    for node, _ in scene.walk():
        if isinstance(node, Shape):
            smooth = SmoothNormals(node.mesh) if node.mesh.normal_indices is None else None
            draft.namers[node.name] = write_mesh(stage, paths[node.name], node, axes, library, smooth)
            draft.normals[node.name] = smooth
            write_vertex_attributes(UsdGeom.Mesh.Get(stage, paths[node.name]), scene, node.name)
            write_matrix(stage.GetPrimAtPath(paths[node.name]), gf_matrix(scene.world_matrix(node.name), axes))
        else:
            prim = stage.DefinePrim(paths[node.name], "Xform")
            write_transform(prim, node, axes)
            put_targets(prim, CHILDREN, [paths[child.name] for child in node.children])
        put_name(stage.GetPrimAtPath(paths[node.name]), node.name)
    put_targets(root, CHILDREN, [paths[node.name] for node in scene.roots])
    return draft


def finish(
    draft: Draft,
    targets: Sequence[MeshTargets],
    motion: Motion | None = None,
    weights: Mapping[str, Floats] | None = None,
) -> None:
    """Hang the meshes that blend shapes or joints move on one skeleton with one animation.

    targets : of the shapes, in the order of the scene.
    weights : see `formats.usd.animation.write_animation`.
    """
    root = draft.root.GetPath()
    skeleton, animation = root.AppendChild(SKELETON), root.AppendChild(ANIMATION)
    tokens = dict.fromkeys(token for target in targets for token in target.tokens)
    moved = False
    for shape, target in zip(draft.scene.shapes, targets, strict=True):
        if target.tokens:
            target.bind()
        if target.tokens or draft.rig.of_shape[shape.name]:
            world = draft.scene.world_matrix(shape.name)
            draft.rig.bind(target.mesh, shape, world, skeleton, draft.axes)
            moved = True
    if moved:
        draft.rig.write(draft.stage, skeleton, draft.axes, animation)
        write_animation(draft.stage, animation, tokens, draft.rig, draft.axes, motion, weights or {})


def _write_tables(draft: Draft, face: AnimatableFace, motion: Motion | None) -> None:
    counts = {shape.name: shape.mesh.vertex_count for shape in face.scene.shapes}
    targets = {name: draft.targets(name) for name in counts}
    weights: dict[str, Floats] = {}
    scope = draft.stage.DefinePrim(draft.root.GetPath().AppendChild("Tables"))
    put_targets(draft.root, "tables", [scope.GetPath()])
    for number, table in enumerate(face.tables):
        prim = draft.stage.DefinePrim(scope.GetPath().AppendChild(table.name))
        put(prim, "fapID", Sdf.ValueTypeNames.Int, table.fap_id)
        put(prim, "highLevelSelect", Sdf.ValueTypeNames.Int, table.high_level_select)
        blends = []
        for mesh in table.meshes:
            check_indices(table, mesh, counts)
            own = targets[mesh.shape]
            blends.append(write_face_def_mesh(own, table, mesh, face.fapu, draft.axes))
            if motion is not None:
                weights[own.tokens[-1]] = motion.values[:, number] / full_value(table_borders(table))
        put_targets(prim, "meshes", blends)
        for place, turn in enumerate(table.transforms):
            _write_face_def_transform(draft, prim.GetPath().AppendChild(f"transform_{place}"), turn)
    finish(draft, list(targets.values()), motion, weights)


def _write_face_def_transform(draft: Draft, path: Sdf.Path, turn: FaceDefTransform) -> None:
    prim = draft.stage.DefinePrim(path)
    x, y, z = draft.axes.vector(turn.rotation_def[:3])
    put_targets(prim, "transform", [draft.paths[turn.transform]])
    put(prim, "fieldId", Sdf.ValueTypeNames.Int, int(turn.field))
    put(prim, "rotationDef", Sdf.ValueTypeNames.Double4, Gf.Vec4d(x, y, z, turn.rotation_def[3]))
    put(prim, "scaleDef", Sdf.ValueTypeNames.Double3, Gf.Vec3d(*draft.axes.scale(turn.scale_def)))
    put(prim, "translationDef", Sdf.ValueTypeNames.Double3, Gf.Vec3d(*draft.axes.vector(turn.translation_def)))
