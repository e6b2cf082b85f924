"""Is a USD face sound? OpenUSD's own validators, and checks of what these do not look at."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom, UsdSkel, UsdValidation

from fba.findings import Finding
from formats.usd.properties import get, ints, rows
from formats.usd.stages import open_stage, reading

_SEVERITY: dict[str, Literal["error", "warning", "info"]] = {"Error": "error", "Warn": "warning", "Info": "info"}


def validate_stage(path: Path) -> list[Finding]:
    """Check a USD file.

    Returns
    -------
    What OpenUSD's registered validators say, with their own names as codes, and the findings ``usd-...`` of
    this toolkit: polygons, extents, blend shapes, their targets, animations, face definition tables.

    Raises
    ------
    InputFileError
        If the file cannot be opened at all.
    """
    with reading(path):
        stage, _ = open_stage(path)
        findings = _registered(stage)
        for prim in stage.Traverse(Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)):
            if prim.IsA(UsdGeom.Mesh):
                findings += _mesh(prim)
                findings += _targets(prim)
            elif prim.IsA(UsdSkel.BlendShape):
                findings += _blend_shape(prim)
            elif prim.IsA(UsdSkel.Animation):
                findings += _animation(prim)
        findings += _animation_names(stage)
    return findings


def _registered(stage: Usd.Stage) -> list[Finding]:
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    found = []
    for error in UsdValidation.ValidationContext(validators).Validate(stage):
        severity = _SEVERITY.get(error.GetType().name, "error")
        if error.GetName() == "UnresolvableDependency":
            # A texture that is not there is the material's loss; the face is whole and plays.
            severity = "warning"
        where = ", ".join(_site(site) for site in error.GetSites())
        found.append(Finding(severity, str(error.GetName()), " ".join(error.GetMessage().split()), where))
    return sorted(found, key=lambda f: (f.where, f.code, f.message))


def _site(site: UsdValidation.ValidationErrorSite) -> str:
    if site.IsProperty():
        return str(site.GetProperty().GetPath())
    if site.IsPrim():
        return str(site.GetPrim().GetPath())
    return "stage"


def _mesh(prim: Usd.Prim) -> Iterator[Finding]:
    where = str(prim.GetPath())
    mesh = UsdGeom.Mesh(prim)
    points = rows(mesh.GetPointsAttr().Get(), 3)
    counts = ints(mesh.GetFaceVertexCountsAttr().Get() or [])
    indices = ints(mesh.GetFaceVertexIndicesAttr().Get() or [])
    if not np.all(np.isfinite(points)):
        yield Finding("error", "usd-points", "some points are not finite numbers", where)
    if int(counts.sum()) != indices.size:
        text = f"the face counts ask for {int(counts.sum())} corners, but there are {indices.size} face indices"
        yield Finding("error", "usd-face-indices", text, where)
    if np.any(counts < 3):
        yield Finding("error", "usd-face-counts", "some polygons have fewer than 3 corners", where)
    if indices.size and (int(indices.min()) < 0 or int(indices.max()) >= len(points)):
        text = f"face indices run from {int(indices.min())} to {int(indices.max())}, but there are {len(points)} points"
        yield Finding("error", "usd-face-indices", text, where)
    yield from _extent(mesh, points, where)


def _extent(mesh: UsdGeom.Mesh, points: NDArray[Any], where: str) -> list[Finding]:
    extent = mesh.GetExtentAttr().Get()
    if extent is None:
        return [Finding("warning", "usd-extent", "the mesh has no extent; viewers cannot frame it quickly", where)]
    box = rows(extent, 3)
    if len(box) != 2:
        return [Finding("error", "usd-extent", f"the extent has {len(box)} points instead of 2", where)]
    if len(points) and (np.any(points.min(axis=0) < box[0]) or np.any(points.max(axis=0) > box[1])):
        return [Finding("warning", "usd-extent", "some points lie outside the extent; compute it again", where)]
    return []


def _targets(prim: Usd.Prim) -> Iterator[Finding]:
    """Blend shapes as a mesh sees them."""
    where = str(prim.GetPath())
    binding = UsdSkel.BindingAPI(prim)
    tokens = [str(t) for t in binding.GetBlendShapesAttr().Get() or ()]
    paths = binding.GetBlendShapeTargetsRel().GetForwardedTargets()
    if len(tokens) != len(paths):
        text = f"skel:blendShapes names {len(tokens)} shapes, but skel:blendShapeTargets has {len(paths)}"
        yield Finding("error", "usd-target-count", text, where)
    if len(set(tokens)) != len(tokens):
        yield Finding("error", "usd-target-names", "skel:blendShapes names a shape twice", where)
    points = len(UsdGeom.Mesh(prim).GetPointsAttr().Get() or ())
    for path in paths:
        blend = UsdSkel.BlendShape(prim.GetStage().GetPrimAtPath(path))
        if not blend:
            yield Finding("error", "usd-target", f"the blend shape target {path} is not a blend shape", where)
            continue
        index = ints(blend.GetPointIndicesAttr().Get() or [])
        offsets = len(blend.GetOffsetsAttr().Get() or ())
        if index.size and (int(index.min()) < 0 or int(index.max()) >= points):
            text = f"pointIndices run from {int(index.min())} to {int(index.max())}, but {where} has {points} points"
            yield Finding("error", "usd-point-indices", text, str(path))
        if not index.size and offsets not in (0, points):
            text = f"there are {offsets} offsets without pointIndices, but {where} has {points} points"
            yield Finding("error", "usd-offsets-count", text, str(path))


def _blend_shape(prim: Usd.Prim) -> Iterator[Finding]:
    """A blend shape by itself: numbers of offsets, inbetweens, table data."""
    where = str(prim.GetPath())
    blend = UsdSkel.BlendShape(prim)
    index = ints(blend.GetPointIndicesAttr().Get() or [])
    offsets = rows(blend.GetOffsetsAttr().Get(), 3)
    normals = blend.GetNormalOffsetsAttr().Get()
    count = index.size or len(offsets)
    if len(offsets) != count:
        text = f"there are {len(offsets)} offsets for {index.size} pointIndices"
        yield Finding("error", "usd-offsets-count", text, where)
    if normals is not None and len(normals) not in (0, count):
        text = f"there are {len(normals)} normalOffsets for {count} points"
        yield Finding("error", "usd-offsets-count", text, where)
    if not np.all(np.isfinite(offsets)):
        yield Finding("error", "usd-offsets", "some offsets are not finite numbers", where)
    weights = []
    for inbetween in blend.GetInbetweens():
        name = inbetween.GetAttr().GetName()
        weight = inbetween.GetWeight()
        values = len(inbetween.GetOffsets() or ())
        turned = len(inbetween.GetNormalOffsets() or ())
        if values != count or turned not in (0, count):
            text = f"{name} has {values} offsets and {turned} normal offsets for {count} points"
            yield Finding("error", "usd-offsets-count", text, where)
        if weight is None or weight in (0.0, 1.0) or weight in weights:
            text = f"{name} has the weight {weight}; every inbetween needs its own, and neither 0 nor 1"
            yield Finding("error", "usd-inbetween-weight", text, where)
        weights.append(weight)
    yield from _table(prim, count, weights)


def _table(prim: Usd.Prim, count: int, weights: list[float]) -> Iterator[Finding]:
    """The table data of an own blend shape against its inbetweens."""
    found = get(prim, "intervalBorders")
    if found is None:
        return
    where = str(prim.GetPath())
    borders = ints(found)
    if borders.size < 2 or np.any(np.diff(borders) <= 0) or 0 not in borders:
        text = "fba:intervalBorders must be at least two increasing integers with 0 among them"
        yield Finding("error", "usd-interval-borders", text, where)
        return
    full = get(prim, "valueAtWeightOne")
    if not full:
        yield Finding("error", "usd-weight-one", "fba:valueAtWeightOne must be a FAP value other than 0", where)
        return
    wanted = sorted(np.float32(b / full) for b in borders.tolist() if b not in (0, full))
    if wanted != sorted(np.float32(w) for w in weights if w is not None):
        text = "the inbetweens are not at fba:intervalBorders divided by fba:valueAtWeightOne"
        yield Finding("error", "usd-interval-borders", text, where)
    slopes = len(get(prim, "slopes") or ())
    needed = count * (borders.size - 1)
    if slopes != needed:
        text = f"fba:slopes has {slopes} vectors; {count} points and {borders.size - 1} intervals need {needed}"
        yield Finding("error", "usd-slopes", text, where)


def _animation(prim: Usd.Prim) -> Iterator[Finding]:
    """Numbers of weights of an animation, at every time sample."""
    animation = UsdSkel.Animation(prim)
    names = animation.GetBlendShapesAttr().Get() or ()
    weights = animation.GetBlendShapeWeightsAttr()
    times = [Usd.TimeCode.Default(), *(Usd.TimeCode(t) for t in weights.GetTimeSamples())]
    for time in times:
        values = weights.Get(time)
        if values is not None and len(values) != len(names):
            text = f"there are {len(values)} weights for {len(names)} blend shapes at {time}"
            yield Finding("error", "usd-animation-weights", text, str(prim.GetPath()))
            return


def _animation_names(stage: Usd.Stage) -> Iterator[Finding]:
    """Names that an animation drives, but no mesh below its skeletons has; and the other way round."""
    cache = UsdSkel.Cache()
    driven: dict[str, set[str]] = {}
    known: dict[str, set[str]] = {}
    names: dict[str, list[str]] = {}
    for prim in stage.Traverse():
        if not prim.IsA(UsdSkel.Root):
            continue
        root = UsdSkel.Root(prim)
        cache.Populate(root, Usd.PrimDefaultPredicate)
        for bound in cache.ComputeSkelBindings(root, Usd.PrimDefaultPredicate):
            animation = cache.GetSkelQuery(bound.GetSkeleton()).GetAnimQuery()
            if not animation:
                continue
            path = str(animation.GetPrim().GetPath())
            names[path] = [str(n) for n in animation.GetBlendShapeOrder()]
            known.setdefault(path, set())
            for query in bound.GetSkinningTargets():
                tokens = {str(t) for t in query.GetBlendShapeOrder() or ()}
                known[path] |= tokens
                driven.setdefault(str(query.GetPrim().GetPath()), set()).update(tokens - set(names[path]))
    for path, listed in names.items():
        unknown = [n for n in listed if n not in known[path]]
        if unknown:
            text = f"the animation drives blend shapes that no mesh has: {', '.join(unknown[:5])}"
            yield Finding("error", "usd-animation-names", text, path)
    for path, silent in driven.items():
        if silent:
            text = f"the animation leaves out blend shapes of this mesh: {', '.join(sorted(silent)[:5])}"
            yield Finding("warning", "usd-animation-names", text, path)
