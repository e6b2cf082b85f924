"""glTF 2.0 (.gltf, .glb): faces as meshes with morph targets, and everything that their tables need."""

from __future__ import annotations

from pathlib import Path

from fat.face import AnimatableFace
from fba.scene import FaceScene
from fba.shapes import ShapeSet
from fba.stream import FapStream
from formats.gltf.reader import GltfDocument, read_foreign

__all__ = ["GltfDocument", "read", "read_foreign", "read_shape_set", "write", "write_shape_set"]


def read(path: Path) -> FaceScene | AnimatableFace:
    """Read a .gltf or .glb file.

    Returns
    -------
    The scene or AnimatableFace that `write` put there, exactly. Of a file of other origin, or one of ours that
    another program has changed: the scene that `read_foreign` gives.

    Raises
    ------
    InputFileError
        If the file is missing, cut, or contradicts itself.
    UnsupportedFeatureError
        For other versions and for compressed meshes.
    MeshError
        If it has no triangles.
    """
    from formats.gltf.own_reader import read_gltf

    return read_gltf(path)


def write(face: FaceScene | AnimatableFace, path: Path, stream: FapStream | None = None) -> None:
    """Write a scene, or a face with its tables as morph targets; .gltf has its buffer beside it, in NAME.bin.

    Parameters
    ----------
    stream : played on the face; becomes the file's animation.

    Raises
    ------
    FaceDefTablesError
        If a table speaks of a shape, transform or vertex that the scene does not have.
    MeshError
        If there is nothing to draw, or numbers are not finite.
    OutputFileError
        If the file cannot be written.
    """
    from formats.gltf.writer import write_gltf

    write_gltf(face, Path(path), stream)


def read_shape_set(path: Path) -> ShapeSet | None:
    """Read the morph targets that `write_shape_set` put into a file; None for a file of other origin."""
    from formats.gltf.shape_sets import read_shapes

    return read_shapes(path)


def write_shape_set(scene: FaceScene, shapes: ShapeSet, path: Path) -> None:
    """Write a scene with free expressions as morph targets, on each shape of the scene that they move.

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
    from formats.gltf.shape_sets import write_shapes

    write_shapes(scene, shapes, Path(path))
