"""Rigid motion of teeth, eyeballs and tongue: fitted on the source, applied at the target's own place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Floats


@dataclass(frozen=True, eq=False)
class RigidMotion:
    """The rigid part of K motions of one body.

    Attributes
    ----------
    center : (3,) the point whose path is `shift`.
    turns : (K, 3, 3) rotations.
    shifts : (K, 3) offsets of the centre.
    residual : (K,) root mean square of what is not rigid, relative to the root mean square offset.
    """

    center: Floats
    turns: Floats
    shifts: Floats
    residual: Floats

    def offsets(self, vertices: Floats, center: Floats, ratio: Floats) -> Floats:
        """Offsets of another body: turned by the same angle about its own centre, which moves `ratio` as far.

        Parameters
        ----------
        vertices : (n, 3).
        center : (3,) the point that corresponds to `self.center`.
        ratio : (3,) FAPU ratios.

        Returns
        -------
        (n, K, 3)
        """
        local = vertices - center
        turned = np.einsum("kij,nj->nki", self.turns - np.eye(3), local)
        moved: Floats = turned + (self.shifts * ratio)[None]
        return moved


def fit_rigid(vertices: Floats, offsets: Floats, center: Floats) -> RigidMotion:
    """Fit a rotation and a translation to each motion of a body.

    Parameters
    ----------
    vertices : (n, 3) at rest.
    offsets : (n, K, 3).
    center : (3,) where the translation is measured.
    """
    middle = vertices.mean(axis=0)
    local = vertices - middle
    moved = local[:, None] + offsets
    mean = moved.mean(axis=0)
    covariance = np.einsum("nki,nj->kij", moved - mean[None], local)
    u, _, vt = np.linalg.svd(covariance)
    flip = np.where(np.linalg.det(u @ vt) < 0, -1.0, 1.0)
    u[:, :, 2] *= flip[:, None]
    turns = u @ vt
    still = ~np.any(offsets != 0.0, axis=(0, 2))
    turns[still] = np.eye(3)
    shifts = mean + np.einsum("kij,j->ki", turns - np.eye(3), center - middle)
    shifts[still] = 0.0
    fitted = np.einsum("kij,nj->nki", turns - np.eye(3), vertices - center) + shifts
    size = np.sqrt(np.mean(np.sum(offsets**2, axis=2), axis=0))
    missed = np.sqrt(np.mean(np.sum((offsets - fitted) ** 2, axis=2), axis=0))
    return RigidMotion(center, turns, shifts, np.divide(missed, size, out=np.zeros_like(size), where=size > 0))
