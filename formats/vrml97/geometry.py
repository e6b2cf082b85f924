"""Shape nodes of the syntax tree and the toolkit's meshes and materials: both directions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fba.arrays import Floats, Ints
from fba.errors import MeshError
from fba.findings import Finding
from fba.mesh import Material, PolyMesh
from fba.scene import Shape
from formats.vrml97.tree import Booleans, Nodes, Numbers, Strings, Use, VrmlNode, node, number, numbers

Definitions = Mapping[str, VrmlNode]


def resolve(item: VrmlNode | Use | None, defs: Definitions) -> VrmlNode | None:
    """The node behind a USE; None if nothing has that name."""
    return defs.get(item.name) if isinstance(item, Use) else item


def child(owner: VrmlNode | None, name: str, defs: Definitions) -> VrmlNode | None:
    """The first node in a field, USE resolved; None if there is none."""
    found = owner.nodes(name) if owner is not None else ()
    return resolve(found[0], defs) if found else None


def values_of(owner: VrmlNode, name: str, width: int) -> Floats | None:
    """The (n, width) numbers of a field; None if it is absent or empty.

    Raises
    ------
    MeshError
        If the field holds something else, a wrong count, or numbers that are not finite.
    """
    value = owner.get(name)
    if not isinstance(value, Numbers):
        if value is None or not isinstance(value, (Strings, Booleans, Nodes)):
            return None
        raise MeshError(f"line {owner.line}: {owner.type}.{name} must be numbers")
    if value.values.size % width:
        raise MeshError(
            f"line {owner.line}: {owner.type}.{name} has {value.values.size} numbers, not a multiple of {width}"
        )
    if not np.all(np.isfinite(value.values)):
        raise MeshError(f"line {owner.line}: {owner.type}.{name} holds a value that is not a finite number")
    return value.values.reshape(-1, width) if value.values.size else None


def fixed(owner: VrmlNode | None, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
    """A number, vector, colour or rotation, or its default."""
    if owner is None:
        return default
    found = values_of(owner, name, len(default))
    if found is None:
        return default
    if len(found) != 1:
        raise MeshError(f"line {owner.line}: {owner.type}.{name} needs {len(default)} numbers, not {found.size}")
    return tuple(float(v) for v in found[0])


def flag(owner: VrmlNode, name: str, default: bool) -> bool:
    """A Boolean field, or its default."""
    value = owner.get(name)
    return value.values[0] if isinstance(value, Booleans) and value.values else default


@dataclass(frozen=True)
class _Polygons:
    """Corner lists cut at -1: `keep` marks the places in coordIndex that are corners of real polygons."""

    offsets: Ints
    keep: Ints
    face_rows: Ints
    dropped: int


def _integers(owner: VrmlNode, name: str) -> Ints | None:
    found = values_of(owner, name, 1)
    if found is None:
        return None
    flat = found[:, 0]
    if np.any(np.abs(flat) > 2**31 - 1) or np.any(flat != np.rint(flat)):
        raise MeshError(f"line {owner.line}: {owner.type}.{name} holds a number that is not an int32")
    return flat.astype(np.int32)


def _polygons(index: Ints) -> _Polygons:
    corner = index >= 0
    face = np.concatenate([[0], np.cumsum(~corner)])[:-1]
    size = np.bincount(face[corner], minlength=int(face[-1]) + 1)
    real = size >= 3
    keep = np.flatnonzero(corner & real[face])
    offsets = np.concatenate([[0], np.cumsum(size[real])])
    dropped = int(np.count_nonzero((size > 0) & ~real))
    return _Polygons(offsets.astype(np.int32), keep.astype(np.int32), np.flatnonzero(real).astype(np.int32), dropped)


def mesh_of(shape: VrmlNode, defs: Definitions, findings: list[Finding] | None = None) -> PolyMesh | None:
    """The mesh of a Shape with an IndexedFaceSet; None for other geometry.

    Polygons wound clockwise (``ccw FALSE``) come out counter-clockwise.

    Raises
    ------
    MeshError
        If indices point outside the points, or numbers are missing or not finite.
    """
    faces = child(shape, "geometry", defs)
    if faces is None or faces.type != "IndexedFaceSet":
        return None
    coord = child(faces, "coord", defs)
    points = None if coord is None else values_of(coord, "point", 3)
    index = _integers(faces, "coordIndex")
    points = np.zeros((0, 3)) if points is None else points
    index = np.zeros(0, np.int32) if index is None else index
    if index.size == 0:
        return PolyMesh(points, index, np.zeros(1, np.int32))
    if int(index.max()) >= len(points):
        raise MeshError(
            f"line {faces.line}: coordIndex uses point {int(index.max())}, but there are {len(points)} points"
        )
    cut = _polygons(index)
    said = findings if findings is not None else []
    where = f"line {faces.line}"
    if cut.dropped:
        said.append(Finding("warning", "polygons", f"{cut.dropped} polygons with fewer than 3 corners left out", where))
    texcoords, texcoord_indices = _texture(faces, index, cut, defs, said)
    normals, normal_indices = _normals(faces, index, cut, defs, said)
    mesh = PolyMesh(points, index[cut.keep], cut.offsets, texcoords, texcoord_indices, normals, normal_indices)
    return mesh if flag(faces, "ccw", True) else mesh.reversed()


def _texture(
    faces: VrmlNode, index: Ints, cut: _Polygons, defs: Definitions, said: list[Finding]
) -> tuple[Floats | None, Ints | None]:
    owner = child(faces, "texCoord", defs)
    points = None if owner is None else values_of(owner, "point", 2)
    if points is None:
        return None, None
    own = _integers(faces, "texCoordIndex")
    corners = _corner_values(index if own is None else own, index, cut, len(points))
    if corners is None:
        said.append(Finding("warning", "texCoordIndex", "does not match coordIndex; not used", f"line {faces.line}"))
        return None, None
    return points, corners


def _normals(
    faces: VrmlNode, index: Ints, cut: _Polygons, defs: Definitions, said: list[Finding]
) -> tuple[Floats | None, Ints | None]:
    owner = child(faces, "normal", defs)
    vectors = None if owner is None else values_of(owner, "vector", 3)
    if vectors is None:
        return None, None
    own = _integers(faces, "normalIndex")
    if flag(faces, "normalPerVertex", True):
        corners = _corner_values(index if own is None else own, index, cut, len(vectors))
    else:
        per_face = np.arange(int(cut.face_rows.max(initial=-1)) + 1, dtype=np.int32) if own is None else own
        corners = None
        if per_face.size > cut.face_rows.max(initial=-1):
            corners = np.repeat(per_face[cut.face_rows], np.diff(cut.offsets))
            corners = corners if corners.size and corners.min() >= 0 and corners.max() < len(vectors) else None
    if corners is None:
        said.append(Finding("warning", "normalIndex", "does not match coordIndex; not used", f"line {faces.line}"))
        return None, None
    return vectors, corners


def _corner_values(own: Ints, index: Ints, cut: _Polygons, count: int) -> Ints | None:
    """Values at the corners of real polygons; None if the list is cut otherwise than coordIndex or out of range."""
    shared = min(own.size, index.size)
    if np.any((own[:shared] < 0) != (index[:shared] < 0)) or (cut.keep.size and cut.keep[-1] >= own.size):
        return None
    corners = own[cut.keep]
    return corners if corners.size == 0 or (corners.min() >= 0 and corners.max() < count) else None


def material_of(shape: VrmlNode, defs: Definitions) -> Material:
    """What a Shape's Appearance says; the name is the DEF name of its Material or Appearance."""
    appearance = child(shape, "appearance", defs)
    material = child(appearance, "material", defs)
    texture = child(appearance, "texture", defs)
    url = texture.get("url") if texture is not None and texture.type == "ImageTexture" else None
    named = next((n.def_name for n in (material, appearance) if n is not None and n.def_name), "")
    default = Material()

    def color(name: str, fallback: tuple[float, float, float]) -> tuple[float, float, float]:
        red, green, blue = fixed(material, name, fallback)
        return red, green, blue

    return Material(
        name=named or "",
        diffuse=color("diffuseColor", default.diffuse),
        ambient_intensity=fixed(material, "ambientIntensity", (default.ambient_intensity,))[0],
        specular=color("specularColor", default.specular),
        emissive=color("emissiveColor", default.emissive),
        shininess=fixed(material, "shininess", (default.shininess,))[0],
        transparency=fixed(material, "transparency", (default.transparency,))[0],
        texture=url.values[0] if isinstance(url, Strings) and url.values else None,
    )


def appearance_node(materials: tuple[Material, ...]) -> VrmlNode:
    """An Appearance for the first of these materials."""
    m = materials[0] if materials else Material()
    image = None if m.texture is None else Nodes((node("ImageTexture", url=Strings((m.texture,))),))
    look = node(
        "Material",
        ambientIntensity=number(m.ambient_intensity),
        diffuseColor=number(*m.diffuse),
        emissiveColor=number(*m.emissive),
        shininess=number(m.shininess),
        specularColor=number(*m.specular),
        transparency=number(m.transparency),
    )
    return node("Appearance", material=Nodes((look,)), texture=image)


def _index_lists(values: Ints, offsets: Ints) -> Numbers:
    """Corner values with -1 after each polygon."""
    return numbers(np.insert(values.astype(np.float64), offsets[1:], -1.0))


def face_set_node(mesh: PolyMesh, materials: tuple[Material, ...], like: VrmlNode | None = None) -> VrmlNode:
    """An IndexedFaceSet in the mesh's own polygons, counter-clockwise.

    A corner without texture coordinate points to an extra last one, since VRML97 has none for that. Several
    materials become one colour per polygon. `like` gives creaseAngle, solid and convex.
    """
    fields: dict[str, Numbers | Nodes | Booleans | None] = {}
    fields["coord"] = Nodes((node("Coordinate", point=numbers(mesh.vertices)),))
    fields["coordIndex"] = _index_lists(mesh.indices, mesh.offsets)
    if mesh.texcoords is not None and mesh.texcoord_indices is not None:
        uv, corners = _filled(mesh.texcoords, mesh.texcoord_indices)
        fields["texCoord"] = Nodes((node("TextureCoordinate", point=numbers(uv)),))
        fields["texCoordIndex"] = _index_lists(corners, mesh.offsets)
    if mesh.normals is not None and mesh.normal_indices is not None:
        vectors, corners = _filled(mesh.normals, mesh.normal_indices)
        fields["normal"] = Nodes((node("Normal", vector=numbers(vectors)),))
        fields["normalIndex"] = _index_lists(corners, mesh.offsets)
    if len(materials) > 1 and mesh.face_materials is not None:
        palette = [m.diffuse for m in (*materials, Material())]
        fields["color"] = Nodes((node("Color", color=numbers(palette)),))
        used = np.where(mesh.face_materials < 0, len(materials), mesh.face_materials)
        fields["colorIndex"] = numbers(used)
        fields["colorPerVertex"] = Booleans((False,))
    built = node("IndexedFaceSet", **fields)
    if like is None:
        return built.with_field("solid", Booleans((False,))).with_field("creaseAngle", number(3.0))
    for name in ("creaseAngle", "solid", "convex"):
        built = built.with_field(name, like.get(name))
    return built


def _filled(values: Floats, indices: Ints) -> tuple[Floats, Ints]:
    if indices.size == 0 or int(indices.min()) >= 0:
        return values, indices
    extra = np.concatenate([values, np.zeros((1, values.shape[1]))])
    return extra, np.where(indices < 0, len(values), indices).astype(np.int32)


def shape_node(name: str, mesh: PolyMesh, materials: tuple[Material, ...]) -> VrmlNode:
    """A whole Shape."""
    return node(
        "Shape",
        name,
        appearance=Nodes((appearance_node(materials),)),
        geometry=Nodes((face_set_node(mesh, materials),)),
    )


def same_polygons(a: PolyMesh, b: PolyMesh) -> bool:
    """Whether two meshes have the same number of points, the same polygons and texture coordinates."""

    def same(x: Floats | Ints | None, y: Floats | Ints | None) -> bool:
        if x is None or y is None:
            return x is y
        return np.array_equal(x, y)

    names = ("indices", "offsets", "texcoords", "texcoord_indices")
    return a.vertex_count == b.vertex_count and all(same(getattr(a, n), getattr(b, n)) for n in names)


def same_mesh(a: PolyMesh, b: PolyMesh) -> bool:
    """Whether points, polygons and texture coordinates are equal (normals follow from them)."""
    return same_polygons(a, b) and np.array_equal(a.vertices, b.vertices)


def carried_colors(
    faces: VrmlNode, old: PolyMesh, new: PolyMesh, rows: Ints | None, defs: Definitions
) -> dict[str, Numbers | Nodes | Booleans]:
    """The Color fields of an IndexedFaceSet cut to a part of its mesh; empty if it has none or the part is not one."""
    owner = child(faces, "color", defs)
    palette = None if owner is None else values_of(owner, "color", 3)
    index = _integers(faces, "coordIndex")
    if palette is None or index is None or rows is None:
        return {}
    own = _integers(faces, "colorIndex")
    cut = _polygons(index)
    chosen: Floats
    if flag(faces, "colorPerVertex", True):
        corners = _corner_values(index if own is None else own, index, cut, len(palette))
        if corners is None:
            return {}
        table = np.full((old.vertex_count, 3), 0.8)
        table[index[cut.keep]] = palette[corners]
        chosen = table[rows]
    else:
        per_face = np.arange(len(palette), dtype=np.int32) if own is None else own
        if cut.face_rows.size and (cut.face_rows[-1] >= per_face.size or per_face[cut.face_rows].max() >= len(palette)):
            return {}
        covered = np.zeros(old.vertex_count, dtype=bool)
        covered[rows] = True
        kept = np.flatnonzero(np.logical_and.reduceat(covered[old.indices], old.offsets[:-1]))
        corners = np.repeat(np.isin(np.arange(old.face_count), kept), old.arities)
        if not np.array_equal(old.indices[corners], rows[new.indices]):
            return {}
        chosen = palette[per_face[cut.face_rows[kept]]]
    return {
        "color": Nodes((node("Color", color=numbers(chosen)),)),
        "colorPerVertex": Booleans((flag(faces, "colorPerVertex", True),)),
    }


def changed_shape(shape: VrmlNode, old: PolyMesh, new: Shape, rows: Ints | None, defs: Definitions) -> VrmlNode:
    """A Shape of the document with another mesh; its appearance and, where the polygons are the same, all else stay.

    rows : for each vertex of the new mesh its place in the old one; None if it is not a part of it.
    """
    faces = child(shape, "geometry", defs)
    assert faces is not None
    if same_polygons(old, new.mesh):
        geometry = faces.with_field("coord", Nodes((node("Coordinate", point=numbers(new.mesh.vertices)),)))
        geometry = geometry.with_field("normal", None).with_field("normalIndex", None)
    else:
        geometry = face_set_node(new.mesh, new.materials, like=faces)
        for name, value in carried_colors(faces, old, new.mesh, rows, defs).items():
            geometry = geometry.with_field(name, value)
    return shape.with_field("geometry", Nodes((replace(geometry, def_name=None),)))


def rows_of(part: PolyMesh, whole: PolyMesh) -> Ints | None:
    """For each vertex of `part` the place of an equal vertex in `whole`; None if one is missing or there is none."""
    if part.vertex_count == 0 or part.vertex_count > whole.vertex_count:
        return None
    place = {row.tobytes(): k for k, row in reversed(list(enumerate(whole.vertices + 0.0)))}
    found = [place.get(row.tobytes()) for row in part.vertices + 0.0]
    if any(k is None for k in found):
        return None
    return np.array(found, dtype=np.int32)
