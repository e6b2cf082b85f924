"""VRML97 (ISO/IEC 14772-1) with the MPEG-4 Face node: an own parser and writer that lose nothing.

A file without tables reads as a FaceScene, one with tables as an AnimatableFace. What the scene cannot hold (PROTOs,
Scripts, ROUTEs, lights, unknown nodes) travels in `FaceScene.document` and is written back.
"""

from __future__ import annotations

from pathlib import Path

from fat.face import AnimatableFace
from fba.errors import InputFileError
from fba.findings import Finding
from fba.scene import FaceScene
from fba.stream import FapStream
from formats.vrml97.document import VrmlDocument
from formats.vrml97.parser import parse
from formats.vrml97.printer import HEADER, print_tree
from formats.vrml97.reader import assemble
from formats.vrml97.text import read_text, write_text
from formats.vrml97.writer import declarations, pieces

__all__ = ["VrmlDocument", "parse", "print_tree", "read", "write", "write_portable"]


def read(path: Path) -> FaceScene | AnimatableFace:
    """Read a .wrl file, compressed or not.

    Raises
    ------
    VrmlSyntaxError
        With line and column, if the text breaks the grammar.
    InputFileError, MeshError, FaceDefTablesError
        If the file cannot be read, holds no polygon mesh, or contradicts itself.
    """
    path = Path(path)
    text, findings = read_text(path)
    if text.startswith("#VRML V1.0"):
        raise InputFileError(f"{path} is VRML 1.0; convert it to VRML97 first, for example with Open Inventor's ivvrml")
    if not text.startswith("#VRML V2.0 utf8"):
        findings.append(Finding("warning", "header", "the line '#VRML V2.0 utf8' is missing", "line 1"))
    return assemble(parse(text, str(path)), _stem(path), findings)


def write(face: FaceScene | AnimatableFace, path: Path) -> None:
    """Write a scene or face; compressed if the name ends in .gz or .wrz. Same face, same bytes."""
    write_text(to_text(face), Path(path))


def to_text(face: FaceScene | AnimatableFace) -> str:
    """The text of a .wrl file.

    The scene graph stands at the top, where every browser draws it; the Face node uses it.
    """
    built = pieces(face)
    statements = (*built.statements, built.metadata)
    if built.face is not None:
        statements = (*declarations(built.face), *statements, built.face)
    return HEADER + print_tree(statements)


def write_portable(face: FaceScene | AnimatableFace, path: Path, stream: FapStream | None = None) -> None:
    """Write a file that plays in every browser with Scripts; see `formats.vrml97.portable`. It reads back the same.

    Raises
    ------
    UnsupportedFeatureError
        If two tables drive one field of one transform.
    """
    from formats.vrml97.portable import portable_statements

    write_text(HEADER + print_tree(portable_statements(face, stream)), Path(path))


def _stem(path: Path) -> str:
    name = path.name
    for extension in (".gz", ".wrl", ".wrz", ".vrml", ".bt"):
        if name.lower().endswith(extension):
            name = name[: -len(extension)]
    return name
