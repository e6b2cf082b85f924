"""What a face file holds, what it can play and what is wrong with it, as plain data."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fat.face import AnimatableFace
from fat.open_jaw import closed_mouth, open_jaw_mode
from fat.tables import FaceDefTables
from fat.validate import validate
from fba.faps import LOW_LEVEL_FAPS, fap
from fba.fapu import Fapu
from fba.feature_points import FeaturePoints, standard_feature_points
from fba.findings import Finding
from fba.high_level import EXPRESSIONS, VISEMES
from fba.mesh import PolyMesh
from fba.neutral import check_neutral
from fba.scene import FaceScene, Shape
from fba.stream import FapStream
from formats.gltf import GltfDocument
from studio.jaw_mode import note_findings


def describe_mesh(mesh: PolyMesh) -> dict[str, object]:
    """Counts of one mesh: vertices, polygons by arity, components, border and non-manifold edges, box."""
    arities = mesh.arities
    uses = mesh.edge_uses
    used = mesh.used_vertices
    box = mesh.vertices[used] if used.any() else mesh.vertices
    return {
        "vertices": mesh.vertex_count,
        "unused_vertices": int((~used).sum()),
        "polygons": mesh.face_count,
        "triangles": int((arities == 3).sum()),
        "quads": int((arities == 4).sum()),
        "larger": int((arities > 4).sum()),
        "components": int(np.unique(mesh.components()[used]).size),
        "border_edges": int((uses == 1).sum()),
        "non_manifold_edges": int((uses > 2).sum()),
        "uv": mesh.texcoords is not None,
        "box": [box.min(axis=0).tolist(), box.max(axis=0).tolist()],
    }


def describe_scene(scene: FaceScene) -> dict[str, object]:
    """Shapes, transforms, axes and unit of a scene."""
    return {
        "name": scene.name,
        "vertices": scene.vertex_count,
        "shapes": [_describe_shape(shape) for shape in scene.shapes],
        "transforms": [transform.name for transform in scene.transforms],
        "morph_targets": morph_targets(scene),
        "meters_per_unit": scene.meters_per_unit,
        "axes_turned": not scene.frame.identity,
        "winding_reversed": scene.frame.reversed_winding,
    }


def morph_targets(scene: FaceScene) -> list[str]:
    """Names of the morph targets that a glTF file holds beside the neutral mesh."""
    document = scene.document
    if not isinstance(document, GltfDocument):
        return []
    return list(dict.fromkeys(name for targets in document.targets.values() for name in targets))


def _describe_shape(shape: Shape) -> dict[str, object]:
    return {
        "name": shape.name,
        "role": shape.role.value,
        "materials": [m.name for m in shape.materials],
        "textures": [m.texture for m in shape.materials if m.texture],
        **describe_mesh(shape.mesh),
    }


def describe_tables(tables: FaceDefTables) -> dict[str, object]:
    """Which FAPs, visemes and expressions the tables serve, and which are missing."""
    low = [t.fap_id for t in tables if t.fap_id in LOW_LEVEL_FAPS]
    return {
        "faps": low,
        "missing_faps": [number for number in LOW_LEVEL_FAPS if number not in low],
        "visemes": [t.name for t in tables if t.fap_id == 1],
        "missing_visemes": [v.name for v in VISEMES if tables.get(1, v.id) is None],
        "expressions": [t.name for t in tables if t.fap_id == 2],
        "missing_expressions": [e.name for e in EXPRESSIONS if tables.get(2, e.id) is None],
        "intervals": {t.name: [m.interval_borders.tolist() for m in t.meshes] for t in tables if t.meshes},
    }


def describe_points(scene: FaceScene, points: FeaturePoints) -> tuple[dict[str, object], list[Finding]]:
    """Feature points and the FAPUs they give, and what the neutral pose lacks."""
    from fba.errors import LandmarkError

    fapu: dict[str, float] | None = None
    findings: list[Finding] = []
    try:
        measured = Fapu.from_feature_points(points.positions(scene))
        fapu = describe_fapu(measured)
        findings += check_neutral(scene, points, measured)
    except LandmarkError as error:
        findings.append(Finding("error", "fapu", str(error)))
    known = standard_feature_points()
    about: dict[str, object] = {
        "feature_points": len([i for i in points if i in known]),
        "missing_feature_points": [i for i in known if i not in points],
        "fapu": fapu,
    }
    return about, findings


def describe_fapu(fapu: Fapu) -> dict[str, float]:
    """The five distances in mesh units."""
    return {
        "IRISD0": fapu.irisd0,
        "ES0": fapu.es0,
        "ENS0": fapu.ens0,
        "MNS0": fapu.mns0,
        "MW0": fapu.mw0,
    }


def describe_face(face: AnimatableFace) -> tuple[dict[str, object], list[Finding]]:
    """Everything about an animatable face."""
    about, findings = describe_points(face.scene, face.feature_points)
    findings = [*validate(face), *findings]
    plays = all(f.severity != "error" for f in findings)
    about = {
        **describe_scene(face.scene),
        **about,
        "tables": describe_tables(face.tables),
        "open_jaw": open_jaw_mode(face) if plays else None,
        "notes": dict(face.notes),
    }
    return about, [*findings, *note_findings(face), *closed_mouth(face)] if plays else findings


def mesh_findings(scene: FaceScene) -> list[Finding]:
    """What makes a plain mesh hard to animate."""
    remarks: tuple[str, ...] = getattr(scene.document, "remarks", ())
    findings = [Finding("info", "reader", remark) for remark in remarks]
    for shape in scene.shapes:
        about = describe_mesh(shape.mesh)
        if about["non_manifold_edges"]:
            text = f"{about['non_manifold_edges']} edges belong to more than two polygons"
            findings.append(Finding("warning", "non-manifold", text, shape.name))
        if about["unused_vertices"]:
            text = f"{about['unused_vertices']} vertices belong to no polygon; they are kept and stay still"
            findings.append(Finding("info", "unused-vertices", text, shape.name))
        seams = _coincident_border_vertices(shape.mesh)
        if seams:
            text = f"{seams} border vertices lie exactly on another one: seams split by texture coordinates, or lips"
            findings.append(Finding("info", "split-vertices", text, shape.name))
    return findings


def _coincident_border_vertices(mesh: PolyMesh) -> int:
    border = np.unique(mesh.edges[mesh.edge_uses == 1])
    if border.size == 0:
        return 0
    _, counts = np.unique(mesh.vertices[border], axis=0, return_counts=True)
    return int(counts[counts > 1].sum())


def describe_stream(stream: FapStream) -> dict[str, object]:
    """Frames, rate and the FAPs that a stream moves, with their ranges."""
    moving = np.flatnonzero(stream.mask.any(axis=0) & (stream.values != 0).any(axis=0))
    return {
        "frames": len(stream),
        "frame_rate": stream.frame_rate,
        "seconds": len(stream) / stream.frame_rate,
        "masked_faps": (np.flatnonzero(stream.mask.any(axis=0)) + 1).tolist(),
        "ranges": {
            fap(int(k) + 1).name: [int(stream.values[:, k].min()), int(stream.values[:, k].max())] for k in moving
        },
        "visemes": bool(stream.mask[:, 0].any()),
        "expressions": bool(stream.mask[:, 1].any()),
    }


def number_ranges(numbers: Sequence[int]) -> str:
    """Write numbers short.

    >>> number_ranges([3, 4, 5, 8, 10, 11])
    '3-5, 8, 10-11'
    """
    parts: list[str] = []
    start = previous = None
    for number in [*numbers, None]:
        if previous is not None and number == previous + 1:
            previous = number
            continue
        if start is not None:
            parts.append(str(start) if start == previous else f"{start}-{previous}")
        start = previous = number
    return ", ".join(parts)
