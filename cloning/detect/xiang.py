"""The landmark detector of Xiang et al. (2008), section 3.1, as published.

Around each landmark of the source a patch of its surface is laid onto the target by iterated closest points, from
nine first places; the best one takes the landmark along. Faces must already be roughly aligned.
"""

from __future__ import annotations

import numpy as np

from cloning.similarity import fit_similarity
from cloning.surface import Surface
from cloning.template.closest import TriangleSearch
from fba.arrays import Bools, Floats

LANDMARKS = (
    "2.1", "2.4", "2.5", "2.10", "3.7", "3.8", "3.11", "3.12", "4.1", "4.2", "4.5", "4.6",
    "5.3", "5.4", "8.1", "8.2", "9.1", "9.2", "9.3", "9.15",
)  # fmt: skip
"""Twenty MPEG-4 points; the paper shows its own choice in a picture only."""

RADIUS = 0.06
"""Geodesic radius of a patch, in eye widths of the source."""

FACING = 0.5
"""Partners' normals differ by less than 60 degrees."""

SAMPLES = 60
"""Points of a patch: at this radius a mesh has hardly a vertex in it, so the surface is sampled."""

ITERATIONS = 15

FEWEST = 4
"""Pairs that a step needs."""


def detect_landmarks(source: Surface, vertices: Floats, target: Surface) -> dict[str, Floats]:
    """Find the landmarks on a target.

    Parameters
    ----------
    source : with the landmarks, neutral.
    vertices : (n, 3) the source's vertices where the search starts: aligned, or deformed to the target already.
    target : in the same space.

    Returns
    -------
    Landmark -> (3,) place on the target.
    """
    at = source.positions
    width = 0.5 * float(np.linalg.norm(at["3.7"] - at["3.11"]) + np.linalg.norm(at["3.8"] - at["3.12"]))
    radius = RADIUS * width
    search = TriangleSearch(target.vertices, target.triangles)
    ids = [key for key in LANDMARKS if key in source.points]
    distances = source.distances(ids, 4.0 * radius + 0.5 * width)
    places = source.point_matrix(ids) @ vertices
    found = {}
    for k, key in enumerate(ids):
        points, normals = _patch(source, vertices, key, distances[k], radius)
        found[key] = _best(points, normals, places[k], radius, search)
    return found


def _patch(source: Surface, vertices: Floats, key: str, distances: Floats, radius: float) -> tuple[Floats, Floats]:
    """Points of the surface within a geodesic radius of a landmark, and their normals, where `vertices` are."""
    own, weights = source.points[key]
    heavy = own[weights > 1e-6]
    corners = source.vertices[source.triangles]
    # A triangle reaches into the patch if a corner does, or if the landmark lies in it.
    edge = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    inside = np.isin(source.triangles, heavy).sum(axis=1) == len(heavy)
    near = np.flatnonzero((distances[source.triangles].min(axis=1) < radius + edge) | inside)
    random = np.random.default_rng(0)
    count = 400 * len(near)
    picked = near[np.arange(count) % len(near)]
    root, other = np.sqrt(random.random(count)), random.random(count)
    shares = np.stack([1.0 - root, root * (1.0 - other), root * other], axis=1)
    at = np.einsum("nk,nkd->nd", shares, corners[picked])
    way = np.linalg.norm(at[:, None] - corners[picked], axis=2) + distances[source.triangles[picked]]
    geodesic = way.min(axis=1)
    straight = np.linalg.norm(at - source.positions[key], axis=1)
    geodesic = np.where(inside[picked], straight, np.maximum(geodesic, straight))
    chosen = np.flatnonzero(geodesic <= radius)
    if len(chosen) < 8:
        chosen = np.argsort(geodesic, kind="stable")[:8]
    chosen = chosen[np.linspace(0, len(chosen) - 1, min(SAMPLES, len(chosen))).astype(int)]
    moved = vertices[source.triangles[picked[chosen]]]
    normals = np.cross(moved[:, 1] - moved[:, 0], moved[:, 2] - moved[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    return np.einsum("nk,nkd->nd", shares[chosen], moved), normals


def _best(points: Floats, normals: Floats, mark: Floats, radius: float, search: TriangleSearch) -> Floats:
    """Register a patch from nine places; the landmark goes with the best, then to the closest point of the target."""
    steps = np.array([0.0, -0.5, 0.5]) * radius
    states = [_State(points, normals, mark) for _ in range(9)]
    for state, (x, y) in zip(states, ((x, y) for x in steps for y in steps), strict=True):
        state.shift(np.array([x, y, 0.0]))
    for _ in range(ITERATIONS):
        # One query for all states.
        near = search.closest(
            np.concatenate([s.points for s in states]), np.concatenate([s.normals for s in states]), None, FACING
        )
        goals, found = search.positions(near), near.triangles >= 0
        for k, state in enumerate(states):
            own = slice(k * len(points), (k + 1) * len(points))
            state.step(goals[own], found[own], near.distances[own])
    best = min(states, key=lambda s: s.error)
    place: Floats = search.positions(search.closest(best.mark[None]))[0]
    return place


class _State:
    """A patch on its way to the target."""

    def __init__(self, points: Floats, normals: Floats, mark: Floats) -> None:
        self.points, self.normals, self.mark, self.error = points, normals, mark, np.inf

    def shift(self, way: Floats) -> None:
        """Move it to its first place."""
        self.points, self.mark = self.points + way, self.mark + way

    def step(self, goals: Floats, found: Bools, distances: Floats) -> None:
        """One step of iterated closest points, rigid."""
        if found.sum() < FEWEST:
            return
        self.error = float(np.mean(distances[found] ** 2))
        turn = fit_similarity(self.points[found], goals[found]).rotation
        middle, goal = self.points[found].mean(axis=0), goals[found].mean(axis=0)
        self.points = (self.points - middle) @ turn.T + goal
        self.normals = self.normals @ turn.T
        self.mark = turn @ (self.mark - middle) + goal
