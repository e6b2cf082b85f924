"""Measures of a cloned motion, always to be read beside the source's own value.

A *motion* is given as offsets from neutral, shape by shape or as one (n, 3) array. Amounts that people compare across
faces are in FAP units (FAPU/1024) or in eye separations.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from fat.conformance import FapConformance, conformance
from fba.arrays import Bools, Floats, Ints
from fba.errors import MeshError
from fba.faps import faps
from fba.fapu import Fapu
from fba.feature_points import FeaturePoints

LIP_PAIRS = (("2.2", "2.3"), ("2.6", "2.8"), ("2.7", "2.9"))
LID_PAIRS = (("3.1", "3.3"), ("3.2", "3.4"))

TIED = ({6, 53}, {7, 54}, {12, 59}, {13, 60})
"""Inner and outer lip corners lie so close together that their FAPs move as one; that is no cross-talk."""

JAW_FAPS = (3, 14, 15)
_CARRIED_BY_JAW = ("2.", "6.", "8.")

STILL = 1e-9
"""Offsets below this share of the largest one count as still."""


def feature_point_motion(points: FeaturePoints, offsets: Mapping[str, Floats]) -> dict[str, Floats]:
    """Offset (3,) of every feature point on a surface, from shape name -> offsets (n, 3); absent shapes are still."""
    out: dict[str, Floats] = {}
    for key, point in points.items():
        if point.shape is None:
            continue
        moved = offsets.get(point.shape)
        out[key] = np.zeros(3) if moved is None else np.asarray(point.weights) @ moved[list(point.vertices)]
    return out


def fap_values(motion: Mapping[str, Floats], fapu: Fapu) -> dict[int, float]:
    """FAP -> the value, in FAP units, that its own feature point shows in a motion (translation FAPs only).

    Parameters
    ----------
    motion : feature point -> offset (3,); see `feature_point_motion`.
    """
    return {
        f.id: float(motion[f.feature_points[0]] @ f.direction) / fapu.unit(f.unit)
        for f in faps()
        if f.direction is not None and f.feature_points[0] in motion
    }


@dataclass(frozen=True, slots=True)
class FapError:
    """Difference of two motions at all feature points.

    relative : sum of errors / sum of the source's motion, over the axes of all FAPs.
    largest : the largest error, in FAP units, and `fap_id` whose axis has it.
    """

    relative: float
    largest: float
    fap_id: int | None


LEAST = 1.0
"""FAP units: the least that a stream can say. Motions below it are what rounded tables leave of none."""


def fap_error(source: Mapping[int, float], target: Mapping[int, float]) -> FapError:
    """Compare two motions by their `fap_values`; FAPs that one side lacks are left out.

    The relative error is infinite where the source is still and the target is not.

    >>> fap_error({3: 1000.0, 5: -500.0}, {3: 1030.0, 5: -500.0})
    FapError(relative=0.02, largest=30.0, fap_id=3)
    """
    common = sorted(source.keys() & target.keys())
    errors = {k: abs(target[k] - source[k]) for k in common}
    total = sum(abs(source[k]) for k in common)
    worst = max(errors, key=lambda k: errors[k], default=None)
    largest = 0.0 if worst is None else errors[worst]
    relative = sum(errors.values()) / total if total else (float("inf") if largest > LEAST else 0.0)
    return FapError(relative, largest, worst)


def cross_talk(values: Mapping[int, float], fap_id: int) -> tuple[float, int | None]:
    """Largest motion of another FAP's feature point as a share of the FAP's own, and that other FAP.

    Left out are the other axes of the same point, the tied lip corners, and what a jaw carries.

    >>> cross_talk({31: 300.0, 33: -6.0, 37: 90.0}, 31)
    (0.02, 33)
    """
    own = faps()[fap_id - 1]
    others = {
        k: abs(v)
        for k, v in values.items()
        if faps()[k - 1].feature_points[0] != own.feature_points[0]
        and {k, fap_id} not in TIED
        and not (fap_id in JAW_FAPS and faps()[k - 1].feature_points[0].startswith(_CARRIED_BY_JAW))
    }
    amount = abs(values.get(fap_id, 0.0))
    worst = max(others, key=lambda k: others[k], default=None)
    if worst is None or others[worst] == 0.0:
        return 0.0, None
    return (others[worst] / amount if amount else float("inf")), worst


def flips(vertices: Floats, triangles: Ints, offsets: Floats) -> float:
    """Percent of the moving triangles whose normal turns by more than 90 degrees.

    Parameters
    ----------
    vertices, offsets : (n, 3). triangles : (t, 3).

    Notes
    -----
    A triangle moves when the offset of a corner is more than 1e-9 of the largest. Triangles without area at rest
    have no normal and are left out.
    """
    moving, turned = turned_over(vertices, triangles, offsets)
    return 100.0 * len(turned) / moving if moving else 0.0


def turned_over(vertices: Floats, triangles: Ints, offsets: Floats) -> tuple[int, Ints]:
    """How many triangles move, and which of them turn over; see `flips`."""
    moving = np.flatnonzero(_moving(offsets)[triangles].any(axis=1))
    before = _normals(vertices, triangles[moving])
    after = _normals(vertices + offsets, triangles[moving])
    solid = np.einsum("ij,ij->i", before, before) > 0.0
    turned: Ints = moving[solid & (np.einsum("ij,ij->i", before, after) < 0.0)].astype(np.int32)
    return int(np.count_nonzero(solid)), turned


def _moving(offsets: Floats) -> Bools:
    lengths = np.linalg.norm(offsets, axis=1)
    moving: Bools = lengths > STILL * float(lengths.max(initial=0.0))
    return moving


def _normals(vertices: Floats, triangles: Ints) -> Floats:
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normals: Floats = np.cross(b - a, c - a)
    return normals


def opening_change(motion: Mapping[str, Floats], pairs: Iterable[tuple[str, str]]) -> dict[str, float]:
    """By how much each (upper, lower) pair of feature points opens in a motion, in units of the mesh."""
    return {f"{a}/{b}": float(motion[a][1] - motion[b][1]) for a, b in pairs if a in motion and b in motion}


def lip_gap_change(
    source: Mapping[str, Floats], source_fapu: Fapu, target: Mapping[str, Floats], target_fapu: Fapu
) -> float:
    """Largest difference between the lips' opening in two motions at 2.2/2.3, 2.6/2.8, 2.7/2.9, in MNS (MNS0 = 1)."""
    a, b = opening_change(source, LIP_PAIRS), opening_change(target, LIP_PAIRS)
    return max((abs(b[k] / target_fapu.mns0 - a[k] / source_fapu.mns0) for k in a if k in b), default=0.0)


def lid_gap(rest: Mapping[str, Floats], motion: Mapping[str, Floats], fapu: Fapu) -> dict[str, float]:
    """How far each eye stays open in a motion, in IRISD (IRISD0 = 1); negative where the lids overlap.

    Parameters
    ----------
    rest : feature point -> neutral position (3,). motion : feature point -> offset (3,).
    """
    change = opening_change(motion, LID_PAIRS)
    neutral = opening_change(rest, LID_PAIRS)
    return {k: (neutral[k] + change[k]) / fapu.irisd0 for k in change if k in neutral}


def largest_motion(offsets: Floats, where: Bools, fapu: Fapu) -> float:
    """Largest offset of the vertices `where` (n,) bool, in eye separations: for skin that must stay still."""
    lengths = np.linalg.norm(offsets[where], axis=1)
    return float(lengths.max(initial=0.0)) / fapu.es0


def truth_error(offsets: Floats, truth: Floats, where: Bools | None = None) -> float:
    """Relative L2 distance from the true offsets, ``||D - T|| / ||T||``, over the vertices `where`."""
    used = slice(None) if where is None else where
    norm = float(np.linalg.norm(truth[used]))
    wrong = float(np.linalg.norm(offsets[used] - truth[used]))
    return wrong / norm if norm else (float("inf") if wrong else 0.0)


def mirror_map(vertices: Floats, tolerance: float) -> Ints:
    """For each vertex the one at its place mirrored in x = 0, (n,); its own inverse.

    Raises
    ------
    MeshError
        If some vertex has no partner within `tolerance` (units of the mesh): the mesh is not symmetric.
    """
    from scipy.spatial import cKDTree

    distance, partner = cKDTree(vertices).query(vertices * [-1.0, 1.0, 1.0])
    index = np.asarray(partner, dtype=np.int32)
    largest = float(np.max(distance, initial=0.0))
    if largest > tolerance or np.any(index[index] != np.arange(len(index))):
        raise MeshError(f"the mesh is not symmetric: vertices miss their mirror image by up to {largest:.3g}")
    return index


def asymmetry(offsets: Floats, other: Floats, mirror: Ints) -> float:
    """Relative L2 difference between a motion and the mirrored motion of the other side.

    Parameters
    ----------
    offsets, other : (n, 3) of a FAP and of its mirror FAP (for a middle FAP the same motion twice).
    mirror : see `mirror_map`.
    """
    return truth_error(other[mirror] * [-1.0, 1.0, 1.0], offsets)


def edge_stretch(vertices: Floats, edges: Ints, offsets: Floats) -> float:
    """99th percentile of |log(length after / length before)| over the edges (e, 2) with a moving end."""
    used = edges[_moving(offsets)[edges].any(axis=1)]
    moved = vertices + offsets
    before = np.linalg.norm(vertices[used[:, 0]] - vertices[used[:, 1]], axis=1)
    after = np.linalg.norm(moved[used[:, 0]] - moved[used[:, 1]], axis=1)
    long = before > 0.0
    if not long.any():
        return 0.0
    ratio = np.maximum(after[long], 1e-12 * before[long]) / before[long]
    return float(np.percentile(np.abs(np.log(ratio)), 99))


def roughness(edges: Ints, offsets: Floats, where: Bools | None = None) -> float:
    """``||D - mean of D over the neighbours|| / ||D||``: high for noise, low for a smooth motion.

    Parameters
    ----------
    where : (n,) the vertices that are read; None: all.
    """
    count = len(offsets)
    ring = np.zeros_like(offsets)
    degree = np.bincount(edges.ravel(), minlength=count)
    for a, b in ((0, 1), (1, 0)):
        for axis in range(3):
            ring[:, axis] += np.bincount(edges[:, a], offsets[edges[:, b], axis], count)
    lone = degree == 0
    ring[~lone] /= degree[~lone, None]
    ring[lone] = offsets[lone]
    used = slice(None) if where is None else where
    norm = float(np.linalg.norm(offsets[used]))
    return float(np.linalg.norm(offsets[used] - ring[used])) / norm if norm else 0.0


__all__ = [
    "FapConformance",
    "FapError",
    "asymmetry",
    "conformance",
    "cross_talk",
    "edge_stretch",
    "fap_error",
    "fap_values",
    "feature_point_motion",
    "flips",
    "largest_motion",
    "lid_gap",
    "lip_gap_change",
    "mirror_map",
    "opening_change",
    "roughness",
    "truth_error",
    "turned_over",
]
