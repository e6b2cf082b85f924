"""Turn a scene into the inside axes (+X the subject's left, +Y up, +Z gaze), found from its feature points.

The turn is a signed permutation of the axes: it is exact, and `Frame` gives it back exactly. A head that is
tilted within its file stays tilted; a finding says by how much.

Left and right, up and front each follow from the points alone. When they form a left-handed system, either
the file is left-handed or the points of the two sides are exchanged: the polygons' winding tells which. A
mirrored file whose polygons were left as they were has its normals pointing inwards; a good file with
exchanged points has them pointing outwards.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import permutations, product

import numpy as np

from fba.arrays import Floats
from fba.errors import LandmarkError
from fba.feature_points import FeaturePoint, FeaturePoints
from fba.findings import Finding
from fba.landmark_checks import check_points, pairs
from fba.mesh import PolyMesh
from fba.scene import FaceScene, Frame, Node, Shape

_PITCH = np.radians(7.0)
"""The line from the eye corners to the mouth corners leans forward by this much on an upright head: 4.0 degrees
on the MakeHuman base head, 10.6 on the ICT FaceKit head."""

_TILT_LIMIT = 10.0
_PITCH_LIMIT = 15.0
"""Degrees of tilt that are worth a warning; nodding is known only to about 5 degrees, see `_PITCH`."""

_FRONT = ("9.3", "9.12", "9.15", "8.1", "8.2", "2.2")
_BACK = ("10.1", "10.2", "10.3", "10.4", "10.5", "10.6", "10.7", "10.8", "10.9", "10.10", "2.13", "2.14", "7.1", "11.6")
_FACING_FRONT = (
    "9.3", "9.12", "2.10", "2.11", "2.12", "11.1", "11.2", "11.3",
    "4.1", "4.2", "4.3", "4.4", "4.5", "4.6", "5.1", "5.2", "5.3", "5.4",
)  # fmt: skip
"""Points where the skin looks forward on every face."""

_SURE = 0.1
"""Mean cosine above which normals tell outside from inside."""


def orient(scene: FaceScene, points: FeaturePoints) -> tuple[FaceScene, FeaturePoints, list[Finding]]:
    """Turn a scene and its feature points into the inside axes, polygons wound to the outside.

    Parameters
    ----------
    scene, points : as read; already turned ones come back as they are.

    Returns
    -------
    scene, points : the turned ones; ``scene.frame`` remembers the turn.
    findings : what was found out, in plain words.

    Raises
    ------
    LandmarkError
        If the points do not tell the axes, or contradict each other or the mesh.
    """
    at = points.positions(scene)
    left, up, front = _directions(at)
    outward = _outward(scene, points, at, up, front)
    if float(np.linalg.det([left, up, front])) < 0.0 and outward >= 0:
        raise LandmarkError(
            "left and right are exchanged in the feature points: with left, up and front as they say, the face "
            "would be its own mirror image, but its polygons are wound to the outside. Left means the subject's "
            "left: exchange the points of the two sides (or, for a left-handed file, reverse its polygons)"
        )
    axes, rest = _nearest_axes(np.array([left, up, front]))
    mirrored = float(np.linalg.det(axes)) < 0.0
    reverse = outward < 0 and not mirrored
    findings = _describe(axes, mirrored, reverse, rest)
    turned = turn_scene(scene, axes, reverse)
    moved = _turn_points(points, axes)
    findings += check_points(turned, moved)
    return turned, moved, findings


def to_file_order(scene: FaceScene, world: Floats) -> Floats:
    """Turn (N, 3) world coordinates in inside axes to the file's own axes; exact."""
    return scene.frame.to_file(world)


def _directions(at: Mapping[str, Floats]) -> tuple[Floats, Floats, Floats]:
    """Unit vectors to the subject's left, up and front, in the coordinates of the points."""
    across = [at[a] - at[b] for a, b in pairs(at)]
    eyes = _centre(at, ("3.7", "3.12", "3.8", "3.11"), ("3.5", "3.6"), ("3.1", "3.2", "3.3", "3.4"))
    mouth = _centre(at, ("8.3", "8.4"), ("2.4", "2.5"), ("8.1", "8.2"), ("2.2", "2.3"))
    if not across or eyes is None or mouth is None:
        raise LandmarkError(
            "the head's axes need feature points of both eyes and of the mouth: give at least "
            "3.5, 3.6 (pupils) or 3.7, 3.8, 3.11, 3.12 (eye corners) and 8.3, 8.4 (lip corners)"
        )
    vectors = np.array(across)
    # The direction that most pair vectors share, whatever their signs; then the side that most of them say.
    left = np.linalg.svd(vectors, full_matrices=False)[2][0]
    votes = np.sign(vectors @ left)
    if votes.sum() < 0 or (votes.sum() == 0 and (vectors @ left).sum() < 0):
        left = -left
    upward = eyes - mouth
    upward = upward - (upward @ left) * left
    height = float(np.linalg.norm(upward))
    if not height > 1e-6 * float(np.abs(vectors).max()) or not np.abs(vectors).max() > 0.0:
        raise LandmarkError("the feature points of the eyes and of the mouth lie on one line across the face")
    upward /= height
    front = np.cross(left, upward)
    ahead = [float((at[i] - eyes) @ front) for i in _FRONT if i in at]
    behind = [float((at[i] - eyes) @ front) for i in _BACK if i in at]
    evidence = sum(ahead) - sum(behind)
    if not abs(evidence) > 0.05 * height:
        raise LandmarkError(
            "the feature points do not tell front from back: give 9.3 (tip of the nose) or points on the ears"
        )
    front = front if evidence > 0 else -front
    up = np.cos(_PITCH) * upward + np.sin(_PITCH) * front
    return left, up, np.cos(_PITCH) * front - np.sin(_PITCH) * upward


def _centre(at: Mapping[str, Floats], *choices: tuple[str, ...]) -> Floats | None:
    for ids in choices:
        if all(i in at for i in ids):
            centre: Floats = np.mean([at[i] for i in ids], axis=0)
            return centre
    return None


def _outward(scene: FaceScene, points: FeaturePoints, at: Mapping[str, Floats], up: Floats, front: Floats) -> int:
    """+1 if the polygons' normals point out of the head, -1 if they point into it, 0 if that cannot be told."""
    wanted = {**dict.fromkeys(_FACING_FRONT, front), "11.4": up, "11.6": -front}
    normals: dict[str, Floats] = {}
    cosines = []
    for key, point in points.items():
        if key not in wanted or point.shape is None:
            continue
        if point.shape not in normals:
            mesh = scene.shape(point.shape).mesh
            normals[point.shape] = mesh.vertex_normals(scene.world_vertices(point.shape))
        cosines.append(float(np.asarray(point.weights) @ normals[point.shape][list(point.vertices)] @ wanted[key]))
    if len(cosines) >= 3 and abs(np.mean(cosines)) > _SURE:
        return int(np.sign(np.mean(cosines)))
    return _radial(scene, points)


def _radial(scene: FaceScene, points: FeaturePoints) -> int:
    """The same from the shape with most points: do its triangles look away from its middle?"""
    named = [p.shape for p in points.values() if p.shape is not None]
    if not named:
        return 0
    name = max(named, key=named.count)
    corners = scene.world_vertices(name)[scene.shape(name).mesh.triangles]
    if len(corners) == 0:
        return 0
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    centers = corners.mean(axis=1)
    size = np.linalg.norm(area, axis=1)
    away = centers - (size @ centers) / max(float(size.sum()), np.finfo(float).tiny)
    outward = np.einsum("ij,ij->i", area, away)
    whole = float((size * np.linalg.norm(away, axis=1)).sum())
    mean = float(outward.sum()) / whole if whole > 0 else 0.0
    return int(np.sign(mean)) if abs(mean) > _SURE else 0


def _nearest_axes(directions: Floats) -> tuple[Floats, Floats]:
    """The signed permutation of the same handedness nearest to three directions (rows), and the rest rotation."""
    handedness = np.sign(np.linalg.det(directions))
    best: tuple[float, Floats] | None = None
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            axes = np.zeros((3, 3))
            axes[np.arange(3), order] = signs
            score = float((axes * directions).sum())
            if np.linalg.det(axes) * handedness > 0.0 and (best is None or score > best[0]):
                best = (score, axes)
    assert best is not None
    return best[1], directions @ best[1].T


def _describe(axes: Floats, mirrored: bool, reverse: bool, rest: Floats) -> list[Finding]:
    findings = []
    if not np.array_equal(axes, np.eye(3)):
        names = ["+X", "-X", "+Y", "-Y", "+Z", "-Z"]
        left, up, front = (names[2 * int(np.argmax(np.abs(r))) + int(r.sum() < 0)] for r in axes)
        findings.append(
            Finding(
                "info",
                "axes",
                f"the file's axes are turned while working: the subject's left is {left}, up is {up}, the gaze is "
                f"{front} in the file; outputs keep the file's axes",
            )
        )
    if mirrored:
        findings.append(
            Finding(
                "warning",
                "left-handed",
                "the file is read as left-handed (a mirror image), as its feature points and its winding say; if the "
                "face is not mirrored, left and right are exchanged in the points and the polygons are inside out",
            )
        )
    if reverse:
        findings.append(
            Finding(
                "info",
                "inside-out",
                "the polygons are wound inside out; they are reversed while working and given back in outputs",
            )
        )
    left, up, front = rest
    angles = {
        "roll": (np.degrees(np.arctan2(left[1], left[0])), _TILT_LIMIT),
        "yaw": (np.degrees(np.arctan2(-left[2], left[0])), _TILT_LIMIT),
        "pitch": (np.degrees(np.arctan2(front[1], front[2])), _PITCH_LIMIT),
    }
    large = [f"{name} {angle:+.0f} degrees" for name, (angle, limit) in angles.items() if abs(angle) > limit]
    if large:
        findings.append(
            Finding(
                "warning",
                "tilted",
                f"the head is tilted against the axes of its file ({', '.join(large)}); the tilt stays, and motions "
                "follow the axes: turn the head upright in its modelling program for best results",
            )
        )
    return findings


def turn_scene(scene: FaceScene, axes: Floats, reverse: bool = False) -> FaceScene:
    """Turn all transforms and meshes of a scene; the frame takes note.

    Parameters
    ----------
    axes : (3, 3) signed permutation; new coordinates = axes @ old ones. A mirror keeps the polygons' order.
    reverse : wind every polygon the other way round.
    """
    if np.array_equal(axes, np.eye(3)) and not reverse:
        return scene
    turn = Frame(axes)
    spin = float(np.linalg.det(axes)) > 0.0
    frame = Frame(axes @ scene.frame.axes, scene.frame.reversed_winding != reverse)
    return replace(scene, roots=tuple(_turn_node(n, turn, spin, reverse) for n in scene.roots), frame=frame)


def _turn_node(node: Node, turn: Frame, spin: bool, reverse: bool) -> Node:
    if isinstance(node, Shape):
        return replace(node, mesh=_turn_mesh(node.mesh, turn, reverse))
    return replace(
        node,
        children=tuple(_turn_node(c, turn, spin, reverse) for c in node.children),
        translation=_vector(node.translation, turn),
        rotation=_rotation(node.rotation, turn, spin),
        scale=_scale(node.scale, turn),
        scale_orientation=_rotation(node.scale_orientation, turn, spin),
        center=_vector(node.center, turn),
    )


def _turn_mesh(mesh: PolyMesh, turn: Frame, reverse: bool) -> PolyMesh:
    if not turn.identity:
        normals = None if mesh.normals is None else turn.from_file(mesh.normals)
        mesh = replace(mesh, vertices=turn.from_file(mesh.vertices), normals=normals)
    return mesh.reversed() if reverse else mesh


def _vector(values: tuple[float, float, float], turn: Frame) -> tuple[float, float, float]:
    x, y, z = turn.from_file(np.asarray(values, dtype=np.float64)).tolist()
    return (x, y, z)


def _scale(values: tuple[float, float, float], turn: Frame) -> tuple[float, float, float]:
    x, y, z = (values[int(k)] for k in np.argmax(np.abs(turn.axes), axis=1))
    return (x, y, z)


def _rotation(values: tuple[float, float, float, float], turn: Frame, spin: bool) -> tuple[float, float, float, float]:
    """Turn axis and angle; an axis is a pseudo-vector, so a mirror turns the other way round about it."""
    x, y, z = _vector(values[:3], turn)
    return (x, y, z, values[3]) if spin else (-x, -y, -z, values[3])


def _turn_points(points: FeaturePoints, axes: Floats) -> FeaturePoints:
    turn = Frame(axes)

    def moved(point: FeaturePoint) -> FeaturePoint:
        return point if point.point is None else replace(point, point=_vector(point.point, turn))

    return FeaturePoints({key: moved(point) for key, point in points.items()})
