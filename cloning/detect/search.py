"""Where in a file is a face, how large and which way round: a depth picture of the source's is sought in all of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cloning.detect.samples import Samples, depth_map, seen
from fba.arrays import Floats

CELLS = 8
"""Cells of the depth pictures in one eye separation: the nose is 5 wide, the smallest thing that tells a face."""

STEP = 1.2
"""Ratio of neighbouring scales; the registration that follows pulls in from 20 %."""

WIDEST, NARROWEST = 1.6, 42.0
"""A file's longest side is between a mask without forehead and a body with raised arms, in eye separations."""

WINDOW = (-1.05, 1.05, -1.85, 0.75)
"""Left, right, bottom, top of the sought picture about the middle between the eyes, in eye separations."""

BACKGROUND = 1.6
"""What lies this far behind its surroundings is no face: the inside of the head seen through eye openings, a body
beside the head. In eye separations; a nose stands out by half of one."""

PEAKS = 3
"""Places looked at in one picture."""

DEEPEST = 1.1
"""The picture ends where the skin is this far behind the eyes, in eye separations: hair and ears differ too much."""


@dataclass(frozen=True, eq=False)
class Pose:
    """A similarity: ``head = scale * points @ turn.T + shift``, head = the source's space, eye separations.

    Attributes
    ----------
    score : how well a face is there; 1 = exactly the source's.
    """

    turn: Floats
    scale: float
    shift: Floats
    score: float

    def apply(self, points: Floats) -> Floats:
        moved: Floats = self.scale * (points @ self.turn.T) + self.shift
        return moved


GAZES = ((2, 1.0), (1, -1.0), (1, 1.0), (2, -1.0), (0, 1.0), (0, -1.0))
"""Axis and sign of the ways a face may look in its file, the usual ones first: most files have y up, others z."""


def turns(axis: int, sign: float) -> list[Floats]:
    """The 4 turns (3, 3) that take file axes to head axes for one gaze; rows = left, up, gaze in file axes."""
    gaze = sign * np.eye(3)[axis]
    ups = [way * np.eye(3)[k] for way in (1.0, -1.0) for k in range(3) if k != axis]
    return [np.array([np.cross(up, gaze), up, gaze]) for up in ups]


class Template:
    """The source's face as a depth picture: (rows up, columns to the subject's left)."""

    def __init__(self, face: Samples) -> None:
        left, right, bottom, top = WINDOW
        shape = (round((top - bottom) * CELLS), round((right - left) * CELLS))
        points = face.points[seen(face.points, 1.0 / CELLS, 0.2)]
        self.depth = depth_map(points[:, :2], points[:, 2], np.array([left, bottom]), 1.0 / CELLS, shape)
        self.mask = self.depth > -DEEPEST
        self.middle = float(self.depth[self.mask].mean())
        self.depth = np.where(self.mask, self.depth - self.middle, 0.0)
        self.whole = float((self.depth**2).sum())


def search(target: Samples, template: Template) -> Iterator[list[Pose]]:
    """The places most like a face, best first, for one gaze of `GAZES` after the other.

    Parameters
    ----------
    target : points on all of the file's surfaces.
    """
    low, high = target.points.min(axis=0), target.points.max(axis=0)
    middle = 0.5 * (low + high)
    extent = float((high - low).max())
    steps = int(np.log(NARROWEST / WIDEST) / np.log(STEP)) + 1
    for gaze in GAZES:
        same = turns(*gaze)
        view = (target.points - middle) @ same[0].T
        box = np.array([view[:, :2].min(axis=0), view[:, :2].max(axis=0)])
        found: list[Pose] = []
        for scale in (WIDEST / extent) * STEP ** np.arange(steps):
            picture = _Picture(view, scale, box, same[0], max(template.mask.shape))
            for turn in same:
                found += [
                    Pose(turn, scale, -turn @ same[0].T @ place - scale * turn @ middle, score)
                    for place, score in picture.places(turn, template)
                ]
        yield sorted(found, key=lambda p: -p.score)


class _Picture:
    """A depth picture of the target from one side at one scale."""

    def __init__(self, view: Floats, scale: float, box: Floats, axes: Floats, margin: int) -> None:
        """Draw it.

        Parameters
        ----------
        view : points, turned; not yet scaled.
        box : (2, 2) lower left and upper right corner of `view`.
        axes : (3, 3) the turn; its rows are the picture's right, up and the way to the viewer.
        margin : cells added so that a correlation does not wrap round.
        """
        from scipy.fft import next_fast_len, rfft2

        self.axes = axes
        self.low = scale * box[0] - 1.0
        columns, rows = (int(n) for n in np.ceil((scale * box[1] + 1.0 - self.low) * CELLS))
        some = scale * view[: max(6 * rows * columns, 20_000)]
        depth = depth_map(some[:, :2], some[:, 2], self.low, 1.0 / CELLS, (rows, columns))
        mask = depth > _foremost(depth, CELLS - 1) - BACKGROUND
        self.base = float(depth[mask].mean())
        depth = np.where(mask, depth - self.base, 0.0)
        self.shape = rows, columns
        self.padded = tuple(next_fast_len(n + margin, real=True) for n in self.shape)
        self.images = rfft2(np.array([mask, depth, depth**2], np.float32), self.padded)

    def places(self, turn: Floats, template: Template) -> list[tuple[Floats, float]]:
        """Where a template that is turned in the picture fits best: the place of its origin, and the score."""
        roll = round(np.arctan2(turn[1] @ self.axes[0], turn[1] @ self.axes[1]) / (0.5 * np.pi))
        score, depth, size = self._scores(template, roll)
        found = []
        for _ in range(PEAKS if score.size else 0):
            row, column = divmod(int(np.argmax(score)), score.shape[1])
            best = float(score[row, column])
            if best <= 0.0:
                break
            flat = _origin(self.low + (np.array([column, row]) + 0.5 * size) / CELLS, roll)
            found.append((np.append(flat, self.base + float(depth[row, column]) - template.middle), best))
            score[max(row - CELLS, 0) : row + CELLS, max(column - CELLS, 0) : column + CELLS] = -np.inf
        return found

    def _scores(self, template: Template, roll: int) -> tuple[Floats, Floats, Floats]:
        """Explained part of the template's relief for each place of its first cell; the depth there; its size."""
        from scipy.fft import irfft2, rfft2

        parts = [np.rot90(p, roll) for p in (template.mask, template.depth, template.depth**2)]
        shape = parts[0].shape
        mask, depth, square = np.conj(rfft2(np.array(parts, np.float32), self.padded))
        here, deep, squared = self.images
        # Sums of correlations are formed before the way back, and all go back at once.
        sums = np.array([here * mask, deep * mask - here * depth, squared * mask - 2.0 * deep * depth + here * square])
        size = np.array(shape[::-1], np.float64)
        rows, columns = (max(n - k + 1, 0) for n, k in zip(self.shape, shape, strict=True))
        count, depth, error = irfft2(sums, self.padded)[:, :rows, :columns]
        count = np.maximum(count, 1.0)
        depth = depth / count
        error = error - count * depth**2
        # A cell where the target shows nothing is as bad as one without any relief.
        cells = int(template.mask.sum())
        return 1.0 - error / template.whole - (cells - count) / cells, depth, size


def _foremost(depth: Floats, reach: int) -> Floats:
    """The largest value within so many cells of each, along both axes."""
    for _ in range(2):
        # Windows of 2, 4, 8 ... cells, the last one twice so that they overlap: far fewer steps than cells.
        wide, found = 1, np.pad(depth, ((reach, reach), (0, 0)), constant_values=-np.inf)
        while wide < 2 * reach + 1:
            step = min(wide, 2 * reach + 1 - wide)
            found = np.maximum(found[:-step], found[step:])
            wide += step
        depth = found.T
    return depth


def _origin(middle: Floats, roll: int) -> Floats:
    """Where the template's origin lies when the middle of its turned picture lies at `middle`."""
    left, right, bottom, top = WINDOW
    angle = -0.5 * np.pi * roll
    spin = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    found: Floats = middle - spin @ (0.5 * np.array([left + right, bottom + top]))
    return found


def apart(poses: list[Pose], count: int) -> list[Pose]:
    """The first poses, at most `count`, that differ from all before in turn, in scale or in place by half an eye
    separation."""
    kept: list[Pose] = []
    for pose in poses:
        if len(kept) == count:
            break
        origin = -pose.shift @ pose.turn / pose.scale
        near = (
            np.array_equal(p.turn, pose.turn)
            and abs(np.log(p.scale / pose.scale)) < 0.2
            and np.linalg.norm(p.apply(origin)) < 0.5
            for p in kept
        )
        if not any(near):
            kept.append(pose)
    return kept
