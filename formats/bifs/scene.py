"""From a face, and a stream that moves it, to the scene of a BIFS file."""

from __future__ import annotations

from dataclasses import dataclass, field

from fat.face import AnimatableFace
from fba.errors import UnsupportedFeatureError
from fba.scene import FaceScene
from fba.stream import FapStream
from formats.bifs.changes import FAP_NAMES, Frame, Timing, changes, fap_node, stream_note, timing_of
from formats.vrml97.names import Names
from formats.vrml97.references import definitions_first
from formats.vrml97.tree import (
    ExternProto,
    Field,
    Nodes,
    Proto,
    Route,
    Statement,
    Strings,
    Use,
    VrmlNode,
    definitions,
    node,
)
from formats.vrml97.writer import Written, pieces


@dataclass(frozen=True, eq=False)
class BifsScene:
    """A file: the scene at its start, and what changes then.

    Attributes
    ----------
    statements : PROTOs, one top Group with the Face, ROUTEs.
    frames : what the frames after the first one change in the FAP node.
    """

    statements: tuple[Statement, ...]
    timing: Timing = field(default_factory=Timing)
    frames: tuple[Frame, ...] = ()


def bifs_scene(face: FaceScene | AnimatableFace, stream: FapStream | None) -> BifsScene:
    """Build the scene; its FAP node has the stream's first frame.

    Raises
    ------
    UnsupportedFeatureError
        If the stream has no frames, or a frame rate that ticks of a clock cannot tell.
    """
    built = pieces(face)
    if stream is None or built.face is None:
        return BifsScene(_statements(built, built.face, built.metadata))
    if not len(stream):
        raise UnsupportedFeatureError(f"the stream '{stream.name}' has no frames")
    free = Names(definitions(built.statements))
    names = [free.give(name) for name in FAP_NAMES]
    moved = built.face.with_field("fap", Nodes((fap_node(stream, names),)))
    info = built.metadata.get("info")
    assert isinstance(info, Strings)
    metadata = built.metadata.with_field("info", Strings((*info.values, stream_note(stream)), True))
    return BifsScene(_statements(built, moved, metadata), timing_of(stream), tuple(changes(stream, names)))


def _statements(built: Written, face: VrmlNode | None, metadata: VrmlNode) -> tuple[Statement, ...]:
    """One top Group; the face's scene graph stands inside the Face node."""
    protos = [s for s in built.statements if isinstance(s, (Proto, ExternProto))]
    routes = [s for s in built.statements if isinstance(s, Route)]
    rest: list[VrmlNode | Use] = [s for s in built.statements if isinstance(s, (VrmlNode, Use))]
    if face is not None:
        inside = tuple(s for s in rest if isinstance(s, VrmlNode) and s.def_name in built.roots)
        first = next((k for k, s in enumerate(rest) if any(s is i for i in inside)), len(rest))
        before, after = ([s for s in part if not any(s is i for i in inside)] for part in (rest[:first], rest[first:]))
        rest = [*before, _complete(face, inside), *after]
    top = node("Group", children=Nodes((*rest, metadata), True))
    return (*protos, *definitions_first((top,)), *routes)


def _complete(face: VrmlNode, inside: tuple[VrmlNode, ...]) -> VrmlNode:
    """The Face node with its scene graph inside, and an interpolation table: an empty one derives no FAP of others."""
    fdp = face.nodes("fdp")[0]
    assert isinstance(fdp, VrmlNode)
    face = face.with_field("fdp", Nodes((fdp.with_field("faceSceneGraph", Nodes(inside, True)),)))
    return face if any(isinstance(p, Field) and p.name == "fit" for p in face.body) else face.with_field("fit", _NO_FIT)


_NO_FIT = Nodes((node("FIT"),))
