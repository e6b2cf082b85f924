"""MPEG-4 XMT-A, the XML form of BIFS scenes (ISO/IEC 14496-11): the Face node with the scene inside it.

Scene, metadata and updates are those of BT; only the letters differ. XML is read without entities and without looking
for anything outside the file.
"""

from __future__ import annotations

from pathlib import Path

from fat.face import AnimatableFace
from fba.findings import Finding
from fba.scene import FaceScene
from fba.stream import FapStream
from formats.bifs.playing import played, remark
from formats.bifs.scene import bifs_scene
from formats.vrml97.reader import assemble
from formats.vrml97.text import write_text
from formats.xml_tree import read_xml
from formats.xmta.printer import print_scene
from formats.xmta.reader import read_document

__all__ = ["read", "read_stream", "to_text", "write"]


def read(path: Path) -> FaceScene | AnimatableFace:
    """Read a .xmt or .xmta file, compressed or not.

    Raises
    ------
    TextSyntaxError
        With line and column, if the text is no XML, or has entities.
    InputFileError, MeshError, FaceDefTablesError
        If the file cannot be read, holds no polygon mesh, or contradicts itself.
    """
    path = Path(path)
    document = read_document(read_xml(path), str(path))
    return assemble(document.statements, _stem(path), remark(len(document.updates)))


def read_stream(path: Path) -> tuple[FapStream, list[Finding]]:
    """The stream that a file's timed updates make of the FAP node of its first Face.

    Raises
    ------
    InputFileError, FapStreamError
        If the file cannot be read, is no XMT-A, or moves no Face.
    """
    path = Path(path)
    document = read_document(read_xml(path), str(path))
    return played(document.statements, document.updates, str(path), _stem(path))


def write(face: FaceScene | AnimatableFace, path: Path, stream: FapStream | None = None) -> None:
    """Write a scene or face; compressed if the name ends in .gz. Same face, same bytes.

    stream : becomes timed updates of the FAP node.
    """
    write_text(to_text(face, stream), Path(path))


def to_text(face: FaceScene | AnimatableFace, stream: FapStream | None = None) -> str:
    """The text of a .xmt file: one top Group; the face's scene graph stands inside the Face node."""
    return print_scene(bifs_scene(face, stream))


def _stem(path: Path) -> str:
    name = path.name.lower().removesuffix(".gz").removesuffix(".xmta").removesuffix(".xmt")
    return path.name[: len(name)]
