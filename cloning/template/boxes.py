"""A tree of boxes around triangles, and the loop over queries that walks it: for numba, which makes it fast.

Triangles are sorted along a curve that fills space; each `LEAF` in a row share a box, and each two boxes a larger one.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from fba.arrays import Floats, Ints

LEAF = 4
"""Triangles in the smallest boxes."""

SLACK = 1e-9
"""Boxes are opened when they are farther than the best triangle by this share of its distance: rounding."""

DEEPEST = 64
"""Boxes that can wait to be opened; a tree has fewer levels."""


class BoxTree(NamedTuple):
    """Triangles in the order of a tree of boxes.

    Attributes
    ----------
    triangles : (t,) index of each.
    corners : (t, 3, 3).
    normals : (t, 3), unit.
    bits : (t,) labels that it touches, one bit each.
    low, high : (2 l, 3) corners of the boxes; box k holds boxes 2 k and 2 k + 1, box 1 holds all, box l + k the
        triangles from `LEAF` k on.
    """

    triangles: Ints
    corners: Floats
    normals: Floats
    bits: Ints
    low: Floats
    high: Floats


def box_tree(some: Ints, corners: Floats, normals: Floats, bits: Ints) -> BoxTree:
    """The tree of some (t,) triangles, at least one, among all: (a, 3, 3) corners, (a, 3) normals, (a,) bits."""
    ids = some[np.argsort(_along_curve(corners[some].sum(axis=1)), kind="stable")]
    chosen = corners[ids]
    leaves = 1
    while leaves * LEAF < len(ids):
        leaves *= 2
    low, high = np.full((2 * leaves, 3), np.inf), np.full((2 * leaves, 3), -np.inf)
    for bounds, outer in ((low, np.minimum), (high, np.maximum)):
        padded = np.repeat(bounds[:leaves], LEAF, axis=0)
        padded[: len(ids)] = outer(outer(chosen[:, 0], chosen[:, 1]), chosen[:, 2])
        bounds[leaves:] = outer.reduce([padded[k::LEAF] for k in range(LEAF)])
        count = leaves
        while count > 1:
            bounds[count // 2 : count] = outer(bounds[count : 2 * count : 2], bounds[count + 1 : 2 * count : 2])
            count //= 2
    return BoxTree(ids, chosen, normals[ids], bits[ids], low, high)


def _along_curve(places: Floats) -> Ints:
    """(t,) numbers that order (t, 3) places along a curve that stays near: the bits of three coordinates in turn."""
    low = places.min(axis=0)
    size = max(float((places.max(axis=0) - low).max()), 1e-300)
    cells = ((places - low) * (1023.0 / size)).astype(np.int64)
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
        cells = (cells | (cells << shift)) & mask
    found: Ints = cells[:, 0] | cells[:, 1] << 1 | cells[:, 2] << 2
    return found


def closest_loop(
    points: Floats,
    normals: Floats,
    refused: Ints,
    least: float,
    limits: Floats,
    guesses: Ints,
    tree: BoxTree,
    found: Ints,
    weights: Floats,
    distances: Floats,
    facing: Floats,
) -> None:
    """Find the closest of the triangles that fit each query; the lowest index wins where some are equally near.

    Parameters
    ----------
    points : (m, 3).
    normals : (m, 3), or (0, 3) where every triangle faces well enough.
    refused : (m,) bits of labels that no triangle may touch.
    least : least cosine between the normals.
    limits : (m,) nothing farther is found.
    guesses : (m,) place of a triangle in the tree that is tried first, -1 for none.
    found, weights, distances, facing : (m,), (m, 3), (m,), (m,), written where a triangle is found.
    """
    triangles, corners, turned, bits, low, high = tree
    leaves = len(low) // 2
    waiting = np.empty(DEEPEST, np.int64)
    gaps = np.empty(DEEPEST)
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        best, bound = np.inf, limits[i]
        index, best_v, best_w, best_facing = -1, 0.0, 0.0, -1.0
        count = 1
        waiting[0], gaps[0] = 1, 0.0
        first = guesses[i]
        while count > 0 or first >= 0:
            if first >= 0:
                # The guess comes alone and before all boxes: it bounds what has to be opened.
                begin, end, first = first, first + 1, -1
            else:
                count -= 1
                box = waiting[count]
                if gaps[count] > bound:
                    continue
                if box < leaves:
                    for child in (2 * box, 2 * box + 1):
                        dx = max(low[child, 0] - x, 0.0, x - high[child, 0])
                        dy = max(low[child, 1] - y, 0.0, y - high[child, 1])
                        dz = max(low[child, 2] - z, 0.0, z - high[child, 2])
                        waiting[count], gaps[count] = child, sqrt(dx * dx + dy * dy + dz * dz) * (1.0 - SLACK)
                        count += 1
                    if gaps[count - 2] < gaps[count - 1]:
                        # The nearer one is opened first.
                        waiting[count - 2], waiting[count - 1] = waiting[count - 1], waiting[count - 2]
                        gaps[count - 2], gaps[count - 1] = gaps[count - 1], gaps[count - 2]
                    continue
                begin = (box - leaves) * LEAF
                end = min(begin + LEAF, len(triangles))
            for k in range(begin, end):
                if bits[k] & refused[i]:
                    continue
                cosine = 1.0
                if len(normals):
                    cosine = normals[i, 0] * turned[k, 0] + normals[i, 1] * turned[k, 1] + normals[i, 2] * turned[k, 2]
                    if cosine < least:
                        continue
                ax, ay, az = corners[k, 0, 0], corners[k, 0, 1], corners[k, 0, 2]
                bx, by, bz = corners[k, 1, 0] - ax, corners[k, 1, 1] - ay, corners[k, 1, 2] - az
                cx, cy, cz = corners[k, 2, 0] - ax, corners[k, 2, 1] - ay, corners[k, 2, 2] - az
                px, py, pz = x - ax, y - ay, z - az
                d00, d01 = bx * bx + by * by + bz * bz, bx * cx + by * cy + bz * cz
                d11, d20 = cx * cx + cy * cy + cz * cz, px * bx + py * by + pz * bz
                d21, app = px * cx + py * cy + pz * cz, px * px + py * py + pz * pz
                det = max(d00 * d11 - d01 * d01, 1e-30)
                v, w = (d11 * d20 - d01 * d21) / det, (d00 * d21 - d01 * d20) / det
                least_square = np.inf
                if v >= 0.0 and w >= 0.0 and v + w <= 1.0:
                    least_square = app - 2.0 * (v * d20 + w * d21) + v * v * d00 + 2.0 * v * w * d01 + w * w * d11
                for edge in range(3):
                    if edge == 0:
                        v_edge, w_edge = min(max(d20 / max(d00, 1e-30), 0.0), 1.0), 0.0
                    elif edge == 1:
                        v_edge, w_edge = 0.0, min(max(d21 / max(d11, 1e-30), 0.0), 1.0)
                    else:
                        w_edge = (d21 - d20 - d01 + d00) / max(d00 - 2.0 * d01 + d11, 1e-30)
                        w_edge = min(max(w_edge, 0.0), 1.0)
                        v_edge = 1.0 - w_edge
                    square = (
                        app
                        - 2.0 * (v_edge * d20 + w_edge * d21)
                        + v_edge * v_edge * d00
                        + 2.0 * v_edge * w_edge * d01
                        + w_edge * w_edge * d11
                    )
                    if square < least_square:
                        least_square, v, w = square, v_edge, w_edge
                distance = sqrt(max(least_square, 0.0))
                if distance <= limits[i] and (distance < best or (distance == best and triangles[k] < index)):
                    best, bound, index = distance, distance, triangles[k]
                    best_v, best_w, best_facing = v, w, cosine
        if index >= 0:
            found[i], distances[i], facing[i] = index, best, best_facing
            weights[i, 0], weights[i, 1], weights[i, 2] = 1.0 - best_v - best_w, best_v, best_w
