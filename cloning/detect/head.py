"""The head of a file: found, turned, scaled, and freed of what is not its skin."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cloning.detect.register import agreement, front, register, stretch, symmetric
from cloning.detect.samples import Samples, sample, seen
from cloning.detect.search import Pose, Template, apart, search
from cloning.surface import Surface
from cloning.template.closest import TriangleSearch
from fba.arrays import Bools, Floats, Ints
from fba.sphere import fit_sphere

SAMPLES = 100_000
"""Points on all of a file's surfaces: a hundred on the nose of a whole body."""

FACE_SAMPLES = 40_000
"""Points on a head alone."""

FACE_SCORE = 0.74
"""Agreement with the source's face below which there is no human face; measured: human heads, busts, masks and bodies
0.79 to 0.98; the best places in creatures 0.41 to 0.65, in things that are no faces (a torus, a body without its head,
the back of a head, an egg with a nose, a sphere, boxes like a car or a chair) 0.00 to 0.68."""

CANDIDATES = 16
"""Places that are registered; the right one is among the first six on all faces measured, except those below a body's
clothes."""

QUICK, LONG, LONGEST = 8, 12, 25
"""Steps of the registration: to choose a candidate, to place the chosen one, and to place one that is not clear. More
than `LONG` move no clear face by more than 0.003 eye separations."""

ROOM = (1.8, 2.6, 2.6)
"""Half the size of the box around the middle between the eyes that holds a head, in eye separations."""

GRID = 0.08
"""Cell in which the foremost surface hides others, in eye separations."""

CLEAR = 0.8
"""Agreement after the quick registration above which nothing else is tried; the best place that is no face reaches
0.76 (on a whole body), and most faces 0.82 to 0.98."""

SURE = 0.7
"""Agreement after the quick registration above which no other part of the file is searched; false places reach 0.65."""

ALONE = 5
"""Pieces that are tried as the whole face: hair, glasses or clothes may show more than the skin."""

SHARE = 0.2
"""Otherwise a piece is skin if it shows this share of what the first one shows: faces cut in halves stay whole, brows
and lashes fall out."""

BALL = 0.12
"""Largest error of an eyeball as a sphere, as part of its radius: a cornea stands out by about that."""

SPAN = 1.2
"""Width and height of an eyeball in radii, at least: wet edges of lids lie on a sphere too, but cover little of it."""

BALL_SIZES = (0.08, 0.45)
BALL_SIZE = 0.2
"""Radii of eyeballs in eye separations: 0.2 in people, up to twice that in cartoons."""


@dataclass(frozen=True, eq=False)
class Eyeball:
    """An eyeball: a piece of its own.

    Attributes
    ----------
    center, radius : in the head's space.
    vertices : of the whole surface.
    """

    center: Floats
    radius: float
    vertices: Ints


@dataclass(frozen=True, eq=False)
class Head:
    """A head in the source's space, eye separations of the source.

    Attributes
    ----------
    skin : the skin near the face; no feature points yet.
    vertices : (n,) vertex of the whole surface for each vertex of `skin`.
    whole : all surfaces in the head's space, wound to the outside.
    pose : how the file's places were moved.
    eyeballs : left and right; None where there is no piece of its own.
    proportions : (3,) factors and (3,) shift that take the source's face onto this one, roughly.
    """

    skin: Surface
    vertices: Ints
    whole: Surface
    pose: Pose
    eyeballs: tuple[Eyeball | None, Eyeball | None]
    proportions: tuple[Floats, Floats]

    @cached_property
    def search(self) -> TriangleSearch:
        """Finds closest points on the skin."""
        return TriangleSearch(self.skin.vertices, self.skin.triangles)


@dataclass(frozen=True, eq=False)
class Model:
    """The source's face as something to look for.

    Attributes
    ----------
    face : points of the face seen from the front, the middle between the pupils at the origin.
    template : its depth picture.
    """

    face: Samples
    template: Template


def face_model(skin: Surface) -> Model:
    """Prepare a source's skin, given with the middle between its pupils at the origin."""
    points = sample(skin, FACE_SAMPLES)
    ahead = points.subset(seen(points.points, GRID, GRID) & front(points.points) & (points.normals[:, 2] > 0.1))
    return Model(ahead.subset(slice(0, 2000)), Template(points))


def find_pose(surface: Surface, model: Model) -> tuple[Pose, bool]:
    """Search a whole file for a face.

    Returns
    -------
    pose : the best one; its score tells how much of a face is there.
    reversed : the polygons are wound inside out.
    """
    best: tuple[Pose, bool, Samples] | None = None
    for points in _choices(surface):
        for pose, inside_out in _registered(points, model):
            if best is None or pose.score > best[0].score:
                best = pose, inside_out, points
            if pose.score > CLEAR:
                break
        if best is not None and best[0].score > SURE:
            break
    if best is None:
        return Pose(np.eye(3), 1.0, np.zeros(3), 0.0), False
    return settle(best[2], model, best[0]), best[1]


def _registered(points: Samples, model: Model) -> Iterator[tuple[Pose, bool]]:
    """Poses in which a face may be, and whether it is inside out there: the best place of each gaze, then others."""
    quick = model.face.subset(slice(0, 600))
    found: list[Pose] = []
    tried: list[Pose] = []

    def tries(poses: list[Pose]) -> Iterator[tuple[Pose, bool]]:
        for start in poses:
            tried.append(start)
            view, inside_out = facing(points, start)
            if len(view.points) >= 100:
                yield register(quick, view, start, QUICK), inside_out

    for poses in search(points, model.template):
        found += poses
        yield from tries(poses[:1])
    best = apart(sorted(found, key=lambda p: -p.score), CANDIDATES)
    yield from tries([pose for pose in best if not any(pose is other for other in tried)])


def settle(points: Samples, model: Model, pose: Pose) -> Pose:
    """Place a pose exactly, its middle in the target's own plane of symmetry."""
    steps = LONG if pose.score > CLEAR else LONGEST
    pose = register(model.face, facing(points, pose)[0], pose, steps)
    for _ in range(2):
        pose = symmetric(facing(points, pose)[0], pose, steps)
        pose = register(model.face, facing(points, pose)[0], pose, steps, upright=True)
    return pose


def facing(points: Samples, pose: Pose) -> tuple[Samples, bool]:
    """The points of a target that are seen from the front in a pose, normals towards the viewer's side.

    Returns
    -------
    view : the points.
    reversed : most normals of the face look inwards and were turned.
    """
    local = pose.apply(points.points)
    near = np.flatnonzero(_within(local, (0.0, -0.5, -0.3)))
    if not len(near):
        return points.subset(near), False
    view = points.subset(near[seen(local[near], GRID, 2.0 * GRID)])
    ahead = view.normals @ pose.turn[2]
    if ahead.mean() >= 0.0:
        return view, False
    return Samples(view.points, -view.normals, view.triangles), True


def _within(points: Floats, middle: tuple[float, float, float]) -> Bools:
    """Points that lie in the box around a head."""
    inside = [np.abs(points[:, k] - middle[k]) < ROOM[k] for k in range(3)]
    found: Bools = inside[0] & inside[1] & inside[2]
    return found


def _choices(surface: Surface) -> Iterator[Samples]:
    """What is searched: the largest piece, then everything."""
    piece = surface.components()[surface.triangles[:, 0]]
    largest = np.flatnonzero(piece == np.argmax(np.bincount(piece)))
    if len(largest) < len(piece):
        yield sample(surface, SAMPLES, largest)
    yield sample(surface, SAMPLES)


def isolate(surface: Surface, pose: Pose, inside_out: bool, model: Model) -> Head:
    """Take the head out of a file: turn it, drop what is far, tell skin and eyeballs."""
    vertices = pose.apply(surface.vertices)
    whole = replace(surface, vertices=vertices)
    if inside_out:
        whole = _reversed(whole)
    piece = surface.components()
    near = _within(vertices, (0.0, -0.5, -0.7))
    eyeballs = _eyeballs(whole, piece, near)
    balls = [piece[b.vertices[0]] for b in eyeballs if b is not None]
    kept = np.isin(piece, _skin_pieces(whole, piece, near, model, balls)) & near
    indices, offsets = whole.polygons
    skin, ids = part(whole, np.minimum.reduceat(kept[indices], offsets[:-1]))
    proportions = np.ones(3), np.zeros(3)
    if pose.score >= FACE_SCORE:
        points = sample(skin, FACE_SAMPLES)
        ahead = points.subset(seen(points.points, GRID, 2.0 * GRID))
        proportions = stretch(model.face, ahead, Pose(np.eye(3), 1.0, np.zeros(3), pose.score), LONG)
    return Head(skin, ids, whole, pose, eyeballs, proportions)


def _skin_pieces(whole: Surface, piece: Ints, near: Bools, model: Model, balls: list[Ints]) -> Ints:
    """The piece that is a face all alone; where there is none, all pieces that show much of it."""
    owner = piece[whole.triangles[:, 0]]
    inside = near[whole.triangles].all(axis=1)
    points = sample(whole, SAMPLES, np.flatnonzero(inside))
    ahead = points.subset(seen(points.points, GRID, 0.5 * GRID) & front(points.points))
    shown = np.bincount(owner[ahead.triangles], minlength=int(piece.max()) + 1)
    shown[balls] = 0
    here = Pose(np.eye(3), 1.0, np.zeros(3), 0.0)
    fits = {}
    for number in np.argsort(-shown, kind="stable")[:ALONE]:
        if shown[number] > 0:
            alone = points.subset(owner[points.triangles] == number)
            fits[int(number)] = float(agreement(model.face, facing(alone, here)[0], here).mean())
    best = max(fits, key=lambda number: fits[number])
    if fits[best] > SURE:
        return np.array([best], np.int32)
    return np.flatnonzero(shown >= SHARE * shown.max()).astype(np.int32)


def _eyeballs(whole: Surface, piece: Ints, near: Bools) -> tuple[Eyeball | None, Eyeball | None]:
    """On each side the piece that is most like an eyeball."""
    found: list[tuple[float, Eyeball]] = []
    for number in np.unique(piece[near]):
        ids = np.flatnonzero(piece == number).astype(np.int32)
        places = whole.vertices[ids]
        size = np.ptp(places, axis=0)
        if len(ids) < 12 or size.max() > 2.4 * BALL_SIZES[1] or size.min() < BALL_SIZES[0]:
            continue
        # The front alone: many eyes are half balls with a flat back.
        ahead = places[places[:, 2] > places[:, 2].mean()]
        center, radius, error = fit_sphere(ahead if len(ahead) >= 8 else places)
        fits = error < BALL * radius and BALL_SIZES[0] < radius < BALL_SIZES[1] and size[:2].min() > SPAN * radius
        if fits and 0.2 < abs(center[0]) < 0.9 and abs(center[1]) < 0.5 and -0.9 < center[2] < 0.3:
            found.append((error / radius + 0.1 * abs(np.log(radius / BALL_SIZE)), Eyeball(center, radius, ids)))
    sides = [[row for row in found if side * row[1].center[0] > 0.0] for side in (1.0, -1.0)]
    left, right = (min(some, key=lambda row: row[0])[1] if some else None for some in sides)
    return left, right


def _reversed(surface: Surface) -> Surface:
    """The same surface with every polygon wound the other way round."""
    indices, offsets = surface.polygons
    arity = np.diff(offsets)
    place = np.arange(len(indices)) - np.repeat(offsets[:-1], arity)
    turned = indices[np.repeat(offsets[1:] - 1, arity) - place]
    return replace(surface, polygons=(turned, offsets), triangles=surface.triangles[:, ::-1])


def part(whole: Surface, polygons: Bools) -> tuple[Surface, Ints]:
    """Some polygons as a surface of their own, its feature points included, and its vertices in the whole one."""
    indices, offsets = whole.polygons
    arity = np.diff(offsets)
    corners = indices[np.repeat(polygons, arity)]
    ids = np.unique(corners)
    number = np.full(whole.vertex_count, -1, np.int32)
    number[ids] = np.arange(len(ids))
    links = number[whole.links].reshape(-1, 2)
    owner = np.repeat(np.arange(len(arity)), np.maximum(arity - 2, 0))
    surface = Surface(
        ("part",),
        np.array([0, len(ids)], np.int32),
        whole.vertices[ids],
        (number[corners], np.concatenate([[0], np.cumsum(arity[polygons])]).astype(np.int32)),
        number[whole.triangles[polygons[owner]]],
        links[(links >= 0).all(axis=1)],
        {key: (number[v], w) for key, (v, w) in whole.points.items() if (number[v] >= 0).all()},
        whole.positions,
    )
    return surface, ids.astype(np.int32)
