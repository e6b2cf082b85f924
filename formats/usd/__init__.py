"""USD: faces as UsdSkel blend shapes with inbetweens, and everything that the Facial Animation Tables need.

The modules behind import OpenUSD; this one does not, until a file is read or written.
"""

from __future__ import annotations

from pathlib import Path

from fat.face import AnimatableFace
from fba.scene import FaceScene
from fba.shapes import ShapeSet
from fba.stream import FapStream


def read(path: Path) -> FaceScene | AnimatableFace:
    """Read a .usda, .usdc, .usd or .usdz file.

    Returns
    -------
    The AnimatableFace that `write` put there, or the scene of a file of other origin: its meshes and transforms
    in the stage's own axes.

    Raises
    ------
    InputFileError
        If the file is missing or damaged, or refers to files that cannot be opened.
    UnsupportedFeatureError
        If it holds what a scene of meshes cannot express (point instancers, perspective transforms).
    """
    from formats.usd.reader import read_usd

    return read_usd(path)


def write(face: FaceScene | AnimatableFace, path: Path, stream: FapStream | None = None) -> None:
    """Write a scene, or a face with its tables as blend shapes; .usd holds the binary form, .usdz the images too.

    stream : played on the face; becomes the animation of the stage.

    Raises
    ------
    FaceDefTablesError
        If a table speaks of a shape, transform or vertex that the scene does not have.
    OutputFileError
        If the file cannot be written.
    """
    from formats.usd.writer import write_usd

    write_usd(face, path, stream)


def write_portable(face: FaceScene | AnimatableFace, path: Path, stream: FapStream | None) -> None:
    """Write a face for programs without inbetweens and negative weights; a plain scene as `write` does.

    The face plays there, alone or with a stream; its tables do not read back.

    Raises
    ------
    FaceDefTablesError, OutputFileError
        As `write` does.
    """
    from formats.usd.portable import write_portable_usd
    from formats.usd.writer import write_usd

    if isinstance(face, AnimatableFace):
        write_portable_usd(face, path, stream)
    else:
        write_usd(face, path, None)


def read_shape_set(path: Path) -> ShapeSet | None:
    """Read the blend shapes of any USD file as free expressions at weight 1; None if it has none.

    World coordinates, in the file's own axes, units and vertex order. Inbetweens are not part of it. The errors
    are those of `read`.
    """
    from formats.usd.shape_sets import read_shapes

    return read_shapes(path)


def write_shape_set(scene: FaceScene, shapes: ShapeSet, path: Path) -> None:
    """Write a scene with free expressions as blend shapes, one for each shape of the scene that moves.

    Parameters
    ----------
    shapes : over all vertices of `scene`, in its own file order and axes, world coordinates.

    Raises
    ------
    MeshError
        If the shapes are made for another number of vertices.
    OutputFileError
        If the file cannot be written.
    """
    from formats.usd.shape_sets import write_shapes

    write_shapes(scene, shapes, path)
