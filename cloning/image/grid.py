"""Vertex tents on a picture: pixels as the vertices (x, y, luminance) of a quadrangle mesh.

Song et al., sections IV and VI. The ring of a pixel are its four neighbours; the tip stands on it along the normal of
the quadrangles around it, as high as the ring's edges are long on average. Only luminances are unknown, so of every
transform Q = w' w^T (w w^T)^-1 only the row for the luminance counts. The target's tips are unknowns too; as each
occurs in one tent only, it is eliminated exactly: the equations of a tent are projected on the plane across the tip's
row of w^T (w w^T)^-1, and two equations for five pixels remain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cloning.image.color import Planes

Indices = NDArray[np.integer[Any]]

SIDES = ((0, 1), (0, -1), (1, 0), (-1, 0))
"""Steps (rows, columns) to the ring's pixels."""


@dataclass(frozen=True, eq=False)
class Tents:
    """The tents of any number of pixels, arrays of whose shape are written as ....

    Attributes
    ----------
    ring : (4, ...) luminance differences to the neighbours, in the order of `SIDES`.
    normal : x, y, z of the unit normals.
    length : length of the tips.
    """

    ring: Planes
    normal: tuple[Planes, Planes, Planes]
    length: Planes

    @cached_property
    def inverse(self) -> tuple[Planes, ...]:
        """Of w w^T: xx, yy, zz, xy, xz, yz."""
        right, left, down, up = self.ring
        nx, ny, nz = self.normal
        tip = self.length * self.length
        tx, ty, tz = tip * nx, tip * ny, tip * nz
        xx, yy, zz = 2.0 + tx * nx, 2.0 + ty * ny, (self.ring * self.ring).sum(axis=0) + tz * nz
        xy, xz, yz = tx * ny, right - left + tx * nz, down - up + ty * nz
        minors = (
            yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy,
            xz * yz - xy * zz, xy * yz - xz * yy, xy * xz - xx * yz,
        )  # fmt: skip
        scale = 1.0 / (xx * minors[0] + xy * minors[3] + xz * minors[4])
        for minor in minors:
            minor *= scale
        return minors

    def solve(self, x: Planes, y: Planes, z: Planes) -> tuple[Planes, Planes, Planes]:
        """(w w^T)^-1 times a vector."""
        xx, yy, zz, xy, xz, yz = self.inverse
        return xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z


def differences(plane: Planes, at: Indices) -> Planes:
    """(4, ...) differences from inner pixels of a plane to their neighbours, in the order of `SIDES`.

    Parameters
    ----------
    plane : (h, w).
    at : (...) places of the pixels in the plane, counted row by row.
    """
    flat, wide = plane.ravel(), plane.shape[1]
    above = at - wide
    middle = flat[wide:].take(above)
    out = np.empty((len(SIDES), *at.shape), plane.dtype)
    for found, (down, across) in zip(out, SIDES, strict=True):
        np.subtract(flat[(1 + down) * wide + across :].take(above), middle, out=found)
    return out


def tents(ring: Planes) -> Tents:
    """Build tents from the differences (4, ...) in their rings; 4-byte floats are enough and twice as fast."""
    right, left, down, up = ring
    nx, ny = 0.5 * (left - right), 0.5 * (up - down)
    nz = 1.0 / np.sqrt(1.0 + nx * nx + ny * ny)
    nx *= nz
    ny *= nz
    edges = ring * ring
    edges += 1.0
    return Tents(ring, (nx, ny, nz), 0.25 * np.sqrt(edges, out=edges).sum(axis=0))


def motion_rows(neutral: Tents, expression: Tents) -> tuple[Planes, Planes, Planes]:
    """The luminance row of each source transform Q = w' w^T (w w^T)^-1."""
    tip = expression.length * expression.normal[2] * neutral.length
    right, left, down, up = expression.ring
    height = (expression.ring * neutral.ring).sum(axis=0)
    nx, ny, nz = neutral.normal
    return neutral.solve(right - left + tip * nx, down - up + tip * ny, height + tip * nz)


def tent_equations(target: Tents) -> tuple[Planes, Planes]:
    """The two equations that are left of each tent of the target.

    Returns
    -------
    (2, 4, ...) coefficients of the luminance differences in the ring, and (2, 3, ...) those of the row of the source's
    transform to which their sums must be equal.
    """
    px, py, pz = target.solve(*target.normal)
    scale = 1.0 / np.sqrt(px * px + py * py + pz * pz)
    px, py, pz = px * scale, py * scale, pz * scale
    flat = np.sqrt(px * px + pz * pz)
    axes = np.empty((2, 3, *flat.shape), flat.dtype)
    np.divide(pz, flat, out=axes[0, 0])
    axes[0, 1] = 0.0
    np.divide(-px, flat, out=axes[0, 2])
    axes[1] = py * axes[0, 2], flat, -py * axes[0, 0]
    rows = np.empty((2, 4, *flat.shape), flat.dtype)
    for row, axis in zip(rows, axes, strict=True):
        x, y, z = target.solve(*axis)
        np.multiply(z, target.ring, out=row)
        row[0] += x
        row[1] -= x
        row[2] += y
        row[3] -= y
    return rows, axes


def wanted_differences(target: Tents, motion: Sequence[Planes], near: Planes) -> Planes:
    """(4, ...) the differences in each ring that fulfil the tent's two equations, nearest to given ones.

    Parameters
    ----------
    motion : the three entries of the rows of the source's transforms.
    near : (4, ...) the differences where the equations leave a choice.
    """
    rows, axes = tent_equations(target)
    one, other = rows
    left = [
        sum(a * m for a, m in zip(axis, motion, strict=True)) - (row * near).sum(axis=0)
        for axis, row in zip(axes, rows, strict=True)
    ]
    aa, bb, ab = (one * one).sum(axis=0), (other * other).sum(axis=0), (one * other).sum(axis=0)
    scale = 1.0 / (aa * bb - ab * ab)
    first, second = (bb * left[0] - ab * left[1]) * scale, (aa * left[1] - ab * left[0]) * scale
    out: Planes = near + first * one + second * other
    return out
