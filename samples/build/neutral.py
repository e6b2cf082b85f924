"""Bring a MakeHuman head nearer to MPEG-4's neutral face: lips and teeth in contact, lids tangent to the iris."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fba.arrays import Floats
from fba.feature_points import FeaturePoint
from fba.mesh import PolyMesh
from samples.build.contact import LIDS, LIPS, edge_line, side_mask
from samples.build.geodesic import smoothstep
from samples.build.head import Head
from samples.build.surface import nearest_facing

COARSE_GAP, FINE_GAP = -2.0 / 1024.0, -6.0 / 1024.0
"""Gap between the lips, in MNS0, on MakeHuman's own skin and on a finer one: they overlap by a hair (.04 and .12 mm),
so that no light falls through where the edges of two lips with different vertices meet."""
LIP_REACH = 0.17
"""How far from the line of contact a lip follows the correction, in ES0."""
DEPTH_MEAN = 8
"""Slices to both sides whose mean is taken: the edge of a flat lip jumps in depth from vertex to vertex."""
PASSES = 6
SOFT_PASSES = 16
CORNER = 0.15
"""On a finer skin the lips meet half-way in this outer share of the mouth, whose corners curve down by themselves."""
TONGUE_CLEARANCE = 0.02
"""The tip stays this far (ES0) behind the front of the teeth, whose strips have no thickness."""
LASH_ENDS = 0.3
"""Length of the outermost lashes, of the middle ones'."""
TONGUE_FLAT = 0.35
"""Share by which what rises above the tip is lowered where teeth are shown: the neutral tongue is flat."""
LASHES = (("lashes_left", "eye_left"), ("lashes_right", "eye_right"))
LASH_LENGTH = 0.4
"""Of MakeHuman's lashes: the strips are made for a texture with fine hairs, not for a plain colour."""

SIDES = (("left", "3.1", "3.3", "3.5"), ("right", "3.2", "3.4", "3.6"))


def neutral(head: Head, opening: float, show: float = 0.0) -> Head:
    """Return the head with lids tangent to the iris, lips closed on a level line, and teeth and tongue in place.

    Parameters
    ----------
    opening : of the lids = diameter of the iris, in ES0.
    show : how far the upper teeth reach below where MakeHuman's do, in ES0.
    """
    head = _lids(replace(head, placed={**head.placed, **lid_points(head)}), opening)
    if head.fairing is not None:
        for _ in range(SOFT_PASSES):
            head = head.moved({"skin": head.fairing.spread(close_lips(head) + meet_in_depth(head))})
    for _ in range(PASSES):
        head = head.moved({"skin": close_lips(head)})
    head = replace(head, placed={**head.placed, **lip_points(head)})
    return _lashes(_teeth(head, show))


def lid_points(head: Head) -> dict[str, FeaturePoint]:
    """Feature points 3.1-3.4 on the rims that bound the opening, above and below the pupil."""
    placed = {}
    for side, upper, lower, eye in SIDES:
        span = head.positions[eye][:1]
        for part, key in (("upper", upper), ("lower", lower)):
            edge = LIDS[side, part]
            placed[key] = edge_line(head, edge, side_mask(head, edge), span).feature_point(0)
    return placed


def _lids(head: Head, opening: float) -> Head:
    """Mix in eyeWide and eyeSquint so that each lid is half the opening away from the pupil's height.

    The iris radius follows the opening, so the lids become tangent to the iris above and below.
    """
    body = head.body.copy()
    p = head.positions
    for side, upper, lower, eye in SIDES:
        names = [name + side.capitalize() for name in ("eyeWide", "eyeSquint")]
        rows = [[_move(head, key, head.unit(name)["skin"])[1] for name in names] for key in (upper, lower)]
        half = 0.5 * opening * head.fapu.es0
        wanted = [p[eye][1] + half - p[upper][1], p[eye][1] - half - p[lower][1]]
        for name, weight in zip(names, np.linalg.solve(np.array(rows), np.array(wanted)), strict=True):
            body += weight * head.makehuman.target("faceunits", name)
    return replace(head, body=body)


def _move(head: Head, key: str, skin_offsets: Floats) -> Floats:
    point = head.points[key]
    moved: Floats = np.asarray(point.weights) @ skin_offsets[list(point.vertices)]
    return moved


def close_lips(head: Head) -> Floats:
    """Offsets (n, 3) of the skin that bring both lips into contact on a level line at the height of the corners.

    On a finer skin the corners keep their height, and the motion fades beyond them instead of ending there.
    """
    p, soft = head.positions, head.fairing is not None
    span, lines = _lip_edges(head)
    level = np.full(span.size, 0.5 * (p["2.4"][1] + p["2.5"][1]))
    if soft:
        half_way = 0.5 * (lines["upper"][:, 1] + lines["lower"][:, 1])
        level = half_way + smoothstep((1.0 - np.abs(span) / span[-1]) / CORNER) * (level - half_way)
    half = 0.5 * (FINE_GAP if soft else COARSE_GAP) * head.fapu.mns0
    shifts = {name: level + edge.sign * half - lines[name][:, 1] for name, edge in LIPS.items()}
    return _follow(head, span, lines, shifts, 1)


def meet_in_depth(head: Head) -> Floats:
    """Offsets (n, 3) of the skin that bring the edges of both lips half-way to each other in depth.

    Lips that touch one behind the other look closed from the front, but let light through seen from below.
    """
    span, lines = _lip_edges(head)
    apart = lines["upper"][:, 2] - lines["lower"][:, 2]
    even = np.convolve(np.pad(apart, DEPTH_MEAN, mode="edge"), np.full(2 * DEPTH_MEAN + 1, 1.0), "valid")
    half = 0.5 * even / (2 * DEPTH_MEAN + 1)
    return _follow(head, span, lines, {"upper": -half, "lower": half}, 2)


def _lip_edges(head: Head) -> tuple[Floats, dict[str, Floats]]:
    """x of slices from corner to corner, and the edges of both lips there, (s, 3)."""
    skin = head.parts["skin"]
    ends = [head.points[k].vertices[0] for k in ("2.5", "2.4")]
    span = np.linspace(skin[ends[0], 0], skin[ends[1], 0], 161)[1:-1]
    return span, {name: edge_line(head, edge, side_mask(head, edge), span).points for name, edge in LIPS.items()}


def _follow(head: Head, span: Floats, lines: dict[str, Floats], shifts: dict[str, Floats], axis: int) -> Floats:
    """Offsets (n, 3) of the skin along an axis when the edges of the lips are shifted; they fade with the distance."""
    skin, soft = head.parts["skin"], head.fairing is not None
    offsets = np.zeros_like(skin)
    for name, edge in LIPS.items():
        side = side_mask(head, edge)
        x = skin[side, 0]
        place = np.column_stack([np.clip(x, span[0], span[-1]) if soft else x, *_along(x, span, lines[name])])
        away = np.linalg.norm(skin[side] - place, axis=1) / (LIP_REACH * head.fapu.es0)
        beyond = {} if soft else {"left": 0.0, "right": 0.0}
        offsets[side, axis] = np.interp(x, span, shifts[name], **beyond) * (1.0 - smoothstep(away))
    return offsets


def _along(x: Floats, span: Floats, line: Floats) -> list[Floats]:
    return [np.interp(x, span, line[:, k]) for k in (1, 2)]


def lip_points(head: Head) -> dict[str, FeaturePoint]:
    """Feature points 2.2, 2.3 and 2.6-2.9 where the standard has them: on the lines along which the lips meet."""
    quarter = 0.5 * head.positions["2.4"][0]
    span = np.array([-quarter, 0.0, quarter])
    placed = {}
    for edge in LIPS.values():
        line = edge_line(head, edge, side_mask(head, edge), span)
        for row, key in enumerate(edge.guide[1:-1]):
            placed[key] = line.feature_point(row)
    return placed


def _lashes(head: Head) -> Head:
    """Plant the lashes on the lids; shorten them, most at the ends."""
    offsets = {}
    skin = head.scene.shape("skin").mesh
    for name, eye in LASHES:
        mesh = head.scene.shape(name).mesh
        lashes = mesh.vertices
        outward = lashes - head.eye_centers[eye][0]
        roots = _roots(mesh, np.linalg.norm(outward, axis=1))
        rows = np.unique(roots)
        facing = outward[rows] / np.linalg.norm(outward[rows], axis=1)[:, None]
        planted = np.zeros_like(lashes)
        planted[rows] = nearest_facing(lashes[rows], facing, skin).carry(skin.vertices)
        along = (lashes[roots, 0] - lashes[rows, 0].min()) / np.ptp(lashes[rows, 0])
        length = LASH_LENGTH * (LASH_ENDS + (1.0 - LASH_ENDS) * 4.0 * along * (1.0 - along))
        offsets[name] = planted[roots] + length[:, None] * (lashes - lashes[roots]) - lashes
    return head.moved(offsets)


def _roots(strip: PolyMesh, height: Floats) -> NDArray[np.int64]:
    """For each vertex of a strip of quads the end of its row on the lower long side, (n,); height (n,)."""
    neighbours: dict[int, list[int]] = {v: [] for v in range(strip.vertex_count)}
    for a, b in strip.edges.tolist():
        neighbours[a].append(b)
        neighbours[b].append(a)
    border = set(strip.edges[strip.edge_uses == 1].ravel().tolist())
    corners = {v for v in border if len(neighbours[v]) == 2}
    loop = [min(corners)]
    while (onward := [v for v in neighbours[loop[-1]] if v in border and v not in loop[-2:]]) and onward[0] != loop[0]:
        loop.append(onward[0])
    cuts = [*(k for k, v in enumerate(loop) if v in corners), len(loop)]
    sides = [[*loop, loop[0]][a : b + 1] for a, b in pairwise(cuts)]
    long = sorted(sides, key=len)[2:]
    front = min(long, key=lambda side: float(height[side].mean()))
    found = np.full(strip.vertex_count, -1, dtype=np.int64)
    found[front] = front
    while front:
        grown = [(v, w) for v in front for w in neighbours[v] if found[w] < 0]
        for v, w in grown:
            found[w] = found[v]
        front = [w for _, w in grown]
    return found


def _teeth(head: Head, show: float) -> Head:
    """Lower the upper teeth, raise the lower ones to them; bring the tip of the tongue to the line where they meet."""
    p = head.positions
    down = np.array([0.0, -show * head.fapu.es0, 0.0])
    upper = np.zeros_like(head.parts["upper_teeth"]) + down
    lower = np.zeros_like(head.parts["lower_teeth"]) + down
    lower[:, 1] += p["9.10"][1] - p["9.11"][1]
    tongue = head.parts["tongue"]
    back = tongue[:, 2].min()
    share = smoothstep((tongue[:, 2] - back) / (p["6.1"][2] - back))
    touch = p["9.10"] + down - p["6.1"]
    touch[2] -= TONGUE_CLEARANCE * head.fapu.es0
    tongue = tongue + share[:, None] * touch
    tip = p["6.1"] + touch
    if show > 0.0:
        tongue[:, 1] -= TONGUE_FLAT * np.maximum(tongue[:, 1] - tip[1], 0.0)
    return head.moved({"upper_teeth": upper, "lower_teeth": lower, "tongue": tongue - head.parts["tongue"]})
