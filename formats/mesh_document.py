"""What the plain mesh formats share: one polygon list, checked, as a scene that remembers it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fba.arrays import Floats, Ints
from fba.errors import InputFileError, MeshError
from fba.mesh import PolyMesh
from fba.scene import FaceScene, Shape


@dataclass(frozen=True, eq=False)
class MeshDocument:
    """What a mesh file held besides the shapes.

    Attributes
    ----------
    indices, offsets : the polygons in the file's own order and vertex numbers (see `PolyMesh`).
    remarks : what was skipped or missing, in plain words.
    """

    indices: Ints
    offsets: Ints
    remarks: tuple[str, ...] = ()


def scene_of_polygons(
    path: Path, vertices: Floats, indices: NDArray[np.int64], counts: NDArray[np.int64], remarks: tuple[str, ...] = ()
) -> FaceScene:
    """Check one vertex and polygon list and make a scene with one shape of it.

    Parameters
    ----------
    indices : (k,) corners of all polygons; counts : (m,) corners of each polygon. Polygons with fewer than
        three corners are left out, with a remark.

    Raises
    ------
    InputFileError
        If there are no vertices or no polygons.
    MeshError
        If a position is not finite or an index out of range.
    """
    if len(vertices) == 0:
        raise InputFileError(f"{path} holds no mesh: it has no vertices")
    finite = np.isfinite(vertices).all(axis=1)
    if not finite.all():
        raise MeshError(f"{path}: the position of vertex {int(np.argmin(finite))} is not a finite number")
    wrong = (indices < 0) | (indices >= len(vertices))
    if wrong.any():
        corner = int(np.argmax(wrong))
        polygon = int(np.searchsorted(np.cumsum(counts), corner, side="right"))
        raise MeshError(
            f"{path}: polygon {polygon} (counted from 0) uses vertex {int(indices[corner])}; "
            f"the file has {len(vertices)}, numbered from 0"
        )
    whole = counts >= 3
    if not whole.all():
        remarks = (*remarks, f"{int((~whole).sum())} polygons with fewer than 3 corners are left out")
        indices, counts = indices[np.repeat(whole, counts)], counts[whole]
    if counts.size == 0:
        raise InputFileError(f"{path} holds {len(vertices)} points but no polygons; a point cloud cannot be animated")
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    mesh = PolyMesh(vertices, indices.astype(np.int32), offsets)
    return FaceScene((Shape("face", mesh),), name=path.stem, document=MeshDocument(mesh.indices, mesh.offsets, remarks))
