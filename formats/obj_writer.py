"""Writing Wavefront OBJ from a scene, with its material library beside."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from fba.arrays import Floats, Ints
from fba.mesh import Material, PolyMesh
from fba.scene import FaceScene
from formats.files import atomic_output, write_bytes
from formats.gathered import GatheredMesh, gather_mesh, original_order
from formats.mtl import format_mtl
from formats.names import unique_names


def write_obj(
    scene: FaceScene,
    path: Path,
    *,
    polygons: tuple[Ints, Ints] | None = None,
    objects: bool = True,
    colors: Floats | None = None,
) -> None:
    """Write the scene's neutral mesh as one vertex list.

    Parameters
    ----------
    polygons : (indices, offsets) of the file that was read: when the scene still holds exactly these
        polygons, they are written in this order; otherwise shape by shape.
    objects : name the shapes as objects (``o``) when there are several.
    colors : (N, k) values written behind the vertices, when N still fits.

    Raises
    ------
    OutputFileError
        If the file cannot be written.
    """
    library = path.with_suffix(".mtl")
    text = ObjText(scene, library.name, polygons=polygons, objects=objects, colors=colors)
    data = text.of(text.gathered.mesh.vertices, normals=True)
    if not text.gathered.materials:
        write_bytes(path, data)
        return
    # The mesh takes its place first: when it cannot be written, the library stays as it was too.
    with atomic_output(library) as temporary:
        temporary.write_bytes(format_mtl(text.gathered.materials).encode())
        write_bytes(path, data)


class ObjText:
    """The text of a scene, for one or many sets of vertex positions; parameters as in `write_obj`.

    library : file name of the material library, named in the text when there are materials.
    """

    def __init__(
        self,
        scene: FaceScene,
        library: str,
        *,
        polygons: tuple[Ints, Ints] | None = None,
        objects: bool = True,
        colors: Floats | None = None,
    ) -> None:
        gathered = gather_mesh(scene)
        if polygons is not None:
            order = original_order(gathered.mesh, *polygons)
            if order is not None:
                gathered = gathered.reordered(order)
        self.gathered = replace(gathered, materials=_named(gathered.materials))
        self._scene = scene
        self._objects = objects and (len(gathered.shape_names) > 1 or gathered.shape_names[0] != "face")
        self._colors = colors if colors is not None and len(colors) == gathered.mesh.vertex_count else None
        self._head = [f"mtllib {library}"] if gathered.materials else []
        self._tails: dict[bool, list[str]] = {}

    def of(self, vertices: Floats, *, normals: bool) -> bytes:
        """The file's bytes with these (N, 3) positions; without normals where they no longer fit."""
        if normals not in self._tails:
            mesh = self.gathered.mesh
            rows = [] if mesh.texcoords is None else _rows("vt", mesh.texcoords)
            if normals and mesh.normals is not None:
                rows += _rows("vn", mesh.normals)
            self._tails[normals] = rows + _faces(self.gathered, self._objects, normals)
        if self._colors is not None:
            vertices = np.hstack([vertices, self._colors])
        lines = [*self._head, *_vertices(vertices, self._scene, self._objects), *self._tails[normals]]
        return ("\n".join(lines) + "\n").encode()


def _named(materials: tuple[Material, ...]) -> tuple[Material, ...]:
    """The materials under names of their own in one line, by which the library is read."""
    labels = (" ".join(m.name.split()) or f"material_{i}" for i, m in enumerate(materials))
    return tuple(replace(m, name=name) for m, name in zip(materials, unique_names(labels), strict=True))


def _vertices(vertices: Floats, scene: FaceScene, objects: bool) -> list[str]:
    """The vertex lines, each run of one shape's vertices under that shape's name."""
    rows = _rows("v", vertices)
    if not objects:
        return rows
    names = {}
    owner = np.zeros(len(vertices), dtype=np.int32)
    for number, (name, ids) in enumerate(scene.file_order().items()):
        owner[ids] = number
        names[number] = name
    starts = np.flatnonzero(np.diff(owner, prepend=-1)).tolist()
    lines = []
    for start, end in zip(starts, [*starts[1:], len(rows)], strict=True):
        lines += [f"o {names[int(owner[start])]}", *rows[start:end]]
    return lines


def _rows(keyword: str, values: Floats) -> list[str]:
    line = " ".join([keyword, *["{!r}"] * values.shape[1]]).format
    return list(map(line, *values.T.tolist()))


def _faces(gathered: GatheredMesh, objects: bool, normals: bool) -> list[str]:
    mesh = gathered.mesh
    corners = _corners(mesh, normals)
    offsets = mesh.offsets.tolist()
    state: list[tuple[str, list[int], tuple[str, ...]]] = []
    if objects:
        state.append(("o", gathered.shape_of_face.tolist(), gathered.shape_names))
    if mesh.face_groups is not None:
        state.append(("g", mesh.face_groups.tolist(), mesh.group_names))
    if mesh.face_materials is not None:
        # Index -1 (no material) falls on the last name.
        names = (*(m.name for m in gathered.materials), "default")
        state.append(("usemtl", mesh.face_materials.tolist(), names))
    now: list[int | None] = [-1 if keyword == "usemtl" else None for keyword, _, _ in state]
    lines: list[str] = []
    for i in range(mesh.face_count):
        for k, (keyword, numbers, names) in enumerate(state):
            if numbers[i] != now[k]:
                now[k] = numbers[i]
                lines.append(f"{keyword} {names[numbers[i]]}")
        lines.append("f " + " ".join(corners[offsets[i] : offsets[i + 1]]))
    return lines


def _corners(mesh: PolyMesh, normals: bool) -> list[str]:
    vertex = (mesh.indices + 1).tolist()
    normal_indices = mesh.normal_indices if normals else None
    if mesh.texcoord_indices is None and normal_indices is None:
        return list(map(str, vertex))
    absent = np.full(mesh.indices.size, -1)
    texcoord = (absent if mesh.texcoord_indices is None else mesh.texcoord_indices).tolist()
    normal = (absent if normal_indices is None else normal_indices).tolist()
    out = []
    for v, t, n in zip(vertex, texcoord, normal, strict=True):
        uv = str(t + 1) if t >= 0 else ""
        out.append(f"{v}/{uv}/{n + 1}" if n >= 0 else f"{v}/{uv}" if uv else str(v))
    return out
