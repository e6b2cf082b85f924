"""Bring a MakeHuman head nearer to MPEG-4's neutral face: lips and teeth in contact, lids tangent to the iris."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fba.arrays import Bools, Floats, Ints
from fba.feature_points import FeaturePoint
from samples.build.geodesic import distances, smoothstep
from samples.build.head import Head

UPPER_LIP = ("2.2", "2.6", "2.7", "8.1", "8.5", "8.6", "8.9", "8.10")
LOWER_LIP = ("2.3", "2.8", "2.9", "8.2", "8.7", "8.8")
LIP_LINES = (("2.2", "2.6", "2.7"), ("2.3", "2.8", "2.9"))
"""Middle, left and right inner contour point of the upper and of the lower lip."""

LIP_GAP = 2.0 / 1024.0
"""Gap left between the lips, in MNS0: contact to the eye, but no two vertices fall together."""
LIP_REACH = 0.17
"""How far from the line of contact a lip follows the correction, in ES0."""
PASSES = 6


def neutral(head: Head) -> Head:
    """Return the head with lids tangent to the iris, lips closed on a level line, and teeth and tongue in place."""
    head = _lids(head)
    for _ in range(PASSES):
        head = head.moved({"skin": _lip_offsets(head)})
    head = replace(head, placed=_lip_points(head))
    return _lashes(_teeth(head))


def lip_sides(head: Head) -> tuple[Bools, Bools]:
    """Masks of the skin vertices that belong to the upper and to the lower lip side, by geodesic distance."""
    mesh = head.scene.shape("skin").mesh
    up = distances(mesh, [head.points[k] for k in UPPER_LIP]).min(axis=0)
    low = distances(mesh, [head.points[k] for k in LOWER_LIP]).min(axis=0)
    near = np.minimum(up, low) < 0.75 * head.fapu.mw0
    return near & (up <= low), near & (low < up)


def _lids(head: Head) -> Head:
    """Mix in eyeWide and eyeSquint so that each lid is half the opening away from the pupil's height.

    The iris radius follows the opening, so the lids become tangent to the iris above and below.
    """
    body = head.body.copy()
    p = head.positions
    for side, upper, lower, eye in (("Left", "3.1", "3.3", "3.5"), ("Right", "3.2", "3.4", "3.6")):
        units = [head.unit(name + side)["skin"] for name in ("eyeWide", "eyeSquint")]
        rows = [[_move(head, key, unit)[1] for unit in units] for key in (upper, lower)]
        half = max(p[upper][1] - p[eye][1], p[eye][1] - p[lower][1]) * LID_SHARE
        wanted = [p[eye][1] + half - p[upper][1], p[eye][1] - half - p[lower][1]]
        weights = np.linalg.solve(np.array(rows), np.array(wanted))
        for name, weight in zip(("eyeWide", "eyeSquint"), weights, strict=True):
            body += weight * head.makehuman.target("faceunits", name + side)
    return replace(head, body=body)


LID_SHARE = 0.8
"""Half the lid opening over the larger of the two distances lid - pupil that the raw head has."""


def _move(head: Head, key: str, skin_offsets: Floats) -> Floats:
    point = head.points[key]
    moved: Floats = np.asarray(point.weights) @ skin_offsets[list(point.vertices)]
    return moved


def _lip_offsets(head: Head) -> Floats:
    """Offsets (n, 3) of the skin that bring both lips to a level line at the height of the corners."""
    p, fapu = head.positions, head.fapu
    skin = head.parts["skin"]
    level = 0.5 * (p["2.4"][1] + p["2.5"][1])
    span = np.linspace(p["2.5"][0], p["2.4"][0], 161)[1:-1]
    offsets = np.zeros_like(skin)
    for side, keys, sign in zip(lip_sides(head), LIP_LINES, (1, -1), strict=True):
        guide = _guide(head, *keys)
        line = lip_line(head, side, guide, span, sign)[0]
        shift = level + sign * 0.5 * LIP_GAP * fapu.mns0 - line[:, 1]
        x = skin[side, 0]
        place = np.column_stack([np.interp(x, span, line[:, k]) for k in (1, 2)])
        away = np.linalg.norm(skin[side, 1:] - place, axis=1) / (LIP_REACH * fapu.es0)
        amount = np.interp(x, span, shift, left=0.0, right=0.0)
        offsets[side, 1] = amount * (1.0 - smoothstep(away))
    return offsets


def lip_line(head: Head, side: Bools, guide: Floats, span: Floats, sign: int) -> tuple[Floats, Ints, Floats]:
    """Lowest (sign 1) or highest (sign -1) point of one lip in each slice x = span[i].

    Only the surface near the guide polyline (through the feature points) counts, so gums and cheeks do not.

    Returns
    -------
    points : (s, 3).
    edges : (s, 2) the skin vertices between which each point lies.
    shares : (s,) the weight of the second one.
    """
    skin = head.parts["skin"]
    triangles = head.scene.shape("skin").mesh.triangles
    triangles = triangles[side[triangles].all(axis=1)]
    tails, heads = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    reach = 0.12 * head.fapu.es0
    points, shares = np.zeros((span.size, 3)), np.zeros(span.size)
    edges = np.zeros((span.size, 2), dtype=np.int32)
    for row, x in enumerate(span):
        crossing = (skin[tails, 0] - x) * (skin[heads, 0] - x) <= 0.0
        crossing &= skin[tails, 0] != skin[heads, 0]
        a, b = tails[crossing], heads[crossing]
        share = (x - skin[a, 0]) / (skin[b, 0] - skin[a, 0])
        cut = skin[a] + (skin[b] - skin[a]) * share[:, None]
        near = np.array([np.interp(x, guide[:, 0], guide[:, k]) for k in (1, 2)])
        height = np.where(np.linalg.norm(cut[:, 1:] - near, axis=1) < reach, sign * cut[:, 1], np.inf)
        best = int(np.argmin(height))
        points[row], edges[row], shares[row] = cut[best], (a[best], b[best]), share[best]
    return points, edges, shares


def _guide(head: Head, middle: str, left: str, right: str) -> Floats:
    p = head.positions
    return np.array([p[k] for k in ("2.5", right, middle, left, "2.4")])


def _lip_points(head: Head) -> dict[str, FeaturePoint]:
    """Feature points 2.2, 2.3 and 2.6-2.9 where the standard has them: on the lines along which the lips meet."""
    quarter = 0.5 * head.positions["2.4"][0]
    span = np.array([0.0, quarter, -quarter])
    placed = {}
    for side, keys, sign in zip(lip_sides(head), LIP_LINES, (1, -1), strict=True):
        _, edges, shares = lip_line(head, side, _guide(head, *keys), span, sign)
        for key, (a, b), share in zip(keys, edges.tolist(), shares.tolist(), strict=True):
            rows = [(v, w) for v, w in ((a, 1.0 - share), (b, share)) if w > 1e-9]
            placed[key] = FeaturePoint("skin", tuple(v for v, _ in rows), tuple(w for _, w in rows))
    return placed


def _lashes(head: Head) -> Head:
    """Shorten the lashes: the strips are made for a texture with fine hairs, not for a plain colour."""
    offsets = {}
    for name, eye in (("lashes_left", "eye_left"), ("lashes_right", "eye_right")):
        mesh = head.scene.shape(name).mesh
        height = np.linalg.norm(mesh.vertices - head.eye_centers[eye][0], axis=1)
        offsets[name] = np.zeros_like(mesh.vertices)
        strips = mesh.components()
        for strip in range(int(strips.max()) + 1):
            members = np.flatnonzero(strips == strip)
            roots = members[np.argsort(height[members], kind="stable")[: members.size // LASH_ROWS]]
            away = mesh.vertices[members][:, None] - mesh.vertices[roots][None]
            nearest = np.argmin((away**2).sum(axis=2), axis=1)
            offsets[name][members] = (LASH_LENGTH - 1.0) * away[np.arange(members.size), nearest]
    return head.moved(offsets)


LASH_ROWS = 5
"""Rows of vertices of a strip from the lid to the tips."""
LASH_LENGTH = 0.6
"""Of MakeHuman's."""


def _teeth(head: Head) -> Head:
    """Raise the lower teeth to the upper ones; bring the tip of the tongue to the line where they meet."""
    p = head.positions
    teeth = np.zeros_like(head.parts["lower_teeth"])
    teeth[:, 1] = p["9.10"][1] - p["9.11"][1]
    tongue = head.parts["tongue"]
    back = tongue[:, 2].min()
    share = smoothstep((tongue[:, 2] - back) / (p["6.1"][2] - back))
    touch = p["9.10"] - p["6.1"]
    touch[2] -= TONGUE_CLEARANCE * head.fapu.es0
    return head.moved({"lower_teeth": teeth, "tongue": share[:, None] * touch})


TONGUE_CLEARANCE = 0.02
"""The tip stays this far (ES0) behind the front of the teeth, whose strips have no thickness."""
