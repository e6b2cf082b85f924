"""What OpenUSD itself makes of a stage at a time: its blend shapes and joints, applied to the points."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom, UsdSkel

from fat import AnimatableFace
from fba.faps import Unit


def smallest_unit(face: AnimatableFace) -> float:
    """The smallest FAPU that displacements have."""
    return min(face.fapu.unit(u) for u in (Unit.MNS, Unit.MW, Unit.IRISD, Unit.ES, Unit.ENS))


def played(path: Path, times: Sequence[float]) -> list[dict[str, np.ndarray]]:
    """World points (n, 3) of every mesh, by the name of its prim, at these times; axes of the stage."""
    stage = Usd.Stage.Open(str(path))
    bound: dict[str, tuple[UsdSkel.SkeletonQuery, UsdSkel.SkinningQuery]] = {}
    cache = UsdSkel.Cache()
    root = UsdSkel.Root(stage.GetDefaultPrim())
    if root:
        cache.Populate(root, Usd.PrimDefaultPredicate)
        for binding in cache.ComputeSkelBindings(root, Usd.PrimDefaultPredicate):
            for query in binding.GetSkinningTargets():
                bound[str(query.GetPrim().GetPath())] = (cache.GetSkelQuery(binding.GetSkeleton()), query)
    meshes = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    return [{p.GetName(): _world(p, bound.get(str(p.GetPath())), time) for p in meshes} for time in times]


def _world(
    prim: Usd.Prim, bound: tuple[UsdSkel.SkeletonQuery, UsdSkel.SkinningQuery] | None, time: float
) -> np.ndarray:
    points = UsdGeom.Mesh(prim).GetPointsAttr().Get()
    if bound is None:
        return _placed(np.array(points), UsdGeom.XformCache(time).GetLocalToWorldTransform(prim))
    skeleton, query = bound
    if query.HasBlendShapes():
        blend = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(prim))
        weights = query.GetBlendShapeMapper().Remap(skeleton.GetAnimQuery().ComputeBlendShapeWeights(time))
        parts = blend.ComputeSubShapeWeights(weights)
        index, offsets = blend.ComputeBlendShapePointIndices(), blend.ComputeSubShapePointOffsets()
        assert blend.ComputeDeformedPoints(*parts, index, offsets, points)
    transforms = skeleton.ComputeSkinningTransforms(time)
    mapper = query.GetJointMapper()
    assert query.ComputeSkinnedPoints(mapper.RemapTransforms(transforms) if mapper else transforms, points, time)
    return _placed(np.array(points), UsdGeom.XformCache(time).GetLocalToWorldTransform(skeleton.GetPrim()))


def _placed(points: np.ndarray, matrix: object) -> np.ndarray:
    rows = np.array(matrix)
    return points.astype(np.float64) @ rows[:3, :3] + rows[3, :3]
