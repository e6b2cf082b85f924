"""USD stages to scenes and animatable faces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from pxr import Sdf, Usd, UsdGeom

from fat.face import AnimatableFace
from fat.tables import FaceDefTable, FaceDefTables, FaceDefTransform, TransformField
from fba.errors import InputFileError, UnsupportedFeatureError
from fba.fapu import Fapu
from fba.scene import FaceScene, Node, Shape, Transform
from formats.names import unique_names
from formats.textures import texture_names
from formats.usd.axes import StageAxes, UsdDocument, read_axes
from formats.usd.blend_shapes import read_face_def_mesh
from formats.usd.facts import read_fapu, read_feature_points, read_notes
from formats.usd.meshes import read_mesh
from formats.usd.names import CHILDREN, name_of
from formats.usd.properties import PREFIX, get, need, target, targets
from formats.usd.stages import open_stage, reading
from formats.usd.vertex_attributes import read_vertex_attributes
from formats.usd.writer import FORMAT
from formats.usd.xforms import read_placement

_PREDICATE = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
_HELPERS = (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy)


def read_usd(path: Path) -> FaceScene | AnimatableFace:
    """Read a scene or, where the tables are there, an animatable face; see `formats.usd.read`."""
    with reading(path):
        stage, packed = open_stage(path)
        scene, axes, _ = read_stage(stage, path, packed)
        root = own_root(stage)
        if root is None or target(root, "tables") is None:
            return scene
        fapu = read_fapu(root)
        return AnimatableFace(
            scene, read_feature_points(root, axes), _read_tables(root, fapu, axes), fapu, read_notes(root)
        )


def own_root(stage: Usd.Stage) -> Usd.Prim | None:
    """The prim that this toolkit's writer made the root of a face, if the stage is its work.

    Raises
    ------
    InputFileError
        If it was written by a version that this one does not know.
    """
    for prim in stage.GetPseudoRoot().GetChildren():
        written = get(prim, "format")
        if written is not None:
            if written != FORMAT:
                raise InputFileError(f"{prim.GetPath()} has the format '{written}'; this version reads '{FORMAT}'")
            return prim
    return None


def read_stage(
    stage: Usd.Stage, path: Path, packed: Mapping[str, bytes]
) -> tuple[FaceScene, StageAxes, dict[str, Usd.Prim]]:
    """Read the meshes and transforms of a stage.

    packed : the files of a package; see `formats.usd.stages.open_stage`.

    Returns
    -------
    scene, the axes of the stage, and name of a shape -> its mesh prim.

    Raises
    ------
    InputFileError
        If there is no mesh.
    UnsupportedFeatureError
        If geometry is multiplied by a point instancer.
    """
    root = own_root(stage)
    axes, frame, meters = read_axes(stage, root)
    walk = _Walk(axes, own=root is not None)
    default = stage.GetDefaultPrim()
    tops = [root or default] if root or default else list(stage.GetPseudoRoot().GetFilteredChildren(_PREDICATE))
    nodes = walk.kept(root) if root and root.HasRelationship(PREFIX + CHILDREN) else walk.nodes(tops)
    if not walk.meshes and root is None and default:
        # The default prim is not where the geometry is.
        nodes = walk.nodes(list(stage.GetPseudoRoot().GetFilteredChildren(_PREDICATE)))
    scene = FaceScene(tuple(nodes), frame, meters, path.name.split(".")[0], UsdDocument(axes.up_axis))
    if not any(shape.mesh.face_count for shape in scene.shapes):
        raise InputFileError(f"{path} has no mesh; a face needs UsdGeomMesh prims with polygons")
    scene = replace(scene, images=_images(scene, packed))
    if root is not None:
        prims = {shape.name: prim for shape, prim in zip(scene.shapes, walk.meshes, strict=True)}
        return replace(scene, vertex_attributes=read_vertex_attributes(scene, prims)), axes, prims
    scene = _with_unique_names(scene)
    return scene, axes, {shape.name: prim for shape, prim in zip(scene.shapes, walk.meshes, strict=True)}


def _images(scene: FaceScene, packed: Mapping[str, bytes]) -> dict[str, bytes]:
    """The images in a package that materials name."""
    return {name: packed[name] for name in texture_names(scene) if name in packed}


class _Walk:
    """Goes through prims in order; collects the mesh prims in the order of the shapes."""

    def __init__(self, axes: StageAxes, own: bool) -> None:
        self._axes = axes
        self._own = own
        self.meshes: list[Usd.Prim] = []
        self._taken: set[Sdf.Path] = set()

    def kept(self, parent: Usd.Prim) -> list[Node]:
        """The nodes that this toolkit's writer put below a prim, whose meshes stand elsewhere in the stage."""
        nodes: list[Node] = []
        for prim in targets(parent, CHILDREN):
            if prim.GetPath() in self._taken:
                raise InputFileError(f"{parent.GetPath()}: {PREFIX}{CHILDREN} leads to {prim.GetPath()} a second time")
            self._taken.add(prim.GetPath())
            name = name_of(prim)
            if prim.IsA(UsdGeom.Mesh):
                self.meshes.append(prim)
                nodes.append(read_mesh(prim, self._axes, name))
            else:
                nodes.append(read_placement(prim, self._axes).node(name, tuple(self.kept(prim))))
        return nodes

    def nodes(self, prims: list[Usd.Prim]) -> list[Node]:
        return [node for prim in prims for node in self._visit(prim)]

    def _visit(self, prim: Usd.Prim) -> list[Node]:
        if prim.IsA(UsdGeom.PointInstancer):
            raise UnsupportedFeatureError(
                f"{prim.GetPath()} is a point instancer; make its instances real meshes before reading"
            )
        if prim.IsA(UsdGeom.Imageable) and UsdGeom.Imageable(prim).GetPurposeAttr().Get() in _HELPERS:
            return []
        nodes: list[Node] = []
        if prim.IsA(UsdGeom.Mesh):
            shape = read_mesh(prim, self._axes, name_of(prim))
            # A mesh without points is a placeholder; nothing can lie on it.
            if shape.mesh.vertex_count:
                self.meshes.append(prim)
                nodes.append(shape)
        nodes += self.nodes(list(prim.GetFilteredChildren(_PREDICATE)))
        if not self._is_transform(prim, bool(nodes)):
            return nodes
        name = name_of(prim)
        if prim.IsA(UsdGeom.Mesh):
            name += "_xform"
        return [read_placement(prim, self._axes).node(name, tuple(nodes))]

    def _is_transform(self, prim: Usd.Prim, filled: bool) -> bool:
        if not prim.IsA(UsdGeom.Xformable) or not (filled or self._own):
            return False
        xform = UsdGeom.Xformable(prim)
        if xform.GetXformOpOrderAttr().Get():
            return filled or prim.IsA(UsdGeom.Xform)
        return bool(prim.IsA(UsdGeom.Xform)) and prim.GetParent() != prim.GetStage().GetPseudoRoot()


def _with_unique_names(scene: FaceScene) -> FaceScene:
    """Number names that are there twice; shapes keep theirs rather than transforms."""
    nodes = [node for node, _ in scene.walk()]
    order = sorted(range(len(nodes)), key=lambda i: not isinstance(nodes[i], Shape))
    names = dict(zip(order, unique_names(nodes[i].name for i in order), strict=True))
    numbers = iter(range(len(nodes)))

    def rename(node: Node) -> Node:
        name = names[next(numbers)]
        if isinstance(node, Transform):
            return replace(node, name=name, children=tuple(rename(child) for child in node.children))
        return replace(node, name=name)

    return replace(scene, roots=tuple(rename(root) for root in scene.roots))


def _read_tables(root: Usd.Prim, fapu: Fapu, axes: StageAxes) -> FaceDefTables:
    scope = target(root, "tables")
    tables = []
    for prim in scope.GetChildren() if scope else ():
        fap_id = int(need(prim, "fapID"))
        if not 1 <= fap_id <= 68:
            raise InputFileError(f"{prim.GetPath()} is a table of FAP {fap_id}; FAPs are numbered 1 to 68")
        meshes = tuple(
            read_face_def_mesh(blend, name_of(blend.GetParent()), fap_id, fapu, axes)
            for blend in targets(prim, "meshes")
        )
        turns = tuple(_read_face_def_transform(child, axes) for child in prim.GetChildren())
        tables.append(FaceDefTable(fap_id, int(need(prim, "highLevelSelect")), meshes, turns))
    return FaceDefTables(tuple(tables))


def _read_face_def_transform(prim: Usd.Prim, axes: StageAxes) -> FaceDefTransform:
    node = target(prim, "transform")
    if node is None:
        raise InputFileError(f"{prim.GetPath()} does not say which transform it moves")
    field = int(need(prim, "fieldId"))
    if field not in set(TransformField):
        raise InputFileError(f"{prim.GetPath()} has the fieldId {field}; it must be 1, 2 or 3")
    rotation = need(prim, "rotationDef")
    x, y, z = axes.back((rotation[0], rotation[1], rotation[2]))
    return FaceDefTransform(
        name_of(node),
        TransformField(field),
        (x, y, z, rotation[3]),
        axes.scale_back(tuple(need(prim, "scaleDef"))),
        axes.back(tuple(need(prim, "translationDef"))),
    )
