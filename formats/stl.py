"""STL: loose triangles, ASCII and binary. Corners of equal position become one vertex."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fat.face import AnimatableFace
from fba.arrays import Floats
from fba.errors import InputFileError, UnsupportedFeatureError
from fba.scene import FaceScene
from formats.files import read_bytes, write_bytes
from formats.gathered import gather_mesh
from formats.mesh_document import scene_of_polygons
from formats.text_lines import TextLines

_HEADER = 84
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read(path: Path) -> FaceScene:
    """Read an STL file.

    The format has no vertices, only triangle corners: corners of exactly equal position are merged, in the
    order of their first use. Surfaces that touch (closed lips) are glued by that; a remark says so.

    Raises
    ------
    InputFileError
        If the file is missing, cut, or neither ASCII nor binary STL.
    MeshError
        For positions that are not finite.
    """
    path = Path(path)
    data = read_bytes(path)
    corners = _binary(data)
    if corners is None:
        corners = _ascii(path, data)
    if len(corners) == 0:
        raise InputFileError(f"{path} holds no triangles")
    # Adding zero makes -0.0 equal to 0.0.
    flat = np.ascontiguousarray(corners.reshape(-1, 3) + 0.0)
    _, first, inverse = np.unique(flat.view("V24").ravel(), return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(order.size)
    vertices = flat[first[order]]
    remark = (
        f"STL has no shared vertices: {len(flat)} corners of equal position were merged into {len(vertices)} vertices; "
        "surfaces that touch, such as closed lips, are glued together"
    )
    return scene_of_polygons(path, vertices, rank[inverse.ravel()], np.full(len(corners), 3, np.int64), (remark,))


def _binary(data: bytes) -> Floats | None:
    """Triangle corners (t, 3, 3), or None if the size does not fit the count in the header."""
    if len(data) < _HEADER:
        return None
    count = int.from_bytes(data[80:84], "little")
    if len(data) != _HEADER + count * _RECORD.itemsize:
        return None
    with np.errstate(invalid="ignore"):  # Signalling NaNs; refused below with all that is not finite.
        return np.frombuffer(data, _RECORD, count, _HEADER)["corners"].astype(np.float64)


def _ascii(path: Path, data: bytes) -> Floats:
    if not data.lstrip().lower().startswith(b"solid") or b"\0" in data:
        raise InputFileError(
            f"{path} is not an STL file, or cut: it does not begin with 'solid', and its size does not fit a binary one"
        )
    lines = TextLines(data.lower(), path)
    corners = lines.keyword_is(b"vertex")
    facets = int(lines.keyword_is(b"facet").sum())
    if facets == 0:
        raise InputFileError(f"{path} holds no triangles")
    if int(corners.sum()) != 3 * facets or not lines.keyword_is(b"endsolid").any():
        raise InputFileError(f"{path} is cut: {facets} triangles need {3 * facets} corners and an 'endsolid' line")
    rows = np.flatnonzero(corners)
    if (lines.word_counts[rows] != 4).any():
        bad = int(rows[int(np.argmax(lines.word_counts[rows] != 4))])
        raise lines.error(bad, "a 'vertex' needs three numbers")
    return lines.numbers(corners, len(b"vertex")).reshape(-1, 3, 3)


def write(face: FaceScene | AnimatableFace, path: Path) -> None:
    """Write a face's neutral mesh as binary STL: fan triangles, single precision.

    Raises
    ------
    UnsupportedFeatureError
        If a coordinate is too large for single precision.
    OutputFileError
        If the file cannot be written.
    """
    mesh = gather_mesh(face.scene if isinstance(face, AnimatableFace) else face).mesh
    corners = mesh.vertices[mesh.triangles]
    if corners.size and np.abs(corners).max() > np.finfo(np.float32).max:
        raise UnsupportedFeatureError("STL holds single-precision numbers, and the mesh has larger coordinates")
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    records = np.zeros(len(corners), _RECORD)
    records["normal"] = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
    records["corners"] = corners
    header = b"binary STL".ljust(80) + len(corners).to_bytes(4, "little")
    write_bytes(Path(path), header + records.tobytes())
