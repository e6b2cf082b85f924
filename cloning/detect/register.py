"""Bring a target onto the source's face by its shape alone: iterated closest points, similarity and stretch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cloning.detect.samples import Samples
from cloning.detect.search import DEEPEST, WINDOW, Pose
from fba.arrays import Bools, Floats
from fba.scene import rotation_matrix

FACING = 0.5
"""Cosine that two partners' normals must have: 60 degrees, as Xiang et al. ask."""

KEPT = 0.85
"""Part of the pairs that counts in each step, nearest first: hair, ears, open mouths and glasses fall into the rest."""

REACH = (0.5, 0.08)
"""Pairs farther apart than this do not count, first and last step, in eye separations."""

FEWEST = 30
"""A registration needs this many pairs."""

MOST_TURN = 0.2
"""Radians that one step turns at most."""

MOST_STRETCH = (0.7, 1.5)
"""Faces of other proportions than this are not stretched farther."""


SPACING = 0.05
"""Distance along the surface to the next sample that costs nothing, in eye separations."""

AGREES = 0.1
"""A surface this far off agrees by 1/e, in eye separations: about what two people's faces differ by."""

AGREES_NOT = 0.7
"""A surface farther off than this agrees by less than 1e-21: as good as none."""

STRETCH = 0.02
"""How strongly a face keeps its proportions while it is stretched, against all pairs together."""


def register(face: Samples, target: Samples, pose: Pose, steps: int, upright: bool = False) -> Pose:
    """Refine a pose; its new score is the mean agreement of the source's face with the target.

    Parameters
    ----------
    face : points of the source's face, in its space.
    target : points of the target as in the file, wound to the outside.
    upright : keep the plane x = 0 where it is: only nod, size, height and depth are sought.
    """
    free = _UPRIGHT if upright else _SIMILARITY
    for step in range(steps):
        places, good = _pairs(face, target, pose, step / max(steps - 1, 1))
        if good.sum() < FEWEST:
            break
        pose = _step(face.points[good], face.normals[good], places[good], pose, free)
    return replace(pose, score=float(agreement(face, target, pose).mean()))


def agreement(face: Samples, target: Samples, pose: Pose) -> Floats:
    """(k,) how well the target lies at each point of the source's face, 0..1: near, and facing the same way."""
    _, facing, gap = _partners(face, target, pose, AGREES_NOT)
    agrees: Floats = np.exp(-((gap / AGREES) ** 2)) * np.clip(facing, 0.0, 1.0)
    return agrees


def stretch(face: Samples, target: Samples, pose: Pose, steps: int) -> tuple[Floats, Floats]:
    """Proportions of the target's face: (3,) factors and (3,) shift that take the source's face onto it."""
    factors, shift = np.ones(3), np.zeros(3)
    for step in range(steps):
        stretched = Samples(factors * face.points + shift, face.normals, face.triangles)
        places, good = _pairs(stretched, target, pose, step / max(steps - 1, 1))
        if good.sum() < FEWEST:
            break
        points, normals = face.points[good], face.normals[good]
        # Left and right stay where the plane of symmetry has put them.
        matrix = np.concatenate([points * normals, normals[:, 1:]], axis=1)
        rest = np.einsum("ij,ij->i", places[good], normals)
        keep = STRETCH * len(points) * np.array([1.0, 1.0, 1.0, 0.0, 0.0])
        found = np.linalg.solve(
            matrix.T @ matrix + np.diag(keep + 1e-9), matrix.T @ rest + keep * (1.0, 1.0, 1.0, 0, 0)
        )
        factors, shift = np.clip(found[:3], *MOST_STRETCH), np.array([0.0, *found[3:]])
    return factors, shift


def symmetric(target: Samples, pose: Pose, steps: int) -> Pose:
    """Turn and shift a pose so that the target's own plane of symmetry is x = 0.

    The face is laid on its mirror image; the plane is half way between each point and the image's.
    """
    mirror = np.array([-1.0, 1.0, 1.0])
    here = target.subset(front(pose.apply(target.points)))
    local = pose.apply(here.points)
    normals = here.normals @ pose.turn.T
    mirrored = Samples(local * mirror, normals * mirror, here.triangles)
    whole = Samples(local, normals, here.triangles)
    # The registration moves the whole face onto points of its mirror image.
    some = mirrored.subset(slice(0, 2000))
    moving = Pose(np.eye(3), 1.0, np.zeros(3), 0.0)
    for step in range(steps):
        places, good = _pairs(some, whole, moving, step / max(steps - 1, 1))
        if good.sum() < FEWEST:
            return pose
        moving = _step(some.points[good], some.normals[good], places[good], moving, _RIGID)
    # A point and its partner: p = mirror(moving(q)), which is the reflection in the wanted plane.
    reflection = mirror[:, None] * moving.turn
    normal = np.linalg.eigh(reflection + reflection.T)[1][:, 0]
    normal = normal * np.sign(normal[0])
    offset = float(np.mean(0.5 * (local + mirror * moving.apply(local)) @ normal))
    across = np.cross(normal, [1.0, 0.0, 0.0])
    sine = float(np.linalg.norm(across))
    turn = rotation(across * (np.arcsin(min(sine, 1.0)) / max(sine, 1e-12)))
    return replace(pose, turn=turn @ pose.turn, shift=turn @ pose.shift - np.array([offset, 0.0, 0.0]))


def _pairs(face: Samples, target: Samples, pose: Pose, along: float) -> tuple[Floats, Bools]:
    """Partners of the face's points and which of them count; `along` goes from 0 to 1 over the steps."""
    reach = REACH[0] * (REACH[1] / REACH[0]) ** along
    places, facing, gap = _partners(face, target, pose, reach)
    good = (facing > FACING) & (gap < reach)
    if good.any():
        good &= gap <= np.quantile(gap[good], KEPT)
    return places, good


def _partners(face: Samples, target: Samples, pose: Pose, reach: float) -> tuple[Floats, Floats, Floats]:
    """Nearest target point of each face point, in the source's space: place, cosine of normals, distance.

    Where there is none nearer than `reach` the distance is infinite.
    """
    back = (face.points - pose.shift) @ pose.turn / pose.scale
    distance, nearest = target.tree.query(back, distance_upper_bound=(reach + SPACING) / pose.scale)
    nearest = np.where(np.isfinite(distance), nearest, 0)
    places = pose.apply(target.points[nearest])
    facing = np.einsum("ij,ij->i", face.normals, target.normals[nearest] @ pose.turn.T)
    # Across the surface: the spacing of the samples does not count.
    gap = np.abs(np.einsum("ij,ij->i", places - face.points, face.normals))
    gap = np.maximum(gap, pose.scale * distance - SPACING)
    return places, facing, gap


def _step(goals: Floats, normals: Floats, places: Floats, pose: Pose, free: Floats) -> Pose:
    """One point-to-plane step: small turn, scale and shift of the target's points, those that are free."""
    middle = places.mean(axis=0)
    local = places - middle
    scaling = np.einsum("ij,ij->i", local, normals)
    matrix = free * np.concatenate([np.cross(local, normals), scaling[:, None], normals], axis=1)
    rest = np.einsum("ij,ij->i", goals - places, normals)
    # A little damping: a round forehead alone does not tell turn from shift.
    system = matrix.T @ matrix + 1e-3 * len(matrix) * np.diag([1.0, 1.0, 1.0, 1.0, 0.1, 0.1, 0.1])
    found = np.linalg.solve(system, matrix.T @ rest)
    angle = float(np.linalg.norm(found[:3]))
    turn = rotation(found[:3] * min(1.0, MOST_TURN / max(angle, 1e-12)))
    scale = float(np.exp(np.clip(found[3], -0.1, 0.1)))
    shift = scale * turn @ (pose.shift - middle) + middle + found[4:]
    return Pose(turn @ pose.turn, scale * pose.scale, shift, pose.score)


_SIMILARITY = np.ones(7)
_RIGID = np.array([1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0])
_UPRIGHT = np.array([1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0])
"""Which of turn (x, y, z), scale and shift (x, y, z) a registration may change."""


def rotation(vector: Floats) -> Floats:
    """Rotation matrix (3, 3) of a rotation vector."""
    x, y, z = vector
    return rotation_matrix((float(x), float(y), float(z), float(np.linalg.norm(vector))))[:3, :3]


def front(local: Floats) -> Bools:
    """Points of the face in the source's space: cheeks, nose, brows, chin, without ears and hair."""
    left, right, bottom, top = WINDOW
    x, y, z = local.T
    inside: Bools = (x > left) & (x < right) & (y > bottom) & (y < top) & (z > -DEEPEST)
    return inside
