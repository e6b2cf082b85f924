"""OFF, the Geomview object file format (ASCII), with or without colours and normals at the vertices."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fat.face import AnimatableFace
from fba.arrays import Floats
from fba.errors import InputFileError, UnsupportedFeatureError
from fba.scene import FaceScene
from formats.files import read_bytes, write_bytes
from formats.gathered import gather_mesh
from formats.mesh_document import scene_of_polygons
from formats.text_lines import TextLines


def read(path: Path) -> FaceScene:
    """Read an OFF, COFF, NOFF or STOFF file: one vertex or polygon a line, comments from ``#``.

    Raises
    ------
    InputFileError
        If the file is missing, cut, damaged or holds no mesh.
    UnsupportedFeatureError
        For the binary and the four-dimensional variants.
    MeshError
        For positions that are not finite and vertex numbers out of range.
    """
    path = Path(path)
    data = read_bytes(path)
    header = re.match(rb"(?:\s|#[^\r\n]*[\r\n])*(ST)?(C)?(N)?(4)?(n)?OFF\b[ \t]*(BINARY)?", data)
    if header is None:
        raise InputFileError(f"{path} is not an OFF file: it does not begin with 'OFF'")
    if header[6] or header[4] or header[5]:
        raise UnsupportedFeatureError(f"{path} is a binary or four-dimensional OFF file; save it as plain OFF")
    blank = re.sub(rb"#[^\r\n]*", lambda m: b" " * len(m[0]), data)
    lines = TextLines(re.sub(rb"[^\s]", b" ", blank[: header.end()]) + blank[header.end() :], path)
    filled = np.flatnonzero(lines.word_counts > 0)
    sizes = lines.line(int(filled[0])).split() if filled.size else []
    if len(sizes) < 2 or not all(s.isdecimal() and len(s) < 10 for s in sizes[:2]):
        raise InputFileError(f"{path}: the line with the numbers of vertices and faces is missing or damaged")
    vertex_count, face_count = int(sizes[0]), int(sizes[1])
    if filled.size < 1 + vertex_count + face_count:
        raise InputFileError(f"{path} is cut: {vertex_count} vertices and {face_count} faces need as many lines")
    if vertex_count == 0 or face_count == 0:
        raise InputFileError(f"{path} holds no mesh: {vertex_count} vertices and {face_count} faces")
    vertices = _positions(lines, filled[1 : 1 + vertex_count])
    corners, counts = _corners(lines, filled[1 + vertex_count : 1 + vertex_count + face_count])
    return scene_of_polygons(path, vertices, corners, counts)


def _rows(lines: TextLines, rows: NDArray[np.intp]) -> tuple[Floats, NDArray[np.intp], NDArray[np.intp]]:
    """All numbers of some lines, where each line begins among them, and how many it has."""
    mask = np.zeros(lines.starts.size, dtype=bool)
    mask[rows] = True
    counts = lines.word_counts[rows]
    return lines.numbers(mask, 0), np.cumsum(counts) - counts, counts


def _positions(lines: TextLines, rows: NDArray[np.intp]) -> Floats:
    values, starts, counts = _rows(lines, rows)
    if int(counts.min()) < 3:
        raise lines.error(int(rows[int(np.argmin(counts))]), "a vertex needs three numbers")
    positions: Floats = values[starts[:, None] + np.arange(3)]
    return positions


def _corners(lines: TextLines, rows: NDArray[np.intp]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    values, starts, counts = _rows(lines, rows)
    stated = values[starts]
    wrong = ~((stated >= 0) & (stated < counts) & (stated == np.floor(stated)))
    if wrong.any():
        raise lines.error(int(rows[int(np.argmax(wrong))]), "a face needs its number of corners, then the corners")
    arity = stated.astype(np.int64)
    places = np.repeat(starts + 1 - (np.cumsum(arity) - arity), arity) + np.arange(arity.sum())
    corners = values[places]
    wrong = ~((np.abs(corners) < 2**31) & (corners == np.floor(corners)))
    if wrong.any():
        raise lines.error(int(np.repeat(rows, arity)[int(np.argmax(wrong))]), "a corner must be a vertex number")
    return corners.astype(np.int64), arity


def write(face: FaceScene | AnimatableFace, path: Path) -> None:
    """Write a face's neutral mesh as ASCII OFF in the file's own vertex order; numbers read back bit-identical.

    Raises
    ------
    OutputFileError
        If the file cannot be written.
    """
    mesh = gather_mesh(face.scene if isinstance(face, AnimatableFace) else face).mesh
    lines = ["OFF", f"{mesh.vertex_count} {mesh.face_count} 0"]
    lines += map("{!r} {!r} {!r}".format, *mesh.vertices.T.tolist())
    corners = list(map(str, mesh.indices.tolist()))
    bounds = mesh.offsets.tolist()
    lines += [f"{b - a} {' '.join(corners[a:b])}" for a, b in pairwise(bounds)]
    write_bytes(Path(path), ("\n".join(lines) + "\n").encode())
