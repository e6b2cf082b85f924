"""The rims of the lids: how far they have gone towards each other, and how to take them where they should be.

Seen from the front an eye is open between two lines: the lowest points of the upper lid and the highest ones of the
lower lid, slice by slice of constant x. MPEG-4 measures them at one place; elsewhere meshes differ, and a rim that
stays behind shows a slit of eyeball between closed lids.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cloning.correct import smooth_step
from cloning.eyeballs import FAR, balls
from cloning.prepare import PreparedFace
from cloning.surface import Surface
from fba.arrays import Bools, Floats, Ints

SLICES = 24
"""Slices from a corner of the eye to the lids' feature points, and from there to the other corner."""

REACH = 0.11
"""How far from its rim, in eye separations, a lid gives way to it."""

ROUND = 1.7
"""An opening that is this much larger than an arc's at the same place was not measured between the rims."""

BLUNT = 2.3
"""The same for the lids that follow: an eye may end so bluntly, and what is left out there would stay open."""

EVEN = (0.5, 0.8)
"""A rim that goes at least the second share of the way its feature point goes is taken the whole way; one that goes
less than the first is left as it is. A source may leave a hair of its own slits open at their ends, where a target,
whose slits are longer or end more bluntly, would show the eyeball."""

NARROW = 0.4
"""Slices that are less open than this share of the middle are left alone."""

BURIED = 0.01
"""What lies deeper in the eyeball at rest, in radii, is the back of a lid and never its rim."""

STIFF = 100.0
"""How much a difference between neighbours counts against a vertex's own way."""

FIRMER = 1e3
"""Weight of a vertex's own place at REACH from the rim; 1 at the rim."""

FIXED = 1e6
"""Weight of what must stay: feature points."""

FIRM = 1e-3
"""Softness of a slice, relative to the skin's: how exactly the rim is met."""

PASSES = 4

FARTHEST = 0.2
"""No vertex is lifted by more than this share of the eye's opening."""

CLOSES = (0.15, 0.3)
"""Rims are watched in motions that take one more than the first share of the opening towards the other, on the mean;
from the second on they follow in full. A brow that comes down may press on a corner of the eye and closes nothing."""

SPARE = 0.1
"""How much farther than the source's, as a share of the opening, a rim may go."""

MEETS = 0.05
"""Lids that have passed each other by this share of the opening are closed; a source's may overlap by a third."""

EYES = (
    (("3.11", "3.7"), (("3.1", 3, 1), ("3.3", 4, -1))),
    (("3.12", "3.8"), (("3.2", 5, 1), ("3.4", 6, -1))),
)
"""Corners by rising x; feature point, label and side (1 upper, -1 lower) of each lid."""


@dataclass(frozen=True, eq=False)
class Lid:
    """One lid near its rim.

    Attributes
    ----------
    side : 1 upper (its rim is its lowest line), -1 lower.
    vertices : (m,) of the skin.
    edges : (e, 2) between them, as rows of `vertices`.
    rest : (m, 3) where they rest, in eye separations.
    clear : (m,) clearance from the eyeball at rest, in radii.
    span : (s,) x of the slices.
    skin : factorized stiffness (m, m): soft at the rim, smooth, fixed at feature points.
    points : (k, m) evaluates the feature points that lie on these vertices.
    """

    side: int
    vertices: Ints
    edges: Ints
    rest: Floats
    clear: Floats
    span: Floats
    skin: Any
    points: Floats

    def rim(self, places: Floats) -> tuple[Floats, Ints, Floats]:
        """Find the rim of the displaced lid.

        Returns
        -------
        heights : (s,) NaN where the lid does not reach.
        edges : (s, 2) the vertices, as rows, between which each point of the rim lies.
        shares : (s,) weight of the second one.
        """
        a, b = self.edges.T
        xa, xb = places[a, 0], places[b, 0]
        width = np.where(xa == xb, 1.0, xb - xa)
        share = (self.span[:, None] - xa) / width
        crossed = (share >= 0.0) & (share <= 1.0) & (xa != xb)
        crossed &= self.clear[a] + share * (self.clear[b] - self.clear[a]) > -BURIED
        height = places[a, 1] + share * (places[b, 1] - places[a, 1])
        best = np.argmin(np.where(crossed, self.side * height, np.inf), axis=1)
        row = np.arange(len(self.span))
        found: Floats = np.where(crossed[row, best], height[row, best], np.nan)
        return found, self.edges[best], share[row, best]

    def lift(self, places: Floats, goal: Floats, used: Bools, spare: Floats, most: float) -> Floats:
        """How the heights of the lid must change to bring its rim to a goal.

        Parameters
        ----------
        places : (m, 3) the displaced lid.
        goal : (s,) heights.
        used : (s,) the slices that count.
        spare : (s,) how far the rim may be beyond the goal.
        most : how far a vertex may be lifted.

        Returns
        -------
        (m,) offsets along y.
        """
        lifted = np.zeros(len(places))
        for _ in range(PASSES):
            now, edges, shares = self.rim(places + np.column_stack([0.0 * lifted, lifted, 0.0 * lifted]))
            missing = goal - now
            beyond = np.maximum(self.side * missing - spare, 0.0) * self.side
            missing = np.where(self.side * missing > 0.0, beyond, missing)
            rows = used & np.isfinite(missing)
            if not rows.any():
                break
            (a, b), t = edges[rows].T, shares[rows]
            pushes = np.zeros((len(places), len(t)))
            column = np.arange(len(t))
            pushes[a, column] += 1.0 - t
            pushes[b, column] += t
            follow = self.skin.solve(pushes)
            between = follow[a] * (1.0 - t)[:, None] + follow[b] * t[:, None]
            between[np.diag_indices(len(t))] += FIRM * float(np.trace(between)) / len(t)
            lifted += follow @ np.linalg.solve(between, missing[rows])
            lifted = np.clip(lifted, -most, most)
            lifted -= np.linalg.lstsq(self.points, self.points @ lifted, rcond=1e-9)[0]
        return lifted


@dataclass(frozen=True, eq=False)
class Eye:
    """Two lids and the opening between them.

    Attributes
    ----------
    lids : upper, lower.
    heights : (2, s) of their rims at rest.
    open : (s,) slices in which the lids were found and are apart.
    """

    lids: tuple[Lid, Lid]
    heights: Floats
    open: Bools

    @property
    def opening(self) -> Floats:
        """(s,) distance of the rims at rest; 0 where they were not found."""
        return np.where(self.open, self.heights[0] - self.heights[1], 0.0)

    def travel(self, part: int, offsets: Floats, unit: float = 1.0) -> Floats:
        """Share of the opening that a rim goes towards the other one, (s,); even beyond the open slices.

        Parameters
        ----------
        part : 0 upper, 1 lower.
        offsets : (n, 3) of the whole skin.
        unit : eye separation in the unit of `offsets`.
        """
        lid = self.lids[part]
        now = lid.rim(lid.rest + offsets[lid.vertices] / unit)[0]
        used = self.open & np.isfinite(now)
        if not used.any():
            return np.zeros(len(now))
        row = np.arange(len(now))
        share = (now[used] - self.heights[part, used]) / (self.heights[1 - part, used] - self.heights[part, used])
        travel: Floats = np.interp(row, row[used], share)
        return travel

    def follow(self, part: int, offsets: Floats, travel: Floats, spare: Floats | float, unit: float = 1.0) -> Floats:
        """Offsets (m,) along y, in eye separations, that bring a rim a share of the way to the other one.

        Parameters
        ----------
        travel : (s,) the least share.
        spare : how much farther it may be, as a share of the opening, (s,) or the same everywhere.
        unit : eye separation in the unit of `offsets`.
        """
        lid = self.lids[part]
        way = self.heights[1 - part] - self.heights[part]
        goal = self.heights[part] + travel * way
        return lid.lift(
            lid.rest + offsets[lid.vertices] / unit,
            goal,
            self.open,
            spare * np.abs(way),
            FARTHEST * self.opening.max(),
        )


def eyes(face: PreparedFace, roundest: float = ROUND) -> list[Eye | None]:
    """The left and the right eye of a face; None where lids are missing, grown together or too coarse.

    Parameters
    ----------
    roundest : openings beyond this many times an arc's are not used.
    """
    clear = np.full(face.skin.vertex_count, np.inf)
    for ball in balls(face):
        clear[ball.vertices] = np.minimum(clear[ball.vertices], ball.clearance(ball.rest - ball.center))
    clear[~np.isfinite(clear)] = FAR
    return [_eye(face, clear, corners, lids, roundest) for corners, lids in EYES]


def _eye(
    face: PreparedFace,
    clear: Floats,
    corners: tuple[str, str],
    keys: Sequence[tuple[str, int, int]],
    roundest: float,
) -> Eye | None:
    surface, labels = face.skin, face.labels
    if any(k not in surface.points for k in (*corners, keys[0][0], keys[1][0])) or keys[0][1] in labels.sealed:
        return None
    first, last = (surface.positions[k] for k in corners)
    lids = []
    for key, label, side in keys:
        guide = np.array([first, surface.positions[key], last])
        lid = _lid(surface, clear, np.flatnonzero(labels.values == label).astype(np.int32), guide, side)
        if lid is None:
            return None
        lids.append(lid)
    heights = np.array([lid.rim(lid.rest)[0] for lid in lids])
    opening = heights[0] - heights[1]
    middle = opening[SLICES - 1]
    share = np.linspace(-1.0, 1.0, 2 * SLICES + 1)[1:-1]
    with np.errstate(invalid="ignore"):
        used = (opening > NARROW * middle) & (opening < roundest * middle * (1.0 - share**2))
    if not middle > 0.0 or used.sum() < SLICES:
        return None
    return Eye((lids[0], lids[1]), heights, used)


def _lid(surface: Surface, clear: Floats, vertices: Ints, guide: Floats, side: int) -> Lid | None:
    if len(vertices) < 3 or not guide[0, 0] < guide[1, 0] < guide[2, 0]:
        return None
    halves = [np.linspace(guide[k, 0], guide[k + 1, 0], SLICES + 1) for k in range(2)]
    span = np.concatenate([halves[0][1:], halves[1][1:-1]])
    near = _away(surface.vertices[vertices], guide) < 2.0 * REACH
    lid = _assemble(surface, clear, vertices[near], span, side, np.zeros(0))
    if lid is None:
        return None
    heights, edges, shares = lid.rim(lid.rest)
    found = np.isfinite(heights)
    a, b = (lid.rest[edges[found, k]] for k in range(2))
    line = a + shares[found, None] * (b - a)
    if not len(line):
        return None
    away: Floats = np.linalg.norm(lid.rest[:, None] - line[None], axis=2).min(axis=1)
    kept = away < REACH
    return _assemble(surface, clear, lid.vertices[kept], span, side, away[kept])


def _assemble(surface: Surface, clear: Floats, vertices: Ints, span: Floats, side: int, away: Floats) -> Lid | None:
    """A lid of these vertices; away (m,) from the rim, or empty for one that is only measured."""
    row = np.full(surface.vertex_count, -1, dtype=np.int32)
    row[vertices] = np.arange(len(vertices))
    edges = row[surface.edges]
    edges = edges[(edges >= 0).all(axis=1)]
    if len(edges) < 3:
        return None
    points = surface.point_matrix(list(surface.points))[:, vertices].toarray()
    points = points[np.any(points > 0.0, axis=1)]
    skin = _stiffness(points, edges, away) if len(away) else None
    return Lid(side, vertices, edges, surface.vertices[vertices], clear[vertices], span, skin, points)


def _stiffness(points: Floats, edges: Ints, away: Floats) -> Any:
    """Factorized stiffness of a lid that is soft at its rim, firm at REACH, smooth, and fixed at feature points."""
    from scipy.sparse import coo_array, csc_array, diags_array
    from scipy.sparse.linalg import splu

    m, (a, b) = len(away), edges.T
    links = coo_array((np.full(len(a), STIFF), (a, b)), shape=(m, m))
    links = links + links.T
    fixed = csc_array(points)
    own = diags_array(links.sum(axis=1) + 1.0 + FIRMER * (away / REACH) ** 4)
    return splu(csc_array(own - links + FIXED * (fixed.T @ fixed)))


def _away(places: Floats, guide: Floats) -> Floats:
    """Distance of (n, 3) places from a polyline."""
    best = np.full(len(places), np.inf)
    for k in range(len(guide) - 1):
        step = guide[k + 1] - guide[k]
        t = np.clip((places - guide[k]) @ step / max(float(step @ step), 1e-18), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(places - guide[k] - t[:, None] * step, axis=1))
    return best


@dataclass(frozen=True, eq=False)
class RimFollower:
    """Takes the rims of a target's lids as far, slice by slice, as the source's: closed lids leave no slit.

    Attributes
    ----------
    mine, yours : eyes of source and target.
    units : eye separation of source and target, mesh units.
    """

    mine: Sequence[Eye | None]
    yours: Sequence[Eye | None]
    units: tuple[float, float]

    def apply(self, source_motion: Floats, motion: Floats) -> None:
        """Correct (n_t, K, 3) offsets in place, given the source's (n_s, K, 3); feature points stay exact."""
        for mine, yours in zip(self.mine, self.yours, strict=True):
            if mine is None or yours is None:
                continue
            lids = np.concatenate([lid.vertices for lid in mine.lids])
            for k in np.flatnonzero(np.any(source_motion[lids] != 0.0, axis=(0, 2))):
                self._close(mine, yours, source_motion[:, k], motion[:, k])

    def _close(self, mine: Eye, yours: Eye, source_motion: Floats, motion: Floats) -> None:
        """Correct one motion (n_t, 3) in place, given the source's (n_s, 3)."""
        gone = [_evened(mine.travel(part, source_motion, self.units[0])) for part in range(2)]
        watched = [smooth_step((way.mean() - CLOSES[0]) / (CLOSES[1] - CLOSES[0])) for way in gone]
        if not any(watched):
            return
        es0 = self.units[1]
        needed, now = _needed(*gone), [yours.travel(part, motion, es0) for part in range(2)]
        met = now[0] + now[1] >= 1.0 + MEETS
        for part in range(2):
            if not watched[part]:
                continue
            least = np.where(met, np.minimum(needed[part], now[part]), needed[part])
            lift = yours.follow(part, motion, least, gone[part] - least + SPARE, es0)
            motion[yours.lids[part].vertices, 1] += watched[part] * lift * es0


def _evened(travel: Floats) -> Floats:
    """The travel (s,) of a rim, with what nearly keeps up with the feature point taken as far as it, or to its end."""
    middle = min(float(travel[SLICES - 1]), 1.0)
    if middle <= 0.0:
        return travel
    keeps_up = smooth_step((travel / middle - EVEN[0]) / (EVEN[1] - EVEN[0]))
    even: Floats = travel + keeps_up * np.maximum(middle - travel, 0.0)
    return even


def _needed(upper: Floats, lower: Floats) -> tuple[Floats, Floats]:
    """What is needed of the travels (s,) of both rims: lids that overlap may overlap less."""
    most = np.maximum(upper + lower - 1.0 - MEETS, 0.0)
    ways = np.maximum(upper, 0.0), np.maximum(lower, 0.0)
    share = most / np.maximum(ways[0] + ways[1], 1.0)
    return upper - share * ways[0], lower - share * ways[1]


def rim_follower(source: PreparedFace, target: PreparedFace) -> RimFollower:
    """The follower of a pair of faces."""
    return RimFollower(eyes(source), eyes(target, BLUNT), (source.fapu.es0, target.fapu.es0))
