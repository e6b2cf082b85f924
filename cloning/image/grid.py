"""Vertex tents on a picture: pixels as the vertices (x, y, luminance) of a quadrangle mesh.

Song et al., sections IV and VI. The ring of a pixel are its four neighbours; the tip stands on it along the normal of
the quadrangles around it, as high as the ring's edges are long on average. Only luminances are unknown, so of every
transform Q = w' w^T (w w^T)^-1 only the row for the luminance counts. The target's tips are unknowns too; as each
occurs in one tent only, it is eliminated exactly: the equations of a tent are projected on the plane across the tip's
row of w^T (w w^T)^-1, and two equations for five pixels remain.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cloning.image.color import Planes

SIDES = ((0, 1), (0, -1), (1, 0), (-1, 0))
"""Steps (rows, columns) to the ring's pixels."""


@dataclass(frozen=True, eq=False)
class Tents:
    """The tents of the inner pixels of a plane (h, w), as planes (h - 2, w - 2).

    Attributes
    ----------
    ring : (4, ...) luminance differences to the neighbours, in the order of `SIDES`.
    normal : (3, ...) unit normals.
    length : length of the tips.
    inverse : (6, ...) of w w^T: xx, yy, zz, xy, xz, yz.
    """

    ring: Planes
    normal: Planes
    length: Planes
    inverse: Planes

    def solve(self, x: Planes | float, y: Planes | float, z: Planes | float) -> Planes:
        """(3, ...) (w w^T)^-1 times a vector."""
        xx, yy, zz, xy, xz, yz = self.inverse
        return np.stack([xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z])


def differences(plane: Planes) -> Planes:
    """(4, h - 2, w - 2) differences from each inner pixel to its neighbours, in the order of `SIDES`."""
    middle = plane[1:-1, 1:-1]
    h, w = plane.shape
    return np.stack([plane[1 + r : h - 1 + r, 1 + c : w - 1 + c] - middle for r, c in SIDES])


def tents(plane: Planes) -> Tents:
    """Build the tents of a height field (h, w), heights in pixels; 4-byte floats are enough and twice as fast."""
    ring = differences(plane)
    right, left, down, up = ring
    nx, ny = (left - right) / 2.0, (up - down) / 2.0
    nz = 1.0 / np.sqrt(1.0 + nx * nx + ny * ny)
    nx, ny = nx * nz, ny * nz
    length = np.sqrt(1.0 + ring * ring).mean(axis=0)
    tip = length * length
    xx, yy = 2.0 + tip * nx * nx, 2.0 + tip * ny * ny
    zz = np.einsum("kij,kij->ij", ring, ring) + tip * nz * nz
    xy, xz, yz = tip * nx * ny, right - left + tip * nx * nz, down - up + tip * ny * nz
    minors = np.stack([
        yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy,
        xz * yz - xy * zz, xy * yz - xz * yy, xy * xz - xx * yz,
    ])  # fmt: skip
    minors /= xx * minors[0] + xy * minors[3] + xz * minors[4]
    return Tents(ring, np.stack([nx, ny, nz]), length, minors)


def motion_rows(neutral: Tents, expression: Tents) -> Planes:
    """(3, ...) the luminance row of each source transform Q = w' w^T (w w^T)^-1."""
    tip = expression.length * expression.normal[2] * neutral.length
    right, left, down, up = expression.ring
    height = np.einsum("kij,kij->ij", expression.ring, neutral.ring)
    nx, ny, nz = neutral.normal
    return neutral.solve(right - left + tip * nx, down - up + tip * ny, height + tip * nz)


def tent_equations(target: Tents) -> tuple[Planes, Planes]:
    """The two equations that are left of each tent of the target.

    Returns
    -------
    (2, 4, ...) coefficients of the luminance differences in the ring, and (2, 3, ...) those of the row of the source's
    transform to which their sums must be equal.
    """
    p = target.solve(*target.normal)
    p /= np.sqrt(np.einsum("kij,kij->ij", p, p))
    flat = np.hypot(p[0], p[2])
    axes = np.zeros((2, *p.shape), p.dtype)
    axes[0, 0], axes[0, 2] = p[2] / flat, -p[0] / flat
    axes[1, 0], axes[1, 1], axes[1, 2] = p[1] * axes[0, 2], flat, -p[1] * axes[0, 0]
    rows = np.empty((2, 4, *p.shape[1:]), p.dtype)
    for row, axis in zip(rows, axes, strict=True):
        x, y, z = target.solve(*axis)
        for k, along in enumerate((x, -x, y, -y)):
            row[k] = along + z * target.ring[k]
    return rows, axes


def wanted_differences(target: Tents, motion: Planes, near: Planes) -> Planes:
    """(4, ...) the differences in each ring that fulfil the tent's two equations, nearest to given ones.

    Parameters
    ----------
    motion : (3, ...) rows of the source's transforms.
    near : (4, ...) the differences where the equations leave a choice.
    """
    rows, axes = tent_equations(target)
    left = np.einsum("akij,kij->aij", axes, motion) - np.einsum("akij,kij->aij", rows, near)
    aa, bb, ab = (np.einsum("kij,kij->ij", rows[i], rows[j]) for i, j in ((0, 0), (1, 1), (0, 1)))
    det = aa * bb - ab * ab
    first, second = (bb * left[0] - ab * left[1]) / det, (aa * left[1] - ab * left[0]) / det
    out: Planes = near + first * rows[0] + second * rows[1]
    return out
