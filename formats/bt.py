"""MPEG-4 BT, the text form of BIFS scenes (ISO/IEC 14496-1): the Face node with the scene inside it.

Object descriptors and timed commands (``AT t { ... }``) are read over: they say how a stream is played, not what
the face is. USE may stand before DEF.
"""

from __future__ import annotations

from pathlib import Path

from fat.face import AnimatableFace
from fba.scene import FaceScene
from formats.vrml97.parser import parse
from formats.vrml97.printer import print_tree
from formats.vrml97.reader import assemble
from formats.vrml97.references import definitions_first
from formats.vrml97.text import read_text, write_text
from formats.vrml97.tree import ExternProto, Nodes, Proto, Route, Statement, Use, VrmlNode, node
from formats.vrml97.writer import pieces

_DESCRIPTOR = """\
InitialObjectDescriptor {
  objectDescriptorID 1
  esDescr [
    ES_Descriptor {
      ES_ID 1
      decConfigDescr DecoderConfigDescriptor {
        streamType 3
        decSpecificInfo BIFSConfig { isCommandStream true pixelMetric true pixelWidth 320 pixelHeight 240 }
      }
    }
  ]
}
"""
"""One BIFS stream. The profile and level fields are left out: encoders differ in how they spell them."""


def read(path: Path) -> FaceScene | AnimatableFace:
    """Read a .bt file, compressed or not; errors as for VRML97."""
    path = Path(path)
    text, findings = read_text(path)
    name = path.name.lower().removesuffix(".gz").removesuffix(".bt")
    return assemble(parse(text, str(path), bt=True), path.name[: len(name)], findings)


def write(face: FaceScene | AnimatableFace, path: Path) -> None:
    """Write a scene or face; compressed if the name ends in .gz. Same face, same bytes."""
    write_text(to_text(face), Path(path))


def to_text(face: FaceScene | AnimatableFace) -> str:
    """The text of a .bt file: one top Group; the face's scene graph stands inside the Face node."""
    built = pieces(face)
    protos = [s for s in built.statements if isinstance(s, (Proto, ExternProto))]
    routes = [s for s in built.statements if isinstance(s, Route)]
    rest: list[VrmlNode | Use] = [s for s in built.statements if isinstance(s, (VrmlNode, Use))]
    if built.face is not None:
        inside = tuple(s for s in rest if isinstance(s, VrmlNode) and s.def_name in built.roots)
        first = next((k for k, s in enumerate(rest) if any(s is i for i in inside)), len(rest))
        before, after = ([s for s in part if not any(s is i for i in inside)] for part in (rest[:first], rest[first:]))
        rest = [*before, _with_scene(built.face, inside), *after]
    top = node("Group", children=Nodes((*rest, built.metadata), True))
    statements: tuple[Statement, ...] = (*protos, *definitions_first((top,)), *routes)
    return _DESCRIPTOR + print_tree(statements, bt=True)


def _with_scene(face: VrmlNode, inside: tuple[VrmlNode, ...]) -> VrmlNode:
    fdp = face.nodes("fdp")[0]
    assert isinstance(fdp, VrmlNode)
    return face.with_field("fdp", Nodes((fdp.with_field("faceSceneGraph", Nodes(inside, True)),)))
