"""MPEG-4 BT, the text form of BIFS scenes (ISO/IEC 14496-1): the Face node with the scene inside it.

A stream becomes timed updates of the FAP node (``AT t { REPLACE FAPS.open_jaw BY 600 }``), which `read_stream` gives
back. For a face, updates and object descriptors are read over: they say how it is played, not what it is. USE may
stand before DEF.
"""

from __future__ import annotations

from pathlib import Path

from fat.face import AnimatableFace
from fba.findings import Finding
from fba.scene import FaceScene
from fba.stream import FapStream
from formats.bifs.bt_commands import read_commands, write_commands
from formats.bifs.changes import TICKS
from formats.bifs.playing import played, remark
from formats.bifs.scene import bifs_scene
from formats.vrml97.parser import parse
from formats.vrml97.printer import print_tree
from formats.vrml97.reader import assemble
from formats.vrml97.text import read_text, write_text

_DESCRIPTOR = """\
InitialObjectDescriptor {{
  objectDescriptorID 1
  esDescr [
    ES_Descriptor {{
      ES_ID 1
      decConfigDescr DecoderConfigDescriptor {{
        streamType 3
        decSpecificInfo BIFSConfig {{ isCommandStream true pixelMetric true pixelWidth 320 pixelHeight 240 }}
      }}{clock}
    }}
  ]
}}
"""
"""One BIFS stream. The profile and level fields are left out: encoders differ in how they spell them."""

_CLOCK = """
      slConfigDescr SLConfigDescriptor {{
        useAccessUnitEndFlag true
        useTimeStampsFlag true
        timeStampResolution {}
        timeStampLength 32
      }}"""


def read(path: Path) -> FaceScene | AnimatableFace:
    """Read a .bt file, compressed or not; errors as for VRML97."""
    path = Path(path)
    text, findings = read_text(path)
    statements = parse(text, str(path), bt=True)
    return assemble(statements, _stem(path), [*findings, *remark(len(read_commands(statements, str(path))))])


def read_stream(path: Path) -> tuple[FapStream, list[Finding]]:
    """The stream that a file's timed updates make of the FAP node of its first Face.

    Raises
    ------
    InputFileError, VrmlSyntaxError, FapStreamError
        If the file cannot be read, breaks the grammar, or moves no Face.
    """
    path = Path(path)
    text, findings = read_text(path)
    statements = parse(text, str(path), bt=True)
    stream, said = played(statements, read_commands(statements, str(path)), str(path), _stem(path))
    return stream, [*findings, *said]


def write(face: FaceScene | AnimatableFace, path: Path, stream: FapStream | None = None) -> None:
    """Write a scene or face; compressed if the name ends in .gz. Same face, same bytes.

    stream : becomes timed updates of the FAP node.
    """
    write_text(to_text(face, stream), Path(path))


def to_text(face: FaceScene | AnimatableFace, stream: FapStream | None = None) -> str:
    """The text of a .bt file: one top Group; the face's scene graph stands inside the Face node."""
    scene = bifs_scene(face, stream)
    resolution = scene.timing.resolution
    clock = "" if resolution == TICKS else _CLOCK.format(resolution)
    return _DESCRIPTOR.format(clock=clock) + print_tree(scene.statements, bt=True) + write_commands(scene)


def _stem(path: Path) -> str:
    name = path.name.lower().removesuffix(".gz").removesuffix(".bt")
    return path.name[: len(name)]
