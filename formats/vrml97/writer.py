"""From scene or face to statements and text; shared by VRML97 and BT."""

from __future__ import annotations

from dataclasses import dataclass, replace

from fat.face import AnimatableFace
from fba.scene import FaceScene
from formats.vrml97.document import MPEG4_NODES, VrmlDocument
from formats.vrml97.face_nodes import face_node, fap_field
from formats.vrml97.merge import merge
from formats.vrml97.metadata import metadata_node
from formats.vrml97.tree import (
    Booleans,
    Empty,
    Interface,
    Nodes,
    Numbers,
    Proto,
    Statement,
    Use,
    VrmlNode,
    node,
    number,
    walk,
)

NOT_INITIALIZED = 2**31 - 1
"""The value of a FAP field that is not set: the standard's +I as VRML97's largest SFInt32."""

_NULL = Nodes((None,))
_INTERFACES: dict[str, tuple[tuple[str, str, Numbers | Nodes | Booleans | Empty], ...]] = {
    "Viseme": (
        ("SFInt32", "viseme_select1", number(0)),
        ("SFInt32", "viseme_select2", number(0)),
        ("SFInt32", "viseme_blend", number(0)),
        ("SFBool", "viseme_def", Booleans((False,))),
    ),
    "Expression": (
        ("SFInt32", "expression_select1", number(0)),
        ("SFInt32", "expression_intensity1", number(0)),
        ("SFInt32", "expression_select2", number(0)),
        ("SFInt32", "expression_intensity2", number(0)),
        ("SFBool", "init_face", Booleans((False,))),
        ("SFBool", "expression_def", Booleans((False,))),
    ),
    "FAP": (
        ("SFNode", "viseme", _NULL),
        ("SFNode", "expression", _NULL),
        *(("SFInt32", fap_field(k), number(NOT_INITIALIZED)) for k in range(3, 69)),
    ),
    "FaceDefMesh": (
        ("SFNode", "faceSceneGraphNode", _NULL),
        ("MFInt32", "intervalBorders", Empty()),
        ("MFInt32", "coordIndex", Empty()),
        ("MFVec3f", "displacements", Empty()),
    ),
    "FaceDefTransform": (
        ("SFNode", "faceSceneGraphNode", _NULL),
        ("SFInt32", "fieldId", number(1)),
        ("SFRotation", "rotationDef", number(0, 0, 1, 0)),
        ("SFVec3f", "scaleDef", number(1, 1, 1)),
        ("SFVec3f", "translationDef", number(0, 0, 0)),
    ),
    "FaceDefTables": (
        ("SFInt32", "fapID", number(1)),
        ("SFInt32", "highLevelSelect", number(1)),
        ("MFNode", "faceDefMesh", Empty()),
        ("MFNode", "faceDefTransform", Empty()),
    ),
    "FIT": (
        ("MFInt32", "FAPs", Empty()),
        ("MFInt32", "Graph", Empty()),
        ("MFInt32", "numeratorExp", Empty()),
        ("MFInt32", "denominatorExp", Empty()),
        ("MFInt32", "numeratorImpulse", Empty()),
        ("MFInt32", "numeratorTerms", Empty()),
        ("MFInt32", "denominatorTerms", Empty()),
        ("MFFloat", "numeratorCoefs", Empty()),
        ("MFFloat", "denominatorCoefs", Empty()),
    ),
    "FDP": (
        ("SFNode", "featurePointsCoord", _NULL),
        ("SFNode", "textureCoord", _NULL),
        ("MFNode", "faceDefTables", Empty()),
        ("MFNode", "faceSceneGraph", Empty()),
        ("SFBool", "useOrthoTexture", Booleans((False,))),
    ),
    "Face": (
        ("SFNode", "fap", _NULL),
        ("SFNode", "fdp", _NULL),
        ("SFNode", "fit", _NULL),
        ("SFNode", "ttsSource", _NULL),
        ("MFNode", "renderedFace", Empty()),
    ),
}
"""Interfaces of ISO/IEC 14496-1 for the nodes that the writer uses, each after the ones it holds."""

_CREATION_ONLY = frozenset({"FaceDefMesh", "FaceDefTransform"})
_CREATION_ONLY_FIELDS = frozenset({"fapID", "highLevelSelect", "useOrthoTexture"})


@dataclass(frozen=True, eq=False)
class Written:
    """The pieces of a file: the scene with all that surrounds it, the Face (None for a plain scene), the metadata.

    roots : DEF names of the statements that make up the face's scene graph, in order.
    """

    statements: tuple[Statement, ...]
    roots: tuple[str, ...]
    face: VrmlNode | None
    metadata: VrmlNode


def pieces(face: FaceScene | AnimatableFace) -> Written:
    """Build everything that a VRML97 or BT file of this face holds."""
    scene = face.scene if isinstance(face, AnimatableFace) else face
    statements, def_names = merge(scene)
    wanted = {def_names[root.name] for root in scene.roots}
    roots = tuple(s.def_name for s in statements if isinstance(s, VrmlNode) and s.def_name in wanted and s.def_name)
    built = None
    if isinstance(face, AnimatableFace):
        built = face_node(face, def_names, Nodes(tuple(Use(r) for r in roots), True))
        if isinstance(scene.document, VrmlDocument):
            built = replace(built, body=(*built.body, *scene.document.face_fields))
    return Written(statements, roots, built, metadata_node(face, def_names))


def declarations(face: VrmlNode) -> tuple[Proto, ...]:
    """PROTOs of the MPEG-4 nodes below a Face, so that VRML97 browsers accept them (and draw nothing for them)."""
    used = {n.type for n in walk([face]) if isinstance(n, VrmlNode)} & MPEG4_NODES
    protos = []
    for name, fields in _INTERFACES.items():
        if name not in used:
            continue
        interface = []
        for kind, field, default in fields:
            fixed = name in _CREATION_ONLY or field in _CREATION_ONLY_FIELDS
            interface.append(Interface("field" if fixed else "exposedField", kind, field, default))
        protos.append(Proto(name, tuple(interface), (node("Group"),)))
    return tuple(protos)
