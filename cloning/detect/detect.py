"""Find a face's feature points from its shape alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from cloning.detect.confidence import confidences, describe
from cloning.detect.head import FACE_SCORE, SAMPLES, Head, facing, find_pose, isolate, settle
from cloning.detect.inside import inner_points
from cloning.detect.lips import on_own_lip
from cloning.detect.model import FaceTemplate, Source, ready
from cloning.detect.neighbours import by_neighbours
from cloning.detect.patches import by_patches
from cloning.detect.register import agreement
from cloning.detect.rules import OPEN, by_rule
from cloning.detect.samples import sample
from cloning.detect.search import Pose
from cloning.detect.xiang import detect_landmarks
from cloning.parts import PUPILS
from cloning.prepare import PreparedFace
from cloning.similarity import fit_similarity
from cloning.surface import Surface, build_surface
from cloning.template.closest import TriangleSearch
from cloning.template.fitting import BENDING, Schedule, fit_template
from fba.arrays import Floats, Ints
from fba.errors import LandmarkError
from fba.feature_points import FeaturePoint, FeaturePoints, feature_point_definitions
from fba.findings import Finding
from fba.landmark_checks import contradictions, pairs
from fba.scene import FaceScene

DETECTORS = ("auto", "xiang", "xiang-once")

ENOUGH = 4
"""With so many given points the head's place is taken from them."""

FIT = replace(BENDING, k_b=(1e-2, 1e-4), k_c=(3.0, 30.0), steps=6)
FIRST = replace(FIT, steps=5)
"""Stiffer than the fit that carries motion: nobody has confirmed a point yet, and on coarse masks a soft template
runs into folds (points up to 1.3 eye separations off on a mask of 468 vertices, 0.6 with this). On dense heads both
place points equally well. The first fit is only a guess."""

UNEVEN = 0.1
"""Points of the two sides that differ by more than this after mirroring, in eye separations, do not both lie right:
uneven smiles stay below."""

LIDS = (("3.1", "3.3"), ("3.2", "3.4"))

MIRROR = np.array([-1.0, 1.0, 1.0])

LIMITS = 0.3
"""Farthest that the fitted template may be from the skin at a feature point, in eye separations."""

EYEBALL, INSIDE_TRUST = 0.9, 0.6
"""Confidence in the pupil of an eyeball, and in points on teeth and tongue."""

Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class Detection:
    """Feature points that were found.

    Attributes
    ----------
    points : on the scene's own shapes; given ones as they were given.
    score : how much of a face is there, 0..1.
    findings : what is uncertain, in plain words.
    """

    points: FeaturePoints
    score: float
    findings: tuple[Finding, ...]


def detect_points(
    scene: FaceScene,
    source: PreparedFace,
    given: FeaturePoints | None = None,
    *,
    detector: str = "auto",
    progress: Progress | None = None,
) -> Detection:
    """Detect the feature points of a face.

    Parameters
    ----------
    scene : any file with a head in it: any axes, unit and place.
    source : a face whose feature points are known.
    given : points that are right already; they are kept, and the others are fitted to them.
    detector : "auto"; or "xiang" for the 20 landmarks of Xiang et al. (2008) as published; "xiang-once" leaves out
        their second detection on the deformed source.

    Raises
    ------
    LandmarkError
        If there is no face, or the detector is not known.
    """
    if detector not in DETECTORS:
        raise LandmarkError(f"there is no detector '{detector}'; choose one of {', '.join(DETECTORS)}")
    tell = progress or (lambda stage, share: None)
    tell("searching the face", 0.0)
    model = ready(source)
    skin = model.skin
    surface, unit = _whole(scene)
    clicked = {} if given is None else {key: p / unit for key, p in given.positions(scene).items()}
    head = _head(surface, model, clicked, scene.name)
    known = {key: head.pose.apply(p[None])[0] for key, p in clicked.items() if key in skin.points}
    tell("fitting the face", 0.4)
    places, ruled, residual = _DETECT[detector](head, model, known)
    tell("placing the points", 0.9)
    trust = confidences(head.pose.score, places, ruled, residual)
    points = _placed(head, surface, skin, places, trust)
    found = FeaturePoints({**points, **({} if given is None else given)})
    tell("placing the points", 1.0)
    return Detection(found, head.pose.score, describe(found, head.pose.score, scene.name))


def _head(surface: Surface, source: Source, clicked: Mapping[str, Floats], name: str) -> Head:
    """Find the head, from the given points where there are enough."""
    model, skin = source.model, source.skin
    shared = [key for key in clicked if key in skin.positions]
    if len(shared) >= ENOUGH:
        way = fit_similarity(np.array([clicked[i] for i in shared]), np.array([skin.positions[i] for i in shared]))
        start = Pose(way.rotation, way.scale, way.shift, 0.0)
        points = sample(surface, SAMPLES)
        view, inside_out = facing(points, start)
        if len(view.points) < 100:
            raise LandmarkError(f"'{name}': there is no surface where the given points say that the face is")
        pose = settle(points, model, start)
        if pose.score < FACE_SCORE:
            # The shape is no human face's, so it must not overrule the points.
            pose = replace(start, score=float(agreement(model.face, view, start).mean()))
    else:
        pose, inside_out = find_pose(surface, model)
        if pose.score < FACE_SCORE:
            raise LandmarkError(
                f"'{name}': no face was found in it: the place most like one agrees with the source's face by "
                f"{pose.score:.2f}, at least {FACE_SCORE:g} are needed. Give the feature points, or a few to start "
                "from (both pupils, nose tip, chin, lip corners)"
            )
    return isolate(surface, pose, inside_out, model)


_Found = tuple[dict[str, Floats], dict[str, float], dict[str, float]]
"""Places; how far rule and guess differ where there is a rule; how far the fitted source is from the skin."""


def _auto(head: Head, source: Source, known: Mapping[str, Floats]) -> _Found:
    """Fit the face without landmarks, then rules, then fit the head to what the rules have found."""
    skin = source.skin
    guess, _ = _fitted(head, source.face, known, known, FIRST)
    guess = _evened({**guess, **known}, known, _start(head, skin, known))
    ruled = {k: p + source.offsets[k] for k, p in by_rule(head.skin, guess).items() if k in source.offsets}
    ruled = {k: p for k, p in ruled.items() if _both_sides(k, ruled) and k not in known}
    places, residual = _fitted(head, source.head, {**ruled, **known}, known, FIT)
    differ = {key: float(np.linalg.norm(place - guess[key])) for key, place in ruled.items()}
    places = _evened({**places, **ruled, **known}, known, guess)
    places |= {k: p for k, p in by_neighbours(head.skin, skin, places).items() if k not in known}
    laid = {k: p for k, p in by_patches(head.skin, head.search, skin, places).items() if k not in known}
    places = _evened({**places, **laid}, known, places)
    parted = _parted(places, known, _start(head, skin, known))
    return {**places, **parted}, differ, {**residual, **dict.fromkeys(parted, LIMITS)}


def _parted(
    places: Mapping[str, Floats], known: Mapping[str, Floats], start: Mapping[str, Floats]
) -> dict[str, Floats]:
    """Points that cannot be right, where the source's proportions have them: lids that were found closed or the wrong
    way round, points above those that belong above them."""
    found = {}
    wrong = [pair for pair in LIDS if float(places[pair[0]][1] - places[pair[1]][1]) < OPEN]
    for pair in (*wrong, *contradictions(places, 0), *contradictions(places, 1)):
        found.update({key: start[key] for key in pair if key not in known})
    return found


def _start(head: Head, skin: Surface, known: Mapping[str, Floats]) -> dict[str, Floats]:
    """The source's feature points in the head's proportions."""
    places = _brought(head, skin, np.array(list(skin.positions.values())), known)
    return dict(zip(skin.positions, places, strict=True))


def _brought(head: Head, source: Surface, places: Floats, known: Mapping[str, Floats]) -> Floats:
    """Places of the source's in the head's proportions, and to where the known points say.

    Parameters
    ----------
    source : the source's skin, or a part of it.
    places : (n, 3).
    """
    factors, shift = head.proportions
    ids = [key for key in known if key in source.positions]
    moved: Floats = places * factors + shift
    if len(ids) < ENOUGH:
        return moved
    from scipy.interpolate import RBFInterpolator

    anchors = np.array([source.positions[key] for key in ids])
    missing = np.array([known[key] for key in ids]) - (anchors * factors + shift)
    # No more than each point's own way is known: far from all of them it is the mean that counts.
    more: Floats = RBFInterpolator(anchors, missing, kernel="linear", degree=0)(places)
    return moved + more


def _both_sides(key: str, ruled: Mapping[str, Floats]) -> bool:
    """A rule that finds one side only, or places that do not mirror each other, has found something else."""
    other = feature_point_definitions()[key].counterpart
    if other is None:
        return True
    return other in ruled and float(np.linalg.norm(ruled[key] - MIRROR * ruled[other])) < UNEVEN


def _evened(places: Mapping[str, Floats], known: Mapping[str, Floats], near: Mapping[str, Floats]) -> dict[str, Floats]:
    """Where the two sides disagree, the one farther from where it should be follows the other.

    Parameters
    ----------
    known : points that are right as they are.
    near : where each point should be about.
    """
    found = dict(places)
    for left, right in pairs(places):
        if float(np.linalg.norm(places[left] - MIRROR * places[right])) < UNEVEN or left not in near:
            continue
        wrong, right_one = sorted(
            (left, right), key=lambda k: (k in known, -float(np.linalg.norm(places[k] - near[k])))
        )
        if wrong not in known:
            found[wrong] = MIRROR * places[right_one]
    definitions = feature_point_definitions()
    for key, place in places.items():
        if definitions[key].counterpart is None and key not in known and abs(float(place[0])) > UNEVEN:
            found[key] = place * np.array([0.0, 1.0, 1.0])
    return found


def _xiang(head: Head, source: Source, known: Mapping[str, Floats], again: bool = True) -> _Found:
    """The published landmarks, the elastic fit to them, and both once more."""
    surface = source.head.surface
    marks = detect_landmarks(surface, _brought(head, surface, surface.vertices, known), head.skin)
    if again:
        deformed = _deformed(head, source.head, {**marks, **known}, known, FIT)
        marks = detect_landmarks(surface, deformed, head.skin)
    places, residual = _fitted(head, source.head, {**marks, **known}, known, FIT)
    return {**places, **marks, **known}, {}, residual


_DETECT: Mapping[str, Callable[[Head, Source, Mapping[str, Floats]], _Found]] = {
    "auto": _auto,
    "xiang": _xiang,
    "xiang-once": partial(_xiang, again=False),
}


def _whole(scene: FaceScene) -> tuple[Surface, float]:
    """All shapes as one surface of size 10, and the unit that this takes."""
    names = [s.name for s in scene.shapes if s.mesh.face_count]
    if not names:
        raise LandmarkError(f"'{scene.name}' has no polygons, so there is no face in it")
    used = np.concatenate([scene.world_vertices(n)[scene.shape(n).mesh.used_vertices] for n in names])
    unit = 0.1 * float(np.ptp(used, axis=0).max())
    if not unit > 0.0:
        raise LandmarkError(f"'{scene.name}' has no size, so there is no face in it")
    return build_surface(scene, FeaturePoints({}), names, unit), unit


def _deformed(
    head: Head,
    template: FaceTemplate,
    marks: Mapping[str, Floats],
    known: Mapping[str, Floats],
    schedule: Schedule,
) -> Floats:
    """The template's vertices on the head."""
    surface = template.surface
    target = replace(head.skin, positions=dict(marks))
    ids = [key for key in marks if key in surface.points]
    start = _brought(head, surface, surface.vertices, known)
    k_c = schedule.k_c[0] / template.share, schedule.k_c[1] / template.share
    rules = replace(schedule, k_c=k_c)
    return fit_template(surface, target, ids, schedule=rules, visible=template.pulled, start=start).vertices


def _fitted(
    head: Head,
    template: FaceTemplate,
    marks: Mapping[str, Floats],
    known: Mapping[str, Floats],
    schedule: Schedule,
) -> tuple[dict[str, Floats], dict[str, float]]:
    """Every feature point through the fitted template, and how far from the skin the template was there."""
    vertices = _deformed(head, template, marks, known, schedule)
    surface = template.surface
    ids = list(surface.points)
    rows = surface.point_matrix(ids)
    places, normals = rows @ vertices, rows @ surface.normals_of(vertices)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    found = head.search.closest(places, normals, None, 0.3, LIMITS)
    # Where the target has nothing (the lower jaw of a mask) the source's proportions are the best guess.
    on = np.where(
        (found.triangles >= 0)[:, None],
        head.search.positions(found),
        _brought(head, surface, rows @ surface.vertices, known),
    )
    return dict(zip(ids, on, strict=True)), dict(zip(ids, np.minimum(found.distances, LIMITS).tolist(), strict=True))


def _placed(
    head: Head, surface: Surface, skin: Surface, places: Mapping[str, Floats], trust: Mapping[str, float]
) -> dict[str, FeaturePoint]:
    """Points on the scene's own shapes: skin, eyeballs, teeth and tongue."""
    near = head.search.closest(np.array(list(places.values())))
    on = {key: (head.vertices[head.skin.triangles[near.triangles[k]]], near.weights[k]) for k, key in enumerate(places)}
    on |= {
        key: (head.vertices[corners], weights)
        for key, (corners, weights) in on_own_lip(head.skin, head.search, places).items()
    }
    trust = {**trust, **dict.fromkeys(PUPILS, EYEBALL)}
    on |= _pupils(head)
    inside = inner_points(head, skin, places)
    on |= inside
    return {
        key: _point(surface, vertices, weights, trust.get(key, INSIDE_TRUST)) for key, (vertices, weights) in on.items()
    }


def _pupils(head: Head) -> dict[str, tuple[Ints, Floats]]:
    """The place straight before the centre of each eyeball."""
    found = {}
    for key, ball in zip(PUPILS, head.eyeballs, strict=True):
        if ball is None:
            continue
        own = np.isin(head.whole.triangles[:, 0], ball.vertices)
        search = TriangleSearch(head.whole.vertices, head.whole.triangles[own])
        near = search.closest((ball.center + np.array([0.0, 0.0, 1.1 * ball.radius]))[None])
        found[key] = (search.triangles[near.triangles[0]], near.weights[0])
    return found


def _point(surface: Surface, vertices: Ints, weights: Floats, confidence: float) -> FeaturePoint:
    """A point on the shape that its vertices belong to."""
    shape = int(np.searchsorted(surface.starts, vertices[0], side="right")) - 1
    local = vertices - surface.starts[shape]
    return FeaturePoint(
        surface.shapes[shape],
        tuple(local.tolist()),
        tuple((weights / weights.sum()).tolist()),
        source="detected",
        confidence=confidence,
    )
