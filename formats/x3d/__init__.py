"""X3D (XML, ISO/IEC 19776-1): faces as HAnimHumanoids whose displacers are their tables."""

from __future__ import annotations

from pathlib import Path

from fat.face import AnimatableFace
from fba.scene import FaceScene
from fba.stream import FapStream

__all__ = ["read", "write", "write_portable"]

_HEADER = """<?xml version="1.0" encoding="UTF-8"?>
<X3D profile="Immersive" version="4.0">
<head><component name="HAnim" level="1"/></head>
<Scene>
"""
_FOOTER = "</Scene>\n</X3D>\n"


def read(path: Path) -> FaceScene | AnimatableFace:
    """Read an .x3d file, compressed or not.

    Returns
    -------
    The scene or AnimatableFace that `write` put there, exactly. Of a file of other origin: its polygon meshes
    (IndexedFaceSet, IndexedTriangleSet), in rest pose where they are an HAnim skin.

    Raises
    ------
    TextSyntaxError
        With line and column, if it is no XML, or declares a document type of its own.
    InputFileError, MeshError, FaceDefTablesError
        If the file cannot be read, holds no polygon mesh, or contradicts itself.
    """
    from formats.x3d.reader import read_x3d

    return read_x3d(Path(path))


def write(face: FaceScene | AnimatableFace, path: Path, stream: FapStream | None = None) -> None:
    """Write a scene or face; compressed if the name ends in .gz or .x3dz. Same face, same bytes.

    stream : played on the face; becomes interpolators behind a TimeSensor.

    Raises
    ------
    UnsupportedFeatureError
        If two tables drive one field of one transform.
    FaceDefTablesError
        If a table speaks of a shape, transform or vertex that the scene does not have.
    """
    from formats.vrml97.text import write_text
    from formats.x3d.humanoid import x3d_statements
    from formats.x3d.xml_nodes import print_xml

    write_text(_HEADER + print_xml(x3d_statements(face, stream)) + _FOOTER, Path(path))


def write_portable(face: FaceScene | AnimatableFace, path: Path, stream: FapStream | None = None) -> None:
    """Write a file for clients that know no MPEG-4 nodes: the same as `write`, which uses none."""
    write(face, path, stream)
