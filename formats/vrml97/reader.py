"""From parsed statements to a scene or an animatable face; shared by VRML97 and BT."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fat.face import AnimatableFace
from fat.tables import FaceDefTables
from fba.arrays import Floats
from fba.closest import TriangleSearch
from fba.errors import InputFileError, LandmarkError, MeshError
from fba.fapu import FAPU_DIVISOR, Fapu
from fba.feature_points import FeaturePoint, FeaturePoints
from fba.findings import Finding
from fba.orientation import orient
from fba.scene import FaceScene, Role, Shape, Transform
from formats.extent import require_near
from formats.vrml97.axes import from_file_axes
from formats.vrml97.document import VrmlDocument, split
from formats.vrml97.face_nodes import TableReader, calibration_points, fdp_of, referred_names
from formats.vrml97.metadata import Metadata, apply_to_shape, read_metadata
from formats.vrml97.references import definitions_first, unique_definitions
from formats.vrml97.scene import SceneReader
from formats.vrml97.tree import Field, Statement, Use, VrmlNode, definitions

_ON_SURFACE = 0.02
"""A feature point within this part of the scene's diagonal is taken to lie on the surface: the printed coordinates
of hand-made files are rounded or a little off the mesh."""

_DRIFT = 1e-4
"""The same for feature points of the metadata against featurePointsCoord: more means that the file was edited."""

_EYE_FAPS = {23: Role.EYE_LEFT, 25: Role.EYE_LEFT, 24: Role.EYE_RIGHT, 26: Role.EYE_RIGHT}


def assemble(statements: tuple[Statement, ...], name: str, findings: list[Finding]) -> FaceScene | AnimatableFace:
    """Build what a file holds: an AnimatableFace if a Face node has tables, else a FaceScene.

    Raises
    ------
    InputFileError, MeshError, FaceDefTablesError
        If the file has no polygon mesh, or what it holds contradicts itself.
    """
    statements = unique_definitions(statements)
    everything = definitions(statements)
    parts = split(statements)
    kept = definitions_first(parts.statements, everything)
    defs = definitions(kept)
    fdp = fdp_of(parts.faces, everything)
    wanted = referred_names(fdp, everything) if fdp is not None else set()
    reader = SceneReader(defs, wanted, findings)
    roots = reader.roots(kept)
    if not any(isinstance(p, Shape) and p.mesh.face_count for p in reader.parts.values()):
        raise InputFileError(
            f"{name}: there is no IndexedFaceSet with polygons in a Shape, so this file holds no polygon mesh "
            "(Inline files and the insides of PROTOs are not searched)"
        )
    metadata = read_metadata(parts.metadata, findings)
    reader_nodes, scene = _scene(reader, roots, metadata, name)
    document = VrmlDocument(kept, reader_nodes, _by_name(scene), _face_extras(parts.faces), tuple(findings))
    scene = replace(scene, document=document)
    scene = from_file_axes(scene, metadata.frame)
    if fdp is None:
        return scene
    face = _face(scene, fdp, everything, reader_nodes, defs, metadata, findings)
    return replace(face, scene=replace(face.scene, document=replace(document, findings=tuple(findings))))


def _by_name(scene: FaceScene) -> dict[str, Shape | Transform]:
    return {part.name: part for part, _ in scene.walk()}


def _scene(
    reader: SceneReader, roots: tuple[Shape | Transform, ...], metadata: Metadata, name: str
) -> tuple[dict[str, VrmlNode], FaceScene]:
    """The scene in file axes, with the names, roles, groups and materials that the metadata knows."""
    renamed = {
        old: metadata.names[item.def_name]
        for old, item in reader.nodes.items()
        if item.def_name is not None and item.def_name in metadata.names
    }
    final = {old: renamed.get(old, old) for old in reader.nodes}
    if len(set(final.values())) != len(final):
        final = {old: old for old in final}

    def visit(part: Shape | Transform) -> Shape | Transform:
        named = replace(part, name=final[part.name])
        if isinstance(named, Transform):
            return replace(named, children=tuple(visit(c) for c in named.children))
        row = metadata.shapes.get(named.name)
        return named if row is None else apply_to_shape(named, row, reader.findings)

    scene = FaceScene(
        tuple(visit(r) for r in roots), meters_per_unit=metadata.meters_per_unit, name=metadata.name or name
    )
    try:
        scene.file_order()
    except MeshError:
        message = "the noted places of vertices do not form one list; ignored"
        reader.findings.append(Finding("warning", "metadata", message))
        scene = scene.map_shapes({s.name: replace(s, vertex_ids=None) for s in scene.shapes})
    return {final[old]: item for old, item in reader.nodes.items()}, scene


def _face(
    scene: FaceScene,
    fdp: VrmlNode,
    everything: Mapping[str, VrmlNode],
    nodes: Mapping[str, VrmlNode],
    defs: Mapping[str, VrmlNode],
    metadata: Metadata,
    findings: list[Finding],
) -> AnimatableFace:
    positions = calibration_points(fdp, everything)
    points = _checked_points(scene, metadata.points, positions, findings)
    if points is None:
        points = _snapped(scene, {i: scene.frame.from_file(p) for i, p in positions.items()})
    if not metadata.shapes:
        try:
            scene, points, said = orient(scene, points)
            findings.extend(said)
        except LandmarkError as error:
            findings.append(Finding("info", "axes", f"the file's axes are taken as they are: {error}"))
    scene_names = {n.def_name: name for name, n in nodes.items() if n.def_name is not None}
    tables = TableReader(scene, everything, scene_names, _geometry_names(nodes)).read(fdp)
    if not metadata.shapes:
        scene = _with_roles(scene, tables)
    notes = dict(metadata.notes)
    fapu = metadata.fapu
    if fapu is None:
        fapu, missing = _measured({i: scene.frame.from_file(p) for i, p in positions.items()})
        if missing:
            notes["fapu"] = message = f"not measurable: {missing}; one unit of length is taken for each"
            findings.append(Finding("warning", "fapu", message))
    return AnimatableFace(scene, points, tables, fapu, notes)


def _face_extras(faces: tuple[VrmlNode, ...]) -> tuple[Field, ...]:
    """Fields of the first Face that the toolkit does not use and gives back: interpolation table and speech source."""
    for face in faces:
        return tuple(p for p in face.body if isinstance(p, Field) and p.name in ("fit", "ttsSource"))
    return ()


def _geometry_names(nodes: Mapping[str, VrmlNode]) -> dict[str, str]:
    """DEF name of an IndexedFaceSet -> scene name of its shape (some writers let FaceDefMesh refer to it)."""
    found: dict[str, str] = {}
    for name, shape in nodes.items():
        for item in shape.nodes("geometry") if shape.type == "Shape" else ():
            geometry = item.name if isinstance(item, Use) else item.def_name
            if geometry is not None:
                found.setdefault(geometry, name)
    return found


def _with_roles(scene: FaceScene, tables: FaceDefTables) -> FaceScene:
    """Roles that the tables imply: what the eyeball FAPs turn is an eye, what most tables bend is the skin."""
    roles: dict[str, Role] = {}
    bent: dict[str, int] = {}
    for table in tables:
        for mesh in table.meshes:
            bent[mesh.shape] = bent.get(mesh.shape, 0) + 1
        if table.fap_id in _EYE_FAPS:
            turned = {t.transform for t in table.transforms}
            for part, above in scene.walk():
                if isinstance(part, Shape) and any(t.name in turned for t in above):
                    roles[part.name] = _EYE_FAPS[table.fap_id]
    skin = [name for name in bent if name not in roles]
    if skin:
        roles[max(skin, key=lambda n: (bent[n], n))] = Role.SKIN
    return scene.map_shapes({s.name: replace(s, role=roles[s.name]) for s in scene.shapes if s.name in roles})


def _world(scene: FaceScene) -> dict[str, Floats]:
    """World vertices of every shape, in one walk."""
    found: dict[str, Floats] = {}
    for part, above in scene.walk():
        if isinstance(part, Shape):
            matrix = np.eye(4)
            for transform in above:
                matrix = matrix @ transform.matrix()
            with np.errstate(over="ignore", invalid="ignore"):
                found[part.name] = part.mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3]
    require_near(found.values())
    return found


def _diagonal(world: Mapping[str, Floats]) -> float:
    points = np.concatenate(list(world.values()))
    return float(np.linalg.norm(points.max(axis=0) - points.min(axis=0))) if len(points) else 0.0


def _checked_points(
    scene: FaceScene, points: FeaturePoints | None, positions: Mapping[str, Floats], findings: list[Finding]
) -> FeaturePoints | None:
    """The metadata's points if they fit the scene and lie where featurePointsCoord has them."""
    if points is None:
        return None
    counts = {s.name: s.mesh.vertex_count for s in scene.shapes}
    fits = all(
        p.shape is None or (p.shape in counts and min(p.vertices) >= 0 and max(p.vertices) < counts[p.shape])
        for p in points.values()
    )
    if fits:
        world = _world(scene)
        near = _DRIFT * _diagonal(world)
        here = points.positions(scene, world)
        given = {i: scene.frame.from_file(p) for i, p in positions.items()}
        fits = all(float(np.linalg.norm(here[i] - given[i])) <= near for i in here if i in given)
    if fits:
        return points
    message = "the noted feature points do not fit the mesh any more; featurePointsCoord is used instead"
    findings.append(Finding("warning", "feature-points", message))
    return None


def _snapped(scene: FaceScene, positions: Mapping[str, Floats]) -> FeaturePoints:
    """Points on the nearest surface where one is close, free points otherwise."""
    world = _world(scene)
    surfaces = []
    for shape in scene.shapes:
        if shape.mesh.face_count:
            triangles = shape.mesh.triangles
            surfaces.append((shape.name, triangles, TriangleSearch(world[shape.name], triangles)))
    near = _ON_SURFACE * _diagonal(world)
    found: dict[str, FeaturePoint] = {}
    for key, position in positions.items():
        hits = [(search.closest(position), name, triangles) for name, triangles, search in surfaces]
        best = min(hits, key=lambda h: h[0][2], default=None)
        if best is None or best[0][2] > near:
            found[key] = FeaturePoint.free(position)
            continue
        (face, weights, _), name, triangles = best
        corners = tuple(int(v) for v in triangles[face])
        found[key] = FeaturePoint(name, corners, tuple(float(w) for w in weights))
    return FeaturePoints(found)


def _measured(positions: Mapping[str, Floats]) -> tuple[Fapu, str]:
    """FAPUs from feature points; where that fails one unit of length, and the reason."""
    try:
        return Fapu.from_feature_points(positions), ""
    except LandmarkError as error:
        return Fapu(*[FAPU_DIVISOR] * 5), str(error)
