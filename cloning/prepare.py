"""Make a face ready for cloning: axes, parts, feature points, FAPUs, skin and labels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cloning.kinds import NO_PARTS, Parts, tell_parts
from cloning.labels import Labels, label
from cloning.parts import INSIDE, split_parts
from cloning.surface import Surface, build_surface
from fba.arrays import Floats
from fba.errors import LandmarkError, MeshError
from fba.fapu import FAPU_POINTS, Fapu
from fba.feature_points import FeaturePoint, FeaturePoints, feature_point_definitions
from fba.findings import Finding
from fba.orientation import orient
from fba.scene import FaceScene, Role

NECESSARY = (*FAPU_POINTS, "9.3", "2.1", "2.3", "2.4", "2.5", "3.7", "3.8", "3.11", "3.12")
"""Without these no face can be cloned: the FAPUs, and the outline of mouth and eyes."""

DERIVED = ("3.5", "3.6", "7.1", "7.2")
"""These are worked out from other points where they are missing."""

OPTIONAL = ("7.1", "7.2", "11.4", "11.5", "11.6", "8.9", "8.10", *(f"9.{k}" for k in (4, 5, 6, 7, 12, 13, 14)))
"""Not among the points that Facial Motion Cloning asks for; they refine the alignment where they are given."""

EXCHANGED = 0.8
"""An inner lip point lies on the other lip where that lip's outer point is nearer than this share of its own's."""

FIGURE = 8.0
"""What reaches farther than this below the chin, in eye separations, is more than a bust: half a metre of a man."""


@dataclass(frozen=True, eq=False)
class PreparedFace:
    """One side of a clone.

    Attributes
    ----------
    scene : inside axes, every shape with its role.
    skin : all skin shapes as one surface, in eye separations.
    parts : what every piece is and how it moves.
    """

    scene: FaceScene
    points: FeaturePoints
    fapu: Fapu
    skin: Surface
    labels: Labels
    findings: tuple[Finding, ...]
    parts: Parts = NO_PARTS

    def place(self, key: str) -> Floats:
        """World position of a feature point, mesh units."""
        return self.skin.positions[key] * self.fapu.es0


def prepare(
    scene: FaceScene, points: FeaturePoints, who: str, needed: Sequence[str] = NECESSARY, purpose: str = ""
) -> PreparedFace:
    """Orient, split, measure and label a face.

    Parameters
    ----------
    who : "source" or "target", for messages.
    needed : the feature points that must be given.
    purpose : what they are needed for, for messages; "" = cloning.

    Raises
    ------
    LandmarkError
        If necessary feature points are missing or contradict each other.
    MeshError
        If a vertex is not finite.
    """
    require_finite(scene)
    points, findings = complete_points(scene, points, who, needed, purpose)
    scene, points, turned = orient(scene, points)
    scene, points, missing = split_parts(scene, points)
    positions = points.positions(scene)
    fapu = Fapu.from_feature_points(positions)
    points, derived = _pivots(scene, points, fapu, who)
    shapes = [s.name for s in scene.with_role(Role.SKIN)]
    skin = build_surface(scene, points, shapes, fapu.es0)
    if len([i for i in skin.points if i not in INSIDE]) < len(needed) - len(DERIVED):
        raise LandmarkError(
            f"the {who} '{scene.name}': only {len(skin.points)} feature points lie on the skin; "
            "give them as a face and barycentric coordinates, or as a vertex"
        )
    _check_lips(skin, who)
    labels = label(skin)
    parts = tell_parts(scene, skin, fapu.es0)
    about = [parts.finding(scene.name), *_whole_figure(scene, skin, fapu.es0)] if who == "target" else []
    found = (*findings, *turned, *about, *missing, *derived, *_sealed(labels, scene.name))
    return PreparedFace(scene, points, fapu, skin, labels, found, parts)


def _check_lips(skin: Surface, who: str) -> None:
    """Refuse inner lip points on each other's lip: lips that touch cannot be told by height, but along the skin."""
    if not all(i in skin.points for i in ("2.2", "2.3", "8.1", "8.2")):
        return
    rows = skin.point_matrix(["2.2", "2.3"])
    reach = 2.0 * float(np.linalg.norm(skin.positions["8.1"] - skin.positions["8.2"]))
    away = (rows @ np.minimum(skin.distances(["8.1", "8.2"], reach), reach).T).T
    (upper, wrong_upper), (wrong_lower, lower) = away
    if wrong_upper < EXCHANGED * upper and wrong_lower < EXCHANGED * lower:
        raise LandmarkError(
            f"{who}: feature point 2.2 lies on the lower lip and 2.3 on the upper one (they are nearer along the skin "
            "to 8.2 and to 8.1); exchange them"
        )


def require_finite(scene: FaceScene) -> None:
    """Refuse a scene with vertices that are nowhere.

    Raises
    ------
    MeshError
        If a coordinate is infinite or not a number.
    """
    for shape in scene.shapes:
        wrong = np.flatnonzero(~np.isfinite(shape.mesh.vertices).all(axis=1))
        if len(wrong):
            raise MeshError(
                f"'{scene.name}': {len(wrong)} vertices of '{shape.name}' have no finite coordinates, the first is "
                f"vertex {wrong[0]}; repair the mesh in the program that wrote it"
            )


def complete_points(
    scene: FaceScene, points: FeaturePoints, who: str, needed: Sequence[str] = NECESSARY, purpose: str = ""
) -> tuple[FeaturePoints, list[Finding]]:
    """Add what can be worked out, and say what is missing.

    Raises
    ------
    LandmarkError
        If one of those needed is missing and cannot be derived.
    """
    findings: list[Finding] = []
    added: dict[str, FeaturePoint] = {}
    place = points.positions(scene)
    for pupil, ids in (("3.5", ("3.1", "3.3", "3.7", "3.11")), ("3.6", ("3.2", "3.4", "3.8", "3.12"))):
        if pupil not in points and all(i in points for i in ids):
            middle = np.mean([place[i] for i in ids], axis=0)
            added[pupil] = FeaturePoint.free(middle, source="derived", confidence=0.5)
            findings.append(
                Finding(
                    "warning",
                    "derived-point",
                    f"{who}: {pupil} (pupil) is not given; the middle of the "
                    "eye opening is used, and the FAPUs depend on it",
                    pupil,
                )
            )
    points = points.with_points(added)
    cloning = f"cloning {'onto' if who == 'target' else 'from'} the {who} '{scene.name}'"
    points.require(*needed, purpose=purpose or cloning)
    known = feature_point_definitions()
    wanted = [i for i in known if i not in OPTIONAL and i not in INSIDE and not i.startswith("10.")]
    absent = [i for i in wanted if i not in points]
    if absent:
        findings.append(
            Finding(
                "warning",
                "missing-points",
                f"{who}: feature points {', '.join(absent)} are not given; the faces "
                "are aligned without them, less exactly around there",
                scene.name,
            )
        )
    return points, findings


def _pivots(scene: FaceScene, points: FeaturePoints, fapu: Fapu, who: str) -> tuple[FeaturePoints, list[Finding]]:
    """Derive 7.1 (top of the spine) and 7.2 (base of the neck) where they are missing."""
    place = points.positions(scene)
    added: dict[str, FeaturePoint] = {}
    findings: list[Finding] = []
    if "7.1" not in points:
        if "10.7" in place and "10.8" in place:
            top = 0.5 * (place["10.7"] + place["10.8"])
            how = "midway between the ear lobes' contact points 10.7 and 10.8"
        else:
            eyes = 0.5 * (place["3.5"] + place["3.6"])
            top = eyes + np.array([0.0, -1.0, -1.35]) * fapu.es0
            how = "behind and below the eyes, at the proportions of an average head"
        added["7.1"] = FeaturePoint.free(top, source="derived", confidence=0.5)
        findings.append(Finding("info", "derived-point", f"{who}: 7.1 (head pivot) is not given; placed {how}", "7.1"))
        place["7.1"] = top
    if "7.2" not in points:
        added["7.2"] = FeaturePoint.free(
            place["7.1"] + np.array([0.0, -1.5, -0.2]) * fapu.es0, source="derived", confidence=0.3
        )
    return points.with_points(added), findings


def _whole_figure(scene: FaceScene, skin: Surface, es0: float) -> list[Finding]:
    """Say that there is more than a head."""
    lowest = min(float(scene.world_vertices(s.name)[:, 1].min()) for s in scene.shapes if s.mesh.vertex_count)
    if float(skin.positions["2.1"][1]) - lowest / es0 < FIGURE:
        return []
    text = (
        "the file holds a whole figure: only the face gets motion of its own, and the head's rotations, FAPs 48 to 50, "
        "turn everything; give the head alone where the body has a rig of its own"
    )
    return [Finding("warning", "whole-figure", text, scene.name)]


def _sealed(labels: Labels, where: str) -> list[Finding]:
    sides = {3: "left", 5: "right"}
    found = []
    if 1 in labels.sealed:
        text = (
            "the lips are grown together, so the mouth cannot open: the skin between them stretches smoothly instead; "
            "jaw, lip corners and cheeks move as ever. Cut the mesh along the lip line to let it open"
        )
        found.append(Finding("warning", "sealed-mouth", text, where))
    for eye in labels.sealed:
        if eye in sides:
            text = (
                f"the {sides[eye]} eye is filled with skin: a blink draws the upper lid's line down to the lower one, "
                "and what is between is squeezed; no eyeball turns. Cut an opening and add an eyeball for that"
            )
            found.append(Finding("warning", f"sealed-{sides[eye]}-eye", text, where))
    for eye in labels.closed:
        text = (
            f"the {sides[eye]} eye is closed, where MPEG-4's neutral face has it open: its lids rest in every motion, "
            "brows and cheeks move as ever. Open the eye in the mesh to let it blink"
        )
        found.append(Finding("warning", f"closed-{sides[eye]}-eye", text, where))
    return found
