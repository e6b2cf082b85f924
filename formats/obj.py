"""Wavefront OBJ: the file's own vertex order, polygons of any arity, groups and materials are kept."""

from __future__ import annotations

import logging
import re
from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

from fat.face import AnimatableFace
from fba.arrays import Bools, Floats, Ints
from fba.errors import InputFileError, MeshError
from fba.mesh import Material, PolyMesh
from fba.scene import FaceScene, Shape
from formats.files import read_bytes, write_bytes
from formats.mesh_document import MeshDocument
from formats.mtl import find_materials, format_mtl
from formats.names import unique_names
from formats.obj_writer import ObjText, write_obj
from formats.text_lines import TextLines
from formats.vertex_colors import scene_colors, shown_colors

_log = logging.getLogger(__name__)

_ABSENT = 2**31
"""Stands for the missing number in ``v//vn``; no index can be as large."""

_MOST_OBJECTS = 1000
"""Each object is cut out of the whole mesh, so that very many take very long."""

_IGNORED = {b"l": "lines", b"p": "points", b"curv": "curves", b"curv2": "curves", b"surf": "free-form surfaces"}


@dataclass(frozen=True, eq=False)
class ObjDocument(MeshDocument):
    """What an OBJ file held besides the shapes.

    Attributes
    ----------
    objects : names of the shapes that are objects of the file (``o``).
    colors : (N, k) float64 per-vertex values behind the position, or None.
    """

    objects: tuple[str, ...] = ()
    colors: Floats | None = None


@dataclass(frozen=True, eq=False)
class _Polygons:
    """All polygons of the file. lines : (m,) line of each one; the rest as in `PolyMesh`, -1 where absent."""

    lines: NDArray[np.intp]
    offsets: NDArray[np.intp]
    vertex: NDArray[np.int64]
    texcoord: NDArray[np.int64]
    normal: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class _Names:
    """State set by one kind of statement. lines : where it is set, ascending; names : to what."""

    lines: list[int]
    names: list[str]

    def at(self, lines: NDArray[np.intp], default: str) -> tuple[Ints, tuple[str, ...]]:
        """Index of the name that holds at each line, and the names in order of first appearance."""
        order: dict[str, int] = {}
        numbers = [order.setdefault(n, len(order)) for n in (default, *self.names)]
        which = np.asarray(numbers, dtype=np.int32)[np.searchsorted(np.asarray(self.lines, dtype=np.intp), lines)]
        used, compact = np.unique(which, return_inverse=True)
        names = tuple(order)
        return compact.astype(np.int32), tuple(names[i] for i in used)


def read(path: Path) -> FaceScene:
    """Read an OBJ file.

    One shape holds the whole file, unless the file's objects (``o``) use vertices of their own: then each
    object is a shape with `vertex_ids`. Lines, points, curves and smoothing groups are skipped.

    Raises
    ------
    InputFileError
        If the file is missing, empty, binary or holds no mesh.
    TextSyntaxError
        At a number that cannot be read, with line and column.
    MeshError
        For vertices that are not finite and for indices that are 0 or out of range, with the line.
    """
    path = Path(path)
    lines = TextLines(read_bytes(path), path, continuations=True)
    _blank_comments(lines)
    is_vertex, is_face = lines.keyword_is(b"v"), lines.keyword_is(b"f")
    is_texcoord, is_normal = lines.keyword_is(b"vt"), lines.keyword_is(b"vn")
    if not is_vertex.any():
        raise InputFileError(f"{path} holds no mesh: there is no vertex line 'v x y z' in it")
    if not is_face.any():
        raise InputFileError(f"{path} holds {int(is_vertex.sum())} vertices but no polygon line 'f ...'")
    vertices, colors = _rows(lines, is_vertex, b"v", 3)
    texcoords = _rows(lines, is_texcoord, b"vt", 1)[0] if is_texcoord.any() else None
    normals = _rows(lines, is_normal, b"vn", 3)[0] if is_normal.any() else None
    remarks: list[str] = []
    polygons = _polygons(lines, is_face, is_vertex, is_texcoord, is_normal, remarks)
    rest = np.flatnonzero(~(is_vertex | is_face | is_texcoord | is_normal) & (lines.word_counts > 0))
    groups, objects, materials, libraries = _statements(lines, rest, remarks)
    known, missing = find_materials(path.parent, libraries)
    remarks.extend(missing)
    mesh, own = _mesh(vertices, texcoords, normals, polygons, groups, objects, materials, known)
    shapes = _split(mesh, own, objects, polygons, np.flatnonzero(is_vertex), remarks)
    for remark in remarks:
        _log.info("%s: %s", path, remark)
    named = tuple(s.name for s in shapes) if len(shapes) > 1 or objects.names else ()
    document = ObjDocument(mesh.indices, mesh.offsets, tuple(remarks), named, colors)
    return FaceScene(shapes, name=path.stem, document=document, vertex_attributes=scene_colors(colors))


def write(face: FaceScene | AnimatableFace, path: Path) -> None:
    """Write a face's neutral mesh in the file's own axes, vertex order and winding; materials go to a .mtl beside.

    Numbers are written so that they read back bit-identical. Tables do not fit into this format.
    """
    scene = face.scene if isinstance(face, AnimatableFace) else face
    write_obj(scene, Path(path), **_own_order(scene))


def write_series(like: FaceScene, folder: Path, positions: Iterable[tuple[str, Floats]]) -> None:
    """Write NAME.obj into an existing folder for each (name, (N, 3) positions), all with the polygons of `like`.

    Parameters
    ----------
    positions : file axes and the file's own vertex order. Stored normals no longer fit and are left out.

    Raises
    ------
    OutputFileError
        If a file cannot be written.
    """
    text = ObjText(like, "materials.mtl", **_own_order(like))
    if text.gathered.materials:
        write_bytes(folder / "materials.mtl", format_mtl(text.gathered.materials).encode())
    for name, vertices in positions:
        write_bytes(folder / f"{name}.obj", text.of(vertices, normals=False))


def read_positions(path: Path) -> Floats:
    """Read only the (N, 3) vertex positions of an OBJ file; errors as in `read`."""
    lines = TextLines(read_bytes(path), path, continuations=True)
    _blank_comments(lines)
    is_vertex = lines.keyword_is(b"v")
    if not is_vertex.any():
        raise InputFileError(f"{path} holds no mesh: there is no vertex line 'v x y z' in it")
    return _rows(lines, is_vertex, b"v", 3)[0]


class _OwnOrder(TypedDict, total=False):
    polygons: tuple[Ints, Ints]
    objects: bool
    colors: Floats | None


def _own_order(scene: FaceScene) -> _OwnOrder:
    """How the OBJ file that the scene came from had its polygons; of scenes of other formats the colours alone."""
    document = scene.document
    if not isinstance(document, ObjDocument):
        return {"colors": shown_colors(scene)}
    return {
        "polygons": (document.indices, document.offsets),
        # Shapes that were cut out later are no objects of the file.
        "objects": document.objects == tuple(s.name for s in scene.shapes),
        "colors": document.colors,
    }


def _blank_comments(lines: TextLines) -> None:
    """Blank a comment that follows numbers on the same line; names may hold '#' and are left alone."""
    hashes = np.flatnonzero(lines.bytes == ord("#"))
    if hashes.size == 0:
        return
    starts = np.unique(lines.starts[np.searchsorted(lines.starts, hashes, side="right") - 1])
    pieces, last = [], 0
    for start in starts.tolist():
        end = lines.data.index(b"\n", start)
        found = re.match(rb"[ \t]*(?:v|vt|vn|f)[ \t][^#]*(?=#)", lines.data[start:end])
        if found:
            pieces += [lines.data[last : start + found.end()], b" " * (end - start - found.end())]
            last = end
    if pieces:
        lines.replace(b"".join([*pieces, lines.data[last:]]))


def _rows(lines: TextLines, which: Bools, keyword: bytes, least: int) -> tuple[Floats, Floats | None]:
    """Numbers of the v, vt or vn lines as (n, 3) or (n, 2), and what follows a vertex position."""
    counts = lines.word_counts[which] - 1
    if int(counts.min()) < least:
        bad = int(np.flatnonzero(which)[int(np.argmax(counts < least))])
        raise lines.error(bad, f"'{keyword.decode()}' needs at least {least} numbers: '{lines.line(bad)[:60]}'")
    values = lines.numbers(which, len(keyword))
    starts = np.cumsum(counts) - counts
    width = 2 if keyword == b"vt" else 3
    rows = np.zeros((counts.size, width))
    for k in range(width):
        present = counts > k
        rows[present, k] = values[starts[present] + k]
    if not np.isfinite(rows).all():
        bad = int(np.argmin(np.isfinite(rows).all(axis=1)))
        where = lines.error(int(np.flatnonzero(which)[bad]), f"'{keyword.decode()}' is not a finite number")
        raise MeshError(str(where))
    extra = None
    if keyword == b"v" and int(counts.min()) == int(counts.max()) > 4:
        extra = values.reshape(counts.size, -1)[:, 3:]
    return rows, extra


def _polygons(
    lines: TextLines, is_face: Bools, is_vertex: Bools, is_texcoord: Bools, is_normal: Bools, remarks: list[str]
) -> _Polygons:
    rows = np.flatnonzero(is_face)
    arity = lines.word_counts[rows] - 1
    if int(arity.min()) < 3:
        remarks.append(f"{int((arity < 3).sum())} polygons with fewer than 3 corners are left out")
        is_face = is_face.copy()
        is_face[rows[arity < 3]] = False
        rows, arity = rows[arity >= 3], arity[arity >= 3]
        if rows.size == 0:
            raise InputFileError(f"{lines.source} holds no polygon with 3 corners or more")
    try:
        corners = _corner_numbers(lines.text_of(is_face, 1), int(arity.sum()))
    except (ValueError, OverflowError):
        raise _bad_corner(lines, rows) from None
    line = np.repeat(rows, arity)
    found = []
    for name, numbers, declared in (
        ("vertex", corners[0], is_vertex),
        ("texture coordinate", corners[1], is_texcoord),
        ("normal", corners[2], is_normal),
    ):
        places = np.flatnonzero(declared)
        before = np.searchsorted(places, line)
        absent = numbers == _ABSENT
        index = np.where(numbers > 0, numbers - 1, before + numbers)
        bad = ~absent & ((numbers == 0) | (index < 0) | (index >= places.size))
        if bad.any():
            first = int(np.argmax(bad))
            what = f"{name} index {int(numbers[first])}"
            reason = "indices count from 1" if numbers[first] == 0 else f"the file has {places.size}"
            raise MeshError(str(lines.error(int(line[first]), f"{what} is out of range: {reason}")))
        index[absent] = -1
        found.append(index)
    return _Polygons(rows, np.concatenate([[0], np.cumsum(arity)]), *found)


def _corner_numbers(text: bytes, count: int) -> NDArray[np.int64]:
    """Split the corners ``v``, ``v/vt``, ``v//vn``, ``v/vt/vn`` of all polygons into (3, k) numbers."""
    if b"_" in text:
        raise ValueError
    numbers = np.full((3, count), _ABSENT, dtype=np.int64)
    if b"/" not in text:
        numbers[0] = np.array(list(map(int, text.split())), dtype=np.int64)
        return numbers
    if re.search(rb"/\s", text):
        text = re.sub(rb"(?<!/)/+(?=\s)", lambda m: b" " * len(m[0]), text)
    letters = np.frombuffer(text, dtype=np.uint8)
    filled = letters > 32
    filled[1:] &= letters[:-1] <= 32
    slashes = np.searchsorted(np.flatnonzero(filled), np.flatnonzero(letters == ord("/")), side="right") - 1
    parts = np.bincount(slashes, minlength=count) + 1
    text = text.replace(b"//", b" %d " % _ABSENT).replace(b"/", b" ")
    values = np.array(list(map(int, text.split())), dtype=np.int64)
    if parts.size != count or int(parts.max()) > 3 or values.size != int(parts.sum()):
        raise ValueError
    first = np.cumsum(parts) - parts
    for k in range(3):
        present = parts > k
        numbers[k, present] = values[first[present] + k]
    if (numbers[0] == _ABSENT).any():
        raise ValueError
    return numbers


def _bad_corner(lines: TextLines, rows: NDArray[np.intp]) -> Exception:
    for row in rows.tolist():
        for word in lines.line(row).split()[1:]:
            if not re.fullmatch(r"[+-]?\d{1,10}(/[+-]?\d{0,10}){0,2}", word, re.ASCII):
                return lines.error(row, f"'{word[:40]}' is not a corner v, v/vt, v//vn or v/vt/vn", word)
    return lines.error(int(rows[0]), "the corners of the polygons cannot be read")


def _statements(
    lines: TextLines, rows: NDArray[np.intp], remarks: list[str]
) -> tuple[_Names, _Names, _Names, list[str]]:
    groups, objects, materials = _Names([], []), _Names([], []), _Names([], [])
    libraries: list[str] = []
    ignored: dict[str, int] = {}
    wanted = {"g": groups, "o": objects, "usemtl": materials}
    first_letters = lines.bytes[lines.words[lines.first_word[rows]]]
    for row in rows[np.isin(first_letters, list(b"goumlpcs"))].tolist():
        keyword, _, rest = lines.line(row).partition(" ")
        if keyword in wanted:
            wanted[keyword].lines.append(row)
            wanted[keyword].names.append(rest.strip())
        elif keyword == "mtllib":
            libraries.append(rest.strip())
        elif keyword.encode() in _IGNORED:
            what = _IGNORED[keyword.encode()]
            ignored[what] = ignored.get(what, 0) + 1
    remarks.extend(f"{count} {what} are skipped: only polygons are read" for what, count in ignored.items())
    return groups, objects, materials, libraries


def _mesh(
    vertices: Floats,
    texcoords: Floats | None,
    normals: Floats | None,
    polygons: _Polygons,
    groups: _Names,
    objects: _Names,
    materials: _Names,
    known: dict[str, Material],
) -> tuple[PolyMesh, tuple[Material, ...]]:
    # Objects that share vertices cannot be shapes of their own; without groups they stay known as groups.
    named = groups if groups.names or len(set(objects.names)) < 2 else objects
    group, group_names = named.at(polygons.lines, "default")
    material, material_names = materials.at(polygons.lines, "")
    own = tuple(known.get(name, Material(name)) for name in material_names)
    if own and own[0].name == "":
        own, material = own[1:], material - 1
    uv = texcoords is not None and bool((polygons.texcoord >= 0).any())
    shaded = normals is not None and bool((polygons.normal >= 0).any())
    mesh = PolyMesh(
        vertices,
        polygons.vertex.astype(np.int32),
        polygons.offsets.astype(np.int32),
        texcoords if uv else None,
        polygons.texcoord.astype(np.int32) if uv else None,
        normals if shaded else None,
        polygons.normal.astype(np.int32) if shaded else None,
        group if named.names else None,
        group_names if named.names else (),
        material if own else None,
    )
    return mesh, own


def _split(
    mesh: PolyMesh,
    materials: tuple[Material, ...],
    objects: _Names,
    polygons: _Polygons,
    vertex_lines: NDArray[np.intp],
    remarks: list[str],
) -> tuple[Shape, ...]:
    """One shape, or one for each object when no two objects share a vertex and there are not too many."""
    of_face, names = objects.at(polygons.lines, "")
    if len(names) > _MOST_OBJECTS:
        remarks.append(f"{len(names)} objects are read as one: more than {_MOST_OBJECTS} are not kept apart")
        return (Shape("face", mesh, materials=materials),)
    if len(names) < 2:
        return (Shape(names[0] or "face", mesh, materials=materials),)
    corner_object = np.repeat(of_face, mesh.arities)
    owner = np.full(mesh.vertex_count, -1, dtype=np.int32)
    owner[mesh.indices] = corner_object
    if not np.array_equal(owner[mesh.indices], corner_object):
        return (Shape("face", mesh, materials=materials),)
    # A vertex that no polygon uses goes with the object it was written in, or with the polygons that follow it.
    for vertex in np.flatnonzero(owner < 0).tolist():
        line = vertex_lines[vertex]
        declared = objects.names[bisect_right(objects.lines, line) - 1] if line > objects.lines[0] else ""
        following = min(int(np.searchsorted(polygons.lines, line)), len(of_face) - 1)
        owner[vertex] = names.index(declared) if declared in names else of_face[following]
    shapes = []
    for number, label in enumerate(unique_names(names)):
        part, ids = mesh.submesh(owner == number)
        shapes.append(Shape(label, part, materials=materials, vertex_ids=ids))
    return tuple(shapes)
