"""Meshes of a scene as UsdGeomMesh, and back: polygons of any arity, uv, normals, groups and materials."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdGeom, UsdShade

from fba.arrays import Floats, Ints
from fba.errors import InputFileError, MeshError
from fba.mesh import Material, PolyMesh
from fba.scene import Role, Shape
from formats.normals import SmoothNormals
from formats.usd.axes import StageAxes
from formats.usd.materials import MaterialLibrary, read_material
from formats.usd.names import Namer
from formats.usd.properties import (
    get,
    get_twin,
    ints,
    put,
    put_array,
    put_targets,
    put_twin,
    rows,
    targets,
    to_single,
    vt,
)
from formats.usd.surfaces import UV_PRIMVAR
from formats.usd.xforms import value_of

MATERIAL_FAMILY = "materialBind"
GROUP_FAMILY = "faceGroups"

DERIVED = "derivedNormals"
"""Own attribute of a mesh whose normals are the writer's work; the reader leaves them out."""


def write_mesh(
    stage: Usd.Stage,
    path: Sdf.Path,
    shape: Shape,
    axes: StageAxes,
    library: MaterialLibrary,
    smooth: SmoothNormals | None,
) -> Namer:
    """Author a shape, with smooth normals if it has none; return what hands out the names of prims below it."""
    mesh = shape.mesh
    prim = UsdGeom.Mesh.Define(stage, path)
    points = axes.vectors(mesh.vertices)
    single = to_single(points)
    prim.CreatePointsAttr(vt(single))
    prim.CreateExtentAttr(vt(_extent(single)))
    prim.CreateFaceVertexCountsAttr(vt(mesh.arities))
    prim.CreateFaceVertexIndicesAttr(vt(mesh.indices))
    prim.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    put_twin(prim.GetPrim(), "points", points)
    _write_primvar(prim, UV_PRIMVAR, Sdf.ValueTypeNames.TexCoord2fArray, mesh.texcoords, mesh.texcoord_indices)
    normals = None if mesh.normals is None else axes.vectors(mesh.normals)
    _write_primvar(prim, "normals", Sdf.ValueTypeNames.Normal3fArray, normals, mesh.normal_indices)
    if smooth is not None:
        prim.CreateNormalsAttr(vt(to_single(axes.vectors(smooth.rest))))
        prim.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
        put(prim.GetPrim(), DERIVED, Sdf.ValueTypeNames.Bool, True)
    put(prim.GetPrim(), "role", Sdf.ValueTypeNames.Token, shape.role.value)
    if shape.vertex_ids is not None:
        put_array(prim.GetPrim(), "vertexIds", shape.vertex_ids)
    namer = Namer()
    _write_groups(prim, mesh, namer)
    _write_materials(prim, shape, library, namer)
    return namer


def _extent(points: NDArray[np.float32]) -> NDArray[np.float32]:
    if not len(points):
        return np.zeros((2, 3), np.float32)
    return np.stack([points.min(axis=0), points.max(axis=0)])


def _write_primvar(
    mesh: UsdGeom.Mesh, name: str, kind: Sdf.ValueTypeName, values: Floats | None, indices: Ints | None
) -> None:
    if values is None or indices is None:
        return
    primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(name, kind, UsdGeom.Tokens.faceVarying)
    if np.any(indices < 0):
        # Corners without a value point to one zero behind the values, marked as not authored.
        indices = np.where(indices < 0, len(values), indices).astype(np.int32)
        primvar.SetUnauthoredValuesIndex(len(values))
        padded = np.concatenate([values, np.zeros((1, values.shape[1]))])
    else:
        padded = values
    primvar.Set(vt(to_single(padded)))
    primvar.SetIndices(vt(indices))
    put_twin(mesh.GetPrim(), name, values)


def _write_subset(mesh: UsdGeom.Mesh, name: str, faces: NDArray[np.integer[Any]], family: str) -> Usd.Prim:
    subset = UsdGeom.Subset.Define(mesh.GetPrim().GetStage(), mesh.GetPath().AppendChild(name))
    subset.CreateElementTypeAttr(UsdGeom.Tokens.face)
    subset.CreateFamilyNameAttr(family)
    subset.CreateIndicesAttr(vt(faces.astype(np.int32)))
    return subset.GetPrim()


def _set_family(mesh: UsdGeom.Mesh, family: str, numbers: Ints) -> None:
    whole = bool(numbers.size) and bool(np.all(numbers >= 0))
    kind = UsdGeom.Tokens.partition if whole else UsdGeom.Tokens.nonOverlapping
    UsdGeom.Subset.SetFamilyType(mesh, family, kind)


def _write_groups(mesh: UsdGeom.Mesh, poly: PolyMesh, namer: Namer) -> None:
    if poly.group_names:
        put(mesh.GetPrim(), "groupNames", Sdf.ValueTypeNames.StringArray, list(poly.group_names))
    if poly.face_groups is None:
        return
    for number, name in enumerate(poly.group_names):
        faces = np.flatnonzero(poly.face_groups == number)
        if faces.size:
            subset = _write_subset(mesh, namer.name(f"group_{name}"), faces, GROUP_FAMILY)
            put(subset, "group", Sdf.ValueTypeNames.Int, number)
    _set_family(mesh, GROUP_FAMILY, poly.face_groups)


def _write_materials(mesh: UsdGeom.Mesh, shape: Shape, library: MaterialLibrary, namer: Namer) -> None:
    paths = library.paths(shape.materials)
    prim = mesh.GetPrim()
    stage = prim.GetStage()
    if paths:
        put_targets(prim, "materials", paths)
    numbers = shape.mesh.face_materials
    if numbers is None:
        if paths:
            UsdShade.MaterialBindingAPI.Apply(prim).Bind(UsdShade.Material.Get(stage, paths[0]))
        return
    for number, path in enumerate(paths):
        faces = np.flatnonzero(numbers == number)
        if faces.size:
            subset = _write_subset(mesh, namer.name(f"material_{path.name}"), faces, MATERIAL_FAMILY)
            UsdShade.MaterialBindingAPI.Apply(subset).Bind(UsdShade.Material.Get(stage, path))
    _set_family(mesh, MATERIAL_FAMILY, numbers)


def read_mesh(prim: Usd.Prim, axes: StageAxes, name: str) -> Shape:
    """Read a UsdGeomMesh of any origin.

    Raises
    ------
    InputFileError
        If its polygons are damaged; the message names the prim.
    """
    mesh = UsdGeom.Mesh(prim)
    single = rows(value_of(mesh.GetPointsAttr()), 3).astype(np.float32)
    counts = ints(_or_empty(value_of(mesh.GetFaceVertexCountsAttr())))
    indices = ints(_or_empty(value_of(mesh.GetFaceVertexIndicesAttr())))
    offsets = np.concatenate([[0], np.cumsum(counts)])
    try:
        poly = PolyMesh(axes.frame.from_file(get_twin(prim, "points", single)), indices, offsets)
        texcoords, texcoord_indices = _read_uv(mesh, poly)
        normals, normal_indices = _read_normals(mesh, poly, axes)
        materials, face_materials = _read_materials(prim, poly.face_count)
        groups, names = _read_groups(prim, poly.face_count)
        poly = PolyMesh(
            poly.vertices,
            poly.indices,
            poly.offsets,
            texcoords,
            texcoord_indices,
            normals,
            normal_indices,
            groups,
            names,
            face_materials,
        )
        if mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded:
            # Authored normals point outwards whatever the winding, so they are not turned with it.
            poly = replace(poly.reversed(), normals=poly.normals)
        ids = get(prim, "vertexIds")
        return Shape(name, poly, _role(prim), materials, None if ids is None else ints(ids))
    except MeshError as error:
        raise InputFileError(f"{prim.GetPath()} is damaged: {error}") from error


def _or_empty(value: object) -> Any:
    return [] if value is None else value


def _role(prim: Usd.Prim) -> Role:
    role = get(prim, "role")
    return Role(role) if role in set(Role) else Role.OTHER


def _read_uv(mesh: UsdGeom.Mesh, poly: PolyMesh) -> tuple[Floats | None, Ints | None]:
    api = UsdGeom.PrimvarsAPI(mesh)
    primvar = api.GetPrimvar(UV_PRIMVAR)
    if not (primvar and primvar.HasValue()):
        kinds = (Sdf.ValueTypeNames.TexCoord2fArray, Sdf.ValueTypeNames.TexCoord2dArray)
        others = [p for p in api.GetPrimvarsWithValues() if p.GetTypeName() in kinds]
        if not others:
            return None, None
        primvar = others[0]
    return _read_primvar(mesh, primvar, 2, poly)


def _read_normals(mesh: UsdGeom.Mesh, poly: PolyMesh, axes: StageAxes) -> tuple[Floats | None, Ints | None]:
    primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals")
    if primvar and primvar.HasValue():
        values, indices = _read_primvar(mesh, primvar, 3, poly)
    else:
        found = value_of(mesh.GetNormalsAttr())
        if found is None or not len(found) or get(mesh.GetPrim(), DERIVED):
            return None, None
        values = rows(found, 3).astype(np.float64)
        indices = _element_of_corner(mesh.GetNormalsInterpolation(), poly)
    return (None, None) if values is None else (axes.frame.from_file(values), indices)


def _read_primvar(
    mesh: UsdGeom.Mesh, primvar: UsdGeom.Primvar, width: int, poly: PolyMesh
) -> tuple[Floats | None, Ints | None]:
    raw = rows(value_of(primvar.GetAttr()), width)
    corner = _element_of_corner(primvar.GetInterpolation(), poly)
    missing = None
    if primvar.IsIndexed():
        table = ints(value_of(primvar.GetIndicesAttr()))
        missing = primvar.GetUnauthoredValuesIndex()
        if corner.size and int(corner.max()) >= table.size:
            raise MeshError(f"primvar {primvar.GetPrimvarName()} has {table.size} indices, which are too few")
        corner = table[corner]
    if missing is not None and missing >= 0:
        corner = np.where(corner == missing, -1, corner).astype(np.int32)
        raw = raw[:-1] if missing == len(raw) - 1 else raw
    values = get_twin(mesh.GetPrim(), str(primvar.GetPrimvarName()), raw)
    return values, corner


def _element_of_corner(interpolation: str, poly: PolyMesh) -> Ints:
    """Which element of a primvar each corner of each polygon uses, (k,)."""
    if interpolation == UsdGeom.Tokens.faceVarying:
        return np.arange(poly.indices.size, dtype=np.int32)
    if interpolation in (UsdGeom.Tokens.vertex, UsdGeom.Tokens.varying):
        return poly.indices
    if interpolation == UsdGeom.Tokens.uniform:
        return np.repeat(np.arange(poly.face_count, dtype=np.int32), poly.arities)
    return np.zeros(poly.indices.size, dtype=np.int32)


def _subset_faces(subset: UsdGeom.Subset, face_count: int) -> Ints:
    faces = ints(_or_empty(value_of(subset.GetIndicesAttr())))
    if faces.size and (int(faces.min()) < 0 or int(faces.max()) >= face_count):
        raise MeshError(f"subset {subset.GetPrim().GetName()} has polygons outside 0..{face_count - 1}")
    return faces


def _has_family(prim: Usd.Prim, family: str) -> bool:
    kind = UsdGeom.Subset.GetFamilyType(UsdGeom.Imageable(prim), family)
    return bool(kind != UsdGeom.Tokens.unrestricted)


def _read_groups(prim: Usd.Prim, face_count: int) -> tuple[Ints | None, tuple[str, ...]]:
    names = tuple(str(n) for n in get(prim, "groupNames") or ())
    subsets = UsdGeom.Subset.GetGeomSubsets(UsdGeom.Imageable(prim), UsdGeom.Tokens.face, GROUP_FAMILY)
    if not subsets and not _has_family(prim, GROUP_FAMILY):
        return None, names
    groups = np.full(face_count, -1, dtype=np.int32)
    for subset in subsets:
        groups[_subset_faces(subset, face_count)] = int(get(subset.GetPrim(), "group") or 0)
    return groups, names


def _read_materials(prim: Usd.Prim, face_count: int) -> tuple[tuple[Material, ...], Ints | None]:
    own = targets(prim, "materials")
    order: list[Usd.Prim] = list(own)
    subsets = UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets()
    whole = _bound(prim)
    if whole is not None and whole not in order:
        # Bound by another program: what the whole mesh wears comes first.
        order = [whole] if not subsets else [*order, whole]
    if not subsets and not _has_family(prim, MATERIAL_FAMILY):
        return tuple(read_material(m) for m in order), None
    numbers = np.full(face_count, -1 if whole is None else order.index(whole), dtype=np.int32)
    for subset in subsets:
        material = _bound(subset.GetPrim())
        if material is None:
            continue
        if material not in order:
            order.append(material)
        numbers[_subset_faces(subset, face_count)] = order.index(material)
    return tuple(read_material(m) for m in order), numbers


def _bound(prim: Usd.Prim) -> Usd.Prim | None:
    material = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
    return material.GetPrim() if material else None
